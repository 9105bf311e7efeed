//! Flattens the pairs of nodes that top-down builders produce into a tree in depth-first order, siblings together. The
//! agglomerative builder writes its nodes in place.

use crate::aac::ClusterContainer;
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::{par_tasks, zeros};
use crate::stage_times::{Stage, StageTimes};
use crate::tree::{Container, Node, Tree};

/// The two children of an interior node during construction. A node's `count` is then the number of primitives below
/// it. Its `first` is the slot of its children or, for a single primitive, the position of that in the builder's order.
pub type ChildPair<C> = [Node<C>; 2];

/// Maximum number of primitives of a subtree that one task writes.
const TASK_PRIMITIVES: usize = 8192;

/// A subtree to write: its root, and where its nodes and primitives go.
#[derive(Clone, Copy)]
struct FlattenTask<C> {
    node: Node<C>,
    /// Index of the root.
    at: u32,
    /// Index of the first node below it.
    first_node: u32,
    /// Index of its first primitive.
    first_primitive: u32,
    depth: u32,
}

impl<C: Container> FlattenTask<C> {
    /// The root as it is written.
    fn flat_node(&self) -> Node<C> {
        if self.node.count == 1 {
            Node { container: self.node.container, first: self.first_primitive, count: 1 }
        } else {
            Node { container: self.node.container, first: self.first_node, count: 0 }
        }
    }

    /// Number of nodes below the root.
    fn nodes_below(&self) -> u32 {
        2 * (self.node.count - 1)
    }

    /// Both children: everything below the first precedes everything below the second.
    fn children(&self, slots: &[ChildPair<C>]) -> [Self; 2] {
        let [first, second] = slots[self.node.first as usize];
        let depth = self.depth + 1;
        let first_node = self.first_node + 2;
        let first = Self { node: first, at: self.first_node, first_node, first_primitive: self.first_primitive, depth };
        let second = Self {
            node: second,
            at: self.first_node + 1,
            first_node: first_node + first.nodes_below(),
            first_primitive: self.first_primitive + first.node.count,
            depth,
        };
        [first, second]
    }
}

/// Writes both children of a node to their slot, that of the last of the `middle` places of the left side, and returns the node. No other
/// split lies between the last place of the left side and the first of the right one, so the slot is unique. `slots` begin at `offset`.
pub fn pair_node<C: Container>(
    slots: &mut [ChildPair<C>],
    offset: usize,
    middle: usize,
    (left, right): (Node<C>, Node<C>),
) -> Node<C> {
    slots[middle - 1] = [left, right];
    Node {
        container: left.container.union(&right.container),
        first: (offset + middle - 1) as u32,
        count: left.count + right.count,
    }
}

/// The end of a build: ends the `stage` of the tree, and flattens what it made.
pub fn finish<C: ClusterContainer>(
    root: Node<C>,
    slots: &[ChildPair<C>],
    primitive_at: impl Fn(usize) -> u32 + Sync,
    stage: Stage,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    stage.end(times);
    token.check()?;
    let stage = Stage::begin("flatten", token);
    let tree = flatten(root, slots, primitive_at, token)?;
    stage.end(times);
    token.set_progress(1.0);
    Ok(tree)
}

/// Flattens the tree under `root`, whose descendants are in `slots`; `primitive_at` maps positions to primitive
/// indices. Iterative, because trees can be deep.
fn flatten<C: ClusterContainer>(
    root: Node<C>,
    slots: &[ChildPair<C>],
    primitive_at: impl Fn(usize) -> u32 + Sync,
    token: &CancelToken,
) -> Result<Tree<C>, Cancelled> {
    let mut nodes: Vec<Node<C>> = zeros(2 * root.count as usize - 1, token)?;
    let mut primitive_indices: Vec<u32> = zeros(root.count as usize, token)?;

    // Write the top of the tree sequentially, down to subtrees small enough for one task.
    let mut tasks = Vec::new();
    let mut stack = vec![FlattenTask { node: root, at: 0, first_node: 1, first_primitive: 0, depth: 0 }];
    while let Some(task) = stack.pop() {
        nodes[task.at as usize] = task.flat_node();
        if task.node.count as usize <= TASK_PRIMITIVES {
            tasks.push(task);
        } else {
            let [first, second] = task.children(slots);
            stack.extend([second, first]);
        }
    }

    // The tasks' ranges of both lists are consecutive, with nodes of the top in between.
    let mut outputs = Vec::with_capacity(tasks.len());
    let (mut remaining_nodes, mut remaining_primitives, mut skipped) = (&mut nodes[..], &mut primitive_indices[..], 0);
    for task in tasks {
        let (_, remaining) = remaining_nodes.split_at_mut(task.first_node as usize - skipped);
        let (task_nodes, remaining) = remaining.split_at_mut(task.nodes_below() as usize);
        let (task_primitives, remaining_after) = remaining_primitives.split_at_mut(task.node.count as usize);
        (remaining_nodes, remaining_primitives) = (remaining, remaining_after);
        skipped = (task.first_node + task.nodes_below()) as usize;
        outputs.push((task, task_nodes, task_primitives));
    }
    let depths = par_tasks(outputs, token, |(task, nodes, primitives), _| {
        Ok(write_subtree(task, slots, &primitive_at, nodes, primitives))
    })?;
    Ok(Tree { nodes, primitive_indices, max_depth: depths.into_iter().max().unwrap_or(0) })
}

/// Writes everything below `top` and returns the depth of its deepest node.
fn write_subtree<C: Container>(
    top: FlattenTask<C>,
    slots: &[ChildPair<C>],
    primitive_at: &impl Fn(usize) -> u32,
    nodes: &mut [Node<C>],
    primitives: &mut [u32],
) -> u32 {
    let mut max_depth = top.depth;
    let mut stack = vec![top];
    while let Some(task) = stack.pop() {
        max_depth = max_depth.max(task.depth);
        if task.node.count == 1 {
            primitives[(task.first_primitive - top.first_primitive) as usize] = primitive_at(task.node.first as usize);
        } else {
            let children = task.children(slots);
            let at = (task.first_node - top.first_node) as usize;
            nodes[at] = children[0].flat_node();
            nodes[at + 1] = children[1].flat_node();
            stack.extend([children[1], children[0]]);
        }
    }
    max_depth
}
