//! One round of merging: references of the same triangle, which was split before the build or in it, become one where that is cheaper.

use crate::cancel::{CancelToken, Cancelled};
use crate::optimize::anneal::free_tree::{FreeTree, leaf_cost};
use crate::optimize::move_search::{LinkedNodes, NONE};
use crate::order::radix_sort;

/// Number of pairs that are tried for each triangle, those first whose common box grows least.
const MAX_PAIRS: usize = 8;
/// Poll for cancellation every 1024 triangles.
const TRIANGLES_BETWEEN_CHECKS: usize = 1024;

/// For each triangle in several leaves of its own these leaves.
pub struct References(Vec<Vec<u32>>);

impl References {
    /// Those in `tree`, the leaves of which hold `primitive_indices`, of primitives each of which is a part of its `source`.
    pub fn new(
        tree: &FreeTree,
        primitive_indices: &[u32],
        source: impl Fn(u32) -> u32,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let mut leaves: Vec<u64> = Vec::new();
        for (index, node) in (0..).zip(&tree.nodes) {
            if index % (1 << 16) == 0 {
                token.check()?;
            }
            if node.count == 1 && tree.is_leaf(index) {
                let triangle = source(primitive_indices[node.children[1] as usize]);
                leaves.push(u64::from(triangle) << 32 | u64::from(index));
            }
        }
        radix_sort(&mut leaves, u64::BITS, token)?;
        let mut lists = Vec::new();
        for (at, list) in leaves.chunk_by(|a, b| a >> 32 == b >> 32).enumerate() {
            token.check_every(TRIANGLES_BETWEEN_CHECKS, at)?;
            if list.len() > 1 {
                lists.push(list.iter().map(|&key| key as u32).collect());
            }
        }
        Ok(Self(lists))
    }
}

/// Merges references where that lowers the cost of `tree`: one leaf grows around both, the other is removed.
pub fn merging_round(tree: &mut FreeTree, references: &mut References, token: &CancelToken) -> Result<(), Cancelled> {
    for (at, leaves) in references.0.iter_mut().enumerate() {
        token.check_every(TRIANGLES_BETWEEN_CHECKS, at)?;
        while let Some(merged) = closest_pairs(tree, leaves).into_iter().find(|pair| merge(tree, *pair)) {
            leaves.retain(|&leaf| leaf != merged[1]);
        }
    }
    references.0.retain(|leaves| leaves.len() > 1);
    Ok(())
}

/// The pairs of `leaves` with the smallest difference between the area of their common box and the sum of theirs, in both orders.
fn closest_pairs(tree: &FreeTree, leaves: &[u32]) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    for &kept in leaves {
        for &removed in leaves.iter().filter(|&&removed| removed != kept) {
            let [a, b] = [kept, removed].map(|leaf| tree.bounds(leaf));
            pairs.push((a.union(&b).half_area() - a.half_area() - b.half_area(), [kept, removed]));
        }
    }
    pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    pairs.into_iter().take(MAX_PAIRS).map(|(_, pair)| pair).collect()
}

/// Grows the leaf `kept` around `removed` and takes that out, unless the cost of the tree does not fall. Returns whether it did.
fn merge(tree: &mut FreeTree, [kept, removed]: [u32; 2]) -> bool {
    if !tree.is_movable(removed) {
        return false;
    }
    let before = tree.cost();
    let old_leaf = tree.nodes[kept as usize];
    let old = tree.detach(removed);
    let grown = old_leaf.bounds.union(&tree.bounds(removed));
    let leaf = &mut tree.nodes[kept as usize];
    (leaf.bounds, leaf.cost) = (grown, leaf_cost(&grown, 1));
    tree.refit_up(old.above, NONE);
    tree.refit_up(tree.parent(kept), NONE);
    if tree.cost() < before {
        for gone in [removed, old.parent] {
            tree.nodes[gone as usize].count = 0;
        }
        return true;
    }
    let leaf = &mut tree.nodes[kept as usize];
    (leaf.bounds, leaf.cost) = (old_leaf.bounds, old_leaf.cost);
    tree.attach(&old, old.sibling);
    tree.refit_up(old.parent, NONE);
    tree.refit_up(tree.parent(kept), NONE);
    false
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::Aabb;
    use crate::tree::{Node, Tree};

    /// A tree of four leaves, with the primitives 0 and 1 in one half and 2 and 3 in the other.
    fn tree(boxes: [Aabb; 4]) -> Tree<Aabb> {
        let leaf = |at: u32| Node { container: boxes[at as usize], first: at, count: 1 };
        let half = |first: u32, at: usize| Node { container: boxes[at].union(&boxes[at + 1]), first, count: 0 };
        let (left, right) = (half(3, 0), half(5, 2));
        let root = Node { container: left.container.union(&right.container), first: 1, count: 0 };
        let nodes = vec![root, left, right, leaf(0), leaf(1), leaf(2), leaf(3)];
        Tree { nodes, primitive_indices: vec![0, 1, 2, 3], max_depth: 2 }
    }

    fn cube(x: f32) -> Aabb {
        Aabb { min: Vec3::new(x, 0.0, 0.0), max: Vec3::new(x + 1.0, 1.0, 1.0) }
    }

    /// Primitives 1 and 2 are parts of the triangle 1.
    #[test]
    fn parts_are_merged_where_that_is_cheaper() -> Result<(), Cancelled> {
        let token = CancelToken::new();
        let merged = |boxes: [Aabb; 4]| {
            let tree = tree(boxes);
            let mut free = FreeTree::new(&tree, false, &token)?;
            let before = free.cost();
            let mut references =
                References::new(&free, &tree.primitive_indices, |index| [0, 1, 1, 2][index as usize], &token)?;
            assert_eq!(references.0, [vec![4, 5]]);
            merging_round(&mut free, &mut references, &token)?;
            let after = free.to_tree(&tree.primitive_indices, &token)?;
            assert_eq!(free.cost() < before, after.nodes.len() < tree.nodes.len());
            assert_eq!(references.0.is_empty(), after.nodes.len() < tree.nodes.len());
            Ok(after)
        };
        // Both parts are alike: one leaf does.
        let near = merged([cube(0.0), cube(1.0), cube(1.0), cube(2.0)])?;
        assert_eq!(near.nodes.len(), 5);
        assert!(near.nodes.iter().any(|node| node.count == 1 && node.container == cube(1.0)));
        // Apart, a box around both would be as large as the scene.
        let far = merged([cube(0.0), cube(1.0), cube(101.0), cube(102.0)])?;
        assert_eq!(far.nodes.len(), 7);
        Ok(())
    }
}
