//! Which node each primitive is a part of: its ancestor at a depth, or the node of a cut that holds it.

use std::sync::Arc;

use crate::accel::Accel;
use bvhscope_engine::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use bvhscope_engine::construction::{Cut, CutError, Timeline};
use bvhscope_engine::tree::{AnyTree, Container, Tree};
use bvhscope_engine::with_tree;

/// A cut through a tree whose nodes give surfaces their colours, in place of the nodes at a depth.
#[derive(Debug, Clone)]
pub struct ClusterCut {
    /// The cut.
    pub cut: Cut,
    /// For a cut at a step of a construction: the tree that its merges made, and when its clusters are active. `None` for a cut through
    /// the traced tree.
    pub merges: Option<(Arc<Accel>, Arc<Timeline>)>,
}

impl PartialEq for ClusterCut {
    fn eq(&self, other: &Self) -> bool {
        let same = match (&self.merges, &other.merges) {
            (Some((_, timeline)), Some((_, other))) => Arc::ptr_eq(timeline, other),
            (None, None) => true,
            _ => false,
        };
        same && self.cut == other.cut
    }
}

impl ClusterCut {
    /// The node of the cut that holds each primitive; the root for a primitive that no leaf holds.
    pub fn of_primitives(&self, traced: &AnyTree, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
        let (tree, timeline) = match &self.merges {
            Some((accel, timeline)) => (&accel.tree, Some(&**timeline)),
            None => (traced, None),
        };
        let nodes = match self.cut.nodes(tree, timeline, token) {
            Ok(nodes) => nodes,
            Err(CutError::Cancelled(cancelled)) => return Err(cancelled),
            // Without its construction nothing is known of the step: each leaf is a cluster.
            Err(CutError::NeedsTimeline) => Vec::new(),
        };
        let mut is_cut = vec![false; tree.node_count()];
        for node in nodes {
            is_cut[node as usize] = true;
        }
        with_tree!(tree, tree => highest_of_primitives(tree, |node, _| is_cut[node as usize], token))
    }
}

/// The ancestor at `depth` of each primitive, or its leaf if that lies above; the root for a primitive that no leaf holds.
pub fn cluster_of_primitives<C: Container>(
    tree: &Tree<C>,
    depth: u32,
    token: &CancelToken,
) -> Result<Vec<u32>, Cancelled> {
    highest_of_primitives(tree, |_, own_depth| own_depth == depth, token)
}

/// The highest node above each primitive that `is_cluster` by its index and depth, or else its leaf.
fn highest_of_primitives<C: Container>(
    tree: &Tree<C>,
    is_cluster: impl Fn(u32, u32) -> bool,
    token: &CancelToken,
) -> Result<Vec<u32>, Cancelled> {
    let count = tree.primitive_indices.iter().max().map_or(0, |&last| last as usize + 1);
    let mut of_primitive = vec![0; count];
    // Parents come before their children, so one forward pass propagates depth and the cluster, once it is reached.
    let mut of_node = vec![(0_u32, None); tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate() {
        token.check_every(LIGHT_STEPS, index)?;
        let (depth, above) = of_node[index];
        let own = index as u32;
        let reached = above.or_else(|| is_cluster(own, depth).then_some(own));
        for &primitive in &tree.primitive_indices[node.slots()] {
            of_primitive[primitive as usize] = reached.unwrap_or(own);
        }
        for child in node.children() {
            of_node[child as usize] = (depth + 1, reached);
        }
    }
    Ok(of_primitive)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvhscope_engine::geometry::Aabb;
    use bvhscope_engine::tree::Node;

    /// A root with a leaf and an interior node, which has two leaves; primitives in no particular order.
    fn tree() -> Tree<Aabb> {
        let node = |first, count| Node { container: Aabb::EMPTY, first, count };
        Tree {
            nodes: vec![node(1, 0), node(0, 2), node(3, 0), node(2, 1), node(3, 1)],
            primitive_indices: vec![3, 0, 1, 2],
            max_depth: 2,
        }
    }

    #[test]
    fn each_primitive_gets_its_ancestor_at_the_depth_or_its_leaf_above() {
        let token = CancelToken::new();
        let at = |depth| cluster_of_primitives(&tree(), depth, &token).unwrap_or_default();
        assert_eq!(at(0), [0, 0, 0, 0]);
        assert_eq!(at(1), [1, 2, 2, 1]);
        assert_eq!(at(2), [1, 3, 4, 1]);
        assert_eq!(at(u32::MAX), at(2));
        token.cancel();
        assert_eq!(cluster_of_primitives(&tree(), 0, &token), Err(Cancelled));
    }

    #[test]
    fn each_primitive_gets_the_node_of_a_cut_that_holds_it() {
        let token = CancelToken::new();
        let tree = AnyTree::Aabb(tree());
        let of = |cut| ClusterCut { cut, merges: None }.of_primitives(&tree, &token).unwrap_or_default();
        assert_eq!(of(Cut::Primitives(4)), [0, 0, 0, 0]);
        assert_eq!(of(Cut::Primitives(2)), [1, 2, 2, 1]);
        assert_eq!(of(Cut::Primitives(1)), [1, 3, 4, 1], "a leaf that has more stays whole");
        token.cancel();
        let cut = ClusterCut { cut: Cut::Primitives(2), merges: None };
        assert_eq!(cut.of_primitives(&tree, &token), Err(Cancelled));
    }
}
