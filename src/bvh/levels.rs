//! All nodes of a tree depth by depth, and how a pass over a whole tree is shared between threads.

use std::collections::VecDeque;
use std::ops::Range;

use rayon::prelude::*;

use super::{Container, Tree};
use crate::cancel::{CancelToken, Cancelled};

/// Nodes that are looked at one after the other before the rest is shared out: enough subtrees for many threads.
const TOP_NODES: usize = 1024;

/// A node and its depth.
pub(super) type Place = (u32, u32);

/// The top of `tree`, root first, and the roots of the subtrees below it, which together hold all other nodes.
pub(super) fn top_and_subtrees<C: Container>(tree: &Tree<C>) -> (Vec<Place>, Vec<Place>) {
    let mut top = Vec::new();
    let mut subtrees = VecDeque::new();
    subtrees.extend((!tree.nodes.is_empty()).then_some((0, 0)));
    while top.len() < TOP_NODES
        && let Some((index, depth)) = subtrees.pop_front()
    {
        top.push((index, depth));
        let node = &tree.nodes[index as usize];
        if !node.is_leaf() {
            subtrees.extend([(node.first, depth + 1), (node.first + 1, depth + 1)]);
        }
    }
    (top, subtrees.into())
}

/// Calls `visit` for each node below `top` and for `top` itself, first children first.
pub(super) fn walk<C: Container>(tree: &Tree<C>, top: Place, mut visit: impl FnMut(Place)) {
    let mut open = vec![top];
    while let Some((mut index, mut depth)) = open.pop() {
        loop {
            visit((index, depth));
            let node = &tree.nodes[index as usize];
            if node.is_leaf() {
                break;
            }
            (index, depth) = (node.first, depth + 1);
            open.push((index + 1, depth));
        }
    }
}

/// All nodes of a tree depth by depth.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Levels {
    /// The root, then depth 1, and so on; the order within a depth does not depend on the number of threads.
    pub nodes: Vec<u32>,
    /// For each depth its run in `nodes`. Empty for an empty tree.
    pub ranges: Vec<Range<u32>>,
}

impl Levels {
    /// Lists the nodes of `tree`.
    pub fn new<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<Self, Cancelled> {
        let (top, subtrees) = top_and_subtrees(tree);
        let mut parts: Vec<Vec<Vec<u32>>> = vec![vec![Vec::new(); tree.max_depth as usize + 1]];
        for (node, depth) in top {
            parts[0][depth as usize].push(node);
        }
        parts.par_extend(subtrees.into_par_iter().map(|subtree| {
            let mut levels: Vec<Vec<u32>> = Vec::new();
            if !token.is_cancelled() {
                walk(tree, subtree, |(node, depth)| {
                    let level = (depth - subtree.1) as usize;
                    if level == levels.len() {
                        levels.push(Vec::new());
                    }
                    levels[level].push(node);
                });
            }
            // Depths above the subtree's root are empty.
            levels.splice(0..0, vec![Vec::new(); subtree.1 as usize]);
            levels
        }));
        token.check()?;
        let mut nodes = Vec::with_capacity(tree.nodes.len());
        let mut ranges = Vec::new();
        for depth in 0..parts[0].len().min(tree.nodes.len()) {
            let start = nodes.len() as u32;
            parts.iter().filter_map(|part| part.get(depth)).for_each(|level| nodes.extend_from_slice(level));
            ranges.push(start..nodes.len() as u32);
        }
        Ok(Self { nodes, ranges })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Node;
    use crate::geometry::Aabb;

    /// A chain with one leaf hanging off each node, long enough for subtrees below the top.
    fn chain(interior: u32) -> Tree<Aabb> {
        let node = |first, count| Node { container: Aabb::EMPTY, first, count };
        let mut nodes = vec![node(1, 0)];
        for step in 1..=interior {
            nodes.push(node(step - 1, 1));
            nodes.push(if step == interior { node(interior, 1) } else { node(2 * step + 1, 0) });
        }
        Tree { nodes, primitive_indices: (0..=interior).collect(), max_depth: interior }
    }

    #[test]
    fn each_node_stands_at_its_depth() {
        let tree = chain(3000);
        let levels = Levels::new(&tree, &CancelToken::new()).unwrap_or_else(|_| unreachable!("nobody cancels"));
        let depths = tree.depths();
        for (depth, range) in levels.ranges.iter().enumerate() {
            for &node in &levels.nodes[range.start as usize..range.end as usize] {
                assert_eq!(depths[node as usize] as usize, depth);
            }
        }
        let mut all = levels.nodes;
        all.sort_unstable();
        assert!(all.into_iter().eq(0..6001), "each node once");
        assert_eq!(levels.ranges.len(), 3001);
    }

    #[test]
    fn an_empty_tree_has_no_depths() {
        let tree = Tree::<Aabb> { nodes: Vec::new(), primitive_indices: Vec::new(), max_depth: 0 };
        assert_eq!(Levels::new(&tree, &CancelToken::new()), Ok(Levels { nodes: Vec::new(), ranges: Vec::new() }));
        let token = CancelToken::new();
        token.cancel();
        assert_eq!(Levels::new(&chain(2), &token), Err(Cancelled));
    }
}
