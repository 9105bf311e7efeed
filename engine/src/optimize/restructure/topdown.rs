//! Top-down construction over boxes with binned SAH splits, bottom-up where few boxes are left: there agglomerative
//! clustering finds trees of equal cost faster.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Level, Simd, f32x8};

use crate::aac::{Cluster, ClusterContainer, ClusterStack, PairWriter, combine_short};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;
use crate::kernel::SimdLevel;
use crate::kernel::simd::{dispatch, dispatch_plain};
use crate::optimize::restructure::item::{Item, NEW_NODE};
use crate::optimize::restructure::split::{MAX_SPLIT_DEPTH, split};
use crate::optimize::restructure::split_large::{MIN_LARGE, split_large};
use crate::optimize::sah::{leaf_cost, node_or_leaf_cost};
use crate::tree::Node;

/// Maximum number of items that are built by one thread: they fit the second-level cache.
const FORK_ABOVE: usize = 8192;
/// Maximum number of items that are clustered: twice as many take as long and cost a thousandth more.
const MAX_CLUSTERED: usize = 8;

/// Parameters of a build.
#[derive(Clone, Copy)]
pub struct Builder<'a> {
    level: Level,
    /// Whether several items may become one leaf.
    pub collapses: bool,
    pub token: &'a CancelToken,
}

/// Items to build a subtree over.
struct BuildRange<'a> {
    items: &'a mut [Item],
    /// Box of the items, as the root of the subtree.
    root: Item,
    /// Output: the children of the root first, then depth first.
    nodes: &'a mut [Node<Aabb>],
    /// Index of the first of these nodes.
    offset: u32,
    depth: u32,
}

impl<'a> Builder<'a> {
    /// A builder with the SIMD level of builds.
    pub fn new(collapses: bool, token: &'a CancelToken) -> Self {
        Self { level: SimdLevel::of_builds().level(), collapses, token }
    }

    /// Builds the tree over at least two `items`, which are reordered; `root` has their box. Writes everything below
    /// the root to `nodes`, two less than twice the number of items, siblings together; the first of them has index
    /// `offset`. Returns the SAH cost of these nodes.
    pub fn build(
        &self,
        items: &mut [Item],
        root: Item,
        nodes: &mut [Node<Aabb>],
        offset: u32,
    ) -> Result<f32, Cancelled> {
        self.build_range(BuildRange { items, root, nodes, offset, depth: 0 })
    }

    /// Builds both sides of a large range in parallel.
    fn build_range(&self, range: BuildRange) -> Result<f32, Cancelled> {
        self.token.check()?;
        let BuildRange { items, root, nodes, offset, depth } = range;
        let count = items.len();
        if count <= FORK_ABOVE {
            return Ok(
                dispatch_plain!(self.level, simd => self.build_sequential(simd, BuildRange { items, root, nodes, offset, depth })),
            );
        }
        let (middle, mut pair) = if count >= MIN_LARGE && depth < MAX_SPLIT_DEPTH {
            split_large(self.level, items, &root, depth, self.token)?
        } else {
            dispatch_plain!(self.level, simd => split(simd, items, &root, depth))
        };
        let (left_items, right_items) = items.split_at_mut(middle);
        let (pair_nodes, descendants) = nodes.split_at_mut(2);
        let (left_nodes, right_nodes) = descendants.split_at_mut(2 * (left_items.len() - 1));
        let offsets = [offset + 2, offset + 2 * middle as u32];
        for (side, items) in [&*left_items, &*right_items].into_iter().enumerate() {
            if items.len() > 1 { pair[side].first = NEW_NODE | offsets[side] } else { pair[side] = items[0] }
        }
        let side = |items, root: Item, nodes, offset| {
            if root.first & NEW_NODE == 0 {
                return Ok(0.0);
            }
            self.build_range(BuildRange { items, root, nodes, offset, depth: depth + 1 })
        };
        let (left, right) = rayon::join(
            || side(left_items, pair[0], left_nodes, offsets[0]),
            || side(right_items, pair[1], right_nodes, offsets[1]),
        );
        let costs_below = [left?, right?];
        pair_nodes.copy_from_slice(&pair.map(|item| item.node()));
        Ok(self.finish_pair(pair_nodes, |side, _| costs_below[side]))
    }

    /// Builds a range by one thread.
    #[inline(always)]
    fn build_sequential<S: Simd>(&self, simd: S, range: BuildRange) -> f32 {
        let BuildRange { items, root, nodes, offset, depth } = range;
        let mut clusters = ClusterStack::with_capacity(MAX_CLUSTERED);
        // Start, end, root, slot of the first node within the range, depth.
        let mut stack = vec![(0, items.len(), root, 0, depth)];
        while let Some((start, end, root, slot, depth)) = stack.pop() {
            let count = end - start;
            let items = &mut items[start..end];
            if count <= MAX_CLUSTERED {
                let nodes = &mut nodes[slot..slot + 2 * (count - 1)];
                self.cluster(items, &mut clusters, nodes, offset + slot as u32);
                continue;
            }
            let (middle, mut pair) = split(simd, items, &root, depth);
            let sides = [(0, middle, slot + 2), (middle, count, slot + 2 * middle)];
            // Left side on top of the stack.
            for side in [1, 0] {
                let (from, to, slot) = sides[side];
                if to - from > 1 {
                    pair[side].first = NEW_NODE | (offset + slot as u32);
                    stack.push((start + from, start + to, pair[side], slot, depth + 1));
                } else {
                    pair[side] = items[from];
                }
            }
            nodes[slot..slot + 2].copy_from_slice(&pair.map(|item| item.node()));
        }
        let mut costs_below = vec![0.0; nodes.len() / 2];
        for index in (0..costs_below.len()).rev() {
            let children = &mut nodes[2 * index..2 * index + 2];
            costs_below[index] = self.finish_pair(children, |_, first| costs_below[(first - offset) as usize / 2]);
        }
        costs_below[0]
    }

    /// Builds the tree of up to [`MAX_CLUSTERED`] items by clustering.
    #[inline(always)]
    fn cluster(&self, items: &[Item], clusters: &mut ClusterStack<Aabb>, nodes: &mut [Node<Aabb>], offset: u32) {
        for (index, item) in items.iter().enumerate() {
            let Node { container, first, count } = item.node();
            clusters.set(index, Cluster { fields: container.fields(), first, count });
        }
        clusters.len = items.len();
        let mut pairs = PairWriter::new(nodes, (NEW_NODE | offset) as usize);
        dispatch!(self.level, simd => {
            combine_short::<Aabb, _, f32x8<_>, 1, MAX_CLUSTERED>(simd, clusters, 0, 1, &mut pairs);
        });
    }

    /// Completes two siblings, whose `count` is that of the primitives below and whose `first` has [`NEW_NODE`] if they
    /// are interior nodes. Returns their SAH cost; `costs_below(side, first)` is that of a sibling's children.
    #[inline(always)]
    fn finish_pair(&self, pair: &mut [Node<Aabb>], costs_below: impl Fn(usize, u32) -> f32) -> f32 {
        let mut costs = 0.0;
        for (side, node) in pair.iter_mut().enumerate() {
            let area = node.container.half_area();
            costs += if node.first & NEW_NODE == 0 {
                leaf_cost(area, node.count)
            } else {
                node.first &= !NEW_NODE;
                let count = std::mem::take(&mut node.count);
                node_or_leaf_cost::<Aabb>(area, count, costs_below(side, node.first), self.collapses).0
            };
        }
        costs
    }
}
