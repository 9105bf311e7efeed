//! A square of ground with hills, on which copies of meshes stand.

use std::ops::Range;

use glam::Vec3;

use super::mesh::Mesh;
use crate::scene::assemble::Assembly;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::kernel::parallel::par_collect;

/// Heights on a square grid around the origin.
pub(super) struct Ground {
    /// Number of cells along a side.
    cells: usize,
    /// Length of a side.
    side: f32,
    /// The height of each corner of the cells, row by row along z.
    heights: Vec<f32>,
}

impl Ground {
    pub(super) fn new(
        side: f32,
        cells: u32,
        height: impl Fn(f32, f32) -> f32 + Sync,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let cells = cells as usize;
        let at = |index: usize| index as f32 / cells as f32 * side - 0.5 * side;
        let columns = cells + 1;
        let heights = par_collect(columns * columns, token, |index| height(at(index % columns), at(index / columns)))?;
        Ok(Self { cells, side, heights })
    }

    fn corner(&self, column: usize, row: usize) -> f32 {
        self.heights[row * (self.cells + 1) + column]
    }

    /// The height of the triangles at a point; beyond the edges that of the nearest point.
    pub(super) fn at(&self, x: f32, z: f32) -> f32 {
        let scaled = |value: f32| ((value / self.side + 0.5) * self.cells as f32).clamp(0.0, self.cells as f32);
        let (x, z) = (scaled(x), scaled(z));
        let [column, row] = [x, z].map(|value| (value as usize).min(self.cells - 1));
        let (u, v) = (x - column as f32, z - row as f32);
        let [a, b] = [row, row + 1].map(|row| self.corner(column, row));
        let [d, c] = [row, row + 1].map(|row| self.corner(column + 1, row));
        if v > u { a + (b - a) * v + (c - b) * u } else { a + (d - a) * u + (c - d) * v }
    }

    /// The mesh of the ground with `color` at each corner, and with upright sides down to `depth` below its lowest point.
    pub(super) fn finish(
        &self,
        depth: f32,
        color: impl Fn(Vec3) -> Vec3,
        assembly: &mut Assembly,
        token: &CancelToken,
    ) -> Result<Range<u32>, Cancelled> {
        let mut mesh = Mesh::new();
        let (columns, cell) = (self.cells + 1, self.side / self.cells as f32);
        for row in 0..columns {
            token.check_every(16, row)?;
            for column in 0..columns {
                let point = self.point(column, row);
                let [west, east] = [column.saturating_sub(1), (column + 1).min(self.cells)];
                let [north, south] = [row.saturating_sub(1), (row + 1).min(self.cells)];
                let slope = |from: f32, to: f32, cells: usize| (from - to) / (cells as f32 * cell);
                let dx = slope(self.corner(west, row), self.corner(east, row), east - west);
                let dz = slope(self.corner(column, north), self.corner(column, south), south - north);
                mesh.tint = color(point);
                mesh.vertex(point, Vec3::new(dx, 1.0, dz).normalize_or(Vec3::Y));
            }
        }
        for row in 0..self.cells {
            for column in 0..self.cells {
                let a = (row * columns + column) as u32;
                let [b, c, d] = [a + columns as u32, a + columns as u32 + 1, a + 1];
                mesh.triangle([a, b, c]);
                mesh.triangle([a, c, d]);
            }
        }
        let lowest = self.heights.iter().copied().fold(f32::INFINITY, f32::min);
        self.edge(&mut mesh, lowest - depth);
        mesh.finish(assembly, token)
    }

    fn point(&self, column: usize, row: usize) -> Vec3 {
        let at = |index: usize| index as f32 / self.cells as f32 * self.side - 0.5 * self.side;
        Vec3::new(at(column), self.corner(column, row), at(row))
    }

    /// Upright faces around the ground, of bare earth.
    fn edge(&self, mesh: &mut Mesh, bottom: f32) {
        let last = self.cells;
        mesh.tint = Vec3::new(0.21, 0.16, 0.12);
        for index in 0..last {
            let ends = [
                [(index, last), (index + 1, last)],
                [(last, index + 1), (last, index)],
                [(index + 1, 0), (index, 0)],
                [(0, index), (0, index + 1)],
            ];
            for [from, to] in ends.map(|ends| ends.map(|(column, row)| self.point(column, row))) {
                mesh.face(&[from.with_y(bottom), to.with_y(bottom), to, from]);
            }
        }
    }
}
