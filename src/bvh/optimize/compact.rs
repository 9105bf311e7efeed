//! Leaf collapse and order: subtrees become leaves where testing their primitives one after the other is cheaper, and nodes
//! that were moved about come back into the order that a tree promises.

use rayon::prelude::*;

use super::below::{joined_cost, leaf_cost};
use super::shares::{MAX_SHARE_NODES, Share, divide, shares};
use crate::bvh::cluster::Clustered;
use crate::bvh::{Node, Tree};
use crate::cancel::{CancelToken, Cancelled};

/// Puts the nodes of `tree`, which may stand in any order as long as siblings are neighbours, in order: depth first below the
/// top, leaves and their primitives from left to right, without those that nothing leads to. Where it `collapses`, with
/// leaves where those are cheaper. Returns the SAH cost, not normalised.
pub fn compact<C: Clustered>(tree: &mut Tree<C>, collapses: bool, token: &CancelToken) -> Result<f32, Cancelled> {
    let mut shares = shares(&tree.nodes);
    let mut parts: Vec<Part<C>> = Vec::new();
    while parts.len() < shares.len() {
        let whole = &*tree;
        let more = shares[parts.len()..].par_iter().map_init(Vec::new, |entries, share| {
            token.check()?;
            let own = (share.children == 0).then(|| Part::new(whole, share.node, collapses, entries));
            Ok(own.unwrap_or_else(|| Some(Part::default())))
        });
        for part in more.collect::<Result<Vec<_>, _>>()? {
            if part.is_none() {
                divide(&mut shares, &tree.nodes, parts.len());
            }
            parts.push(part.unwrap_or_default());
        }
    }
    for at in (0..shares.len()).rev() {
        if shares[at].children > 0 {
            let first = shares[at].children as usize;
            let container = tree.nodes[shares[at].node as usize].container;
            let primitives = parts[first].count + parts[first + 1].count;
            let below = parts[first].cost + parts[first + 1].cost;
            let (cost, is_leaf) = joined_cost(container.relative_area(), primitives, below, collapses);
            let root = Node { container, first: 0, count: if is_leaf { primitives } else { 0 } };
            parts[at] = Part { nodes: vec![root], cost, count: primitives, ..Part::default() };
        }
    }
    let cost = parts[0].cost;
    assemble(tree, &shares, &parts, token)?;
    Ok(cost)
}

/// What becomes of a subtree.
struct Part<C> {
    /// Its root and what is below; `first` counts from the part's root or first primitive.
    nodes: Vec<Node<C>>,
    /// Its primitives in the order of its leaves.
    primitives: Vec<u32>,
    /// Number of its primitives.
    count: u32,
    /// Depth of its deepest node, its root's being 0.
    depth: u32,
    cost: f32,
}

impl<C> Default for Part<C> {
    fn default() -> Self {
        Self { nodes: Vec::new(), primitives: Vec::new(), count: 0, depth: 0, cost: 0.0 }
    }
}

/// A node of a subtree, breadth first: its loads do not wait for one another. The children of an interior one are entries.
#[derive(Clone, Copy)]
struct Entry<C> {
    node: Node<C>,
    count: u32,
    cost: f32,
    is_leaf: bool,
}

impl<C: Clustered> Part<C> {
    /// What becomes of the subtree of `root`; `None` where it is too large for one thread.
    fn new(tree: &Tree<C>, root: u32, collapses: bool, entries: &mut Vec<Entry<C>>) -> Option<Self> {
        let entry = |node: Node<C>| Entry { node, count: node.count, cost: 0.0, is_leaf: node.is_leaf() };
        entries.clear();
        entries.push(entry(tree.nodes[root as usize]));
        let mut at = 0;
        while let Some(&Entry { node, is_leaf, .. }) = entries.get(at) {
            if at == MAX_SHARE_NODES {
                return None;
            }
            if !is_leaf {
                entries[at].node.first = entries.len() as u32;
                let first = node.first as usize;
                entries.extend([entry(tree.nodes[first]), entry(tree.nodes[first + 1])]);
            }
            at += 1;
        }
        let mut pairs = 0;
        for at in (0..entries.len()).rev() {
            let Entry { node, count, is_leaf, .. } = entries[at];
            let area = node.container.relative_area();
            if is_leaf {
                entries[at].cost = leaf_cost(area, count);
                continue;
            }
            let [first, second] = [entries[node.first as usize], entries[node.first as usize + 1]];
            let count = first.count + second.count;
            let (cost, is_leaf) = joined_cost(area, count, first.cost + second.cost, collapses);
            pairs += usize::from(!is_leaf);
            entries[at] = Entry { node, count, cost, is_leaf };
        }
        Some(Self::written(tree, entries, pairs))
    }

    /// `pairs` is as many as there can be.
    fn written(tree: &Tree<C>, entries: &[Entry<C>], pairs: usize) -> Self {
        let Entry { node, count, cost, .. } = entries[0];
        let (mut nodes, mut primitives) = (Vec::with_capacity(2 * pairs + 1), Vec::with_capacity(count as usize));
        nodes.push(node);
        let mut max_depth = 0;
        // Entries with their place and depth.
        let mut open = vec![(0, 0, 0)];
        let mut below = Vec::new();
        while let Some((at, place, depth)) = open.pop() {
            let Entry { node, count, is_leaf, .. } = entries[at as usize];
            if !is_leaf {
                let first = nodes.len() as u32;
                nodes[place].first = first;
                nodes.extend([entries[node.first as usize].node, entries[node.first as usize + 1].node]);
                open.extend([(node.first + 1, first as usize + 1, depth + 1), (node.first, first as usize, depth + 1)]);
                continue;
            }
            (nodes[place].first, nodes[place].count) = (primitives.len() as u32, count);
            max_depth = max_depth.max(depth);
            below.push(node);
            while let Some(node) = below.pop() {
                let first = node.first as usize;
                if node.is_leaf() {
                    primitives.extend_from_slice(&tree.primitive_indices[first..first + node.count as usize]);
                } else {
                    below.extend([entries[first + 1].node, entries[first].node]);
                }
            }
        }
        Self { nodes, primitives, count, depth: max_depth, cost }
    }
}

/// The top's nodes, then those of each part from left to right.
fn assemble<C: Clustered>(
    tree: &mut Tree<C>,
    shares: &[Share],
    parts: &[Part<C>],
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let mut top = vec![(0, Node { container: C::EMPTY, first: 0, count: 0 })];
    // The parts in order with the numbers of their first node, once the top is done, and whether their nodes stay.
    let mut placed = Vec::with_capacity(parts.len());
    let (mut first_node, mut first_primitive, mut max_depth) = (0, 0, 0);
    // Position in the list, place of the node or none below a leaf, depth.
    let mut open = vec![(0_usize, Some(0_usize), 0)];
    while let Some((at, place, depth)) = open.pop() {
        let (share, part) = (shares[at], &parts[at]);
        let Some(&(mut root)) = part.nodes.first() else { continue };
        let mut below = None;
        if share.children > 0 {
            if let Some(place) = place {
                if root.count == 0 {
                    root.first = top.len() as u32;
                    below = Some(top.len());
                    top.extend([(0, root), (0, root)]);
                } else {
                    root.first = first_primitive;
                }
                top[place] = (0, root);
                max_depth = max_depth.max(depth);
            }
            let child = share.children as usize;
            open.extend([(child + 1, below.map(|below| below + 1), depth + 1), (child, below, depth + 1)]);
            continue;
        }
        if let Some(place) = place {
            // Nodes are counted from behind the top, the length of which is not known yet. The root itself is up there.
            root.first = if root.count > 0 { first_primitive } else { first_node };
            top[place] = (u32::from(root.count == 0), root);
            max_depth = max_depth.max(depth + part.depth);
        }
        placed.push((part, first_node, first_primitive, place.is_some()));
        first_primitive += part.count;
        first_node += if place.is_some() { part.nodes.len() as u32 - 1 } else { 0 };
    }

    let top_len = top.len() as u32;
    // Over the old ones, which saves getting fresh memory.
    let Tree { nodes, primitive_indices, .. } = tree;
    nodes.truncate((top_len + first_node) as usize);
    nodes.shrink_to_fit();
    let (top_nodes, mut rest) = nodes.split_at_mut(top.len());
    for (node, (is_shifted, flat)) in top_nodes.iter_mut().zip(top) {
        *node = Node { first: flat.first + is_shifted * top_len, ..flat };
    }
    let mut targets = Vec::with_capacity(placed.len());
    let mut rest_primitives = &mut primitive_indices[..];
    for (part, first_node, first_primitive, stays) in placed {
        let (own_nodes, others) = rest.split_at_mut(if stays { part.nodes.len() - 1 } else { 0 });
        let (own_primitives, other_primitives) = rest_primitives.split_at_mut(part.count as usize);
        (rest, rest_primitives) = (others, other_primitives);
        targets.push((part, first_node + top_len, first_primitive, own_nodes, own_primitives));
    }
    targets.into_par_iter().try_for_each(|(part, first_node, first_primitive, nodes, primitives)| {
        token.check()?;
        for (to, from) in nodes.iter_mut().zip(&part.nodes[1..]) {
            *to = Node { first: from.first + if from.count > 0 { first_primitive } else { first_node - 1 }, ..*from };
        }
        primitives.copy_from_slice(&part.primitives);
        Ok(())
    })?;
    tree.max_depth = max_depth;
    Ok(())
}
