//! `build_bvh(P)`, figure 5: the whole of approximate agglomerative clustering (Gu et al., HPG 2013).
//!
//! ```text
//! build_bvh(P):
//!     compute the Morton code of the centre of each primitive of P
//!     radix sort P by Morton code
//!     C = build_tree(P)
//!     return combine_clusters(C, 1)
//! ```

use crate::aac::build_cache::BuildCache;
use crate::aac::build_tree::{Forest, TreeBuilder};
use crate::aac::cluster_container::ClusterContainer;
use crate::aac::combine::combine_clusters;
use crate::aac::combine_long::Scratch;
use crate::aac::leaf_blocks::{Blocks, leaf_blocks};
use crate::aac::leaf_order::{Primitives, order_leaves};
use crate::aac::recursion::{Recursion, recursion_of};
use crate::aac::reduction::Reduction;
use crate::aac::tasks::{NodeSlots, TaskPlan};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::SimdLevel;
use crate::kernel::parallel::zeros;
use crate::kernel::simd::dispatch;
use crate::order::{InputBounds, SortedPrimitives, sort_primitives};
use crate::settings::{BuildSettings, BuilderKind};
use crate::stage_times::{Stage, StageTimes};
use crate::tree::statistics::Sums;
use crate::tree::{Node, Tree};

/// Builds the tree over `triangles`: at least one, and none so large that surface areas overflow. `bounds` are theirs. Containers in
/// `own` replace those of the triangles, which decide about the order along the curve alone.
/// With a `cache`, primitives that an earlier build has sorted along the same curve are not sorted again, and their stages are
/// reported in [`StageTimes::reused`].
pub fn build_bvh<C: ClusterContainer>(
    triangles: &[Triangle],
    own: Option<&[C]>,
    bounds: &InputBounds,
    settings: &BuildSettings,
    mut cache: Option<&mut BuildCache>,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    // Compute the Morton code of the centre of each primitive of P; radix sort P by Morton code.
    let cached = cache.as_deref_mut().and_then(|cache| cache.take_order(settings.curve));
    let input = match cached {
        Some(input) => {
            times.reused.extend(["codes", "sort"]);
            input
        }
        None => sort_primitives(triangles, bounds, settings.curve, token, times)?,
    };
    let blocks = match own {
        Some(own) => Some(input.in_containers(own, token)?),
        None => join(triangles, &input, settings, token, times)?,
    };
    let items = SortedItems { primitives: &input, blocks: blocks.as_ref() };
    let node_count = 2 * items.list().len() - 1;
    let nodes = match cache.as_deref_mut().and_then(|cache| cache.nodes(node_count)) {
        Some(nodes) => nodes,
        None => zeros(node_count, token)?,
    };
    // Sums over a tree of blocks would count each as one primitive.
    let mut sums = (cache.is_some() && blocks.is_none()).then(Sums::default);
    let tree = cluster(triangles, items, settings, nodes, sums.as_mut(), token, times);
    if let Some(cache) = cache {
        cache.store_order(input, settings.curve);
        cache.store_stats(sums.zip(tree.as_ref().ok()).map(|(sums, tree)| sums.into_stats(tree)));
    }
    tree
}

/// The items that are clustered.
#[derive(Clone, Copy)]
struct SortedItems<'a, C: ClusterContainer> {
    primitives: &'a SortedPrimitives<C>,
    /// Blocks of them, which are the items where there are any.
    blocks: Option<&'a SortedPrimitives<C>>,
}

impl<'a, C: ClusterContainer> SortedItems<'a, C> {
    fn list(self) -> &'a SortedPrimitives<C> {
        self.blocks.unwrap_or(self.primitives)
    }
}

/// Joins primitives into leaf blocks, where the settings want that.
fn join<C: ClusterContainer>(
    triangles: &[Triangle],
    input: &SortedPrimitives<C>,
    settings: &BuildSettings,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Option<SortedPrimitives<C>>, Cancelled> {
    if settings.builder != BuilderKind::Swift {
        return Ok(None);
    }
    let stage = Stage::begin("blocks", token);
    let joined = leaf_blocks(triangles, input, token)?;
    stage.end(times);
    Ok(Some(joined))
}

/// [`build_bvh`] of the same tree, with the recursion that made it.
pub fn build_bvh_with_recursion<C: ClusterContainer>(
    triangles: &[Triangle],
    bounds: &InputBounds,
    settings: &BuildSettings,
    token: &CancelToken,
) -> Result<(Tree<C>, Recursion), Cancelled> {
    let mut times = StageTimes::default();
    let input = sort_primitives(triangles, bounds, settings.curve, token, &mut times)?;
    let nodes = bytemuck::zeroed_vec(2 * triangles.len() - 1);
    let items = SortedItems { primitives: &input, blocks: None };
    let mut tree = cluster(triangles, items, settings, nodes, None, token, &mut times)?;
    let recursion = recursion_of(&input, settings, &mut tree.nodes, token)?;
    Ok((tree, recursion))
}

/// The second half of figure 5: clusters the sorted `items`. Overwrites `nodes`, whose contents do not matter, and adds the finished
/// nodes to `sums`.
fn cluster<C: ClusterContainer>(
    triangles: &[Triangle],
    items: SortedItems<C>,
    settings: &BuildSettings,
    mut nodes: Vec<Node<C>>,
    sums: Option<&mut Sums>,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let stage = Stage::begin("tree", token);
    let reduction = Reduction::of(settings);
    let level = SimdLevel::of_builds().level();
    let input = items.list();
    let plan = TaskPlan::new(input, &reduction, 0..input.len());
    let (top, task_nodes) = nodes.split_at_mut(plan.top_len());

    // C = build_tree(P)
    let (root, mut last_pairs, slots) = NodeSlots::whole(&plan, &mut *top, task_nodes);
    let builder = TreeBuilder::new(triangles, input, &reduction, level);
    let Forest { mut clusters, mut tasks } = builder.build_tree(&plan, slots, token)?;

    // return combine_clusters(C, 1)
    dispatch!(level, simd => {
        combine_clusters(simd, &mut clusters, &mut Scratch::default(), 0, 1, &mut last_pairs, token)
    })?;
    *root = clusters.items[0].node();
    stage.end(times);
    token.check()?;

    let stage = Stage::begin("flatten", token);
    let SortedItems { primitives, blocks } = items;
    let (primitive_indices, max_depth) = match blocks {
        None => order_leaves(&Primitives, top, &mut tasks, primitives.len(), sums, token),
        Some(blocks) => order_leaves(&Blocks { primitives, blocks }, top, &mut tasks, primitives.len(), sums, token),
    }?;
    stage.end(times);
    token.set_progress(1.0);
    Ok(Tree { nodes, primitive_indices, max_depth })
}
