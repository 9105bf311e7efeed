//! Leaf collapse: subtrees become leaves where testing their primitives one after the other is cheaper (Goldsmith,
//! Salmon, *Automatic Creation of Object Hierarchies for Ray Tracing*, 1987). Writes the nodes in depth-first order,
//! from any order in which earlier passes left them.

use crate::aac::ClusterContainer;
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::{par_tasks, par_tasks_with};
use crate::kernel::prefetch::{prefetch, prefetch_pair};
use crate::optimize::partition::{MAX_SUBTREE_NODES, PartitionNode, partition, subdivide};
use crate::optimize::sah::{leaf_cost, node_or_leaf_cost};
use crate::tree::{Node, Tree};

/// Rewrites the nodes of `tree`, which may be in any order with siblings together: in depth-first order below the top,
/// with leaves and their primitives from left to right, and without unreachable nodes. If `collapses`, subtrees that
/// are cheaper as leaves become leaves. Returns the SAH cost, not normalised.
pub fn collapse_in_order<C: ClusterContainer>(
    tree: &mut Tree<C>,
    collapses: bool,
    token: &CancelToken,
) -> Result<f32, Cancelled> {
    let mut partition = partition(&tree.nodes);
    let mut subtrees: Vec<CollapsedSubtree<C>> = Vec::new();
    while subtrees.len() < partition.len() {
        let shared_tree = &*tree;
        let tasks = &partition[subtrees.len()..];
        let batch = par_tasks_with(tasks, token, Vec::new, |list, task, _| {
            let collapsed =
                (task.children == 0).then(|| CollapsedSubtree::new(shared_tree, task.node, collapses, list));
            Ok(collapsed.unwrap_or_else(|| Some(CollapsedSubtree::default())))
        })?;
        for subtree in batch {
            if subtree.is_none() {
                subdivide(&mut partition, &tree.nodes, subtrees.len());
            }
            subtrees.push(subtree.unwrap_or_default());
        }
    }
    for index in (0..partition.len()).rev() {
        if partition[index].children > 0 {
            let first = partition[index].children as usize;
            let container = tree.nodes[partition[index].node as usize].container;
            let primitives = subtrees[first].count + subtrees[first + 1].count;
            let children_cost = subtrees[first].cost + subtrees[first + 1].cost;
            let (cost, is_leaf) =
                node_or_leaf_cost::<C>(container.relative_area(), primitives, children_cost, collapses);
            let root = Node { container, first: 0, count: if is_leaf { primitives } else { 0 } };
            subtrees[index] =
                CollapsedSubtree { nodes: vec![root], cost, count: primitives, ..CollapsedSubtree::default() };
        }
    }
    let cost = subtrees[0].cost;
    assemble(tree, &partition, &subtrees, token)?;
    Ok(cost)
}

/// A rewritten subtree.
struct CollapsedSubtree<C> {
    /// Its root and all nodes below; `first` is relative to the subtree's first node or first primitive.
    nodes: Vec<Node<C>>,
    /// Primitive indices in leaf order.
    primitives: Vec<u32>,
    /// Number of primitives.
    count: u32,
    /// Depth of the deepest node; 0 for the root.
    depth: u32,
    /// SAH cost, not normalised.
    cost: f32,
}

impl<C> Default for CollapsedSubtree<C> {
    fn default() -> Self {
        Self { nodes: Vec::new(), primitives: Vec::new(), count: 0, depth: 0, cost: 0.0 }
    }
}

/// A node of a subtree. A list of these is breadth first, so that loads do not depend on one another.
#[derive(Clone, Copy)]
struct SubtreeNode {
    /// Index in the tree.
    node: u32,
    /// Index of the first child in the list, followed by the second; 0 for a leaf of the tree.
    children: u32,
    /// Number of primitives.
    count: u32,
    /// The area at first, then the SAH cost.
    cost: f32,
    becomes_leaf: bool,
}

impl<C: ClusterContainer> CollapsedSubtree<C> {
    /// Rewrites the subtree under `root`; `None` if it is too large for one thread.
    fn new(tree: &Tree<C>, root: u32, collapses: bool, list: &mut Vec<SubtreeNode>) -> Option<Self> {
        let entry = |node: u32| SubtreeNode { node, children: 0, count: 0, cost: 0.0, becomes_leaf: false };
        list.clear();
        list.push(entry(root));
        let mut index = 0;
        while let Some(&SubtreeNode { node, .. }) = list.get(index) {
            if index == MAX_SUBTREE_NODES {
                return None;
            }
            let node = &tree.nodes[node as usize];
            list[index].cost = node.container.relative_area();
            if node.is_leaf() {
                list[index].count = node.count;
                prefetch(&tree.primitive_indices, node.first as usize);
            } else {
                list[index].children = list.len() as u32;
                prefetch_pair(&tree.nodes, node.first as usize);
                list.extend([entry(node.first), entry(node.first + 1)]);
            }
            index += 1;
        }
        let mut interior_count = 0;
        for index in (0..list.len()).rev() {
            let SubtreeNode { children, count, cost: area, .. } = list[index];
            let (count, (cost, becomes_leaf)) = if children == 0 {
                (count, (leaf_cost(area, count), true))
            } else {
                let [first, second] = [list[children as usize], list[children as usize + 1]];
                let count = first.count + second.count;
                (count, node_or_leaf_cost::<C>(area, count, first.cost + second.cost, collapses))
            };
            interior_count += usize::from(!becomes_leaf);
            list[index] = SubtreeNode { count, cost, becomes_leaf, ..list[index] };
        }
        Some(Self::write(tree, list, interior_count))
    }

    /// Writes the nodes in `list`, of which `interior_count` at most remain interior nodes.
    fn write(tree: &Tree<C>, list: &[SubtreeNode], interior_count: usize) -> Self {
        let binary_node = |entry: &SubtreeNode| tree.nodes[entry.node as usize];
        let SubtreeNode { count, cost, .. } = list[0];
        let (mut nodes, mut primitives) =
            (Vec::with_capacity(2 * interior_count + 1), Vec::with_capacity(count as usize));
        nodes.push(binary_node(&list[0]));
        let mut max_depth = 0;
        // Index in the list, output slot and depth.
        let mut stack = vec![(0, 0, 0)];
        let mut descendants = Vec::new();
        while let Some((index, slot, depth)) = stack.pop() {
            let entry = &list[index as usize];
            if !entry.becomes_leaf {
                let (first, children) = (nodes.len(), entry.children);
                (nodes[slot].first, nodes[slot].count) = (first as u32, 0);
                nodes.extend([0, 1].map(|side| binary_node(&list[children as usize + side])));
                stack.extend([(children + 1, first + 1, depth + 1), (children, first, depth + 1)]);
                continue;
            }
            (nodes[slot].first, nodes[slot].count) = (primitives.len() as u32, entry.count);
            max_depth = max_depth.max(depth);
            descendants.push(*entry);
            while let Some(entry) = descendants.pop() {
                if entry.children == 0 {
                    let node = binary_node(&entry);
                    let first = node.first as usize;
                    primitives.extend_from_slice(&tree.primitive_indices[first..first + node.count as usize]);
                } else {
                    let first = entry.children as usize;
                    descendants.extend([list[first + 1], list[first]]);
                }
            }
        }
        Self { nodes, primitives, count, depth: max_depth, cost }
    }
}

/// Writes the nodes of the top, then those of each subtree from left to right.
#[expect(clippy::too_many_lines, reason = "one pass over the nodes")]
fn assemble<C: ClusterContainer>(
    tree: &mut Tree<C>,
    partition: &[PartitionNode],
    subtrees: &[CollapsedSubtree<C>],
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let mut top = vec![(0, Node { container: C::EMPTY, first: 0, count: 0 })];
    // Subtrees in order, with their first node relative to the end of the top, their first primitive, and whether their
    // nodes remain.
    let mut placed = Vec::with_capacity(subtrees.len());
    let (mut first_node, mut first_primitive, mut max_depth) = (0, 0, 0);
    // Index in the partition, output slot or none inside a collapsed leaf, depth.
    let mut stack = vec![(0_usize, Some(0_usize), 0)];
    while let Some((index, slot, depth)) = stack.pop() {
        let (task, subtree) = (partition[index], &subtrees[index]);
        let Some(&(mut root)) = subtree.nodes.first() else { continue };
        let mut children_slot = None;
        if task.children > 0 {
            if let Some(slot) = slot {
                if root.count == 0 {
                    root.first = top.len() as u32;
                    children_slot = Some(top.len());
                    top.extend([(0, root), (0, root)]);
                } else {
                    root.first = first_primitive;
                }
                top[slot] = (0, root);
                max_depth = max_depth.max(depth);
            }
            let child = task.children as usize;
            stack.extend([
                (child + 1, children_slot.map(|children_slot| children_slot + 1), depth + 1),
                (child, children_slot, depth + 1),
            ]);
            continue;
        }
        if let Some(slot) = slot {
            // Relative to the end of the top, whose length is not known yet; the root itself belongs to the top.
            root.first = if root.count > 0 { first_primitive } else { first_node };
            top[slot] = (u32::from(root.count == 0), root);
            max_depth = max_depth.max(depth + subtree.depth);
        }
        placed.push((subtree, first_node, first_primitive, slot.is_some()));
        first_primitive += subtree.count;
        first_node += if slot.is_some() { subtree.nodes.len() as u32 - 1 } else { 0 };
    }

    let top_len = top.len() as u32;
    // Overwrite the old nodes, which saves allocating fresh memory.
    let Tree { nodes, primitive_indices, .. } = tree;
    nodes.truncate((top_len + first_node) as usize);
    nodes.shrink_to_fit();
    let (top_nodes, mut remaining_nodes) = nodes.split_at_mut(top.len());
    for (slot, (is_shifted, node)) in top_nodes.iter_mut().zip(top) {
        *slot = Node { first: node.first + is_shifted * top_len, ..node };
    }
    let mut outputs = Vec::with_capacity(placed.len());
    let mut remaining_primitives = &mut primitive_indices[..];
    for (subtree, first_node, first_primitive, keeps_nodes) in placed {
        let (own_nodes, other_nodes) =
            remaining_nodes.split_at_mut(if keeps_nodes { subtree.nodes.len() - 1 } else { 0 });
        let (own_primitives, other_primitives) = remaining_primitives.split_at_mut(subtree.count as usize);
        (remaining_nodes, remaining_primitives) = (other_nodes, other_primitives);
        outputs.push((subtree, first_node + top_len, first_primitive, own_nodes, own_primitives));
    }
    par_tasks(outputs, token, |(subtree, first_node, first_primitive, nodes, primitives), _| {
        for (to, from) in nodes.iter_mut().zip(&subtree.nodes[1..]) {
            *to = Node { first: from.first + if from.count > 0 { first_primitive } else { first_node - 1 }, ..*from };
        }
        primitives.copy_from_slice(&subtree.primitives);
        Ok(())
    })?;
    tree.max_depth = max_depth;
    Ok(())
}
