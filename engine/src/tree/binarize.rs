//! A binary tree from one of any arity, for what takes only binary trees, such as the collapse into our own wide tree.

use std::borrow::Cow;

use crate::cancel::{CancelToken, Cancelled};

use super::node::{Node, Tree};
use crate::geometry::Container;

/// Most children of a node.
const MAX_ARITY: usize = Node::<()>::MAX_ARITY as usize;
/// Children and primitives between two polls for cancellation.
const WORK_BETWEEN_CHECKS: usize = 1 << 13;

/// `tree` itself where it is binary, otherwise a binary tree with the same leaves, over the same list of triangles.
///
/// The children of a node with more than two are joined by greedy agglomerative clustering: again and again the two whose
/// common container has the smallest surface area, the first two where several are equally small (Walter, Bala, Kulkarni,
/// Pingali: *Fast Agglomerative Clustering for Rendering*, 2008). A container around some of the children of a node is never
/// larger than the node's own, but a sphere around two may stick out of that around all. Old nodes keep their containers; one
/// with a single child is replaced by that child. Primitives keep their order within leaves; leaves are in the order of the new
/// tree.
///
/// Takes time linear in the nodes, on one thread; the same tree always.
///
/// ```
/// use bvhscope_engine::{Aabb, CancelToken};
/// use bvhscope_engine::glam::Vec3;
/// use bvhscope_engine::tree::{Node, Tree, binarize::binarize};
///
/// let at = |from: f32, to: f32| Aabb { min: Vec3::X * from, max: Vec3::new(to, 1.0, 1.0) };
/// let leaf = |from: f32, first| Node { container: at(from, from + 1.0), first, count: 1 };
/// let nodes = vec![Node::interior(at(0.0, 6.0), 1, 3), leaf(0.0, 0), leaf(3.0, 1), leaf(5.0, 2)];
/// let tree = Tree { nodes, primitive_indices: vec![0, 1, 2], max_depth: 1 };
/// let binary = binarize(&tree, &CancelToken::new())?;
/// // The second and the third leaf are nearest to each other.
/// assert_eq!((binary.nodes.len(), binary.nodes[2].container), (5, at(3.0, 6.0)));
/// # Ok::<(), bvhscope_engine::Cancelled>(())
/// ```
pub fn binarize<'a, C: Container>(tree: &'a Tree<C>, token: &CancelToken) -> Result<Cow<'a, Tree<C>>, Cancelled> {
    if tree.is_binary(token)? {
        return Ok(Cow::Borrowed(tree));
    }
    let mut binary = Tree {
        nodes: Vec::with_capacity(2 * tree.nodes.len()),
        primitive_indices: Vec::with_capacity(tree.primitive_indices.len()),
        max_depth: 0,
    };
    binary.nodes.push(tree.nodes[0]);
    let mut joined: Vec<Joined<C>> = Vec::new();
    // Depth first, left child on top, so that leaves are met from left to right.
    let mut open = vec![Open { part: Part::Node(0), at: 0, depth: 0 }];
    let mut work = 0;
    while let Some(Open { part, at, depth }) = open.pop() {
        let (container, children) = match part {
            Part::Joined(index) => (joined[index].container, joined[index].children),
            Part::Node(index) => {
                let mut node = &tree.nodes[index as usize];
                while node.arity() == 1 {
                    node = &tree.nodes[node.first as usize];
                    work += 1;
                }
                work += 1 + node.slots().len() + node.arity() as usize;
                if node.is_leaf() {
                    let first = binary.primitive_indices.len() as u32;
                    binary.primitive_indices.extend_from_slice(&tree.primitive_indices[node.slots()]);
                    binary.nodes[at] = Node { first, ..*node };
                    binary.max_depth = binary.max_depth.max(depth);
                    continue;
                }
                (node.container, join(tree, node, &mut joined))
            }
        };
        if work >= WORK_BETWEEN_CHECKS {
            work = 0;
            token.check()?;
        }
        let first = binary.nodes.len();
        let node = Node { container, first: first as u32, count: 0 };
        binary.nodes[at] = node;
        // Overwritten in their turn.
        binary.nodes.extend([node; 2]);
        let child = |side: usize| Open { part: children[side], at: first + side, depth: depth + 1 };
        open.extend([child(1), child(0)]);
    }
    Ok(Cow::Owned(binary))
}

/// A node of the new tree that is still to be written.
struct Open {
    part: Part,
    /// Its index.
    at: usize,
    depth: u32,
}

/// Source of a node of the new tree.
#[derive(Debug, Clone, Copy)]
enum Part {
    /// A node of the old tree.
    Node(u32),
    /// Two parts, by their index in a list.
    Joined(usize),
}

/// Some of the children of a node, as two parts.
struct Joined<C> {
    container: C,
    children: [Part; 2],
}

/// Joins the children of an interior `node`, at least two, until two parts are left, which are returned. What is joined goes to
/// the end of `list`.
fn join<C: Container>(tree: &Tree<C>, node: &Node<C>, list: &mut Vec<Joined<C>>) -> [Part; 2] {
    let mut parts: Vec<(Part, C)> =
        node.children().map(|child| (Part::Node(child), tree.nodes[child as usize].container)).collect();
    // Areas around parts a < b, kept from step to step.
    let mut areas = [[0.0_f32; MAX_ARITY]; MAX_ARITY];
    let area = |parts: &[(Part, C)], a: usize, b: usize| parts[a].1.union(&parts[b].1).relative_area();
    if parts.len() > 2 {
        pairs(parts.len()).for_each(|(a, b)| areas[a][b] = area(&parts, a, b));
    }
    while parts.len() > 2 {
        let count = parts.len();
        let smallest = pairs(count).min_by(|x, y| areas[x.0][x.1].total_cmp(&areas[y.0][y.1]));
        let (a, b) = smallest.unwrap_or((0, 1));
        let union = parts[a].1.union(&parts[b].1);
        let container = if areas[a][b] <= node.container.relative_area() { union } else { node.container };
        list.push(Joined { container, children: [parts[a].0, parts[b].0] });
        parts[a] = (Part::Joined(list.len() - 1), container);
        // The parts behind b move up.
        parts.remove(b);
        for row in &mut areas[..count] {
            row.copy_within(b + 1..count, b);
        }
        areas.copy_within(b + 1..count, b);
        (0..a).for_each(|other| areas[other][a] = area(&parts, other, a));
        (a + 1..parts.len()).for_each(|other| areas[a][other] = area(&parts, a, other));
    }
    [parts[0].0, parts[1].0]
}

/// Each two of `0..count`, the smaller first.
fn pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).flat_map(move |a| (a + 1..count).map(move |b| (a, b)))
}
