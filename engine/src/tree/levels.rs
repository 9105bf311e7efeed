//! All nodes of a tree depth by depth.

use std::ops::Range;
use std::sync::OnceLock;

use crate::cancel::{CancelToken, Cancelled};
use crate::tree::{Container, Tree};

/// Nodes between two looks at the token.
const NODES_BETWEEN_CHECKS: usize = 1 << 16;

/// Nodes that are listed at once: whole depths of up to so many in all. Every rebuild lists them again, so they are few, and
/// yet more than can be told apart on a screen.
const LISTED_AT_ONCE: u32 = 1 << 14;

/// The nodes of a tree depth by depth: the root, then depth 1, and so on, within a depth in the order of [`Tree::nodes`].
/// The first depths are listed at once, the others when someone asks.
#[derive(Debug)]
pub struct Levels {
    /// For each depth its run in the list. Empty for an empty tree.
    pub ranges: Vec<Range<u32>>,
    first: Vec<u32>,
    all: OnceLock<Vec<u32>>,
}

impl Levels {
    /// Bytes of the list of all nodes of a tree with so many.
    pub const fn bytes(nodes: usize) -> usize {
        nodes * size_of::<u32>()
    }

    /// Lists the first depths of `tree`, which has `nodes_per_depth`.
    pub fn new<C: Container>(tree: &Tree<C>, nodes_per_depth: &[u32]) -> Self {
        let mut end = 0;
        let run = |&count: &u32| {
            end += count;
            end - count..end
        };
        let ranges: Vec<Range<u32>> = nodes_per_depth.iter().map(run).collect();
        let mut first = Vec::new();
        let mut depth: Vec<u32> = (0..tree.nodes.len().min(1) as u32).collect();
        for range in ranges.iter().take_while(|range| range.end <= LISTED_AT_ONCE) {
            debug_assert_eq!(depth.len(), range.len());
            let pairs = depth.iter().map(|&node| &tree.nodes[node as usize]).filter(|node| !node.is_leaf());
            let mut next: Vec<u32> = pairs.flat_map(|node| [node.first, node.first + 1]).collect();
            next.sort_unstable();
            first.append(&mut depth);
            depth = next;
        }
        Self { ranges, first, all: OnceLock::new() }
    }

    /// The first nodes of the list, `count` of them or more. Takes a pass over `tree`, whose levels these are, where many are
    /// asked for the first time; see [`Levels::list`] for a UI thread.
    pub fn first<C: Container>(&self, tree: &Tree<C>, count: u32) -> &[u32] {
        if count as usize <= self.first.len() {
            return &self.first;
        }
        // Nobody else has this token.
        self.all.get_or_init(|| self.all_of(tree, &CancelToken::new()).unwrap_or_default())
    }

    /// How many nodes of the list are known.
    pub fn listed(&self) -> u32 {
        self.all.get().unwrap_or(&self.first).len() as u32
    }

    /// Makes the first `count` nodes of the list known, unless `token` is cancelled.
    pub fn list<C: Container>(&self, tree: &Tree<C>, count: u32, token: &CancelToken) -> Result<(), Cancelled> {
        if count as usize > self.first.len() && self.all.get().is_none() {
            let all = self.all_of(tree, token)?;
            self.all.get_or_init(|| all);
        }
        Ok(())
    }

    fn all_of<C: Container>(&self, tree: &Tree<C>, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
        token.check()?;
        let depths = tree.depths(token)?;
        let mut next: Vec<u32> = self.ranges.iter().map(|range| range.start).collect();
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
        Ok(nodes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Aabb;
    use crate::tree::Node;

    /// A chain of so many interior nodes, each with a leaf hanging off it, below a full tree of 2^`full` of them.
    fn chains(full: u32, interior: u32) -> Tree<Aabb> {
        let mut nodes = vec![Node { container: Aabb::EMPTY, first: 0, count: 1 }];
        let mut ends = vec![0];
        for step in 0..full + interior {
            let mut next = Vec::new();
            for end in ends {
                let first = nodes.len() as u32;
                nodes[end as usize] = Node { container: Aabb::EMPTY, first, count: 0 };
                nodes.extend([Node { container: Aabb::EMPTY, first: 0, count: 1 }; 2]);
                next.push(first + 1);
                if step < full {
                    next.push(first);
                }
            }
            ends = next;
        }
        let leaves = nodes.iter().filter(|node| node.is_leaf()).count() as u32;
        Tree { nodes, primitive_indices: (0..leaves).collect(), max_depth: full + interior }
    }

    fn per_depth(tree: &Tree<Aabb>) -> Vec<u32> {
        let mut counts = vec![0; tree.max_depth as usize + 1];
        tree.depths(&CancelToken::new()).unwrap_or_default().iter().for_each(|&depth| counts[depth as usize] += 1);
        counts
    }

    #[test]
    fn each_node_stands_at_its_depth() {
        // Deep, wide and both: less than is listed at once, and more.
        for (full, interior) in [(0, 0), (0, 3_000), (12, 0), (14, 2), (3, 3_000)] {
            let tree = chains(full, interior);
            let levels = Levels::new(&tree, &per_depth(&tree));
            let count = tree.nodes.len() as u32;
            assert_eq!(levels.ranges.last().map(|range| range.end), Some(count));
            let few = levels.first(&tree, 1).to_vec();
            assert!(few.len() as u32 <= LISTED_AT_ONCE);
            let all = levels.first(&tree, count);
            assert_eq!(few, all[..few.len()], "the same list, however much of it is asked for");
            let depths = tree.depths(&CancelToken::new()).unwrap_or_default();
            for (depth, range) in levels.ranges.iter().enumerate() {
                let nodes = &all[range.start as usize..range.end as usize];
                assert!(nodes.iter().all(|&node| depths[node as usize] as usize == depth));
                assert!(nodes.is_sorted(), "within a depth in the order of the tree");
            }
            let mut all = all.to_vec();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..count), "each node once");
        }
    }

    #[test]
    fn an_empty_tree_has_no_depths() {
        let tree = Tree::<Aabb> { nodes: Vec::new(), primitive_indices: Vec::new(), max_depth: 0 };
        let levels = Levels::new(&tree, &[]);
        assert!(levels.ranges.is_empty() && levels.first(&tree, 0).is_empty());
    }

    #[test]
    fn a_cancelled_list_is_made_later() {
        let tree = chains(14, 2);
        let levels = Levels::new(&tree, &per_depth(&tree));
        let token = CancelToken::new();
        token.cancel();
        assert_eq!(levels.list(&tree, tree.nodes.len() as u32, &token), Err(Cancelled));
        assert_eq!(levels.list(&tree, 100, &token), Ok(()), "these are there");
        assert_eq!(levels.first(&tree, tree.nodes.len() as u32).len(), tree.nodes.len());
    }
}
