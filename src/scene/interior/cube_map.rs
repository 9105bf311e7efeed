//! A small cube map: what a point sees of the triangles around it.

use std::sync::LazyLock;

use glam::Vec3;
use rayon::prelude::*;

use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// Cells along the edge of a face of the cube map.
const EDGE: usize = 24;
/// Cells of the cube map.
pub(super) const CELLS: usize = 6 * EDGE * EDGE;
/// Size over distance of a triangle that is drawn into the one cell of its centre: half a cell.
const SMALL: f32 = 0.04;
/// Triangles of a task, which has maps of its own.
const CHUNK: usize = 1 << 14;
/// Triangles between two checks of the token: each may cover all cells.
const POLL_INTERVAL: usize = 1 << 10;

/// Unit direction of each cell's centre.
static DIRECTIONS: LazyLock<Vec<Vec3>> = LazyLock::new(|| (0..CELLS).map(direction).collect());

/// The surface visible in the direction of a cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    /// Distance in world units; infinite where nothing is seen.
    pub(super) distance: f32,
    /// Unit normal of the surface, on the side from which its corners turn counter-clockwise.
    pub(super) normal: Vec3,
}

impl Cell {
    const NOTHING: Self = Self { distance: f32::INFINITY, normal: Vec3::ZERO };

    /// True if the surface, seen in `direction`, shows its front.
    pub(super) fn is_front(&self, direction: Vec3) -> bool {
        self.normal.dot(direction) < 0.0
    }
}

/// The cells of a map with their unit directions and their shares of all directions, not normalised.
pub(super) fn cells(map: &[Cell]) -> impl Iterator<Item = (Vec3, f32, &Cell)> {
    // The solid angle of a cell falls with the third power of its distance on the cube.
    let weight = |direction: Vec3| direction.abs().max_element().powi(3);
    map.iter().zip(&*DIRECTIONS).map(move |(cell, &direction)| (direction, weight(direction), cell))
}

/// Unit direction of a cell's centre.
fn direction(cell: usize) -> Vec3 {
    let (face, y, x) = (cell / (EDGE * EDGE), cell / EDGE % EDGE, cell % EDGE);
    let along = |place: usize| (place as f32 + 0.5) / EDGE as f32 * 2.0 - 1.0;
    let (u, v) = (along(x), along(y));
    let mut direction = Vec3::ZERO;
    let axis = face % 3;
    direction[axis] = if face < 3 { 1.0 } else { -1.0 };
    direction[(axis + 1) % 3] = u;
    direction[(axis + 2) % 3] = v;
    direction / (1.0 + u * u + v * v).sqrt()
}

/// The cell that a direction passes through.
fn cell_of(direction: Vec3) -> usize {
    let axis = direction.abs().max_position();
    let depth = direction[axis].abs();
    let place = |axis: usize| (((direction[axis] / depth + 1.0) * 0.5 * EDGE as f32) as usize).min(EDGE - 1);
    let face = if direction[axis] > 0.0 { axis } else { axis + 3 };
    (face * EDGE + place((axis + 2) % 3)) * EDGE + place((axis + 1) % 3)
}

/// The nearest surfaces around each of `points`, which are seen in one pass over the triangles.
pub(super) fn around(
    points: &[Vec3],
    triangles: &[Triangle],
    token: &CancelToken,
) -> Result<Vec<Vec<Cell>>, Cancelled> {
    let nothing = || vec![vec![Cell::NOTHING; CELLS]; points.len()];
    triangles
        .par_chunks(CHUNK)
        .try_fold(nothing, |mut maps, chunk| {
            for (point, map) in points.iter().zip(&mut maps) {
                for part in chunk.chunks(POLL_INTERVAL) {
                    token.check()?;
                    for triangle in part {
                        draw(triangle, *point, map);
                    }
                }
            }
            Ok(maps)
        })
        .try_reduce(nothing, |mut all, others| {
            for (a, b) in all.iter_mut().zip(others) {
                merge(a, &b);
            }
            Ok(all)
        })
}

/// Keeps the nearer surface of each cell. Of two at the same distance the front counts, whichever comes first.
fn merge(map: &mut [Cell], other: &[Cell]) {
    for ((a, b), direction) in map.iter_mut().zip(other).zip(&*DIRECTIONS) {
        let is_front = |cell: &Cell| cell.is_front(*direction);
        if b.distance < a.distance || b.distance == a.distance && is_front(b) && !is_front(a) {
            *a = *b;
        }
    }
}

/// Draws a triangle into the cells whose centre it covers.
fn draw(triangle: &Triangle, center: Vec3, map: &mut [Cell]) {
    let corners = [triangle.a, triangle.b, triangle.c].map(|corner| corner - center);
    let normal = triangle.scaled_normal();
    let height = normal.dot(corners[0]);
    if height == 0.0 || !height.is_finite() {
        return;
    }
    let (center, size) = ((corners[0] + corners[1] + corners[2]) / 3.0, triangle.bounds().extent().max_element());
    let distance = center.length();
    if size < distance * SMALL {
        let cell = &mut map[cell_of(center)];
        if distance < cell.distance {
            *cell = Cell { distance, normal: normal.normalize_or_zero() };
        }
        return;
    }
    let [a, b, c] = corners;
    let edges = [a.cross(b), b.cross(c), c.cross(a)];
    let directions = &**DIRECTIONS;
    for face in 0..6 {
        let (axis, sign) = (face % 3, if face < 3 { 1.0 } else { -1.0 });
        let depths = corners.map(|corner| corner[axis] * sign);
        if depths.iter().all(|&depth| depth <= 0.0) {
            continue;
        }
        // The cells that the triangle may cover; all of the face where it passes the centre's plane.
        let range = |place: usize| {
            if depths.iter().any(|&depth| depth <= 0.0) {
                return (0, EDGE);
            }
            let at = [0, 1, 2].map(|corner| (corners[corner][place] / depths[corner] + 1.0) * 0.5 * EDGE as f32 - 0.5);
            let low = at[0].min(at[1]).min(at[2]).ceil().clamp(0.0, EDGE as f32);
            let high = (at[0].max(at[1]).max(at[2]).floor() + 1.0).clamp(0.0, EDGE as f32);
            (low as usize, high as usize)
        };
        let ((left, right), (top, bottom)) = (range((axis + 1) % 3), range((axis + 2) % 3));
        for y in top..bottom {
            for x in left..right {
                let cell = (face * EDGE + y) * EDGE + x;
                let direction = directions[cell];
                let toward = normal.dot(direction);
                let distance = height / toward;
                if distance > 0.0 && distance < map[cell].distance && covers(&edges, direction) {
                    map[cell] = Cell { distance, normal: normal.normalize_or_zero() };
                }
            }
        }
    }
}

/// True if the ray from the origin along `direction` passes the triangle on the same side of its three edges, each given as the normal
/// of its plane through the origin.
fn covers(edges: &[Vec3; 3], direction: Vec3) -> bool {
    let sides = edges.map(|edge| edge.dot(direction));
    sides.iter().all(|&side| side >= 0.0) || sides.iter().all(|&side| side <= 0.0)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use std::f32::consts::TAU;

    use super::super::tests::room;
    use super::*;
    use bvhscope_engine::geometry::Aabb;

    #[test]
    fn the_cells_share_all_directions() {
        let map = vec![Cell::NOTHING; CELLS];
        let total: f32 = cells(&map).map(|(_, weight, _)| weight).sum::<f32>() * (2.0 / EDGE as f32).powi(2);
        assert!((total - 2.0 * TAU).abs() < 0.01, "the solid angle of the sphere is 4π, not {total}");
        for cell in 0..CELLS {
            assert!((direction(cell).length() - 1.0).abs() < 1e-6);
            assert_eq!(cell_of(direction(cell) * 7.0), cell);
        }
    }

    /// Every direction meets exactly the wall there, at its distance.
    #[test]
    fn distances_are_those_of_the_walls() {
        let bounds = Aabb { min: Vec3::new(-2.0, -1.0, -3.0), max: Vec3::new(2.0, 1.0, 3.0) };
        let map = around(&[Vec3::ZERO], &room(&bounds, true, None), &CancelToken::new()).unwrap();
        for (direction, _, cell) in cells(&map[0]) {
            let expected = (bounds.max / direction.abs()).min_element();
            assert!(cell.is_front(direction) && (cell.distance / expected - 1.0).abs() < 1e-5, "{direction}: {cell:?}");
        }
    }
}
