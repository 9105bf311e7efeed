//! From the pairs that the top-down builders leave behind to the tree that rays are traced through: depth first, siblings
//! together. The agglomerative builder writes its nodes in place.

use rayon::prelude::*;

use crate::aac::ClusterContainer;
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::par_collect::zeros;
use crate::tree::{Container, Node, Tree};

/// The children of one interior node. While the tree is built a node's `count` is the number
/// of primitives below it, and its `first` is the slot of its children or, below a single primitive, its position in
/// the order of the leaves' making.
pub type Pair<C> = [Node<C>; 2];

/// Subtrees up to this many primitives are written by one task.
const TASK_PRIMITIVES: usize = 8192;

/// A subtree that still has to be written: its node, whose `first` is a slot or a position in Morton order, and where
/// its parts go.
#[derive(Clone, Copy)]
struct Subtree<C> {
    node: Node<C>,
    /// Where the node itself goes.
    at: u32,
    /// Where the nodes below it begin.
    first_node: u32,
    /// Where its primitives begin.
    first_primitive: u32,
    depth: u32,
}

impl<C: Container> Subtree<C> {
    /// The node as it is written.
    fn flat(&self) -> Node<C> {
        if self.node.count == 1 {
            Node { container: self.node.container, first: self.first_primitive, count: 1 }
        } else {
            Node { container: self.node.container, first: self.first_node, count: 0 }
        }
    }

    /// Number of nodes below it.
    fn nodes_below(&self) -> u32 {
        2 * (self.node.count - 1)
    }

    /// Both children: everything below the first one comes before everything below the second.
    fn children(&self, slots: &[Pair<C>]) -> [Self; 2] {
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

/// The tree under `root`, whose descendants' pairs are in `slots` and whose primitives are `order`. Nothing here recurses:
/// agglomerative trees can be deep.
pub fn flatten<C: ClusterContainer>(
    root: Node<C>,
    slots: &[Pair<C>],
    order: impl Fn(usize) -> u32 + Sync,
    token: &CancelToken,
) -> Result<Tree<C>, Cancelled> {
    let mut nodes: Vec<Node<C>> = zeros(2 * root.count as usize - 1, token)?;
    let mut primitive_indices: Vec<u32> = zeros(root.count as usize, token)?;

    // The top of the tree, one after the other, until what is left below is small enough for a task.
    let mut tasks = Vec::new();
    let mut open = vec![Subtree { node: root, at: 0, first_node: 1, first_primitive: 0, depth: 0 }];
    while let Some(subtree) = open.pop() {
        nodes[subtree.at as usize] = subtree.flat();
        if subtree.node.count as usize <= TASK_PRIMITIVES {
            tasks.push(subtree);
        } else {
            let [first, second] = subtree.children(slots);
            open.extend([second, first]);
        }
    }

    // The tasks' parts of both lists follow one another in the order of the tasks, with the top's nodes in between.
    let mut parts = Vec::with_capacity(tasks.len());
    let (mut rest_nodes, mut rest_primitives, mut passed) = (&mut nodes[..], &mut primitive_indices[..], 0);
    for task in tasks {
        let (_, rest) = rest_nodes.split_at_mut(task.first_node as usize - passed);
        let (own_nodes, rest) = rest.split_at_mut(task.nodes_below() as usize);
        let (own_primitives, others) = rest_primitives.split_at_mut(task.node.count as usize);
        (rest_nodes, rest_primitives) = (rest, others);
        passed = (task.first_node + task.nodes_below()) as usize;
        parts.push((task, own_nodes, own_primitives));
    }
    let max_depth = parts
        .into_par_iter()
        .map(|(task, nodes, primitives)| {
            token.check()?;
            Ok(write_subtree(task, slots, &order, nodes, primitives))
        })
        .try_reduce(|| 0, |a, b| Ok(a.max(b)))?;
    Ok(Tree { nodes, primitive_indices, max_depth })
}

/// Writes everything below `top` and returns the depth of the deepest node.
fn write_subtree<C: Container>(
    top: Subtree<C>,
    slots: &[Pair<C>],
    order: &impl Fn(usize) -> u32,
    nodes: &mut [Node<C>],
    primitives: &mut [u32],
) -> u32 {
    let mut max_depth = top.depth;
    let mut open = vec![top];
    while let Some(subtree) = open.pop() {
        max_depth = max_depth.max(subtree.depth);
        if subtree.node.count == 1 {
            primitives[(subtree.first_primitive - top.first_primitive) as usize] = order(subtree.node.first as usize);
        } else {
            let children = subtree.children(slots);
            let at = (subtree.first_node - top.first_node) as usize;
            nodes[at] = children[0].flat();
            nodes[at + 1] = children[1].flat();
            open.extend([children[1], children[0]]);
        }
    }
    max_depth
}
