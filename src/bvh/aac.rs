//! Approximate agglomerative clustering: `build_bvh` and `build_tree`, the downward half (Gu, He, Fatahalian, Blelloch,
//! *Efficient BVH Construction via Approximate Agglomerative Clustering*, HPG 2013).

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::builders::StageTimes;
use super::cluster::{Clustered, Clusters, Matches, Pair};
use super::flatten::flatten;
use super::morton::MortonGrid;
use super::radix_sort::radix_sort;
use super::{BuildSettings, Node, Tree};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Triangle};

/// Subtrees up to this size are built by one thread. Gu et al. fork down to single clusters; below some thousand
/// primitives a fork costs more than it brings.
const FORK_ABOVE: usize = 8192;
/// Triangles to a task where each one is handled alone.
const BATCH: usize = 8192;
/// Most primitives that may share the leading 30 bits of their codes before the remaining 33 are sorted as well.
const MAX_COARSE_GROUP: usize = 32;
/// Bits of a code below its leading 30.
const FINE_BITS: u32 = 33;
/// Size of a group from which its fine codes are radix sorted.
const RADIX_SORT_ABOVE: usize = 4096;
/// Bit at which the code starts in a key; below it stands the primitive's index, or nothing where codes are fine.
const COARSE_CODE_SHIFT: u32 = 32;

/// Primitives along the Morton curve.
pub struct MortonOrder<C> {
    /// Container of each primitive, in the order of the input.
    pub containers: Vec<C>,
    /// Primitives as indices into the input, sorted by code.
    pub order: Vec<u32>,
    /// Code of each primitive in `order`.
    pub codes: Vec<u64>,
    /// Bits of `codes` that are part of the code.
    pub code_mask: u64,
}

/// Morton codes of the containers' middles, sorted. Adds the stages "codes" and "sort".
pub fn morton_order<C: Clustered>(
    triangles: &[Triangle],
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<MortonOrder<C>, Cancelled> {
    token.check()?;
    let start = Instant::now();
    let mut containers = vec![C::EMPTY; triangles.len()];
    let bounds = containers
        .par_chunks_mut(BATCH)
        .zip(triangles.par_chunks(BATCH))
        .map(|(containers, triangles)| {
            token.check()?;
            let mut bounds = Aabb::EMPTY;
            for (container, triangle) in containers.iter_mut().zip(triangles) {
                *container = C::of_triangle(triangle);
                let middle = container.middle();
                bounds = Aabb { min: bounds.min.min(middle), max: bounds.max.max(middle) };
            }
            Ok(bounds)
        })
        .try_reduce(|| Aabb::EMPTY, |a, b| Ok(a.union(&b)))?;
    let grid = MortonGrid::new(&bounds);
    let mut keys: Vec<u64> = containers
        .par_iter()
        .enumerate()
        .with_min_len(BATCH)
        .map(|(index, container)| u64::from(grid.coarse_code(container.middle())) << COARSE_CODE_SHIFT | index as u64)
        .collect();
    times.stages.push(("codes", start.elapsed()));
    token.check()?;

    let start = Instant::now();
    radix_sort(&mut keys, COARSE_CODE_SHIFT, COARSE_CODE_SHIFT + 30, |key| *key);
    let coarse_code = |key: &u64| key >> COARSE_CODE_SHIFT;
    let crowded = keys
        .par_windows(MAX_COARSE_GROUP + 1)
        .with_min_len(BATCH)
        .any(|group| coarse_code(&group[0]) == coarse_code(&group[MAX_COARSE_GROUP]));
    token.check()?;
    let order = if crowded {
        let mut fine: Vec<(u64, u32)> = keys
            .par_iter()
            .with_min_len(BATCH)
            .map(|key| (grid.code(containers[*key as u32 as usize].middle()), *key as u32))
            .collect();
        drop(keys);
        // The groups stand in the right order already: each one is sorted by itself.
        fine.par_chunk_by_mut(|a, b| a.0 >> FINE_BITS == b.0 >> FINE_BITS).for_each(|group| {
            if group.len() > RADIX_SORT_ABOVE {
                let mut sorted = group.to_vec();
                radix_sort(&mut sorted, 0, FINE_BITS, |item| item.0);
                group.copy_from_slice(&sorted);
            } else {
                group.sort_by_key(|item| item.0);
            }
        });
        let order = fine.par_iter().with_min_len(BATCH).map(|item| item.1).collect();
        let codes = fine.par_iter().with_min_len(BATCH).map(|item| item.0).collect();
        MortonOrder { containers, order, codes, code_mask: u64::MAX }
    } else {
        let order = keys.par_iter().with_min_len(BATCH).map(|key| *key as u32).collect();
        MortonOrder { containers, order, codes: keys, code_mask: u64::MAX << COARSE_CODE_SHIFT }
    };
    times.stages.push(("sort", start.elapsed()));
    token.check()?;
    Ok(order)
}

impl<C> MortonOrder<C> {
    /// Where `range` splits: at the first flip of the highest bit that is not the same for all, in the middle where
    /// there is none.
    #[inline]
    pub fn split(&self, range: &Range<usize>) -> usize {
        let codes = &self.codes[range.clone()];
        let differing = (codes[0] ^ codes[codes.len() - 1]) & self.code_mask;
        let Some(bit) = differing.checked_ilog2() else { return range.start + codes.len() / 2 };
        range.start + codes.partition_point(|code| code >> bit & 1 == 0)
    }
}

/// `build_bvh`: the tree of `triangles`, whose areas must not overflow.
pub fn build_bvh<C: Clustered>(
    triangles: &[Triangle],
    settings: &BuildSettings,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let input = morton_order::<C>(triangles, token, times)?;
    let start = Instant::now();
    let count = triangles.len();
    let empty = Node { container: C::EMPTY, first: 0, count: 0 };
    let mut slots: Vec<Pair<C>> = vec![[empty; 2]; count];
    let builder = Builder {
        input: &input,
        reduction: Reduction::new(settings.threshold, settings.epsilon),
        level: level(),
        token,
        finished: AtomicUsize::new(0),
    };
    let (mut clusters, matches) = builder.fork(0..count, &mut slots)?;
    dispatch!(builder.level, simd => {
        clusters.combine_clusters::<C, _>(simd, 0, matches, 1, &mut slots, 0, token)
    })?;
    let root = clusters.node::<C>(0);
    times.stages.push(("tree", start.elapsed()));
    token.check()?;

    let start = Instant::now();
    let tree = flatten(root, &slots, &input.order);
    times.stages.push(("flatten", start.elapsed()));
    token.set_progress(1.0);
    Ok(tree)
}

/// Exact agglomerative clustering of all `triangles` in one list, in the order of the input.
pub fn cluster_all<C: Clustered>(triangles: &[Triangle], token: &CancelToken) -> Result<Tree<C>, Cancelled> {
    let empty = Node { container: C::EMPTY, first: 0, count: 0 };
    let mut slots: Vec<Pair<C>> = vec![[empty; 2]; triangles.len()];
    let mut clusters = Clusters::with_capacity(triangles.len());
    for (position, triangle) in triangles.iter().enumerate() {
        clusters.push(&C::of_triangle(triangle), position as u32);
    }
    dispatch!(level(), simd => {
        clusters.combine_clusters::<C, _>(simd, 0, Matches::None, 1, &mut slots, 0, token)
    })?;
    let order: Vec<u32> = (0..triangles.len() as u32).collect();
    Ok(flatten(clusters.node::<C>(0), &slots, &order))
}

/// The largest absolute value of any coordinate.
pub fn largest_coordinate(triangles: &[Triangle], token: &CancelToken) -> Result<f32, Cancelled> {
    token.check()?;
    let largest = |triangle: &Triangle| triangle.a.abs().max(triangle.b.abs()).max(triangle.c.abs()).max_element();
    Ok(triangles.par_chunks(BATCH).map(|batch| batch.iter().map(largest).fold(0.0, f32::max)).reduce(|| 0.0, f32::max))
}

/// The widest instructions that the builder uses. Not AVX-512: rows are eight wide, and this compiler's vectoriser gives
/// wrong results with it.
fn level() -> Level {
    let level = Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(avx2) = level.as_avx2() {
        return Level::Avx2(avx2);
    }
    level
}

/// f(x) = ½·δ^(½+ε)·x^(½−ε), rounded up: how many clusters are left of x primitives.
struct Reduction {
    /// δ.
    threshold: usize,
    /// f for small x.
    table: Vec<u32>,
    factor: f64,
    exponent: f64,
}

impl Reduction {
    fn new(threshold: u32, epsilon: f32) -> Self {
        let threshold = threshold.max(2);
        let (delta, epsilon) = (f64::from(threshold), f64::from(epsilon));
        let mut reduction = Self {
            threshold: threshold as usize,
            table: Vec::new(),
            factor: 0.5 * delta.powf(0.5 + epsilon),
            exponent: 0.5 - epsilon,
        };
        reduction.table = (0..512).map(|x| reduction.formula(x)).collect();
        reduction
    }

    fn formula(&self, x: usize) -> u32 {
        // A hair less, so that whole numbers are not rounded up to the next.
        (self.factor * (x as f64).powf(self.exponent) - 1e-9).ceil().max(1.0) as u32
    }

    #[inline]
    fn of(&self, x: usize) -> usize {
        self.table.get(x).copied().unwrap_or_else(|| self.formula(x)) as usize
    }
}

struct Builder<'a, C> {
    input: &'a MortonOrder<C>,
    reduction: Reduction,
    level: Level,
    token: &'a CancelToken,
    finished: AtomicUsize,
}

impl<C: Clustered> Builder<'_, C> {
    /// `build_tree` for many primitives: both sides in parallel, each on a stack of its own.
    fn fork(&self, range: Range<usize>, slots: &mut [Pair<C>]) -> Result<(Clusters, Matches), Cancelled> {
        self.token.check()?;
        let count = range.len();
        if count <= FORK_ABOVE {
            let mut clusters = Clusters::with_capacity(4 * self.reduction.of(count) + self.reduction.threshold);
            let offset = range.start;
            let matches = dispatch!(self.level, simd => self.build_tree(simd, range, &mut clusters, slots, offset))?;
            let finished = self.finished.fetch_add(count, Ordering::Relaxed) + count;
            self.token.set_progress(0.1 + 0.8 * finished as f32 / self.input.order.len() as f32);
            return Ok((clusters, matches));
        }
        let offset = range.start;
        let middle = self.input.split(&range);
        let (left_slots, right_slots) = slots.split_at_mut(middle - offset);
        let (left, right) =
            rayon::join(|| self.fork(offset..middle, left_slots), || self.fork(middle..range.end, right_slots));
        let ((mut clusters, left), (other, right)) = (left?, right?);
        let matches = both(left, right, clusters.len());
        clusters.append(&other);
        let target = self.reduction.of(count);
        let matches = dispatch!(self.level, simd => {
            clusters.combine_clusters::<C, _>(simd, 0, matches, target, slots, offset, self.token)
        })?;
        Ok((clusters, matches))
    }

    /// `build_tree`: puts the clusters of the primitives `range` on the stack.
    fn build_tree<S: Simd>(
        &self,
        simd: S,
        range: Range<usize>,
        clusters: &mut Clusters,
        slots: &mut [Pair<C>],
        slot_offset: usize,
    ) -> Result<Matches, Cancelled> {
        let base = clusters.len();
        let count = range.len();
        let matches = if count < self.reduction.threshold {
            // Few enough: one cluster for each primitive.
            for position in range {
                let primitive = self.input.order[position] as usize;
                clusters.push(&self.input.containers[primitive], position as u32);
            }
            Matches::None
        } else {
            let middle = self.input.split(&range);
            let left = self.build_tree(simd, range.start..middle, clusters, slots, slot_offset)?;
            let joint = clusters.len();
            let right = self.build_tree(simd, middle..range.end, clusters, slots, slot_offset)?;
            both(left, right, joint)
        };
        let target = self.reduction.of(count.max(self.reduction.threshold));
        simd.vectorize(
            #[inline(always)]
            || clusters.combine_clusters::<C, S>(simd, base, matches, target, slots, slot_offset, self.token),
        )
    }
}

/// What is known about a list of two halves.
fn both(left: Matches, right: Matches, joint: usize) -> Matches {
    if left == Matches::All && right == Matches::All { Matches::Halves(joint) } else { Matches::None }
}
