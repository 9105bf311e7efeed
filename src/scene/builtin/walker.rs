//! A figure of tubes around 13 joints, with a skin: it walks and jumps.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DMat4, DQuat, Quat, Vec2, Vec3};

use super::shapes::paint;
use crate::scene::assemble::{Assembly, BATCH_SIZE, VertexLists};
use crate::scene::error::FileLocation;
use crate::scene::motion::{
    Clip, Curve, Hold, Interpolation, Local, Motion, Part, Rig, RigNode, RigSkin, Shape, Target, Track,
};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// Name, parent and position of each joint, in metres; the figure looks along +z. Left is +x.
const JOINTS: [(&str, usize, [f32; 3]); 13] = [
    ("hips", 0, [0.0, 0.95, 0.0]),
    ("chest", 0, [0.0, 1.2, 0.0]),
    ("head", 1, [0.0, 1.5, 0.0]),
    ("left arm", 1, [0.2, 1.42, 0.0]),
    ("left forearm", 3, [0.22, 1.14, 0.0]),
    ("right arm", 1, [-0.2, 1.42, 0.0]),
    ("right forearm", 5, [-0.22, 1.14, 0.0]),
    ("left thigh", 0, [0.1, 0.9, 0.0]),
    ("left shin", 7, [0.1, 0.48, 0.0]),
    ("left foot", 8, [0.1, 0.08, 0.0]),
    ("right thigh", 0, [-0.1, 0.9, 0.0]),
    ("right shin", 10, [-0.1, 0.48, 0.0]),
    ("right foot", 11, [-0.1, 0.08, 0.0]),
];

/// A tube from one point to another.
struct Tube {
    ends: [[f32; 3]; 2],
    radii: [f32; 2],
    /// The joint at the beginning and that at the end, which takes over where `bend` of the length has passed.
    joints: [u16; 2],
    bend: f32,
    /// Share of the triangles.
    share: f32,
}

const fn tube(ends: [[f32; 3]; 2], radii: [f32; 2], joints: [u16; 2], bend: f32, share: f32) -> Tube {
    Tube { ends, radii, joints, bend, share }
}

const TUBES: [Tube; 8] = [
    tube([[0.0, 0.82, 0.0], [0.0, 1.52, 0.0]], [0.17, 0.16], [0, 1], 0.5, 0.28),
    tube([[0.0, 1.46, 0.01], [0.0, 1.8, 0.02]], [0.09, 0.11], [2, 2], 0.5, 0.12),
    tube([[0.19, 1.46, 0.0], [0.23, 0.82, 0.0]], [0.065, 0.045], [3, 4], 0.5, 0.12),
    tube([[-0.19, 1.46, 0.0], [-0.23, 0.82, 0.0]], [0.065, 0.045], [5, 6], 0.5, 0.12),
    tube([[0.1, 0.98, 0.0], [0.1, 0.04, 0.0]], [0.1, 0.055], [7, 8], 0.53, 0.14),
    tube([[-0.1, 0.98, 0.0], [-0.1, 0.04, 0.0]], [0.1, 0.055], [10, 11], 0.53, 0.14),
    tube([[0.1, 0.05, -0.07], [0.1, 0.04, 0.2]], [0.05, 0.05], [9, 9], 0.5, 0.04),
    tube([[-0.1, 0.05, -0.07], [-0.1, 0.04, 0.2]], [0.05, 0.05], [12, 12], 0.5, 0.04),
];

/// Step of numerical derivatives, in parts of a tube.
const STEP: f32 = 1e-3;

/// Keys a second.
const KEYS: usize = 16;

/// Adds the figure with about, and at most, `triangles` triangles; at least 500.
pub(super) fn build(triangles: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), Cancelled> {
    assembly.materials.push(paint("suit", [0.22, 0.38, 0.55]));
    let (mut shape, mut corners) = (Shape { holds: vec![Vec::new()], ..Shape::default() }, Vec::new());
    for tube in &TUBES {
        token.check()?;
        add_tube(tube, triangles as f32 * tube.share, &mut shape, &mut corners);
    }
    let lists = VertexLists { normals: shape.normals.clone(), ..VertexLists::default() };
    let first = assembly.add_vertices(shape.positions.len(), &lists, token)?;
    for (index, corners) in corners.iter().enumerate() {
        token.check_every(BATCH_SIZE, index)?;
        let [a, b, c] = corners.map(|corner| shape.positions[corner as usize]);
        let own = first.map(|first| corners.map(|corner| first + corner));
        assembly.push(Triangle { a, b, c }, own, 0, || FileLocation::File);
    }
    assembly.mesh_count = TUBES.len();
    assembly.motion = Some(motion(shape, corners, assembly.normal_count(), first));
    Ok(())
}

/// Adds a tube with rounded ends of at most as many triangles.
fn add_tube(tube: &Tube, triangles: f32, shape: &mut Shape, corners: &mut Vec<[u32; 3]>) {
    let [start, end] = tube.ends.map(Vec3::from_array);
    // Triangles about as long as wide.
    let aspect = start.distance(end) / (PI * (tube.radii[0] + tube.radii[1]));
    let slices = ((triangles / (2.0 * aspect)).sqrt() as u32).max(3);
    let stacks = ((triangles as u32) / (2 * slices)).max(1) + 1;
    let frame = Quat::from_rotation_arc(Vec3::Y, (end - start).normalize());
    let first = shape.positions.len() as u32;
    // The surface at a part of the length and of the turn; both ends are half ellipses.
    let surface = |along: f32, turn: f32| {
        let radius = (tube.radii[0] + (tube.radii[1] - tube.radii[0]) * along)
            * (1.0 - (2.0 * along - 1.0).abs().powi(6)).max(0.0).sqrt();
        let around = Vec2::from_angle(TAU * turn) * radius;
        start + (end - start) * along + frame * Vec3::new(around.x, 0.0, -around.y)
    };
    for stack in 0..=stacks {
        // Denser at both ends.
        let along = 0.5 - 0.5 * (PI * stack as f32 / stacks as f32).cos();
        let blend = ((along - tube.bend) / 0.16 + 0.5).clamp(0.0, 1.0);
        let weight = blend * blend * (3.0 - 2.0 * blend);
        for slice in 0..slices {
            let turn = slice as f32 / slices as f32;
            let [low, high] = [along - STEP, along + STEP].map(|along| surface(along.clamp(0.0, 1.0), turn));
            let across = surface(0.5, turn + 0.25) - surface(0.5, turn - 0.25);
            let pole = (end - start) * (along - 0.5).signum();
            shape.normals.push(across.cross(high - low).try_normalize().unwrap_or_else(|| pole.normalize_or_zero()));
            shape.positions.push(surface(along, turn));
            let [joint, next] = tube.joints;
            shape.holds[0].push(Hold { joints: [joint, next, 0, 0], weights: [1.0 - weight, weight, 0.0, 0.0] });
        }
    }
    for stack in 0..stacks {
        for slice in 0..slices {
            let next = (slice + 1) % slices;
            let [a, b] = [slice, next].map(|slice| first + stack * slices + slice);
            let [c, d] = [a + slices, b + slices];
            // One triangle at each end, where a row is a point.
            if stack > 0 {
                corners.push([a, b, d]);
            }
            if stack + 1 < stacks {
                corners.push([a, d, c]);
            }
        }
    }
}

/// Angle about x, in radians, of each joint at a part of the cycle, 0 to 1, and the height of the hips above their usual one.
type Gait = fn(f32) -> ([f32; 13], f32);

fn walk(cycle: f32) -> ([f32; 13], f32) {
    let turn = TAU * cycle;
    let mut angles = [0.0; 13];
    angles[1] = 0.05;
    for (side, turn) in [(0, turn), (1, turn + PI)] {
        // Forwards is a negative angle: it turns -y to +z.
        angles[7 + 3 * side] = -0.45 * turn.sin() - 0.05;
        angles[8 + 3 * side] = 0.1 + 0.9 * (turn + 0.6).cos().max(0.0);
        angles[9 + 3 * side] = 0.25 * turn.sin();
        // Arms swing against legs.
        angles[3 + 2 * side] = 0.5 * turn.sin();
        angles[4 + 2 * side] = -0.35 - 0.2 * turn.sin();
    }
    (angles, -0.03 + 0.03 * (2.0 * turn).cos())
}

fn jump(cycle: f32) -> ([f32; 13], f32) {
    // Crouch, fly, land.
    let crouch = (1.0 - (cycle - 0.2).abs() / 0.2).max(0.0) + (1.0 - (cycle - 0.85).abs() / 0.15).max(0.0);
    let flight = if (0.4..0.7).contains(&cycle) { (PI * (cycle - 0.4) / 0.3).sin().powi(2) } else { 0.0 };
    let mut angles = [0.0; 13];
    angles[1] = 0.4 * crouch;
    for side in 0..2 {
        (angles[7 + 3 * side], angles[8 + 3 * side], angles[9 + 3 * side]) =
            (-crouch, 2.0 * crouch, 0.5 * flight - crouch);
        angles[3 + 2 * side] = 0.8 * crouch - 1.6 * flight;
    }
    (angles, 0.5 * flight - 0.4 * crouch)
}

/// The motion of the shape, whose bind pose is that of [`JOINTS`].
fn motion(shape: Shape, corners: Vec<[u32; 3]>, normal_count: usize, first: Option<u32>) -> Motion {
    let at = |joint: usize| Vec3::from_array(JOINTS[joint].2).as_dvec3();
    let node = |(index, &(_, parent, _)): (usize, &(_, usize, _))| {
        let translation = if index == 0 { at(0) } else { at(index) - at(parent) };
        RigNode {
            parent: (index > 0).then_some(parent),
            local: Local { translation, ..Local::default() },
            is_visible: true,
            weights: Vec::new(),
        }
    };
    let skin = RigSkin {
        joints: (0..JOINTS.len()).collect(),
        inverse_bind: (0..JOINTS.len()).map(|joint| DMat4::from_translation(-at(joint))).collect(),
    };
    let mut rig =
        Rig { nodes: JOINTS.iter().enumerate().map(node).collect(), skins: vec![skin], normal_count, ..Rig::default() };
    let mut clips = Vec::new();
    for (name, seconds, gait) in [("walk", 1.0, walk as Gait), ("jump", 1.5, jump)] {
        let tracks = add_clip(gait, seconds, &mut rig);
        rig.clips.push(tracks);
        clips.push(Clip { name: name.to_owned(), start: 0.0, end: seconds });
    }
    rig.parts.push(Part {
        shape: Arc::new(shape),
        node: 0,
        skin: Some(0),
        transform: DMat4::IDENTITY,
        first_normal: first.map(|first| first as usize),
        triangles: 0..corners.len(),
    });
    rig.corners = corners;
    Motion::new(clips, Box::new(rig))
}

/// Adds the curves of a gait to the rig, and returns its tracks.
fn add_clip(gait: Gait, seconds: f32, rig: &mut Rig) -> Vec<Track> {
    let count = (seconds * KEYS as f32) as usize;
    let times: Arc<[f32]> = (0..=count).map(|key| seconds * key as f32 / count as f32).collect();
    let keys: Vec<([f32; 13], f32)> = (0..=count).map(|key| gait(key as f32 / count as f32)).collect();
    let mut add = |target: Target, width: usize, values: Vec<f32>| {
        rig.curves.push(Curve::new(Arc::clone(&times), values, width, Interpolation::Linear));
        Track { target, curve: rig.curves.len() - 1 }
    };
    let hips = keys.iter().flat_map(|(_, height)| [0.0, JOINTS[0].2[1] + height, 0.0]).collect();
    let mut tracks = vec![add(Target::Translation(0), 3, hips)];
    for joint in 1..JOINTS.len() {
        let turns =
            keys.iter().flat_map(|(angles, _)| DQuat::from_rotation_x(angles[joint].into()).as_quat().to_array());
        tracks.push(add(Target::Rotation(joint), 4, turns.collect()));
    }
    tracks
}
