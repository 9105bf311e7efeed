//! A village: houses along curved streets on gently rolling ground.

use glam::{Affine3A, Mat3A, Vec3, Vec3A};

use super::ground::Ground;
use super::houses::{self, House};
use super::shapes::{Random, paint};
use super::terrain::noise;
use crate::scene::assemble::Assembly;
use crate::scene::placed_meshes::PlacedMeshes;
use bvhscope_engine::Placed;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::kernel::parallel::par_collect;

/// Metres of a street for each house on one of its sides.
const WIDTH: f32 = 18.0;
/// Metres from the middle of a street to the end of the gardens.
const DEPTH: f32 = 24.0;
/// Metres from the middle of a street to that of a house.
const SETBACK: f32 = 12.0;

/// Number of cells along a side of the ground.
fn cells(houses: u32) -> u32 {
    (3 * houses.isqrt()).clamp(48, 400)
}

/// Upper bound of the number of triangles of ground, street and houses, each counted once.
pub(super) fn mesh_triangles(houses: u32) -> usize {
    let cells = cells(houses) as usize;
    2 * cells * cells + 8 * cells + houses::MAX_TRIANGLES
}

/// The rows of houses on either side of streets.
#[derive(Debug, Clone, Copy)]
struct Plan {
    houses: usize,
    /// Houses of a row.
    columns: usize,
    /// Streets, each with a row on either side.
    streets: usize,
}

impl Plan {
    /// Rows that are together about as wide as long.
    fn new(houses: usize) -> Self {
        let columns = ((houses as f32 * DEPTH / WIDTH).sqrt().ceil() as usize).clamp(1, houses);
        Self { houses, columns, streets: houses.div_ceil(columns).div_ceil(2) }
    }

    fn side(&self) -> f32 {
        (self.columns as f32 * WIDTH).max(self.streets as f32 * 2.0 * DEPTH) + 30.0
    }

    /// Number of pieces of streets, one for each house of a row or two opposite ones.
    fn pieces(&self) -> usize {
        let full = self.columns * (self.streets - 1);
        full + self.columns.min(self.houses - 2 * full)
    }

    /// The middle of a street in a column, and the direction of the street there.
    fn street(&self, street: usize, column: usize) -> (Vec3, Vec3) {
        let x = (column as f32 + 0.5 - 0.5 * self.columns as f32) * WIDTH;
        let z = (street as f32 + 0.5 - 0.5 * self.streets as f32) * 2.0 * DEPTH;
        let (sin, cos) = (x / 42.0).sin_cos();
        (Vec3::new(x, 0.0, z + 7.5 * sin), Vec3::new(1.0, 0.0, 7.5 / 42.0 * cos).normalize_or(Vec3::X))
    }

    /// Which house stands at a place of a row: a church in the middle, and a few more in a large village.
    fn house(&self, index: usize, random: &mut Random) -> House {
        let middle = self.streets / 2 * 2 * self.columns + self.columns / 2;
        if self.houses > 12 && (index == middle || random.unit() < 0.004) {
            return House::Church;
        }
        House::COMMON[(random.unit() * House::COMMON.len() as f32) as usize]
    }
}

/// The ground and `houses` houses on it, with the streets between them.
pub(super) fn build(houses: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<PlacedMeshes, Cancelled> {
    let plan = Plan::new(houses as usize);
    let ground = Ground::new(plan.side(), cells(houses), height, token)?;
    assembly.materials.push(paint("meadow", [1.0; 3]));
    let mut meshes = vec![ground.finish(3.0, meadow, assembly, token)?];
    houses::add_materials(assembly);
    meshes.push(houses::street(WIDTH).finish(assembly, token)?);
    for house in House::ALL {
        meshes.push(house.mesh().finish(assembly, token)?);
    }
    let placed = par_collect(1 + plan.pieces() + plan.houses, token, |index| match index.checked_sub(1) {
        None => Placed { mesh: 0, transform: Affine3A::IDENTITY },
        Some(piece) if piece < plan.pieces() => {
            let (middle, along) = plan.street(piece / plan.columns, piece % plan.columns);
            Placed { mesh: 1, transform: paved(&ground, middle, along) }
        }
        Some(index) => house(&plan, index - plan.pieces(), &ground),
    })?;
    Ok(PlacedMeshes { meshes, placed, motion: None })
}

/// The place of a piece of a street, sheared so that it lies along the slope of the ground.
fn paved(ground: &Ground, middle: Vec3, along: Vec3) -> Affine3A {
    let across = along.cross(Vec3::Y);
    let slope = |direction: Vec3, reach: f32| {
        let [low, high] = [-reach, reach].map(|reach| middle + direction * reach);
        (ground.at(high.x, high.z) - ground.at(low.x, low.z)) / (2.0 * reach)
    };
    let (x, z) = (along.with_y(slope(along, 0.5 * WIDTH)), across.with_y(slope(across, 3.0)));
    Affine3A {
        matrix3: Mat3A::from_cols(x.into(), Vec3A::Y, z.into()),
        translation: middle.with_y(ground.at(middle.x, middle.z)).into(),
    }
}

/// A house beside its street, its front towards it; every other one mirrored.
fn house(plan: &Plan, index: usize, ground: &Ground) -> Placed {
    let mut random = Random::of(13, index);
    let (row, column) = (index / plan.columns, index % plan.columns);
    let (middle, along) = plan.street(row / 2, column);
    let house = plan.house(index, &mut random);
    let side = if row.is_multiple_of(2) { -1.0 } else { 1.0 };
    let place = middle + along.cross(Vec3::Y) * (side * SETBACK) + along * (2.0 * random.unit() - 1.0);
    let front = along.cross(Vec3::Y) * -side + along * (0.24 * (random.unit() - 0.5));
    let front = front.normalize_or(Vec3::Z);
    let width = if random.unit() < 0.5 { -1.0 } else { 1.0 } * (0.92 + 0.16 * random.unit());
    let [height, depth] = [0.92, 0.92].map(|least| least + 0.16 * random.unit());
    let [x, y, z] = [Vec3::Y.cross(front) * width, Vec3::Y * height, front * depth];
    let matrix3 = Mat3A::from_cols(x.into(), y.into(), z.into());
    let translation = place.with_y(ground.at(place.x, place.z)).into();
    Placed { mesh: 2 + house as u32, transform: Affine3A { matrix3, translation } }
}

/// The height of the ground.
fn height(x: f32, z: f32) -> f32 {
    9.0 * noise(x / 190.0, z / 190.0, 21) + 0.6 * noise(x / 40.0, z / 40.0, 22)
}

/// The colour of the ground: meadows, mown and not.
fn meadow(Vec3 { x, z, .. }: Vec3) -> Vec3 {
    let [lawn, grass, hay] = [Vec3::new(0.17, 0.30, 0.08), Vec3::new(0.24, 0.34, 0.11), Vec3::new(0.40, 0.38, 0.18)];
    let part = |scale: f32, seed: u32| ((noise(x / scale, z / scale, seed) - 0.4) * 3.0).clamp(0.0, 1.0);
    lawn.lerp(grass, part(14.0, 23)).lerp(hay, 0.7 * part(45.0, 24))
}
