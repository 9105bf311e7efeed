//! Houses with their gardens, in metres, the front towards +z, and a piece of the street along x that they stand on.

use std::f32::consts::FRAC_1_SQRT_2;

use glam::Vec3;

use super::mesh::Mesh;
use super::shapes::paint;
use crate::scene::assemble::Assembly;
use crate::scene::material::Material;

/// Upper bound of the number of triangles of all houses and the street together.
pub(super) const MAX_TRIANGLES: usize = 8_000;

/// Names and colours of the materials, from index 1 on, in the order of the constants below.
const COLORS: [(&str, [f32; 3]); 17] = [
    ("white plaster", [0.76, 0.74, 0.68]),
    ("ochre plaster", [0.68, 0.48, 0.24]),
    ("cream plaster", [0.72, 0.62, 0.46]),
    ("brick", [0.42, 0.18, 0.12]),
    ("red boards", [0.38, 0.08, 0.06]),
    ("stone", [0.46, 0.44, 0.40]),
    ("red tiles", [0.50, 0.17, 0.09]),
    ("brown tiles", [0.28, 0.15, 0.09]),
    ("slate", [0.14, 0.15, 0.18]),
    ("door", [0.16, 0.09, 0.05]),
    ("glass", [0.05, 0.07, 0.10]),
    ("frame", [0.80, 0.79, 0.76]),
    ("hedge", [0.07, 0.16, 0.04]),
    ("leaves", [0.14, 0.28, 0.06]),
    ("bark", [0.18, 0.12, 0.08]),
    ("asphalt", [0.20, 0.20, 0.21]),
    ("paving", [0.52, 0.49, 0.44]),
];
const WHITE: u32 = 1;
const OCHRE: u32 = 2;
const CREAM: u32 = 3;
const BRICK: u32 = 4;
const BOARDS: u32 = 5;
const STONE: u32 = 6;
const RED_TILES: u32 = 7;
const BROWN_TILES: u32 = 8;
const SLATE: u32 = 9;
const DOOR: u32 = 10;
const GLASS: u32 = 11;
const FRAME: u32 = 12;
const HEDGE: u32 = 13;
const LEAVES: u32 = 14;
const BARK: u32 = 15;
const ASPHALT: u32 = 16;
const PAVING: u32 = 17;

/// Height of the floor above the ground.
const FLOOR: f32 = 0.4;
/// Height of a storey.
const STOREY: f32 = 2.7;

/// Adds the materials of the houses, of which the first must have index 1.
pub(super) fn add_materials(assembly: &mut Assembly) {
    assembly.materials.extend(COLORS.map(|(name, color)| match name {
        "glass" => Material { roughness: 0.15, ..paint(name, color) },
        _ => paint(name, color),
    }));
}

/// A kind of house.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum House {
    Cottage,
    Bungalow,
    Villa,
    Angled,
    Barn,
    Church,
}

impl House {
    pub(super) const ALL: [Self; 6] =
        [Self::Cottage, Self::Bungalow, Self::Villa, Self::Angled, Self::Barn, Self::Church];
    /// Those of which a village has many.
    pub(super) const COMMON: [Self; 9] = [
        Self::Cottage,
        Self::Cottage,
        Self::Bungalow,
        Self::Bungalow,
        Self::Villa,
        Self::Villa,
        Self::Angled,
        Self::Angled,
        Self::Barn,
    ];

    /// The house with its garden, its floor a little above the origin.
    pub(super) fn mesh(self) -> Mesh {
        let mut mesh = Mesh::new();
        let along_x = |size: [f32; 2], storeys: u32, rise: f32, [walls, roof]: [u32; 2]| Wing {
            origin: Vec3::ZERO,
            u: Vec3::X,
            size,
            storeys,
            rise,
            walls,
            roof,
        };
        match self {
            Self::Cottage => {
                along_x([9.0, 7.0], 1, 3.4, [WHITE, RED_TILES]).add(&mut mesh, true);
                chimney(&mut mesh, Vec3::new(2.6, 6.4, -1.2));
            }
            Self::Bungalow => {
                along_x([8.0, 6.6], 1, 2.8, [OCHRE, BROWN_TILES]).add(&mut mesh, true);
                chimney(&mut mesh, Vec3::new(-2.2, 5.8, -1.0));
                porch(&mut mesh);
            }
            Self::Villa => {
                along_x([10.0, 8.0], 2, 3.2, [CREAM, SLATE]).add(&mut mesh, true);
                chimney(&mut mesh, Vec3::new(3.4, 9.0, 1.0));
                chimney(&mut mesh, Vec3::new(-3.4, 9.0, -1.0));
            }
            Self::Angled => {
                let main = along_x([10.0, 6.4], 1, 3.0, [BRICK, RED_TILES]);
                main.add(&mut mesh, true);
                let wing = Wing { origin: Vec3::new(2.9, 0.0, 2.6), u: Vec3::Z, size: [6.4, 4.2], rise: 2.4, ..main };
                wing.add(&mut mesh, false);
                chimney(&mut mesh, Vec3::new(-3.0, 6.0, 0.8));
            }
            Self::Barn => barn(&mut mesh, &along_x([12.0, 8.0], 1, 4.4, [BOARDS, BROWN_TILES])),
            Self::Church => church(&mut mesh, &along_x([11.0, 7.6], 2, 5.0, [STONE, SLATE])),
        }
        garden(&mut mesh, self);
        mesh
    }
}

/// A part of a house under one roof.
struct Wing {
    /// The middle of its ground.
    origin: Vec3,
    /// Direction of the ridge. Windows look to both sides.
    u: Vec3,
    /// Length along the ridge, and width.
    size: [f32; 2],
    storeys: u32,
    /// Height of the ridge above the walls.
    rise: f32,
    walls: u32,
    roof: u32,
}

impl Wing {
    fn at(&self, x: f32, y: f32, z: f32) -> Vec3 {
        self.origin + self.u * x + Vec3::Y * y + self.u.cross(Vec3::Y) * z
    }

    /// A block with its sides along those of the wing.
    fn block(&self, mesh: &mut Mesh, [x, y, z]: [f32; 3], size: [f32; 3]) {
        let [u, v, w] = size.map(|size| 0.5 * size);
        mesh.block(self.at(x, y, z), [self.u * u, Vec3::Y * v, self.u.cross(Vec3::Y) * w]);
    }

    /// Height of the walls.
    fn eaves(&self) -> f32 {
        FLOOR + STOREY * self.storeys as f32
    }

    fn add(&self, mesh: &mut Mesh, has_door: bool) {
        let [length, width] = self.size;
        mesh.material = STONE;
        // Deep enough for a slope.
        self.block(mesh, [0.0, -0.5, 0.0], [length + 0.2, 2.0 * FLOOR + 1.0, width + 0.2]);
        self.shell(mesh);
        let windows = (length / 2.6) as i32;
        for storey in 0..self.storeys {
            let y = FLOOR + STOREY * (storey as f32 + 0.55);
            for window in 0..windows {
                let x = (window as f32 + 0.5 - 0.5 * windows as f32) * (length / windows as f32);
                let is_door = has_door && storey == 0 && window == windows / 2;
                for side in [-1.0, 1.0] {
                    if is_door && side > 0.0 {
                        self.door(mesh, x);
                    } else {
                        self.window(mesh, self.at(x, y, side * 0.5 * width), self.u * side);
                    }
                }
            }
            for side in [-1.0, 1.0] {
                let across = self.u.cross(Vec3::Y) * -side;
                self.window(mesh, self.at(side * 0.5 * length, y, 0.12 * width), across);
                self.window(mesh, self.at(side * 0.5 * length, y + 0.6 * STOREY, -0.1 * width), across);
            }
        }
    }

    /// Walls with gables, and the roof.
    fn shell(&self, mesh: &mut Mesh) {
        let [x, z] = self.size.map(|size| 0.5 * size);
        let (low, high) = (FLOOR, self.eaves());
        mesh.material = self.walls;
        for side in [-1.0, 1.0] {
            let corner = |along: f32, y: f32| self.at(side * along * x, y, side * z);
            mesh.face(&[corner(-1.0, low), corner(1.0, low), corner(1.0, high), corner(-1.0, high)]);
            let gable = |across: f32, y: f32| self.at(side * x, y, -side * across * z);
            let ridge = gable(0.0, high + self.rise);
            mesh.face(&[gable(-1.0, low), gable(1.0, low), gable(1.0, high), ridge, gable(-1.0, high)]);
        }
        mesh.material = self.roof;
        let (ridge, drop) = (self.at(0.0, high + self.rise + 0.08, 0.0), self.rise * (1.0 + 0.5 / z));
        for side in [-1.0, 1.0] {
            let slope = self.u.cross(Vec3::Y) * (side * (z + 0.5)) - Vec3::Y * drop;
            let along = self.u * (side * (x + 0.4));
            // The middle of the slab lies half a slope below the ridge.
            mesh.block(ridge + 0.5 * slope, [along, slope.cross(along).normalize_or(Vec3::Y) * 0.1, 0.5 * slope]);
        }
    }

    /// A window with its frame around `center`, `u` its right as seen from outside.
    #[expect(clippy::unused_self, reason = "a part of the wing")]
    fn window(&self, mesh: &mut Mesh, center: Vec3, u: Vec3) {
        let out = u.cross(Vec3::Y);
        mesh.material = FRAME;
        mesh.block(center, [u * 0.52, Vec3::Y * 0.68, out * 0.06]);
        mesh.block(center - Vec3::Y * 0.72 + out * 0.05, [u * 0.6, Vec3::Y * 0.05, out * 0.12]);
        mesh.material = GLASS;
        for pane in [-0.23, 0.23] {
            let middle = center + u * pane + out * 0.07;
            let (u, v) = (u * 0.19, Vec3::Y * 0.56);
            mesh.face(&[middle - u - v, middle + u - v, middle + u + v, middle - u + v]);
        }
    }

    fn door(&self, mesh: &mut Mesh, x: f32) {
        let z = 0.5 * self.size[1];
        mesh.material = FRAME;
        self.block(mesh, [x, FLOOR + 1.1, z], [1.25, 2.25, 0.14]);
        mesh.material = DOOR;
        self.block(mesh, [x, FLOOR + 1.05, z + 0.03], [1.0, 2.1, 0.14]);
        mesh.material = PAVING;
        self.block(mesh, [x, 0.5 * FLOOR - 0.35, z + 0.6], [1.5, FLOOR + 0.6, 1.0]);
        self.block(mesh, [x, -0.2, z + 2.6], [1.2, 0.56, 3.4]);
    }
}

fn chimney(mesh: &mut Mesh, top: Vec3) {
    mesh.material = BRICK;
    mesh.cuboid(top - Vec3::Y * 1.4, [0.7, 2.8, 0.7]);
    mesh.material = STONE;
    mesh.cuboid(top + Vec3::Y * 0.06, [0.9, 0.14, 0.9]);
}

/// A roof on two posts before the door.
fn porch(mesh: &mut Mesh) {
    mesh.material = DOOR;
    for x in [-0.8, 0.8] {
        mesh.cuboid([x, FLOOR + 1.0, 4.9], [0.14, 2.6, 0.14]);
    }
    mesh.material = BROWN_TILES;
    let slope = Vec3::new(0.0, -0.35, 0.95);
    let normal = slope.cross(Vec3::X).normalize_or(Vec3::Y);
    mesh.block(Vec3::new(0.0, FLOOR + 2.45, 4.2), [Vec3::X * 1.1, normal * 0.07, slope]);
}

/// A barn of boards with a gate.
fn barn(mesh: &mut Mesh, wing: &Wing) {
    let [length, width] = wing.size;
    mesh.material = STONE;
    wing.block(mesh, [0.0, -0.5, 0.0], [length + 0.2, 2.0 * FLOOR + 1.0, width + 0.2]);
    wing.shell(mesh);
    mesh.paint(BOARDS, [0.8; 3]);
    for batten in 0..12 {
        let x = (batten as f32 - 5.5) * length / 12.0;
        for side in [-1.0, 1.0] {
            wing.block(mesh, [x, FLOOR + 0.5 * STOREY, side * 0.5 * width], [0.1, STOREY, 0.1]);
        }
    }
    mesh.paint(DOOR, [1.0; 3]);
    wing.block(mesh, [-1.0, FLOOR + 1.2, 0.5 * width], [3.4, 2.4, 0.24]);
    mesh.material = FRAME;
    for (x, size) in [(-2.7, [0.16, 2.5, 0.3]), (-1.0, [0.1, 2.4, 0.3]), (0.7, [0.16, 2.5, 0.3])] {
        wing.block(mesh, [x, FLOOR + 1.2, 0.5 * width], size);
    }
    wing.block(mesh, [-1.0, FLOOR + 2.45, 0.5 * width], [3.6, 0.16, 0.32]);
}

/// A church with its tower at one end.
fn church(mesh: &mut Mesh, nave: &Wing) {
    const TOP: f32 = 15.0;
    const HALF: f32 = 2.3;
    nave.add(mesh, true);
    mesh.material = STONE;
    mesh.cuboid([-6.4, 0.5 * TOP - 0.5, 0.0], [2.0 * HALF, TOP + 1.0, 2.0 * HALF]);
    mesh.cuboid([-6.4, TOP, 0.0], [2.0 * HALF + 0.5, 0.3, 2.0 * HALF + 0.5]);
    mesh.material = SLATE;
    let spire = Vec3::new(-6.4, TOP + 8.0, 0.0);
    let corner = |x: f32, z: f32| Vec3::new(-6.4 + x * HALF, TOP + 0.15, z * HALF);
    for [from, to] in
        [[(-1.0, 1.0), (1.0, 1.0)], [(1.0, 1.0), (1.0, -1.0)], [(1.0, -1.0), (-1.0, -1.0)], [(-1.0, -1.0), (-1.0, 1.0)]]
    {
        mesh.face(&[corner(from.0, from.1), corner(to.0, to.1), spire]);
    }
    mesh.material = FRAME;
    mesh.cuboid(spire + Vec3::Y * 0.5, [0.12, 1.4, 0.12]);
    mesh.cuboid(spire + Vec3::Y * 0.7, [0.7, 0.12, 0.12]);
    mesh.material = GLASS;
    for (u, out) in [(Vec3::X, Vec3::Z), (Vec3::NEG_X, Vec3::NEG_Z), (Vec3::Z, Vec3::NEG_X), (Vec3::NEG_Z, Vec3::X)] {
        mesh.block(Vec3::new(-6.4, TOP - 2.2, 0.0) + out * HALF, [u * 0.5, Vec3::Y * 1.0, out * 0.06]);
    }
}

/// A hedge along the street with a gap, and trees behind the house.
fn garden(mesh: &mut Mesh, house: House) {
    mesh.paint(HEDGE, [1.0; 3]);
    mesh.cuboid([-4.9, 0.3, 7.6], [6.2, 1.5, 0.8]);
    mesh.cuboid([5.1, 0.3, 7.6], [5.8, 1.5, 0.8]);
    let trees: &[(f32, f32, f32)] = match house {
        House::Cottage => &[(-5.5, -6.5, 1.0), (4.5, -7.5, 0.8)],
        House::Bungalow => &[(6.2, -4.5, 1.1)],
        House::Villa => &[(-6.5, 5.4, 0.7), (5.0, -7.8, 1.2)],
        House::Angled => &[(-4.0, -6.8, 1.0)],
        House::Barn => &[(7.2, -6.2, 1.3)],
        House::Church => &[(7.0, -5.0, 1.3), (7.2, 5.0, 0.9)],
    };
    for &(x, z, size) in trees {
        tree(mesh, Vec3::new(x, 0.0, z), size);
    }
}

/// A tree of a few balls, of about 5 metres times `size`.
fn tree(mesh: &mut Mesh, root: Vec3, size: f32) {
    mesh.paint(BARK, [1.0; 3]);
    mesh.tube(&[(root - Vec3::Y, 0.25 * size), (root + Vec3::Y * (3.0 * size), 0.12 * size)], 6);
    for (at, radius, shade) in [
        ([0.0, 4.2, 0.0], 1.5, 1.1),
        ([0.9, 3.1, 0.5], 1.2, 0.95),
        ([-0.8, 3.2, 0.5], 1.15, 1.0),
        ([0.0, 3.0, -0.9], 1.2, 0.85),
    ] {
        mesh.paint(LEAVES, [shade; 3]);
        mesh.ball(root + Vec3::from_array(at) * size, Vec3::new(1.0, 0.9, 1.0) * (radius * size), [9, 6]);
    }
}

/// A piece of a street along x with pavements and a lamp, a little longer than `length` so that pieces overlap in curves.
pub(super) fn street(length: f32) -> Mesh {
    let mut mesh = Mesh::new();
    let length = 1.05 * length;
    mesh.material = ASPHALT;
    mesh.cuboid([0.0, -0.3, 0.0], [length, 0.8, 5.6]);
    mesh.material = PAVING;
    for side in [-1.0, 1.0] {
        mesh.cuboid([0.0, -0.25, side * 3.4], [length, 0.98, 1.2]);
    }
    mesh.material = FRAME;
    for dash in [-0.35, 0.0, 0.35] {
        mesh.cuboid([dash * length, 0.1, 0.0], [2.4, 0.03, 0.14]);
    }
    mesh.paint(STONE, [0.4; 3]);
    mesh.tube(&[(Vec3::new(0.0, 0.0, 3.75), 0.08), (Vec3::new(0.0, 4.2, 3.75), 0.05)], 6);
    mesh.paint(FRAME, [1.0; 3]);
    mesh.ball(Vec3::new(0.0, 4.3, 3.75), Vec3::splat(0.28 * FRAC_1_SQRT_2), [8, 5]);
    mesh
}
