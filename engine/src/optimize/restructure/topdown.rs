//! Trees from the top down over boxes, by the surface area heuristic, and from the bottom up where few boxes are left: there
//! agglomerative clustering finds trees as good, faster.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Level, Simd, dispatch, f32x8};

use crate::aac::{Cluster, ClusterContainer, ClusterStack, PairWriter, combine_short};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;
use crate::kernel::SimdLevel;
use crate::kernel::simd::plain_loop_level;
use crate::optimize::restructure::item::{Item, NEW};
use crate::optimize::restructure::split::{MAX_SPLIT_DEPTH, split};
use crate::optimize::restructure::split_large::{LARGE, split_large};
use crate::optimize::sah::{joined_cost, leaf_cost};
use crate::tree::Node;

/// Up to this many items are built by one thread: their bytes fit the second cache.
const FORK_ABOVE: usize = 8192;
/// Up to this many are clustered: twice as many take as long and cost a thousandth more.
const CLUSTERED: usize = 8;

/// What stays the same for the whole tree.
#[derive(Clone, Copy)]
pub struct Builder<'a> {
    /// For what has plain loops.
    level: Level,
    /// For clustering.
    widest: Level,
    /// Whether leaves may be made of several items.
    pub collapses: bool,
    pub token: &'a CancelToken,
}

/// Items that still have to be divided.
struct Range<'a> {
    items: &'a mut [Item],
    /// Their box.
    whole: Item,
    /// Where their tree goes: the children of its root first, then depth first.
    nodes: &'a mut [Node<Aabb>],
    /// Number of the first of these nodes.
    offset: u32,
    depth: u32,
}

impl<'a> Builder<'a> {
    /// With the instructions of this machine.
    pub fn new(collapses: bool, token: &'a CancelToken) -> Self {
        Self { level: plain_loop_level(), widest: SimdLevel::best().level(), collapses, token }
    }

    /// Builds the tree over `items`, at least two, whose box `whole` is and which are reordered, into `nodes`, two less than
    /// twice as many: what is below the root, siblings together, the first of them with the number `offset`. Returns what
    /// that costs.
    pub fn build(
        &self,
        items: &mut [Item],
        whole: Item,
        nodes: &mut [Node<Aabb>],
        offset: u32,
    ) -> Result<f32, Cancelled> {
        self.range(Range { items, whole, nodes, offset, depth: 0 })
    }

    /// Both sides of a large range in parallel.
    fn range(&self, range: Range) -> Result<f32, Cancelled> {
        self.token.check()?;
        let Range { items, whole, nodes, offset, depth } = range;
        let count = items.len();
        if count <= FORK_ABOVE {
            return Ok(dispatch!(self.level, simd => self.task(simd, Range { items, whole, nodes, offset, depth })));
        }
        let (middle, mut pair) = if count >= LARGE && depth < MAX_SPLIT_DEPTH {
            split_large(self.level, items, &whole, depth, self.token)?
        } else {
            dispatch!(self.level, simd => split(simd, items, &whole, depth))
        };
        let (left_items, right_items) = items.split_at_mut(middle);
        let (own, below) = nodes.split_at_mut(2);
        let (left_nodes, right_nodes) = below.split_at_mut(2 * (left_items.len() - 1));
        let offsets = [offset + 2, offset + 2 * middle as u32];
        for (side, items) in [&*left_items, &*right_items].into_iter().enumerate() {
            if items.len() > 1 { pair[side].link = NEW | offsets[side] } else { pair[side] = items[0] }
        }
        let side = |items, whole: Item, nodes, offset| {
            if whole.link & NEW == 0 {
                return Ok(0.0);
            }
            self.range(Range { items, whole, nodes, offset, depth: depth + 1 })
        };
        let (left, right) = rayon::join(
            || side(left_items, pair[0], left_nodes, offsets[0]),
            || side(right_items, pair[1], right_nodes, offsets[1]),
        );
        let below = [left?, right?];
        own.copy_from_slice(&pair.map(|item| item.node()));
        Ok(self.finish(own, |side, _| below[side]))
    }

    /// Everything by one thread.
    #[inline(always)]
    fn task<S: Simd>(&self, simd: S, range: Range) -> f32 {
        let Range { items, whole, nodes, offset, depth } = range;
        let mut list = ClusterStack::with_capacity(CLUSTERED);
        // Start, end, their box, the first of their nodes within the task, depth.
        let mut open = vec![(0, items.len(), whole, 0, depth)];
        while let Some((start, end, whole, slot, depth)) = open.pop() {
            let count = end - start;
            let items = &mut items[start..end];
            if count <= CLUSTERED {
                let nodes = &mut nodes[slot..slot + 2 * (count - 1)];
                self.cluster(items, &mut list, nodes, offset + slot as u32);
                continue;
            }
            let (middle, mut pair) = split(simd, items, &whole, depth);
            let sides = [(0, middle, slot + 2), (middle, count, slot + 2 * middle)];
            // The left one is done next.
            for side in [1, 0] {
                let (from, to, slot) = sides[side];
                if to - from > 1 {
                    pair[side].link = NEW | (offset + slot as u32);
                    open.push((start + from, start + to, pair[side], slot, depth + 1));
                } else {
                    pair[side] = items[from];
                }
            }
            nodes[slot..slot + 2].copy_from_slice(&pair.map(|item| item.node()));
        }
        let mut below = vec![0.0; nodes.len() / 2];
        for at in (0..below.len()).rev() {
            let children = &mut nodes[2 * at..2 * at + 2];
            below[at] = self.finish(children, |_, first| below[(first - offset) as usize / 2]);
        }
        below[0]
    }

    /// The tree of up to [`CLUSTERED`] items from the bottom up.
    #[inline(always)]
    fn cluster(&self, items: &[Item], list: &mut ClusterStack, nodes: &mut [Node<Aabb>], offset: u32) {
        for (at, item) in items.iter().enumerate() {
            let Node { container, first, count } = item.node();
            list.set::<Aabb>(at, Cluster { fields: container.fields(), first, count });
        }
        list.len = items.len();
        let mut pairs = PairWriter::new(nodes, (NEW | offset) as usize);
        dispatch!(self.widest, simd => {
            combine_short::<Aabb, _, f32x8<_>, 1, CLUSTERED>(simd, list, 0, 1, &mut pairs);
        });
    }

    /// Makes two siblings what they are in a tree; until here each had its number of primitives and [`NEW`] where it is an
    /// interior node. Returns their SAH cost, with `below(side, first)` for the children of such a one.
    #[inline(always)]
    fn finish(&self, pair: &mut [Node<Aabb>], below: impl Fn(usize, u32) -> f32) -> f32 {
        let mut costs = 0.0;
        for (side, node) in pair.iter_mut().enumerate() {
            let area = node.container.half_area();
            costs += if node.first & NEW == 0 {
                leaf_cost(area, node.count)
            } else {
                node.first &= !NEW;
                let count = std::mem::take(&mut node.count);
                joined_cost(area, count, below(side, node.first), self.collapses).0
            };
        }
        costs
    }
}
