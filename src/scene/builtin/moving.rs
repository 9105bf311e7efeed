//! Built-in scenes that move by a formula: a flag in the wind, and a ball that flies apart.

use std::f32::consts::TAU;

use glam::{Quat, Vec3};

use super::shapes::{Random, paint};
use crate::scene::assemble::{Assembly, BATCH_SIZE, VertexLists};
use crate::scene::error::{FileLocation, LoadError};
use crate::scene::motion::{Clip, Moment, Motion, Mover, Pose};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::kernel::parallel::par_tasks;

/// Length of the clips in seconds.
const SECONDS: f32 = 2.0;

/// Step of numerical derivatives, in parts of the width.
const STEP: f32 = 1e-3;

/// A triangle before it is written.
const NO_TRIANGLE: Triangle = Triangle { a: Vec3::ZERO, b: Vec3::ZERO, c: Vec3::ZERO };

fn clip(name: &str) -> Vec<Clip> {
    vec![Clip { name: name.to_owned(), start: 0.0, end: SECONDS }]
}

/// Adds the triangles of `mover` at the beginning of its clip, and its motion. `corners` are the vertices of a triangle among those that
/// have normals.
fn add<M: Mover + 'static>(
    mover: M,
    name: &str,
    corners: impl Fn(&M, u32) -> [u32; 3],
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<(), LoadError> {
    let mut pose = Pose::default();
    mover.pose(Moment { clip: 0, seconds: 0.0 }, &mut pose, token)?;
    let lists = VertexLists { normals: pose.normals.split_off(1.min(pose.normals.len())), ..VertexLists::default() };
    let first = assembly.add_vertices(lists.normals.len(), &lists, token)?;
    for (index, triangle) in pose.triangles.into_iter().enumerate() {
        token.check_every(BATCH_SIZE, index)?;
        let corners = first.map(|first| corners(&mover, index as u32).map(|corner| first + corner));
        assembly.push(triangle, corners, 0, || FileLocation::File);
    }
    assembly.motion = Some(Motion::new(clip(name), Box::new(mover)));
    Ok(())
}

/// A flag of side 2 in the wind, with about, and at most, `triangles` triangles; at least 2.
pub(super) fn cloth(triangles: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), LoadError> {
    assembly.materials.push(paint("cloth", [0.62, 0.16, 0.14]));
    let cloth = Cloth { cells: (triangles / 2).isqrt().max(1) };
    add(cloth, "wind", Cloth::corners, assembly, token)
}

/// A ball of radius 1 that flies apart, with about, and at most, `triangles` triangles; at least 8.
pub(super) fn explosion(triangles: u32, assembly: &mut Assembly, token: &CancelToken) -> Result<(), LoadError> {
    assembly.materials.push(paint("shard", [0.66, 0.52, 0.30]));
    // As many stacks as half of the slices.
    let slices = triangles.isqrt().max(4);
    let explosion = Explosion { slices, stacks: triangles / (2 * slices) + 1 };
    add(explosion, "blast", |_, _| [0; 3], assembly, token)
}

/// A square grid, held at its left edge.
#[derive(Debug)]
struct Cloth {
    /// Number of squares along each edge.
    cells: u32,
}

impl Cloth {
    /// Position and normal of the vertex at (u, v), each 0 to 1, where both waves repeat after the length of the clip.
    fn vertex(u: f32, v: f32, seconds: f32) -> (Vec3, Vec3) {
        let turn = TAU * seconds / SECONDS;
        let depth = |u: f32, v: f32| {
            let wave = (TAU * 1.5 * u - 2.0 * turn + v).sin() + 0.4 * (TAU * (2.5 * u + v) - 3.0 * turn).sin();
            0.25 * u * wave
        };
        let z = depth(u, v);
        // The sides of the square have length 2.
        let slope = [depth(u + STEP, v) - z, depth(u, v + STEP) - z].map(|rise| rise / (2.0 * STEP));
        (Vec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, z), Vec3::new(-slope[0], -slope[1], 1.0).normalize())
    }

    /// Corners of a triangle, by vertices of the grid.
    fn corners(&self, triangle: u32) -> [u32; 3] {
        let (square, side) = (triangle / 2, self.cells + 1);
        let a = square / self.cells * side + square % self.cells;
        let [b, c, d] = [a + 1, a + side + 1, a + side];
        if triangle.is_multiple_of(2) { [a, b, c] } else { [a, c, d] }
    }
}

impl Mover for Cloth {
    fn triangle_count(&self) -> usize {
        2 * (self.cells * self.cells) as usize
    }

    fn pose(&self, moment: Moment, pose: &mut Pose, token: &CancelToken) -> Result<(), LoadError> {
        let side = self.cells as usize + 1;
        pose.positions.resize(side * side, Vec3::ZERO);
        // The first normal is that of vertices without one.
        pose.normals.resize(1 + side * side, Vec3::ZERO);
        pose.triangles.resize(self.triangle_count(), NO_TRIANGLE);
        let at = |step: usize| step as f32 / self.cells as f32;
        let rows = pose.positions.chunks_mut(side).zip(pose.normals[1..].chunks_mut(side)).enumerate();
        par_tasks(rows, token, |(row, (positions, normals)), _| {
            for (column, (position, normal)) in positions.iter_mut().zip(normals).enumerate() {
                (*position, *normal) = Self::vertex(at(column), at(row), moment.seconds.clamp(0.0, SECONDS));
            }
            Ok(())
        })?;
        let positions = &pose.positions;
        par_tasks(pose.triangles.chunks_mut(BATCH_SIZE).enumerate(), token, |(batch, triangles), _| {
            for (triangle, index) in triangles.iter_mut().zip((batch * BATCH_SIZE) as u32..) {
                let [a, b, c] = self.corners(index).map(|corner| positions[corner as usize]);
                *triangle = Triangle { a, b, c };
            }
            Ok(())
        })?;
        Ok(())
    }

    fn bytes(&self) -> usize {
        0
    }
}

/// A ball of shards.
#[derive(Debug)]
struct Explosion {
    slices: u32,
    stacks: u32,
}

impl Explosion {
    /// The shard with this number on the unit sphere.
    fn at_rest(&self, index: u32) -> Triangle {
        let point = |stack: u32, slice: u32| {
            let (height, y) = (std::f32::consts::PI * stack as f32 / self.stacks as f32).sin_cos();
            let (sin, cos) = (TAU * (slice % self.slices) as f32 / self.slices as f32).sin_cos();
            Vec3::new(height * cos, y, -height * sin)
        };
        // One triangle a slice in the first stack, two in the others but the last.
        let Some(index) = index.checked_sub(self.slices) else {
            return Triangle { a: point(0, index), b: point(1, index), c: point(1, index + 1) };
        };
        let stack = 1 + index / (2 * self.slices);
        let is_last = stack + 1 == self.stacks;
        let slice = if is_last { index } else { index / 2 } % self.slices;
        let [a, b] = [point(stack, slice), point(stack, slice + 1)];
        let below = point(stack + 1, slice);
        if is_last || index % 2 == 0 {
            Triangle { a, b: below, c: b }
        } else {
            Triangle { a: b, b: below, c: point(stack + 1, slice + 1) }
        }
    }

    /// The shard after this many seconds: it flies outwards and aside, each at its own speed, and turns.
    fn shard(&self, index: u32, seconds: f32) -> Triangle {
        let Triangle { a, b, c } = self.at_rest(index);
        let mut random = Random(index.into());
        let center = (a + b + c) / 3.0;
        let speed = center * (0.3 + 1.5 * random.unit()) + 0.6 * random.direction();
        let turn = Quat::from_axis_angle(random.direction(), seconds * TAU * random.unit());
        let [a, b, c] = [a, b, c].map(|corner| center + speed * seconds + turn * (corner - center));
        Triangle { a, b, c }
    }
}

impl Mover for Explosion {
    fn triangle_count(&self) -> usize {
        (2 * self.slices * (self.stacks - 1)) as usize
    }

    fn pose(&self, moment: Moment, pose: &mut Pose, token: &CancelToken) -> Result<(), LoadError> {
        pose.triangles.resize(self.triangle_count(), NO_TRIANGLE);
        par_tasks(pose.triangles.chunks_mut(1 << 12).enumerate(), token, |(batch, triangles), _| {
            for (triangle, index) in triangles.iter_mut().zip((batch << 12) as u32..) {
                *triangle = self.shard(index, moment.seconds.clamp(0.0, SECONDS));
            }
            Ok(())
        })?;
        Ok(())
    }

    fn bytes(&self) -> usize {
        0
    }
}
