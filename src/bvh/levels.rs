//! All nodes of a tree depth by depth.

use std::ops::Range;

use super::{Container, Tree};
use crate::cancel::{CancelToken, Cancelled};

/// Nodes between two looks at the token.
const NODES_BETWEEN_CHECKS: usize = 1 << 16;

/// All nodes of a tree depth by depth.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Levels {
    /// The root, then depth 1, and so on, within a depth in the order of [`Tree::nodes`].
    pub nodes: Vec<u32>,
    /// For each depth its run in `nodes`. Empty for an empty tree.
    pub ranges: Vec<Range<u32>>,
}

impl Levels {
    /// Bytes of the list of a tree with so many nodes.
    pub const fn bytes(nodes: usize) -> usize {
        nodes * size_of::<u32>()
    }

    /// Lists the nodes of `tree`.
    pub fn new<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<Self, Cancelled> {
        token.check()?;
        let depths = tree.depths_unless(token)?;
        let mut counts = vec![0; tree.max_depth as usize + 1];
        for depths in depths.chunks(NODES_BETWEEN_CHECKS) {
            token.check()?;
            for &depth in depths {
                counts[depth as usize] += 1;
            }
        }
        let mut end = 0;
        let run = |count: u32| {
            end += count;
            end - count..end
        };
        let ranges: Vec<Range<u32>> = counts.into_iter().filter(|&count| count > 0).map(run).collect();
        let mut next: Vec<u32> = ranges.iter().map(|range| range.start).collect();
        let mut nodes = vec![0; depths.len()];
        for (index, &depth) in depths.iter().enumerate() {
            if index.is_multiple_of(NODES_BETWEEN_CHECKS) {
                token.check()?;
            }
            let place = &mut next[depth as usize];
            nodes[*place as usize] = index as u32;
            *place += 1;
        }
        token.check()?;
        Ok(Self { nodes, ranges })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Node;
    use crate::geometry::Aabb;

    /// A chain with one leaf hanging off each node.
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
