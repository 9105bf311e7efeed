//! Leaf collapse and order: subtrees become leaves where testing their primitives one after the other is cheaper, and nodes
//! that were moved about come back into the order that a tree promises.

use rayon::prelude::*;

use crate::aac::ClusterContainer;
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::prefetch::{prefetch, prefetch_pair};
use crate::optimize::partition::{MAX_SHARE_NODES, Share, divide, shares};
use crate::optimize::sah::{joined_cost, leaf_cost};
use crate::tree::{Node, Tree};

/// Puts the nodes of `tree`, which may stand in any order as long as siblings are neighbours, in order: depth first below the
/// top, leaves and their primitives from left to right, without those that nothing leads to. Where it `collapses`, with
/// leaves where those are cheaper. Returns the SAH cost, not normalised.
pub fn compact<C: ClusterContainer>(
    tree: &mut Tree<C>,
    collapses: bool,
    token: &CancelToken,
) -> Result<f32, Cancelled> {
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

/// A node of a subtree, breadth first: its loads do not wait for one another.
#[derive(Clone, Copy)]
struct Entry {
    /// Its number in the tree.
    node: u32,
    /// The entry of its first child, with the other one behind; 0 for a leaf of the tree.
    children: u32,
    /// Number of primitives.
    count: u32,
    /// Its area, until its SAH cost is known.
    cost: f32,
    becomes_leaf: bool,
}

impl<C: ClusterContainer> Part<C> {
    /// What becomes of the subtree of `root`; `None` where it is too large for one thread.
    fn new(tree: &Tree<C>, root: u32, collapses: bool, entries: &mut Vec<Entry>) -> Option<Self> {
        let entry = |node: u32| Entry { node, children: 0, count: 0, cost: 0.0, becomes_leaf: false };
        entries.clear();
        entries.push(entry(root));
        let mut at = 0;
        while let Some(&Entry { node, .. }) = entries.get(at) {
            if at == MAX_SHARE_NODES {
                return None;
            }
            let node = &tree.nodes[node as usize];
            entries[at].cost = node.container.relative_area();
            if node.is_leaf() {
                entries[at].count = node.count;
                prefetch(&tree.primitive_indices, node.first as usize);
            } else {
                entries[at].children = entries.len() as u32;
                prefetch_pair(&tree.nodes, node.first as usize);
                entries.extend([entry(node.first), entry(node.first + 1)]);
            }
            at += 1;
        }
        let mut pairs = 0;
        for at in (0..entries.len()).rev() {
            let Entry { children, count, cost: area, .. } = entries[at];
            let (count, (cost, becomes_leaf)) = if children == 0 {
                (count, (leaf_cost(area, count), true))
            } else {
                let [first, second] = [entries[children as usize], entries[children as usize + 1]];
                let count = first.count + second.count;
                (count, joined_cost(area, count, first.cost + second.cost, collapses))
            };
            pairs += usize::from(!becomes_leaf);
            entries[at] = Entry { count, cost, becomes_leaf, ..entries[at] };
        }
        Some(Self::written(tree, entries, pairs))
    }

    /// `pairs` is as many as there can be.
    fn written(tree: &Tree<C>, entries: &[Entry], pairs: usize) -> Self {
        let node_of = |entry: &Entry| tree.nodes[entry.node as usize];
        let Entry { count, cost, .. } = entries[0];
        let (mut nodes, mut primitives) = (Vec::with_capacity(2 * pairs + 1), Vec::with_capacity(count as usize));
        nodes.push(node_of(&entries[0]));
        let mut max_depth = 0;
        // Entries with their place and depth.
        let mut open = vec![(0, 0, 0)];
        let mut below = Vec::new();
        while let Some((at, place, depth)) = open.pop() {
            let entry = &entries[at as usize];
            if !entry.becomes_leaf {
                let (first, children) = (nodes.len(), entry.children);
                (nodes[place].first, nodes[place].count) = (first as u32, 0);
                nodes.extend([0, 1].map(|side| node_of(&entries[children as usize + side])));
                open.extend([(children + 1, first + 1, depth + 1), (children, first, depth + 1)]);
                continue;
            }
            (nodes[place].first, nodes[place].count) = (primitives.len() as u32, entry.count);
            max_depth = max_depth.max(depth);
            below.push(*entry);
            while let Some(entry) = below.pop() {
                if entry.children == 0 {
                    let node = node_of(&entry);
                    let first = node.first as usize;
                    primitives.extend_from_slice(&tree.primitive_indices[first..first + node.count as usize]);
                } else {
                    let first = entry.children as usize;
                    below.extend([entries[first + 1], entries[first]]);
                }
            }
        }
        Self { nodes, primitives, count, depth: max_depth, cost }
    }
}

/// The top's nodes, then those of each part from left to right.
fn assemble<C: ClusterContainer>(
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
