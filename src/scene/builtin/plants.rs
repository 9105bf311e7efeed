//! Five plants, in metres: two kinds of trees with leaves, a conifer, a bush and a fern in grass.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::mesh::Mesh;
use super::shapes::{Random, paint};
use crate::scene::assemble::Assembly;

/// Upper bound of the number of triangles of all plants together.
pub(super) const MAX_TRIANGLES: usize = 11_000;

/// Colours of bark and leaves of each plant, from linear RGB of material `1`, two a plant.
const COLORS: [(&str, [f32; 3]); 10] = [
    ("oak bark", [0.17, 0.12, 0.08]),
    ("oak leaves", [0.14, 0.26, 0.06]),
    ("birch bark", [0.72, 0.70, 0.64]),
    ("birch leaves", [0.36, 0.44, 0.10]),
    ("spruce bark", [0.20, 0.12, 0.07]),
    ("needles", [0.05, 0.14, 0.07]),
    ("twigs", [0.22, 0.15, 0.09]),
    ("bush leaves", [0.22, 0.34, 0.10]),
    ("grass", [0.36, 0.42, 0.13]),
    ("fern", [0.18, 0.36, 0.08]),
];

/// Adds the materials of all plants, of which the first must have index 1.
pub(super) fn add_materials(assembly: &mut Assembly) {
    assembly.materials.extend(COLORS.map(|(name, color)| paint(name, color)));
}

/// A kind of plants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Plant {
    Oak,
    Birch,
    Spruce,
    Bush,
    Fern,
}

impl Plant {
    pub(super) const ALL: [Self; 5] = [Self::Oak, Self::Birch, Self::Spruce, Self::Bush, Self::Fern];

    /// The plant at the origin, which its roots are below.
    pub(super) fn mesh(self) -> Mesh {
        let (mut mesh, mut random) = (Mesh::new(), Random::of(12, self as usize));
        let [wood, leaves] = [1, 2].map(|material| 2 * self as u32 + material);
        let sketch = &mut Sketch { mesh: &mut mesh, random: &mut random, wood, leaves };
        match self {
            Self::Oak => oak(sketch),
            Self::Birch => birch(sketch),
            Self::Spruce => spruce(sketch),
            Self::Bush => bush(sketch),
            Self::Fern => fern(sketch),
        }
        mesh
    }
}

/// A plant under construction, and the indices of its materials.
struct Sketch<'a> {
    mesh: &'a mut Mesh,
    random: &'a mut Random,
    wood: u32,
    leaves: u32,
}

/// Leaves in balls, as they are at the ends of branches.
struct Crown {
    center: Vec3,
    /// Half the size of the crown, without the balls around its surface.
    half: Vec3,
    balls: u32,
    radius: f32,
    leaves: u32,
    /// Length and width of a leaf.
    leaf: [f32; 2],
}

impl Crown {
    /// Centre and radius of each ball, evenly spread over the crown.
    fn balls(&self, random: &mut Random) -> Vec<(Vec3, f32)> {
        let ball = |index: u32| {
            let y = 1.0 - 2.0 * (index as f32 + 0.5) / self.balls as f32;
            // Turned by the golden angle, each away from all before it.
            let around = Vec2::from_angle(2.399_963 * index as f32) * (1.0 - y * y).sqrt();
            let out = Vec3::new(around.x, y, around.y) * (0.75 + 0.3 * random.unit());
            (self.center + out * self.half, self.radius * (0.8 + 0.4 * random.unit()))
        };
        (0..self.balls).map(ball).collect()
    }

    fn add(&self, balls: &[(Vec3, f32)], sketch: &mut Sketch<'_>) {
        let Sketch { mesh, random, leaves, .. } = sketch;
        mesh.material = *leaves;
        for (_, (ball, radius)) in (0..self.leaves).zip(balls.iter().cycle()) {
            let direction = random.direction();
            let depth = random.unit();
            let base = *ball + direction * (radius * (0.6 + 0.4 * depth));
            let outward = (direction + (base - self.center).normalize_or(Vec3::Y)).normalize_or(Vec3::Y);
            // Darker inside and below, where little light arrives.
            let light = 0.8 + 0.3 * outward.y + 0.25 * depth + 0.25 * (random.unit() - 0.5);
            mesh.tint = Vec3::new(light * (0.85 + 0.3 * random.unit()), light, light * 0.9);
            let along = (random.direction() + outward * 0.8 + Vec3::NEG_Y * 0.5).normalize_or(Vec3::X);
            let across = along.cross(outward + random.direction() * 0.6).normalize_or(Vec3::Z);
            let size = 0.75 + 0.5 * random.unit();
            mesh.leaf(base, along * (self.leaf[0] * size), across * (0.5 * self.leaf[1] * size), outward);
        }
    }
}

/// A branch from `from`, which rises towards its end `to`.
fn branch(mesh: &mut Mesh, from: Vec3, to: Vec3, radius: f32) {
    let middle = from.lerp(to, 0.55) - Vec3::Y * (0.12 * from.distance(to));
    mesh.tube(&[(from, radius), (middle, 0.7 * radius), (to, 0.2 * radius)], 5);
}

fn oak(sketch: &mut Sketch<'_>) {
    let crown = Crown {
        center: Vec3::Y * 7.2,
        half: Vec3::new(2.5, 2.2, 2.5),
        balls: 16,
        radius: 1.35,
        leaves: 1_150,
        leaf: [0.75, 0.5],
    };
    let balls = crown.balls(sketch.random);
    let trunk = [(-0.4, 0.62), (0.1, 0.42), (0.8, 0.32), (2.5, 0.28), (4.2, 0.24), (6.0, 0.16), (7.8, 0.06)];
    let bend = |y: f32| Vec3::new(0.12 * y - 0.02 * y * y, y, 0.05 * y);
    sketch.mesh.paint(sketch.wood, [1.0; 3]);
    sketch.mesh.tube(&trunk.map(|(y, radius)| (bend(y), radius)), 9);
    for (index, (ball, _)) in balls.iter().step_by(2).enumerate() {
        branch(sketch.mesh, bend(3.2 + 0.35 * index as f32), *ball, 0.13);
    }
    crown.add(&balls, sketch);
}

fn birch(sketch: &mut Sketch<'_>) {
    let crown = Crown {
        center: Vec3::Y * 8.2,
        half: Vec3::new(1.15, 4.0, 1.15),
        balls: 15,
        radius: 0.95,
        leaves: 900,
        leaf: [0.55, 0.38],
    };
    let balls = crown.balls(sketch.random);
    let bend = |y: f32| Vec3::new(0.03 * y, y, 0.004 * y * y);
    let steps = 20;
    let height = |step: usize| -0.3 + 12.2 * step as f32 / steps as f32;
    let trunk = |step: usize| (bend(height(step)), 0.19 - 0.008 * step as f32);
    for step in 0..steps {
        // The dark marks of its bark.
        let shade = if sketch.random.unit() < 0.3 { 0.25 } else { 1.0 };
        sketch.mesh.paint(sketch.wood, [shade; 3]);
        sketch.mesh.tube(&[trunk(step), trunk(step + 1)], 6);
    }
    sketch.mesh.paint(sketch.wood, [0.6; 3]);
    for (ball, _) in balls.iter().step_by(2) {
        branch(sketch.mesh, bend(ball.y - 1.2), *ball, 0.05);
    }
    crown.add(&balls, sketch);
}

fn spruce(sketch: &mut Sketch<'_>) {
    const TIERS: u32 = 17;
    sketch.mesh.paint(sketch.wood, [1.0; 3]);
    sketch.mesh.tube(
        &[(0.0, 0.34), (0.5, 0.24), (6.0, 0.15), (13.0, 0.03)].map(|(y, radius)| (Vec3::Y * (y - 0.3), radius)),
        8,
    );
    sketch.mesh.material = sketch.leaves;
    for tier in 0..TIERS {
        let part = tier as f32 / TIERS as f32;
        let (y, reach) = (1.3 + 11.9 * part, 2.7 * (1.0 - part) + 0.25);
        sketch.mesh.tint = Vec3::splat(0.55 + 0.3 * part);
        cone(sketch.mesh, Vec3::Y * (y + 0.35), 0.55 * reach, 1.3, 10);
        let branches = 13 - tier / 2;
        for index in 0..branches {
            let turn = TAU * (index as f32 + 0.6 * sketch.random.unit()) / branches as f32 + 1.7 * tier as f32;
            let out = Vec2::from_angle(turn);
            bough(sketch, Vec3::Y * y, Vec3::new(out.x, 0.0, out.y), reach);
        }
    }
    sketch.mesh.tint = Vec3::ONE;
    cone(sketch.mesh, Vec3::Y * 13.9, 0.3, 1.4, 8);
}

/// A cone of needles around the trunk, from `top` down, which hides it.
fn cone(mesh: &mut Mesh, top: Vec3, radius: f32, height: f32, sides: u32) {
    let normal = |turn: f32| {
        let around = Vec2::from_angle(turn);
        Vec3::new(around.x, radius / height, around.y).normalize_or(Vec3::Y)
    };
    for side in 0..sides {
        let [from, middle, to] = [0.0, 0.5, 1.0].map(|part| TAU * (side as f32 + part) / sides as f32);
        let tip = mesh.vertex(top, normal(middle));
        let [from, to] = [from, to].map(|turn| {
            let around = Vec2::from_angle(turn) * radius;
            mesh.vertex(top + Vec3::new(around.x, -height, around.y), normal(turn))
        });
        mesh.triangle([tip, to, from]);
    }
}

/// A bough of needles, about `reach` long, that hangs down on both sides of its middle.
fn bough(sketch: &mut Sketch<'_>, base: Vec3, out: Vec3, reach: f32) {
    let Sketch { mesh, random, .. } = sketch;
    let across = out.cross(Vec3::Y);
    let reach = reach * (0.85 + 0.3 * random.unit());
    let light = 0.8 + 0.5 * random.unit();
    let middle = |part: f32| base + out * (reach * part) + Vec3::Y * (reach * (0.12 * part - 0.4 * part * part));
    let side = |part: f32, width: f32| middle(part) + across * (reach * width) - Vec3::Y * (reach * width.abs() * 0.7);
    for (step, [from, to]) in [[0.1, 0.45], [0.45, 0.75], [0.75, 1.0]].into_iter().enumerate() {
        // Lighter where it grew last.
        mesh.tint = Vec3::new(0.9, 1.0, 0.9) * (light * (0.75 + 0.25 * step as f32));
        let width = 0.24 - 0.07 * step as f32;
        for hand in [1.0, -1.0] {
            let corner = side(to * 0.85, hand * width);
            let points =
                if hand > 0.0 { [middle(from), middle(to), corner] } else { [middle(from), corner, middle(to)] };
            mesh.face(&points);
        }
    }
    // Twigs that stand out to the sides.
    for twig in 0..2 {
        let (part, hand) = (0.35 + 0.3 * random.unit(), if twig == 0 { 1.0 } else { -1.0 });
        let along = (out * 0.7 + across * hand - Vec3::Y * 0.5) * (0.3 * reach);
        mesh.leaf(middle(part), along, Vec3::Y.cross(along).normalize_or(out) * (0.07 * reach), Vec3::Y);
    }
}

fn bush(sketch: &mut Sketch<'_>) {
    let crown = Crown {
        center: Vec3::Y * 0.6,
        half: Vec3::new(0.75, 0.5, 0.75),
        balls: 11,
        radius: 0.5,
        leaves: 680,
        leaf: [0.24, 0.16],
    };
    let balls = crown.balls(sketch.random);
    sketch.mesh.paint(sketch.wood, [1.0; 3]);
    for (ball, _) in &balls {
        branch(sketch.mesh, Vec3::new(0.15 * ball.x, -0.15, 0.15 * ball.z), *ball, 0.03);
    }
    crown.add(&balls, sketch);
}

fn fern(sketch: &mut Sketch<'_>) {
    const FRONDS: u32 = 13;
    const PAIRS: u32 = 13;
    let Sketch { mesh, random, wood, leaves } = sketch;
    mesh.material = *leaves;
    for frond in 0..FRONDS {
        let out = Vec2::from_angle(TAU * (frond as f32 + 0.5 * random.unit()) / FRONDS as f32);
        let out = Vec3::new(out.x, 0.0, out.y);
        let (reach, height) = (0.75 + 0.4 * random.unit(), 0.55 + 0.35 * random.unit());
        let middle = |part: f32| out * (reach * part) + Vec3::Y * (height * part * (2.1 - 1.6 * part));
        let light = 0.75 + 0.5 * random.unit();
        for pair in 0..PAIRS {
            let part = 0.2 + 0.8 * pair as f32 / PAIRS as f32;
            let length = 0.34 * reach * (1.1 - part);
            mesh.tint = Vec3::new(0.9, 1.0, 0.9) * (light * (0.7 + 0.4 * part));
            for hand in [1.0, -1.0] {
                let along = (out.cross(Vec3::Y) * hand + out * 0.35 - Vec3::Y * 0.2) * length;
                mesh.leaf(middle(part), along, out * (0.035 * reach), Vec3::Y);
            }
        }
    }
    mesh.material = *wood;
    for _ in 0..280 {
        let [place, lean] = [random.direction(), random.direction()].map(|direction| direction.with_y(0.0));
        let along = Vec3::Y * (0.2 + 0.35 * random.unit()) + lean * 0.18;
        let across = lean.cross(Vec3::Y).normalize_or(Vec3::X) * 0.018;
        mesh.tint = Vec3::new(1.0, 1.0, 0.8) * (0.6 + 0.5 * random.unit());
        mesh.leaf(place * (1.1 * random.unit()), along, across, Vec3::Y);
    }
}
