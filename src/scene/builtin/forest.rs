//! A forest: copies of five plants on hilly ground.

use std::f32::consts::TAU;

use glam::{Affine3A, Quat, Vec3};

use super::ground::Ground;
use super::plants::{self, Plant};
use super::shapes::{Random, paint};
use super::terrain::noise;
use crate::scene::assemble::Assembly;
use crate::scene::placed_meshes::PlacedMeshes;
use bvhscope_engine::Placed;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::kernel::parallel::par_collect;

/// Square metres of ground for each plant: crowns overlap a little.
const SPACE: f32 = 11.0;
/// Part of the plants that grow below the trees.
const UNDERGROWTH: f32 = 0.4;

/// Number of cells along a side of the ground.
fn cells(plants: u32) -> u32 {
    plants.isqrt().clamp(48, 400)
}

/// Upper bound of the number of triangles of ground and plants, each counted once.
pub(super) fn mesh_triangles(plants: u32) -> usize {
    let cells = cells(plants) as usize;
    2 * cells * cells + 8 * cells + plants::MAX_TRIANGLES
}

/// The ground and `plants` plants on it.
pub(super) fn build(plants: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<PlacedMeshes, Cancelled> {
    let side = (plants as f32 * SPACE).sqrt().max(8.0);
    let ground = Ground::new(side, cells(plants), height, token)?;
    assembly.materials.push(paint("soil", [1.0; 3]));
    let mut meshes = vec![ground.finish(1.5, soil, assembly, token)?];
    plants::add_materials(assembly);
    for plant in Plant::ALL {
        meshes.push(plant.mesh().finish(assembly, token)?);
    }
    let plant = |index: usize| {
        let mut random = Random::of(11, index);
        let [x, z] = place(index, side, &mut random);
        let plant = choose(x, z, &mut random);
        let lean = Vec3::new(random.unit() - 0.5, 0.0, random.unit() - 0.5) * 0.14;
        let turn = Quat::from_rotation_arc(Vec3::Y, (Vec3::Y + lean).normalize_or(Vec3::Y));
        let turn = turn * Quat::from_rotation_y(TAU * random.unit());
        let scale = Vec3::splat(0.7 + 0.6 * random.unit());
        let place = Vec3::new(x, ground.at(x, z), z);
        Placed { mesh: 1 + plant as u32, transform: Affine3A::from_scale_rotation_translation(scale, turn, place) }
    };
    let placed = par_collect(plants as usize + 1, token, |index| match index.checked_sub(1) {
        None => Placed { mesh: 0, transform: Affine3A::IDENTITY },
        Some(index) => plant(index),
    })?;
    Ok(PlacedMeshes { meshes, placed, motion: None })
}

/// Where a plant stands: points of the R2 sequence (Roberts, *The Unreasonable Effectiveness of Quasirandom Sequences*, 2018), which are
/// evenly far from one another for any number of plants, moved a little so that no rows are seen.
fn place(index: usize, side: f32, random: &mut Random) -> [f32; 2] {
    // The reciprocals of the plastic number and of its square, in units of 2⁻³².
    [0xC13F_A9A9_u32, 0x91E1_0DA5].map(|step| {
        let part = ((index as u32 + 1).wrapping_mul(step) >> 8) as f32 / (1 << 24) as f32;
        let moved = (part - 0.5) * side + (random.unit() - 0.5) * 1.6;
        moved.clamp(0.6 - 0.5 * side, 0.5 * side - 0.6)
    })
}

/// Which plant grows at a point: conifers keep together.
fn choose(x: f32, z: f32, random: &mut Random) -> Plant {
    let conifers = (3.0 * (noise(x / 22.0, z / 22.0, 7) - 0.5) + 0.45).clamp(0.05, 0.95);
    if random.unit() < UNDERGROWTH {
        return if random.unit() < 0.5 { Plant::Bush } else { Plant::Fern };
    }
    match random.unit() {
        unit if unit < conifers => Plant::Spruce,
        unit if unit < conifers + 0.55 * (1.0 - conifers) => Plant::Oak,
        _ => Plant::Birch,
    }
}

/// The height of the ground.
fn height(x: f32, z: f32) -> f32 {
    9.0 * noise(x / 60.0, z / 60.0, 1) + 2.0 * noise(x / 18.0, z / 18.0, 2) + 0.25 * noise(x / 4.0, z / 4.0, 3)
}

/// The colour of the ground: grass, moss and fallen leaves.
fn soil(Vec3 { x, z, .. }: Vec3) -> Vec3 {
    let [grass, moss, leaves] = [Vec3::new(0.16, 0.24, 0.06), Vec3::new(0.09, 0.15, 0.05), Vec3::new(0.24, 0.16, 0.08)];
    let part = |scale: f32, seed: u32| ((noise(x / scale, z / scale, seed) - 0.35) * 2.5).clamp(0.0, 1.0);
    grass.lerp(moss, part(9.0, 4)).lerp(leaves, part(5.0, 5) * 0.8)
}
