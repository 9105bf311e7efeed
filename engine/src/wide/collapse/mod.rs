//! Collapses a binary tree into a wide one (Ylitie, Karras, Laine, *Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs*, 2017, section 3).
//!
//! Bottom-up, [`optimal`] computes the least cost of each subtree by the surface area heuristic, as a leaf or under at
//! most one to eight roots. Top-down, [`emit`] gives each wide node the cheapest eight roots of its subtree. Each of
//! its tasks plans a subtree, the same ones for any number of threads; once the sizes are known, all nodes and blocks
//! are written in parallel.

mod cost;
mod decision;

mod boundary;
mod chunk;
mod optimal;

mod emit;

use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::prefetch::prefetch;
use crate::tree::Tree;
use crate::wide::block::TriangleBlock;
use crate::wide::bounds::WideContainer;
use crate::wide::collapse::emit::{Emitter, PlannedChild, Segment};
use crate::wide::collapse::optimal::optimal_decisions;
use crate::wide::layout::WIDTH;
use crate::wide::tree::{Child, WideNode, WideTree};

/// Binary nodes for each wide node of the sequentially made top of the tree. Each such wide node yields about four
/// tasks.
const TASK_NODES: usize = 16_384;
/// Maximum number of wide nodes in the top.
const MAX_TOP_NODES: usize = 512;

/// Nodes and blocks that each thread writes between polls for cancellation: 20 ms where the triangles are scattered in
/// memory.
const NODES_BETWEEN_CHECKS: usize = 1 << 12;
const BLOCKS_BETWEEN_CHECKS: usize = 1 << 14;
/// Minimum number of nodes or blocks in a task, so that stealing work pays.
const MIN_WRITES_PER_TASK: usize = 256;
/// Distance, in blocks, at which triangles are prefetched.
const BLOCKS_AHEAD: usize = 8;
/// Distance, in nodes, at which containers are prefetched.
const NODES_AHEAD: usize = 4;

/// The wide tree of the binary `tree` over `triangles`, see [`Tree::is_binary`]; the same for any number of threads. Leaves may
/// have any size; those of up to 16 primitives may be joined.
pub fn collapse<C: WideContainer>(
    tree: &Tree<C>,
    triangles: &[Triangle],
    token: &CancelToken,
) -> Result<WideTree<C>, Cancelled> {
    if tree.nodes.is_empty() {
        return Ok(WideTree { root: None, nodes: Vec::new(), blocks: Vec::new() });
    }
    token.begin_stage("wide costs");
    let decisions = optimal_decisions(tree, token)?;
    token.begin_stage("wide plan");
    let emitter = Emitter { tree, decisions: &decisions };
    let (top, tasks) = emitter.top((tree.nodes.len() / TASK_NODES).min(MAX_TOP_NODES));
    let top_nodes = top.nodes.len();
    let fork = token.fork();
    let segments = tasks.par_iter().map(|&root| fork.task(|token| emitter.segment(root, token)));
    let segments: Vec<Segment> = segments.collect::<Result<_, Cancelled>>()?;
    fork.join();
    let segments: Vec<Segment> = std::iter::once(top).chain(segments).collect();

    // Segments follow one another.
    let mut starts = vec![SegmentStart { node: 0, block: 0 }];
    for (segment, before) in segments.iter().zip(0..) {
        let SegmentStart { node, block } = starts[before];
        starts.push(SegmentStart { node: node + segment.nodes.len(), block: block + segment.blocks.len() });
    }
    let [.., SegmentStart { node: node_count, block: block_count }] = starts[..] else {
        unreachable!("the top is a segment")
    };

    token.begin_stage("wide write");
    // All threads write in place: obtaining fresh memory takes as long as filling it, and so that work is shared too.
    let nodes = par_write(node_count, NODES_BETWEEN_CHECKS, token, |segment, index| {
        if index < top_nodes {
            let relocate = |child: Child| match child.index().checked_sub(top_nodes) {
                Some(task) if !child.is_leaf() => Child::node(starts[task + 1].node),
                _ => child,
            };
            return wide_node(tree, &segments[0].nodes[index], relocate);
        }
        let start = SegmentStart::find(&starts, segment, |start| start.node, index);
        let plans = &segments[*segment].nodes[index - start.node..];
        if let Some(ahead) = plans.get(NODES_AHEAD) {
            for lane in ahead {
                prefetch(&tree.nodes, lane.node as usize);
            }
        }
        wide_node(tree, &plans[0], |child| start.relocate(child))
    })?;
    let blocks = par_write(block_count, BLOCKS_BETWEEN_CHECKS, token, |segment, index| {
        let start = SegmentStart::find(&starts, segment, |start| start.block, index);
        let plans = &segments[*segment].blocks[index - start.block..];
        if let Some(ahead) = plans.get(BLOCKS_AHEAD) {
            ahead.slots().for_each(|slot| prefetch(triangles, tree.primitive_indices[slot] as usize));
        }
        TriangleBlock::new(triangles, &tree.primitive_indices[plans[0].slots()], plans[0].is_last)
    })?;
    let root = if node_count == 0 { Child::leaf(0) } else { Child::node(0) };
    token.check()?;
    Ok(WideTree { root: Some(root), nodes, blocks })
}

/// The list of `write(_, index)` for each index below `count`, written by all threads, which poll for cancellation
/// after `writes_between_checks` elements each. The first argument of `write` is a value that persists between calls, 0
/// at first.
fn par_write<T: Send>(
    count: usize,
    writes_between_checks: usize,
    token: &CancelToken,
    write: impl Fn(&mut usize, usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let mut list = Vec::with_capacity(count);
    let round = writes_between_checks * rayon::current_num_threads();
    let parts = round / MIN_WRITES_PER_TASK;
    let fork = token.fork();
    for start in (0..count).step_by(round) {
        token.check()?;
        let range = start..count.min(start + round);
        let range = range.into_par_iter().with_min_len(MIN_WRITES_PER_TASK);
        list.par_extend(range.map_init(|| (0, fork.part_of_loop(parts)), |(segment, _), index| write(segment, index)));
    }
    fork.join();
    Ok(list)
}

/// Indices of the first node and the first block of a segment.
#[derive(Clone, Copy)]
struct SegmentStart {
    node: usize,
    block: usize,
}

impl SegmentStart {
    /// Start of the segment that contains element `index`, counted by `offset`. `segment` caches the last result.
    #[inline(always)]
    fn find(starts: &[Self], segment: &mut usize, offset: impl Fn(&Self) -> usize, index: usize) -> Self {
        if !(offset(&starts[*segment])..offset(&starts[*segment + 1])).contains(&index) {
            *segment = starts.partition_point(|start| offset(start) <= index) - 1;
        }
        starts[*segment]
    }

    fn relocate(self, child: Child) -> Child {
        if child.is_leaf() { Child::leaf(child.index() + self.block) } else { Child::node(child.index() + self.node) }
    }
}

/// The wide node of the planned `lanes`, with the references to children relocated.
#[inline(always)]
fn wide_node<C: WideContainer>(
    tree: &Tree<C>,
    lanes: &[PlannedChild; WIDTH],
    relocate: impl Fn(Child) -> Child,
) -> WideNode<C::Bounds> {
    let mut node = WideNode { bounds: C::EMPTY_BOUNDS, children: [Child::node(0); WIDTH] };
    for (lane, &PlannedChild { node: binary_node, child }) in lanes.iter().enumerate() {
        if binary_node == PlannedChild::NONE.node {
            break;
        }
        tree.nodes[binary_node as usize].container.store(&mut node.bounds, lane);
        node.children[lane] = relocate(child);
    }
    node
}
