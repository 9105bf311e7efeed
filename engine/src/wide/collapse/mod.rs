//! Collapses a binary tree into a wide one (Ylitie, Karras, Laine, *Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs*, 2017, section 3).
//!
//! Bottom-up, [`optimal`] computes the least cost of each subtree by the surface area heuristic, as a leaf or under at
//! most one to eight roots. Top-down, [`emit`] gives each wide node the cheapest eight roots of its subtree, in the order
//! of [`visit_order`]. Each of its tasks plans a subtree, the same ones for any number of threads; once the sizes are
//! known, all nodes and blocks are written in parallel.

mod cost;
mod decision;
mod visit_order;

mod boundary;
mod chunk;
mod optimal;

mod emit;

use fearless_simd::Simd;
use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::SimdLevel;
use crate::kernel::parallel::{par_tasks, zeros};
use crate::kernel::prefetch::{prefetch, prefetch_whole};
use crate::kernel::simd::dispatch_plain;
use crate::tree::binarize::binarize;
use crate::tree::{AnyTree, Tree};
use crate::wide::bounds::{CompactBounds, WideContainer};
use crate::wide::child::{Child, LeafRange};
use crate::wide::collapse::emit::{Emitter, PlannedChild, PlannedNode, Segment};
use crate::wide::collapse::optimal::optimal_decisions;
use crate::wide::layout::{BLOCK, COMPACT_AREA, MAX_TRIANGLES, VALUES, WIDTH};
use crate::wide::leaves::{Leaves, PADDING, write_leaf};
use crate::wide::tree::{AnyWideTree, NodeForm, WideNode, WideTree};

/// Binary nodes for each wide node of the sequentially made top of the tree. Each such wide node yields about four
/// tasks.
const TASK_NODES: usize = 16_384;
/// Maximum number of wide nodes in the top.
const MAX_TOP_NODES: usize = 512;

/// Nodes, their bytes, and triangles, that each thread writes between polls for cancellation: 20 ms where these are scattered in memory.
const NODES_BETWEEN_CHECKS: usize = 1 << 12;
const NODE_BYTES_BETWEEN_CHECKS: usize = 1 << 20;
const TRIANGLES_BETWEEN_CHECKS: usize = 1 << 16;
/// Minimum number of nodes in a task, so that stealing work pays.
const MIN_WRITES_PER_TASK: usize = 256;
/// Distance, in slots, at which triangles are prefetched.
const SLOTS_AHEAD: usize = 32;
/// Distance, in nodes, at which containers are prefetched.
const NODES_AHEAD: usize = 4;

/// The wide tree of the binary `tree` over `triangles`, see [`Tree::is_binary`], with nodes of the given `form`; the same for any number
/// of threads. Leaves may have any size; those of up to 16 primitives may be joined.
///
/// # Panics
///
/// Where there are more than 2³⁰ triangles.
pub fn collapse<C: WideContainer>(
    tree: &Tree<C>,
    triangles: &[Triangle],
    form: NodeForm,
    token: &CancelToken,
) -> Result<WideTree<C>, Cancelled> {
    assert!(triangles.len() <= MAX_TRIANGLES, "{} triangles", triangles.len());
    if tree.nodes.is_empty() {
        let (nodes, compact_nodes) = (Vec::new(), Vec::new());
        return Ok(WideTree { root: None, nodes, compact_nodes, leaves: Leaves::default() });
    }
    token.begin_stage("wide costs");
    let decisions = optimal_decisions(tree, compact_area(tree, form), token)?;
    token.begin_stage("wide plan");
    let emitter = Emitter { tree, decisions: &decisions };
    let (top, tasks) = emitter.top((tree.nodes.len() / TASK_NODES).min(MAX_TOP_NODES));
    let mut values = zeros(VALUES * tree.primitive_indices.len() + PADDING, token)?;
    let sources = Sources { triangles, primitive_indices: &tree.primitive_indices };
    let first_slots: Vec<u32> = tasks.iter().map(|&root| emitter.first_slot(root)).collect();
    let (top_parts, task_parts) = parts(&mut values, &top.leaves, &first_slots);
    for (leaf, part) in top.leaves.iter().zip(top_parts) {
        sources.write(std::slice::from_ref(leaf), leaf.first, part, token)?;
    }
    let tasks = tasks.iter().zip(&first_slots).zip(task_parts);
    let segments = par_tasks(tasks, token, |((&root, &first), part), token| {
        let segment = emitter.segment(root, token)?;
        sources.write(&segment.leaves, first, part, token)?;
        Ok(segment)
    })?;
    let segments: Vec<Segment> = std::iter::once(top).chain(segments).collect();
    token.begin_stage("wide write");
    let starts = SegmentStart::of_all(&segments);
    let full = |bounds: C::Bounds, _, children| WideNode { bounds, children };
    let nodes = write_nodes::<_, _, FULL>(tree, &segments, &starts, full, token)?;
    let compact = |bounds: C::Bounds, count, children| WideNode { bounds: C::Compact::pack(&bounds, count), children };
    let compact_nodes = write_nodes::<_, _, COMPACT>(tree, &segments, &starts, compact, token)?;
    let root = match (&nodes[..], &segments[0].leaves[..]) {
        ([], [leaf]) => Child::leaf(*leaf).unwrap_or(Child::long_leaf(0)),
        _ => Child::ROOT,
    };
    let long = segments.into_iter().flat_map(|segment| segment.long).collect();
    let leaves = Leaves { values, long };
    token.check()?;
    Ok(WideTree { root: Some(root), nodes, compact_nodes, leaves })
}

/// Area below which nodes of `tree` are compact: less than that of the root, which is full.
fn compact_area<C: WideContainer>(tree: &Tree<C>, form: NodeForm) -> f32 {
    if form == NodeForm::Full || !C::HAS_COMPACT {
        return 0.0;
    }
    tree.nodes[0].container.nonempty_area() * (COMPACT_AREA / tree.nodes.len() as f32).min(1.0)
}

impl AnyWideTree {
    /// The wide tree of a `tree` over `triangles`, see [`collapse`]; all but boxes have one form only. A tree that is not binary is made so
    /// before, see [`binarize`]: the wide tree has the same leaves or larger ones, but its own nodes above them.
    pub fn new(tree: &AnyTree, triangles: &[Triangle], form: NodeForm, token: &CancelToken) -> Result<Self, Cancelled> {
        Ok(match tree {
            AnyTree::Aabb(tree) => Self::Aabb(collapse(&*binarize(tree, token)?, triangles, form, token)?),
            AnyTree::Sphere(tree) => Self::Sphere(collapse(&*binarize(tree, token)?, triangles, form, token)?),
            AnyTree::Dop14(tree) => Self::Dop14(collapse(&*binarize(tree, token)?, triangles, form, token)?),
            AnyTree::Oriented(tree) => Self::Oriented(collapse(&*binarize(tree, token)?, triangles, form, token)?),
        })
    }
}

/// Cuts `values`, where all triangles go in leaf order, into the parts of the `leaves` and those of the subtrees that begin at
/// `first_slots`.
fn parts<'a>(
    mut values: &'a mut [f32],
    leaves: &[LeafRange],
    first_slots: &[u32],
) -> (Vec<&'a mut [f32]>, Vec<&'a mut [f32]>) {
    let starts: Vec<u32> = leaves.iter().map(|leaf| leaf.first).chain(first_slots.iter().copied()).collect();
    let mut order: Vec<usize> = (0..starts.len()).collect();
    order.sort_unstable_by_key(|&at| starts[at]);
    let mut parts: Vec<&mut [f32]> = starts.iter().map(|_| &mut [][..]).collect();
    for (at, &part) in order.iter().enumerate() {
        let after = order.get(at + 1).map_or(values.len(), |&next| VALUES * (starts[next] - starts[part]) as usize);
        let (own, others) = values.split_at_mut(after);
        (parts[part], values) = (own, others);
    }
    let of_tasks = parts.split_off(leaves.len());
    (parts, of_tasks)
}

/// Source of the leaves.
#[derive(Clone, Copy)]
pub(crate) struct Sources<'a> {
    pub(crate) triangles: &'a [Triangle],
    /// Index of the triangle in each slot.
    pub(crate) primitive_indices: &'a [u32],
}

impl Sources<'_> {
    /// Writes `leaves`, which begin with slot `first` and leave no gap, to `part`.
    pub(crate) fn write(
        self,
        leaves: &[LeafRange],
        first: u32,
        part: &mut [f32],
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        dispatch_plain!(SimdLevel::of_builds().level(), simd => self.write_with(simd, leaves, first, part, token))
    }

    #[inline(always)]
    fn write_with<S: Simd>(
        self,
        simd: S,
        leaves: &[LeafRange],
        first: u32,
        part: &mut [f32],
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        // In the order of memory, so that a leaf may write beyond its end.
        let mut sizes = vec![0; leaves.iter().map(|leaf| leaf.count as usize).sum()];
        for leaf in leaves {
            sizes[(leaf.first - first) as usize] = leaf.count as usize;
        }
        let (mut at, mut unchecked) = (0, 0);
        while let Some(&size) = sizes.get(at) {
            let slot = first as usize + at;
            for ahead in 0..BLOCK {
                if let Some(&index) = self.primitive_indices.get(slot + SLOTS_AHEAD + ahead) {
                    prefetch_whole(self.triangles, index as usize);
                }
            }
            for piece in (at..at + size).step_by(TRIANGLES_BETWEEN_CHECKS) {
                let end = (piece + TRIANGLES_BETWEEN_CHECKS).min(at + size);
                let indices = &self.primitive_indices[first as usize + piece..first as usize + end];
                write_leaf(simd, self.triangles, indices, &mut part[VALUES * piece..]);
                unchecked += end - piece;
                if unchecked >= TRIANGLES_BETWEEN_CHECKS {
                    token.check()?;
                    unchecked = 0;
                }
            }
            at += size;
        }
        Ok(())
    }
}

/// The full or the compact nodes of all segments, which follow one another; the first segment is the top of the tree. `make` makes
/// them of their containers, their number and the children.
fn write_nodes<C: WideContainer, B: Send, const FORM: usize>(
    tree: &Tree<C>,
    segments: &[Segment],
    starts: &[SegmentStart],
    make: impl Fn(C::Bounds, usize, [Child; WIDTH]) -> WideNode<B> + Sync,
    token: &CancelToken,
) -> Result<Vec<WideNode<B>>, Cancelled> {
    let node_count = starts[segments.len()].nodes[FORM];
    let top_nodes = segments[0].nodes[FULL].len();
    // All threads write in place: obtaining fresh memory takes as long as filling it, and so that work is shared too.
    let between_checks = NODES_BETWEEN_CHECKS.min(NODE_BYTES_BETWEEN_CHECKS / size_of::<WideNode<B>>());
    par_write(node_count, between_checks, token, |segment, index| {
        let start = SegmentStart::find::<FORM>(starts, segment, index);
        let plans = &segments[*segment].nodes[FORM][index - start.nodes[FORM]..];
        let (bounds, count, children) = if *segment == 0 {
            wide_node(tree, &plans[0], |child| match child.index().checked_sub(top_nodes) {
                Some(task) if !child.is_leaf() => starts[task + 1].relocate(segments[task + 1].root),
                _ => child,
            })
        } else {
            if let Some(ahead) = plans.get(NODES_AHEAD) {
                for lane in ahead {
                    prefetch(&tree.nodes, lane.node as usize);
                }
            }
            wide_node(tree, &plans[0], |child| start.relocate(child))
        };
        make(bounds, count, children)
    })
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

/// Index of the full nodes among the lists of both forms.
const FULL: usize = 0;
/// Index of the compact nodes.
const COMPACT: usize = 1;

/// Indices of the first nodes of either form and the first long leaf of a segment.
#[derive(Clone, Copy)]
struct SegmentStart {
    nodes: [usize; 2],
    long: usize,
}

impl SegmentStart {
    /// Where each segment starts, and the end.
    fn of_all(segments: &[Segment]) -> Vec<Self> {
        let mut start = Self { nodes: [0; 2], long: 0 };
        let mut starts = vec![start];
        for segment in segments {
            for (start, nodes) in start.nodes.iter_mut().zip(&segment.nodes) {
                *start += nodes.len();
            }
            start.long += segment.long.len();
            starts.push(start);
        }
        starts
    }

    /// Start of the segment that contains the node `index` of a form. `segment` caches the last result.
    #[inline(always)]
    fn find<const FORM: usize>(starts: &[Self], segment: &mut usize, index: usize) -> Self {
        if !(starts[*segment].nodes[FORM]..starts[*segment + 1].nodes[FORM]).contains(&index) {
            *segment = starts.partition_point(|start| start.nodes[FORM] <= index) - 1;
        }
        starts[*segment]
    }

    #[inline(always)]
    fn relocate(self, child: Child) -> Child {
        if !child.is_leaf() {
            child.node_after(self.nodes[usize::from(child.is_compact())])
        } else if child.short_leaf().is_some() {
            child
        } else {
            Child::long_leaf(child.index() + self.long)
        }
    }
}

/// The containers of the planned `lanes`, their number, and the references to children, relocated.
#[inline(always)]
fn wide_node<C: WideContainer>(
    tree: &Tree<C>,
    lanes: &PlannedNode,
    relocate: impl Fn(Child) -> Child,
) -> (C::Bounds, usize, [Child; WIDTH]) {
    let used = lanes.iter().take_while(|lane| lane.node != PlannedChild::NONE.node);
    let mut bounds = C::EMPTY_BOUNDS;
    let mut children = [Child::ROOT; WIDTH];
    let mut count = 0;
    for (at, lane) in used.enumerate() {
        tree.nodes[lane.node as usize].container.store(&mut bounds, at);
        children[at] = relocate(lane.child);
        count += 1;
    }
    (bounds, count, children)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::{Aabb, Ray};
    use crate::kernel::SimdLevel;
    use crate::tree::Node;
    use crate::tree::traverse::TestCounts;

    /// A root with a leaf of one triangle beside a node of two leaves, of 20 and of 4 triangles, all around the origin in boxes of
    /// `half_sizes`, and the slot of the first of those 4.
    fn three_leaves(half_sizes: [f32; 3], one_is_left: bool) -> (Tree<Aabb>, usize) {
        let boxes = half_sizes.map(|half| Aabb { min: Vec3::splat(-half), max: Vec3::splat(half) });
        let both = Node { container: boxes[0].union(&boxes[1]), first: 3, count: 0 };
        let root = Node { container: both.container.union(&boxes[2]), first: 1, count: 0 };
        let firsts = if one_is_left { [1, 21, 0] } else { [0, 20, 24] };
        let leaf = |at: usize, count| Node { container: boxes[at], first: firsts[at], count };
        let children = if one_is_left { [leaf(2, 1), both] } else { [both, leaf(2, 1)] };
        let nodes = [&[root][..], &children, &[leaf(0, 20), leaf(1, 4)]].concat();
        (Tree { nodes, primitive_indices: (0..25).collect(), max_depth: 2 }, firsts[1] as usize)
    }

    #[test]
    fn any_hit_rays_visit_children_by_hits_per_cost() {
        let triangle = |y: f32| Triangle {
            a: Vec3::new(1.0, y - 1.0, -1.0),
            b: Vec3::new(1.0, y + 1.0, -1.0),
            c: Vec3::new(1.0, y, 1.0),
        };
        for half_sizes in [[9.0, 9.0, 9.0], [9.0, 7.0, 8.0], [8.0, 7.0, 9.0]] {
            for one_is_left in [false, true] {
                let (tree, four) = three_leaves(half_sizes, one_is_left);
                // The ray below hits the triangles of the leaf of four alone.
                let is_hit = |index| (four..four + 4).contains(&index);
                let triangles: Vec<Triangle> =
                    (0..25).map(|index| triangle(if is_hit(index) { 0.0 } else { 5.0 })).collect();
                let wide = collapse(&tree, &triangles, NodeForm::Full, &CancelToken::new())
                    .expect("the token is not cancelled");
                let children = wide.children_of(Child::ROOT);
                let counts: Vec<u32> = children.map(|child| wide.leaves.range(child).count).collect();
                assert_eq!(counts, [20, 1, 4], "{half_sizes:?}, {one_is_left}");

                let mut tests = TestCounts::default();
                let ray = Ray::new(Vec3::ZERO, Vec3::X);
                assert!(AnyWideTree::Aabb(wide).any_hit_with(SimdLevel::of_builds().level(), &ray, &mut tests));
                assert_eq!(tests, TestCounts { containers: 1, primitives: 1 }, "{half_sizes:?}, {one_is_left}");
            }
        }
    }
}
