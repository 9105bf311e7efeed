//! Triangle presplitting: before a tree is built, large triangles are split into several proxies with smaller boxes, so
//! that the box of a wall or a beam no longer overlaps a whole room (Ernst, Greiner, *Early Split Clipping for Bounding
//! Volume Hierarchies*, 2007). Which triangles are split, how often and where follows Karras, Aila, *Fast Parallel
//! Construction of High-Quality Bounding Volume Hierarchies*, 2013, section 4: above all those whose boxes are much
//! larger than the triangle needs and cross a high-level plane of the scene's grid. Builders take the proxies for
//! triangles; several leaves can then hold the same triangle.

use crate::builders::clip::{halves, overlap_within};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Triangle};
use crate::kernel::parallel::par_tasks;

/// Maximum number of additional proxies, as a fraction of the number of triangles.
const MAX_EXTRA: f64 = 0.1;
/// Maximum number of proxies for one triangle.
const MAX_PROXIES: u32 = 64;
/// Bits of the grid along each axis.
const GRID_BITS: u32 = 20;
/// Number of triangles in a task; poll for cancellation before each.
const BATCH_TRIANGLES: usize = 1 << 12;

/// Proxies of the triangles of a scene.
pub struct Presplit {
    /// For each proxy a degenerate triangle with the same box.
    pub proxy_triangles: Vec<Triangle>,
    /// For each proxy the index of the triangle that it is part of.
    pub source_index: Vec<u32>,
}

/// Splits `triangles` into proxies in the same order; `None` if no triangle is worth splitting.
pub fn presplit(triangles: &[Triangle], token: &CancelToken) -> Result<Option<Presplit>, Cancelled> {
    let batches = || triangles.chunks(BATCH_TRIANGLES);
    let boxes = par_tasks(batches(), token, |batch, _| {
        Ok(batch.iter().fold(Aabb::EMPTY, |all, triangle| all.union(&triangle.bounds())))
    })?;
    let grid = Grid::new(&boxes.iter().fold(Aabb::EMPTY, |all, batch| all.union(batch)));
    let priorities: Vec<Vec<f32>> =
        par_tasks(batches(), token, |batch, _| Ok(batch.iter().map(|triangle| grid.priority(triangle)).collect()))?;
    let budget = (triangles.len() as f64 * MAX_EXTRA) as u64;
    let split_factor = split_factor(&priorities, budget, token)?;
    if split_factor == 0.0 {
        return Ok(None);
    }
    let tasks = batches().zip(&priorities).enumerate();
    let batches = par_tasks(tasks, token, |(batch, (triangles, priorities)), _| {
        let mut output = Presplit { proxy_triangles: Vec::with_capacity(triangles.len()), source_index: Vec::new() };
        for (position, (triangle, &priority)) in triangles.iter().zip(priorities).enumerate() {
            grid.split(triangle, split_count(priority, split_factor), &mut output.proxy_triangles);
            output.source_index.resize(output.proxy_triangles.len(), (batch * BATCH_TRIANGLES + position) as u32);
        }
        Ok(output)
    })?;
    token.check()?;
    let count = batches.iter().map(|output| output.source_index.len()).sum();
    let mut all = Presplit { proxy_triangles: Vec::with_capacity(count), source_index: Vec::with_capacity(count) };
    for output in batches {
        token.check()?;
        all.proxy_triangles.extend(output.proxy_triangles);
        all.source_index.extend(output.source_index);
    }
    Ok((count > triangles.len()).then_some(all))
}

/// Number of times that a triangle is split.
fn split_count(priority: f32, split_factor: f64) -> u32 {
    (f64::from(priority) * split_factor).min(f64::from(MAX_PROXIES - 1)) as u32
}

/// The largest factor from priorities to numbers of splits whose sum stays within `budget`; 0 for no splits.
fn split_factor(priorities: &[Vec<f32>], budget: u64, token: &CancelToken) -> Result<f64, Cancelled> {
    let total: f64 = priorities.iter().map(|batch| batch.iter().map(|&p| f64::from(p)).sum::<f64>()).sum();
    if !(total > 0.0 && total.is_finite()) || budget == 0 {
        return Ok(0.0);
    }
    // Rounding down loses up to one split per triangle, so the factor can far exceed the quotient.
    let (mut low, mut high) = (0.0, 64.0 * budget as f64 / total);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        let of_batch = |batch: &Vec<f32>| batch.iter().map(|&p| u64::from(split_count(p, middle))).sum::<u64>();
        let sums = par_tasks(priorities, token, |batch, _| Ok(of_batch(batch)))?;
        if sums.iter().sum::<u64>() <= budget { low = middle } else { high = middle }
    }
    Ok(low)
}

/// Grid over the scene, at whose planes triangles are split.
struct Grid {
    origin: [f64; 3],
    /// Cells per unit of length.
    scale: f64,
    /// Distance by which proxies extend beyond their planes.
    overlap: f64,
}

/// A plane of the grid.
struct Plane {
    axis: usize,
    position: f64,
    /// 0 for the plane through the centre, 1 for those at the quarters, and so on.
    level: u32,
}

impl Grid {
    fn new(bounds: &Aabb) -> Self {
        let extent = f64::from(bounds.extent().max_element());
        Self {
            origin: bounds.min.as_dvec3().to_array(),
            scale: if extent > 0.0 { f64::from(1_u32 << GRID_BITS) / extent } else { 0.0 },
            overlap: overlap_within(bounds),
        }
    }

    /// The plane of the lowest level that crosses the interior of a box; of several the one across its longest side.
    fn plane(&self, bounds: &Aabb) -> Option<Plane> {
        let mut best: Option<Plane> = None;
        for axis in 0..3 {
            let cell = |x: f32| ((f64::from(x) - self.origin[axis]) * self.scale) as u32;
            let (low, high) = (cell(bounds.min[axis]), cell(bounds.max[axis]));
            if low >= high {
                continue;
            }
            let bit = (low ^ high).ilog2();
            let level = GRID_BITS.saturating_sub(1 + bit);
            let side = |axis: usize| bounds.max[axis] - bounds.min[axis];
            if best
                .as_ref()
                .is_none_or(|best| level < best.level || level == best.level && side(axis) > side(best.axis))
            {
                let position = self.origin[axis] + f64::from(high >> bit << bit) / self.scale;
                best = Some(Plane { axis, position, level });
            }
        }
        best
    }

    /// Priority for splitting a triangle: the cube root of its box's excess area times 2^−level of the plane
    /// that it crosses (Karras, Aila, 2013, section 4).
    fn priority(&self, triangle: &Triangle) -> f32 {
        let bounds = triangle.bounds();
        let Some(plane) = self.plane(&bounds) else { return 0.0 };
        // The area that boxes of ever smaller pieces approach: the triangle's projections along the axes.
        let normal = (triangle.b - triangle.a).cross(triangle.c - triangle.a).abs();
        let min_half_area = 0.5 * (normal.x + normal.y + normal.z);
        let excess = (bounds.half_area() - min_half_area).max(0.0);
        // 2^−level, exactly: levels are below 32.
        let priority = cube_root(excess * f32::from_bits((127 - plane.level) << 23));
        if priority.is_finite() { priority } else { 0.0 }
    }

    /// Adds the proxies that `split_count` splits make of `triangle`.
    fn split(&self, triangle: &Triangle, split_count: u32, proxy_triangles: &mut Vec<Triangle>) {
        let mut open = vec![(triangle.bounds(), split_count)];
        while let Some((bounds, split_count)) = open.pop() {
            let Some(halves) = (split_count > 0).then(|| self.halves(triangle, &bounds)).flatten() else {
                proxy_triangles.push(Triangle { a: bounds.min, b: bounds.max, c: bounds.min });
                continue;
            };
            // Distribute the remaining splits by the longest sides.
            let [first, second] = halves.map(|half| half.extent().max_element());
            let left = ((split_count - 1) as f32 * first / (first + second) + 0.5) as u32;
            let left = left.min(split_count - 1);
            open.extend([(halves[1], split_count - 1 - left), (halves[0], left)]);
        }
    }

    /// Boxes of the pieces of `triangle` within `bounds` on both sides of its split plane.
    fn halves(&self, triangle: &Triangle, bounds: &Aabb) -> Option<[Aabb; 2]> {
        let Plane { axis, position, .. } = self.plane(bounds)?;
        let halves = halves(triangle, bounds, axis, position, self.overlap);
        // A split is useless if a side is empty or as large as the whole.
        let useful = |half: &Aabb| !half.is_empty() && half != bounds;
        halves.iter().all(useful).then_some(halves)
    }
}

/// Cube root of a number that is not negative, with the same bits on every machine: those of system libraries differ in the last.
fn cube_root(x: f32) -> f32 {
    if !(x > 0.0 && x.is_finite()) {
        return x;
    }
    let x = f64::from(x);
    // A third of the exponent is within 5 % (Kahan); each of Newton's steps squares the error.
    let mut root = f64::from_bits(x.to_bits() / 3 + (715_094_163 << 32));
    for _ in 0..4 {
        root = (2.0 * root + x / (root * root)) / 3.0;
    }
    root as f32
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn proxies_cover_their_triangles_within_budget() {
        let mut state = 1_u32;
        let mut number = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for (size, offset) in [(1.0, 0.0), (0.1, 100.0), (1e9, -1e9), (1e-9, 0.0)] {
            let mut corner = || Vec3::new(number(), number(), number()) * size + offset;
            let triangles: Vec<Triangle> =
                (0..500).map(|_| Triangle { a: corner(), b: corner(), c: corner() }).collect();
            let split = presplit(&triangles, &CancelToken::new()).expect("not cancelled").expect("large triangles");
            let count = split.source_index.len();
            assert!(count > 500 && count <= 550 && count == split.proxy_triangles.len(), "{count} of size {size}");
            assert!(split.source_index.is_sorted() && split.source_index.last() == Some(&499));
            for (source_index, triangle) in triangles.iter().enumerate() {
                let own = split
                    .source_index
                    .iter()
                    .zip(&split.proxy_triangles)
                    .filter(|(index, _)| **index as usize == source_index);
                let boxes: Vec<Aabb> = own.map(|(_, proxy)| proxy.bounds()).collect();
                assert!(boxes.iter().all(|proxy| triangle.bounds().contains(proxy, 0.0)), "{triangle:?}: {boxes:?}");
                for _ in 0..100 {
                    let (u, v) = (number(), number());
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    let point = triangle.a + (triangle.b - triangle.a) * u + (triangle.c - triangle.a) * v;
                    let slack =
                        triangle.bounds().max.abs().max(triangle.bounds().min.abs()).max_element() * f32::EPSILON;
                    let holds = |proxy: &Aabb| proxy.contains(&Aabb { min: point, max: point }, slack);
                    assert!(boxes.iter().any(holds), "{point} of {triangle:?}: {boxes:?}");
                }
            }
        }
    }

    #[test]
    fn cube_roots_are_the_nearest_numbers() {
        for root in [1.0_f32, 2.0, 3.0, 0.5, 17.0, 1e-12, 1e12] {
            assert_eq!(cube_root(root * root * root), root);
        }
        let mut x = f32::MIN_POSITIVE / 8.0;
        while x < f32::MAX / 4.0 {
            let cube = f64::from(cube_root(x)).powi(3);
            assert!((cube / f64::from(x) - 1.0).abs() <= 1.5 * f64::from(f32::EPSILON), "{x}: {cube}");
            x *= 1.37;
        }
        assert_eq!([0.0, f32::INFINITY].map(cube_root), [0.0, f32::INFINITY]);
    }

    #[test]
    fn tight_boxes_are_not_split() {
        // Boxes of points are as small as they can be.
        let flat =
            |position: f32| Triangle { a: Vec3::splat(position), b: Vec3::splat(position), c: Vec3::splat(position) };
        for triangles in [vec![], (0..100_u8).map(|position| flat(f32::from(position))).collect()] {
            assert!(presplit(&triangles, &CancelToken::new()).expect("not cancelled").is_none());
        }
    }
}
