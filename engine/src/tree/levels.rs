//! The nodes of a tree sorted by depth.

use std::ops::Range;
use std::sync::OnceLock;

use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};

use super::node::Tree;
use crate::geometry::Container;

/// Maximum number of nodes that [`Levels::new`] lists, in whole depths. Few, because every rebuild lists them again, and yet more
/// than can be told apart on a screen.
const LISTED_EAGERLY: u32 = 1 << 14;

/// Node indices sorted by depth: the root, then depth 1, and so on, within a depth in the order of [`Tree::nodes`]. The first
/// depths are listed at once, the others on request. Of a hierarchy of some of its nodes, those at their depths there.
#[derive(Debug)]
pub struct Levels {
    /// Range of each depth in the list. Empty for an empty tree.
    pub ranges: Vec<Range<u32>>,
    first: Vec<u32>,
    all: OnceLock<Vec<u32>>,
}

impl Levels {
    /// Bytes of the list for a tree of `nodes` nodes.
    pub const fn bytes(nodes: usize) -> usize {
        nodes * size_of::<u32>()
    }

    /// Lists the first depths of `tree`, whose numbers of nodes per depth are `nodes_per_depth`.
    pub fn new<C: Container>(tree: &Tree<C>, nodes_per_depth: &[u32]) -> Self {
        let mut end = 0;
        let range = |&count: &u32| {
            end += count;
            end - count..end
        };
        let ranges: Vec<Range<u32>> = nodes_per_depth.iter().map(range).collect();
        let mut first = Vec::new();
        let mut depth: Vec<u32> = (0..tree.nodes.len().min(1) as u32).collect();
        for range in ranges.iter().take_while(|range| range.end <= LISTED_EAGERLY) {
            debug_assert_eq!(depth.len(), range.len());
            let mut next: Vec<u32> = depth.iter().flat_map(|&node| tree.nodes[node as usize].children()).collect();
            next.sort_unstable();
            first.append(&mut depth);
            depth = next;
        }
        Self { ranges, first, all: OnceLock::new() }
    }

    /// The nodes of each depth, in the order of [`Tree::nodes`], of a hierarchy of some of the nodes of a tree.
    pub fn of(by_depth: Vec<Vec<u32>>) -> Self {
        let mut end = 0;
        let range = |nodes: &Vec<u32>| {
            end += nodes.len() as u32;
            end - nodes.len() as u32..end
        };
        let ranges = by_depth.iter().map(range).collect();
        Self { ranges, first: by_depth.concat(), all: OnceLock::new() }
    }

    /// The first `count` nodes of the list, or more. `tree` is the one that [`Levels::new`] got. Takes a pass over it when more nodes
    /// than are listed are first requested: a UI thread calls [`Levels::list`] elsewhere before.
    pub fn first<C: Container>(&self, tree: &Tree<C>, count: u32) -> &[u32] {
        if count as usize <= self.first.len() {
            return &self.first;
        }
        // This token is never cancelled.
        self.all.get_or_init(|| self.all_of(tree, &CancelToken::new()).unwrap_or_default())
    }

    /// Number of nodes listed so far.
    pub fn listed(&self) -> u32 {
        self.all.get().unwrap_or(&self.first).len() as u32
    }

    /// Lists the first `count` nodes, so that [`Levels::first`] returns them at once.
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
            token.check_every(LIGHT_STEPS, index)?;
            let slot = &mut next[depth as usize];
            nodes[*slot as usize] = index as u32;
            *slot += 1;
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

    /// A full tree of depth `full`, with a chain of `interior` nodes, each with one leaf, below each of its leaves.
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
    fn each_node_is_listed_at_its_depth() {
        // Deep, wide and both, with fewer nodes than are listed eagerly and with more.
        for (full, interior) in [(0, 0), (0, 3_000), (12, 0), (14, 2), (3, 3_000)] {
            let tree = chains(full, interior);
            let levels = Levels::new(&tree, &per_depth(&tree));
            let count = tree.nodes.len() as u32;
            assert_eq!(levels.ranges.last().map(|range| range.end), Some(count));
            let few = levels.first(&tree, 1).to_vec();
            assert!(few.len() as u32 <= LISTED_EAGERLY);
            let all = levels.first(&tree, count);
            assert_eq!(few, all[..few.len()], "the same list, however much of it is requested");
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
        assert_eq!(levels.list(&tree, 100, &token), Ok(()), "already listed");
        assert_eq!(levels.first(&tree, tree.nodes.len() as u32).len(), tree.nodes.len());
    }
}
