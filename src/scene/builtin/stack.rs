//! A pile of wooden crates, each turned its own way.

use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A};

use super::ground::Ground;
use super::mesh::Mesh;
use super::shapes::{Random, paint};
use super::terrain::noise;
use crate::scene::assemble::Assembly;
use crate::scene::placed_meshes::PlacedMeshes;
use bvhscope_engine::Placed;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::kernel::parallel::par_collect;

/// Distance between the middles of crates, whose edges have length 1: turned ones just do not touch.
const SPACING: f32 = 1.17;
/// Number of cells along a side of the floor.
const CELLS: u32 = 48;
/// Upper bound of the number of triangles of floor and crates, each counted once.
pub(super) const MESH_TRIANGLES: usize = 2 * 48 * 48 + 8 * 48 + 3_000;

/// Where crates stand: layers that are squares, each resting on a larger one, and some crates around them.
struct Plan {
    /// Crates along a side of the lowest layer.
    base: usize,
    /// Index of the first crate of each layer.
    starts: Vec<usize>,
    /// Crates in the layers; the others lie around.
    stacked: usize,
    around: usize,
}

impl Plan {
    fn new(crates: usize) -> Self {
        let fits = |base: usize| base * (base + 1) * (2 * base + 1) / 6;
        let base_for = |count: usize| (1..=count).find(|&base| fits(base) >= count).unwrap_or(1);
        let around = (crates / 16).min(2 * base_for(crates));
        let stacked = crates - around;
        let base = base_for(stacked);
        let starts = (0..base).map(|layer| fits(base) - fits(base - layer)).collect();
        Self { base, starts, stacked, around }
    }

    /// Length of a side of the lowest layer.
    fn side(&self) -> f32 {
        self.base as f32 * SPACING
    }

    /// The middle of the bottom of a crate in the layers.
    fn stacked(&self, index: usize) -> Vec3 {
        let layer = self.starts.partition_point(|&start| start <= index) - 1;
        let (within, side) = (index - self.starts[layer], self.base - layer);
        let at = |index: usize| (index as f32 + 0.5 - 0.5 * side as f32) * SPACING;
        Vec3::new(at(within % side), layer as f32, at(within / side))
    }

    /// The same of one around them: along the sides of a square.
    fn around(&self, index: usize, random: &mut Random) -> Vec3 {
        let part = 4.0 * (index as f32 + 0.3 + 0.4 * random.unit()) / self.around as f32;
        let (out, along) = (0.5 * self.side() + 1.2 + 1.3 * random.unit(), (part.fract() - 0.5) * (self.side() + 2.0));
        match part as u32 {
            0 => Vec3::new(along, 0.0, out),
            1 => Vec3::new(out, 0.0, -along),
            2 => Vec3::new(-along, 0.0, -out),
            _ => Vec3::new(-out, 0.0, along),
        }
    }
}

/// A floor with `crates` crates on it.
pub(super) fn build(crates: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<PlacedMeshes, Cancelled> {
    let plan = Plan::new(crates as usize);
    assembly.materials = vec![
        paint("floor", [1.0; 3]),
        paint("pine", [0.60, 0.40, 0.20]),
        paint("oak", [0.36, 0.21, 0.10]),
        paint("painted", [0.20, 0.34, 0.32]),
    ];
    let floor = Ground::new(plan.side() + 8.0, CELLS, |_, _| 0.0, token)?;
    let concrete = |at: Vec3| Vec3::splat(0.34 + 0.12 * noise(at.x / 1.5, at.z / 1.5, 31));
    let mut meshes = vec![floor.finish(0.25, concrete, assembly, token)?];
    for kind in 0..3 {
        meshes.push(crate_mesh(kind).finish(assembly, token)?);
    }
    let placed = par_collect(crates as usize + 1, token, |index| match index.checked_sub(1) {
        None => Placed { mesh: 0, transform: Affine3A::IDENTITY },
        Some(index) => placed(&plan, index),
    })?;
    Ok(PlacedMeshes { meshes, placed, motion: None })
}

/// Where a crate stands, or lies tilted on an edge.
fn placed(plan: &Plan, index: usize) -> Placed {
    let mut random = Random::of(14, index);
    let mesh = 1 + (random.unit() * random.unit() * 3.0) as u32;
    let is_stacked = index < plan.stacked;
    let place = if is_stacked { plan.stacked(index) } else { plan.around(index - plan.stacked, &mut random) };
    let most = if is_stacked { 0.16 } else { 1.5 };
    let turn = Vec2::from_angle((2.0 * random.unit() - 1.0) * most);
    let (x, z) = (Vec3::new(turn.x, 0.0, turn.y), Vec3::new(-turn.y, 0.0, turn.x));
    // Every seventh is worn: lower, narrower, or out of true.
    let worn = match random.unit() {
        unit if unit < 0.07 => Mat3A::from_diagonal(Vec3::new(1.0, 0.93, 0.86)),
        unit if unit < 0.14 => Mat3A::from_cols(Vec3A::X, Vec3A::new(0.09, 1.0, -0.05), Vec3A::Z),
        _ => Mat3A::IDENTITY,
    };
    let mut matrix = Mat3A::from_cols(x.into(), Vec3A::Y, z.into()) * worn;
    // The crate's middle is its origin.
    let mut height = 0.5 * worn.y_axis.y;
    if !is_stacked && random.unit() < 0.5 {
        let tilt = Vec2::from_angle(0.2 + 0.5 * random.unit());
        let tilted = Mat3A::from_cols(Vec3A::X, Vec3A::new(0.0, tilt.x, tilt.y), Vec3A::new(0.0, -tilt.y, tilt.x));
        matrix = Mat3A::from_cols(x.into(), Vec3A::Y, z.into()) * tilted;
        height = 0.5 * (tilt.x + tilt.y);
    }
    Placed { mesh, transform: Affine3A { matrix3: matrix, translation: (place + Vec3::Y * height).into() } }
}

/// A crate of boards around the origin, with edges of length 1.
fn crate_mesh(kind: u32) -> Mesh {
    let mut mesh = Mesh::new();
    let mut random = Random::of(15, kind as usize);
    let (boards, braces) = [(5, 1), (4, 2), (6, 0)][kind as usize];
    for (n, u, v) in [(Vec3::X, Vec3::Y, Vec3::Z), (Vec3::Y, Vec3::Z, Vec3::X), (Vec3::Z, Vec3::X, Vec3::Y)] {
        for n in [n, -n] {
            let u = if n.min_element() < 0.0 { -u } else { u };
            let mut board = |center: Vec3, along: Vec3, across: Vec3, out: f32| {
                let shade = 0.75 + 0.4 * random.unit();
                mesh.paint(1 + kind, Vec3::new(1.0, 0.97 + 0.06 * random.unit(), 1.0) * shade);
                mesh.block(center + n * out, [n * 0.02, along, across]);
            };
            for index in 0..boards {
                let across = (index as f32 + 0.5 - 0.5 * boards as f32) / boards as f32 * 0.92;
                board(v * across, u * 0.45, v * (0.43 / boards as f32), 0.44);
            }
            for side in [-0.43, 0.43] {
                board(u * side, v * 0.5, u * -0.07, 0.48);
                board(v * side, u * 0.36, v * 0.07, 0.479);
            }
            for brace in 0..braces {
                let slant = if brace == 0 { 1.0 } else { -1.0 };
                let along = (u + v * slant) * 0.355;
                board(Vec3::ZERO, along, n.cross(along).normalize_or(v) * 0.06, 0.475 - 0.004 * brace as f32);
            }
        }
    }
    mesh
}
