//! Large triangles in several fragments, each with a box of its own, before a tree is built: a wall or a beam across a room
//! no longer has one box that reaches over everything (Ernst and Greiner, *Early Split Clipping for Bounding Volume Hierarchies*,
//! 2007). Which triangles, how often and where after Karras and Aila, *Fast Parallel Construction of High-Quality Bounding Volume
//! Hierarchies*, 2013, section 4: most where a box is much larger than its triangle needs and crosses a high plane of
//! the scene's grid. The builder takes fragments for triangles, so that several leaves can hold the same triangle.

use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Triangle};

/// Fragments on top of one for each triangle, as a share of the triangles.
const MORE: f64 = 0.1;
/// Fragments that one triangle becomes at most.
const MOST: u32 = 64;
/// Bits of the grid on each axis.
const GRID_BITS: u32 = 20;
/// How much a fragment reaches over the plane that it ends at, as a share of the largest coordinate: rays that cross the
/// plane must not pass between the two sides.
const OVERLAP: f64 = 4.0 * f32::EPSILON as f64;
/// Triangles between two looks at the token.
const BATCH: usize = 1 << 12;

/// What a tree is built of where triangles are split.
pub struct Presplit {
    /// For each fragment a triangle that has its box.
    pub proxy_triangles: Vec<Triangle>,
    /// For each fragment its triangle.
    pub of: Vec<u32>,
}

/// The fragments of `triangles`, first to last; `None` where splitting is of no use.
pub fn fragments(triangles: &[Triangle], token: &CancelToken) -> Result<Option<Presplit>, Cancelled> {
    let boxes = triangles
        .par_chunks(BATCH)
        .map(|batch| {
            token.check()?;
            Ok(batch.iter().fold(Aabb::EMPTY, |all, triangle| all.union(&triangle.bounds())))
        })
        .try_reduce(|| Aabb::EMPTY, |a, b| Ok(a.union(&b)))?;
    let grid = Grid::new(&boxes);
    let priorities: Vec<Vec<f32>> = triangles
        .par_chunks(BATCH)
        .map(|batch| token.check().map(|()| batch.iter().map(|triangle| grid.priority(triangle)).collect()))
        .collect::<Result<_, Cancelled>>()?;
    let budget = (triangles.len() as f64 * MORE) as u64;
    let factor = factor(&priorities, budget, token)?;
    if factor == 0.0 {
        return Ok(None);
    }
    let parts: Vec<Presplit> = triangles
        .par_chunks(BATCH)
        .zip(&priorities)
        .enumerate()
        .map(|(batch, (triangles, priorities))| {
            token.check()?;
            let mut part = Presplit { proxy_triangles: Vec::with_capacity(triangles.len()), of: Vec::new() };
            for (at, (triangle, &priority)) in triangles.iter().zip(priorities).enumerate() {
                grid.split(triangle, splits(priority, factor), &mut part.proxy_triangles);
                part.of.resize(part.proxy_triangles.len(), (batch * BATCH + at) as u32);
            }
            Ok(part)
        })
        .collect::<Result<_, Cancelled>>()?;
    token.check()?;
    let count = parts.iter().map(|part| part.of.len()).sum();
    let mut all = Presplit { proxy_triangles: Vec::with_capacity(count), of: Vec::with_capacity(count) };
    for part in parts {
        token.check()?;
        all.proxy_triangles.extend(part.proxy_triangles);
        all.of.extend(part.of);
    }
    Ok((count > triangles.len()).then_some(all))
}

/// How often a triangle is split.
fn splits(priority: f32, factor: f64) -> u32 {
    (f64::from(priority) * factor).min(f64::from(MOST - 1)) as u32
}

/// The largest factor by which priorities become numbers of splits that add up to no more than `budget`; 0 for none.
fn factor(priorities: &[Vec<f32>], budget: u64, token: &CancelToken) -> Result<f64, Cancelled> {
    let total: f64 = priorities.iter().map(|batch| batch.iter().map(|&p| f64::from(p)).sum::<f64>()).sum();
    if !(total > 0.0 && total.is_finite()) || budget == 0 {
        return Ok(0.0);
    }
    // Rounding down loses up to one split a triangle, so that the factor can be well above the budget's.
    let (mut low, mut high) = (0.0, 64.0 * budget as f64 / total);
    for _ in 0..24 {
        token.check()?;
        let middle = 0.5 * (low + high);
        let of_batch = |batch: &Vec<f32>| batch.iter().map(|&p| u64::from(splits(p, middle))).sum::<u64>();
        let sum: u64 = priorities.par_iter().map(of_batch).sum();
        if sum <= budget { low = middle } else { high = middle }
    }
    Ok(low)
}

/// The scene's grid, whose planes triangles are split at.
struct Grid {
    origin: [f64; 3],
    /// Cells a unit.
    scale: f64,
    /// How far fragments reach over their ends.
    overlap: f64,
}

/// A plane of the grid.
struct Plane {
    axis: usize,
    at: f64,
    /// 0 for the one through the middle, 1 for those of the quarters and so on.
    level: u32,
}

impl Grid {
    fn new(bounds: &Aabb) -> Self {
        let extent = f64::from(bounds.extent().max_element());
        let largest = f64::from(bounds.min.abs().max(bounds.max.abs()).max_element());
        Self {
            origin: bounds.min.as_dvec3().to_array(),
            scale: if extent > 0.0 { f64::from(1_u32 << GRID_BITS) / extent } else { 0.0 },
            overlap: largest * OVERLAP,
        }
    }

    /// The highest plane through the inside of a box; the one across its longest side where several are as high.
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
                let at = self.origin[axis] + f64::from(high >> bit << bit) / self.scale;
                best = Some(Plane { axis, at, level });
            }
        }
        best
    }

    /// How much a triangle deserves to be split: the third root of the area that its box has too much, less the deeper the
    /// grid's planes that it crosses.
    fn priority(&self, triangle: &Triangle) -> f32 {
        let bounds = triangle.bounds();
        let Some(plane) = self.plane(&bounds) else { return 0.0 };
        // What boxes around endless many parts would have: the areas of the triangle's shadows along the axes.
        let normal = (triangle.b - triangle.a).cross(triangle.c - triangle.a).abs();
        let least = 0.5 * (normal.x + normal.y + normal.z);
        let excess = (bounds.half_area() - least).max(0.0);
        let priority = (excess * (-(plane.level as f32)).exp2()).cbrt();
        if priority.is_finite() { priority } else { 0.0 }
    }

    /// Adds stand-ins for the fragments that `splits` cuts leave of `triangle`.
    fn split(&self, triangle: &Triangle, splits: u32, proxy_triangles: &mut Vec<Triangle>) {
        let mut open = vec![(triangle.bounds(), splits)];
        while let Some((bounds, splits)) = open.pop() {
            let Some(halves) = (splits > 0).then(|| self.halves(triangle, &bounds)).flatten() else {
                proxy_triangles.push(Triangle { a: bounds.min, b: bounds.max, c: bounds.min });
                continue;
            };
            // Shared out by the longest sides.
            let [first, second] = halves.map(|half| half.extent().max_element());
            let left = ((splits - 1) as f32 * first / (first + second) + 0.5) as u32;
            let left = left.min(splits - 1);
            open.extend([(halves[1], splits - 1 - left), (halves[0], left)]);
        }
    }

    /// The boxes of what lies of `triangle` on either side of the highest plane through `bounds`.
    fn halves(&self, triangle: &Triangle, bounds: &Aabb) -> Option<[Aabb; 2]> {
        let Plane { axis, at, .. } = self.plane(bounds)?;
        let corners = [triangle.a, triangle.b, triangle.c].map(glam::Vec3::as_dvec3);
        // Exact enough: rounded outwards below, by more than these roundings come to.
        let mut sides = [[glam::DVec3::INFINITY, glam::DVec3::NEG_INFINITY]; 2];
        let mut add = |side: usize, point: glam::DVec3| {
            sides[side] = [sides[side][0].min(point), sides[side][1].max(point)];
        };
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let (from, to) = (corners[from], corners[to]);
            if from[axis] <= at {
                add(0, from);
            }
            if from[axis] >= at {
                add(1, from);
            }
            if (from[axis] - at) * (to[axis] - at) < 0.0 {
                let mut cut = from + (to - from) * ((at - from[axis]) / (to[axis] - from[axis]));
                cut[axis] = at;
                add(0, cut);
                add(1, cut);
            }
        }
        let halves = sides.map(|[min, max]| {
            let outer = Aabb { min: (min - self.overlap).as_vec3(), max: (max + self.overlap).as_vec3() };
            outer.intersection(bounds)
        });
        // Nothing is won where a side is as large as both or holds nothing.
        let useful = |half: &Aabb| !half.is_empty() && half != bounds;
        halves.iter().all(useful).then_some(halves)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn fragments_cover_their_triangles_and_are_few() {
        let mut state = 1_u32;
        let mut number = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for (size, offset) in [(1.0, 0.0), (0.1, 100.0), (1e9, -1e9), (1e-9, 0.0)] {
            let mut corner = || Vec3::new(number(), number(), number()) * size + offset;
            let triangles: Vec<Triangle> =
                (0..500).map(|_| Triangle { a: corner(), b: corner(), c: corner() }).collect();
            let fragments =
                fragments(&triangles, &CancelToken::new()).expect("nobody cancels").expect("large triangles");
            let count = fragments.of.len();
            assert!(count > 500 && count <= 550 && count == fragments.proxy_triangles.len(), "{count} of size {size}");
            assert!(fragments.of.is_sorted() && fragments.of.last() == Some(&499));
            for (of, triangle) in triangles.iter().enumerate() {
                let own =
                    fragments.of.iter().zip(&fragments.proxy_triangles).filter(|(index, _)| **index as usize == of);
                let boxes: Vec<Aabb> = own.map(|(_, stand_in)| stand_in.bounds()).collect();
                assert!(boxes.iter().all(|part| triangle.bounds().contains(part, 0.0)), "{triangle:?}: {boxes:?}");
                for _ in 0..100 {
                    let (u, v) = (number(), number());
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    let point = triangle.a + (triangle.b - triangle.a) * u + (triangle.c - triangle.a) * v;
                    let slack =
                        triangle.bounds().max.abs().max(triangle.bounds().min.abs()).max_element() * f32::EPSILON;
                    let holds = |part: &Aabb| part.contains(&Aabb { min: point, max: point }, slack);
                    assert!(boxes.iter().any(holds), "{point} of {triangle:?}: {boxes:?}");
                }
            }
        }
    }

    #[test]
    fn nothing_is_split_in_vain() {
        // Boxes that fit as they are, and no triangles at all.
        let flat = |at: f32| Triangle { a: Vec3::splat(at), b: Vec3::splat(at), c: Vec3::splat(at) };
        for triangles in [vec![], (0..100_u8).map(|at| flat(f32::from(at))).collect()] {
            assert!(fragments(&triangles, &CancelToken::new()).expect("nobody cancels").is_none());
        }
    }
}
