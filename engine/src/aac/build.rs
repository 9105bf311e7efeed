//! Approximate agglomerative clustering: `build_bvh` and the upper part of `build_tree`, which works in parallel (Gu, He,
//! Fatahalian, Blelloch, *Efficient BVH Construction via Approximate Agglomerative Clustering*, HPG 2013).
//!
//! A range of x primitives always leaves [`Reduction::left_of`] x clusters, so that the number of merges in each range
//! is known before any of them is made: every node is written once, straight to its place. The list of nodes holds the
//! root, then the pairs merged in ranges above the tasks, then those of each task, and within each of these what is
//! merged last comes first, which puts parents before their children.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use fearless_simd::{Level, dispatch};

use crate::aac::build_cache::{BuildCache, Sorted, sorted};
use crate::aac::cluster::{Cluster, Clustered, Clusters, Pairs};
use crate::aac::combine::{Scratch, combine_clusters};
use crate::aac::leaf_order::{TaskTree, order_leaves};
use crate::aac::reduction::Reduction;
use crate::aac::subtree::build_subtree;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::SimdLevel;
use crate::kernel::lanes::LANES;
use crate::kernel::simd::simd_level;
use crate::order::sorted_primitives::{Extent, SortedPrimitives};
use crate::settings::BuildSettings;
use crate::stage_times::StageTimes;
use crate::tree::statistics::Sums;
use crate::tree::{Node, Tree};

/// Subtrees up to this size are built by one thread. Gu et al. fork down to single clusters; below some thousand
/// primitives a fork costs more than it brings, and what a task writes should fit a core's second cache.
const FORK_ABOVE: usize = 8192;

/// `build_bvh`: the tree of `triangles`, of which there is one at least and whose areas must not overflow.
pub fn build_bvh<C: Clustered>(
    triangles: &[Triangle],
    extent: &Extent,
    settings: &BuildSettings,
    mut cache: Option<&mut BuildCache>,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let input: Sorted<C> = sorted(triangles, extent, settings.curve, cache.as_deref_mut(), token)?;
    // As long as it took when it was done.
    times.stages.extend(&input.stages);
    let count = 2 * triangles.len() - 1;
    let nodes = cache.as_deref_mut().map_or_else(|| bytemuck::zeroed_vec(count), |cache| cache.nodes(count));
    let mut sums = cache.is_some().then(Sums::default);
    let tree = build_sorted(triangles, &input.order, settings, nodes, sums.as_mut(), token, times);
    if let Some(cache) = cache {
        cache.keep(input);
        cache.stats = sums.zip(tree.as_ref().ok()).map(|(sums, tree)| sums.into_stats(tree));
    }
    tree
}

/// `build_tree` and the last `combine_clusters`, over `nodes`, which are written anew and added to `sums`.
fn build_sorted<C: Clustered>(
    triangles: &[Triangle],
    input: &SortedPrimitives<C>,
    settings: &BuildSettings,
    mut nodes: Vec<Node<C>>,
    sums: Option<&mut Sums>,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let start = Instant::now();
    let reduction = Reduction::new(settings.threshold, settings.epsilon);
    let count = triangles.len();
    let plan = Plan::new(input, &reduction, 0..count);
    let builder = Builder {
        triangles,
        input,
        reduction: &reduction,
        level: SimdLevel::best().level(),
        token,
        finished: AtomicUsize::new(0),
        top_len: 1 + 2 * (reduction.left_of(count) - 1 + plan.top_pairs),
    };

    let (top, below) = nodes.split_at_mut(builder.top_len);
    let (root, top_pairs) = top.split_at_mut(1);
    let (last_pairs, forks) = top_pairs.split_at_mut(2 * (reduction.left_of(count) - 1));
    let place =
        Place { top: forks, top_offset: 1 + last_pairs.len(), below, below_offset: builder.top_len, first_root: 0 };
    let Branch { mut clusters, mut tasks } = builder.fork(&plan, place)?;
    let mut pairs = Pairs::new(last_pairs, 1);
    dispatch!(builder.level, simd => {
        combine_clusters(simd, &mut clusters, &mut Scratch::default(), 0, 1, &mut pairs, token)
    })?;
    root[0] = clusters.items[0].node();
    times.stages.push(("tree", start.elapsed()));
    token.check()?;

    let start = Instant::now();
    let (primitive_indices, max_depth) = order_leaves(top, &mut tasks, count, sums, token)?;
    times.stages.push(("flatten", start.elapsed()));
    token.set_progress(1.0);
    Ok(Tree { nodes, primitive_indices, max_depth })
}

/// Exact agglomerative clustering of all `triangles` in one list, in the order of the input.
pub fn cluster_all<C: Clustered>(triangles: &[Triangle], token: &CancelToken) -> Result<Tree<C>, Cancelled> {
    let mut clusters = Clusters::with_capacity(triangles.len());
    dispatch!(simd_level(), simd => {
        for (primitive, triangle) in triangles.iter().enumerate() {
            // The very containers of the approximate builder, which makes eight at a time.
            let (kept, _) = C::keep_and_middles(simd, &[*triangle; LANES]);
            let fields = C::restore_fields(simd, &kept[0], triangle);
            clusters.push::<C>(Cluster::of_primitive(fields, primitive as u32));
        }
    });
    let mut nodes: Vec<Node<C>> = bytemuck::zeroed_vec(2 * triangles.len() - 1);
    let (root, others) = nodes.split_at_mut(1);
    let mut pairs = Pairs::new(others, 1);
    dispatch!(SimdLevel::best().level(), simd => {
        combine_clusters(simd, &mut clusters, &mut Scratch::default(), 0, 1, &mut pairs, token)
    })?;
    root[0] = clusters.items[0].node();
    let (primitive_indices, max_depth) = order_leaves(&mut nodes, &mut [], triangles.len(), None, token)?;
    Ok(Tree { nodes, primitive_indices, max_depth })
}

/// How a range is divided among tasks.
struct Plan {
    range: Range<usize>,
    /// Both sides; none for a task.
    sides: Option<Box<[Self; 2]>>,
    /// Number of merges above the tasks.
    top_pairs: usize,
    /// Number of clusters that the tasks leave.
    roots: usize,
}

impl Plan {
    fn new<C: Clustered>(input: &SortedPrimitives<C>, reduction: &Reduction, range: Range<usize>) -> Self {
        let left = reduction.left_of(range.len());
        if range.len() <= FORK_ABOVE {
            return Self { range, sides: None, top_pairs: 0, roots: left };
        }
        let middle = input.split(&range);
        let sides = [range.start..middle, middle..range.end].map(|side| Self::new(input, reduction, side));
        let own_pairs = sides.iter().map(|side| reduction.left_of(side.range.len())).sum::<usize>() - left;
        Self {
            range,
            top_pairs: own_pairs + sides[0].top_pairs + sides[1].top_pairs,
            roots: sides[0].roots + sides[1].roots,
            sides: Some(Box::new(sides)),
        }
    }
}

/// Where the nodes of a range go.
struct Place<'t, 'n, C> {
    /// For the pairs above the tasks, and the number of the first of these nodes.
    top: &'t mut [Node<C>],
    top_offset: usize,
    /// For the pairs of the tasks.
    below: &'n mut [Node<C>],
    below_offset: usize,
    /// Number of clusters that the tasks before this range leave.
    first_root: usize,
}

/// What is made of a range.
struct Branch<'a, C> {
    clusters: Clusters,
    tasks: Vec<TaskTree<'a, C>>,
}

struct Builder<'a, C: Clustered> {
    triangles: &'a [Triangle],
    input: &'a SortedPrimitives<C>,
    reduction: &'a Reduction,
    level: Level,
    token: &'a CancelToken,
    finished: AtomicUsize,
    /// Number of nodes before those of the tasks.
    top_len: usize,
}

impl<C: Clustered> Builder<'_, C> {
    /// `build_tree` for many primitives: both sides in parallel.
    fn fork<'n>(&self, plan: &Plan, place: Place<'_, 'n, C>) -> Result<Branch<'n, C>, Cancelled> {
        self.token.check()?;
        let Some(sides) = &plan.sides else { return self.task(plan.range.clone(), place) };
        let left_of = |range: &Range<usize>| self.reduction.left_of(range.len());
        let [left, right] = &**sides;
        // This range's own pairs, then those of the left side, then those of the right.
        let own = plan.top_pairs - left.top_pairs - right.top_pairs;
        let (own_nodes, sides_top) = place.top.split_at_mut(2 * own);
        let (left_top, right_top) = sides_top.split_at_mut(2 * left.top_pairs);
        let left_below = left.range.len() - left_of(&left.range) - left.top_pairs;
        let (left_nodes, right_nodes) = place.below.split_at_mut(2 * left_below);
        let left_place = Place {
            top_offset: place.top_offset + own_nodes.len(),
            top: left_top,
            below: left_nodes,
            below_offset: place.below_offset,
            first_root: place.first_root,
        };
        let right_place = Place {
            top_offset: left_place.top_offset + left_place.top.len(),
            top: right_top,
            below_offset: place.below_offset + left_place.below.len(),
            below: right_nodes,
            first_root: place.first_root + left.roots,
        };
        let (left, right) = rayon::join(|| self.fork(left, left_place), || self.fork(right, right_place));
        let (Branch { mut clusters, mut tasks }, mut right) = (left?, right?);
        clusters.append::<C>(&right.clusters, 0, right.clusters.len);
        tasks.append(&mut right.tasks);
        let mut pairs = Pairs::new(own_nodes, place.top_offset);
        let target = left_of(&plan.range);
        dispatch!(self.level, simd => {
            combine_clusters(simd, &mut clusters, &mut Scratch::default(), 0, target, &mut pairs, self.token)
        })?;
        Ok(Branch { clusters, tasks })
    }

    /// `build_tree` for the primitives `range`, by one thread.
    fn task<'n>(&self, range: Range<usize>, place: Place<'_, 'n, C>) -> Result<Branch<'n, C>, Cancelled> {
        let count = range.len();
        let mut pairs = Pairs::new(&mut *place.below, place.below_offset);
        let mut clusters = dispatch!(self.level, simd => {
            build_subtree(simd, self.triangles, self.input, self.reduction, range, &mut pairs, self.token)
        })?;
        // From here on the clusters are numbers of this task's roots.
        let mut roots = Vec::with_capacity(clusters.len);
        for (cluster, number) in clusters.items[..clusters.len].iter_mut().zip(self.top_len + place.first_root..) {
            roots.push(cluster.first);
            if cluster.count > 1 {
                cluster.first = number as u32;
            }
        }
        let finished = self.finished.fetch_add(count, Ordering::Relaxed) + count;
        self.token.set_progress(0.1 + 0.8 * finished as f32 / self.input.len() as f32);
        Ok(Branch { clusters, tasks: vec![TaskTree { nodes: place.below, offset: place.below_offset, roots }] })
    }
}
