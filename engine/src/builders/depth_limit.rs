//! Limits the depth of agglomerative trees. Clustering nested containers degenerates into a list: the closest pair are
//! always the two smallest, with which the next larger one is merged.

use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::tree::{Container, Node, Tree};

/// Maximum depth of an agglomerative tree of `count` primitives, at least one: 2·log2(n) + 16.
pub fn depth_limit(count: usize) -> u32 {
    2 * count.ilog2() + 16
}

/// Balances the subtrees of `tree` that exceed the depth limit, as low as the limit allows. The leaves keep their
/// order, and all other nodes are unchanged, except that the spheres above are fitted again: those of the balanced ones
/// depend on the order of their unions. Pairs of nested containers cost the same in any order. Returns whether anything
/// changed.
pub fn limit_depth<C: Container>(tree: &mut Tree<C>, token: &CancelToken) -> Result<bool, Cancelled> {
    let limit = depth_limit(tree.primitive_indices.len().max(1));
    if tree.max_depth <= limit {
        return Ok(false);
    }
    let sizes = subtree_sizes(tree, token)?;
    let mut stack = vec![(0_u32, 0_u32)];
    let mut max_depth = 0;
    let mut refitted = vec![false; tree.nodes.len()];
    while let Some((index, depth)) = stack.pop() {
        let node = tree.nodes[index as usize];
        if node.is_leaf() || depth + sizes[index as usize].height <= limit {
            max_depth = max_depth.max(depth + sizes[index as usize].height);
            continue;
        }
        // Descend only if both children can keep within the limit, if need be balanced.
        let children = [node.first, node.first + 1];
        if children.iter().all(|&child| depth + 1 + balanced_height(sizes[child as usize].leaves) <= limit) {
            stack.extend(children.map(|child| (child, depth + 1)));
        } else {
            balance(tree, index, &sizes, token)?;
            refitted[index as usize] = tree.nodes[index as usize].container != node.container;
            max_depth = max_depth.max(depth + balanced_height(sizes[index as usize].leaves));
        }
    }
    tree.max_depth = max_depth;
    refit_above(tree, &mut refitted, token)?;
    Ok(true)
}

/// Fits the containers of all nodes above those that are `refitted`.
fn refit_above<C: Container>(tree: &mut Tree<C>, refitted: &mut [bool], token: &CancelToken) -> Result<(), Cancelled> {
    for index in (0..tree.nodes.len()).rev() {
        token.check_every(LIGHT_STEPS, index)?;
        let node = tree.nodes[index];
        let first = node.first as usize;
        if !node.is_leaf() && (refitted[first] || refitted[first + 1]) {
            let fitted = tree.nodes[first].container.union(&tree.nodes[first + 1].container);
            refitted[index] |= fitted != node.container;
            tree.nodes[index].container = fitted;
        }
    }
    Ok(())
}

/// Size of a subtree.
#[derive(Clone, Copy, Default, bytemuck::Zeroable)]
struct SubtreeSize {
    /// Number of leaves.
    leaves: u32,
    /// Number of levels below its root.
    height: u32,
}

/// The [`SubtreeSize`] of each node.
fn subtree_sizes<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<Vec<SubtreeSize>, Cancelled> {
    let mut sizes: Vec<SubtreeSize> = bytemuck::zeroed_vec(tree.nodes.len());
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        token.check_every(LIGHT_STEPS, index)?;
        sizes[index] = if node.is_leaf() {
            SubtreeSize { leaves: 1, height: 0 }
        } else {
            let [a, b] = [0, 1].map(|side| sizes[node.first as usize + side]);
            SubtreeSize { leaves: a.leaves + b.leaves, height: 1 + a.height.max(b.height) }
        };
    }
    Ok(sizes)
}

/// Height of a balanced tree of `leaves`.
fn balanced_height(leaves: u32) -> u32 {
    leaves.next_power_of_two().ilog2()
}

/// Replaces the tree below `root` by a balanced one over its leaves in the same order. The nodes are stored in the same
/// slots.
fn balance<C: Container>(
    tree: &mut Tree<C>,
    root: u32,
    sizes: &[SubtreeSize],
    token: &CancelToken,
) -> Result<(), Cancelled> {
    // The leaves from left to right, and the slots of all pairs.
    let count = sizes[root as usize].leaves as usize;
    let mut leaves = Vec::with_capacity(count);
    let mut pair_slots = Vec::with_capacity(count - 1);
    let mut stack = vec![root];
    while let Some(index) = stack.pop() {
        token.check_every(LIGHT_STEPS, leaves.len())?;
        let node = tree.nodes[index as usize];
        if node.is_leaf() {
            leaves.push(node);
        } else {
            pair_slots.push(node.first);
            stack.extend([node.first + 1, node.first]);
        }
    }
    pair_slots.sort_unstable();

    // Breadth first into ascending slots, so that parents precede their children.
    let mut ranges = vec![(root, 0..count)];
    for (at, &first) in pair_slots.iter().enumerate() {
        token.check_every(LIGHT_STEPS, at)?;
        let (node, range) = ranges[at].clone();
        let middle = range.start + range.len() / 2;
        tree.nodes[node as usize] = Node { container: C::EMPTY, first, count: 0 };
        for (child, half) in [(first, range.start..middle), (first + 1, middle..range.end)] {
            match half.len() {
                1 => tree.nodes[child as usize] = leaves[half.start],
                _ => ranges.push((child, half)),
            }
        }
    }
    for (node, _) in ranges.iter().rev() {
        let first = tree.nodes[*node as usize].first as usize;
        tree.nodes[*node as usize].container = tree.nodes[first].container.union(&tree.nodes[first + 1].container);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Aabb, Sphere, Triangle};
    use crate::tree::AnyTree;
    use crate::tree::validate::validate;
    use glam::Vec3;

    /// Nested triangles and a tree that degenerated into a list, the largest triangle first.
    fn degenerate_tree(count: usize) -> (Tree<Aabb>, Vec<Triangle>) {
        let triangle = |at: usize| {
            let size = (count - at) as f32;
            Triangle { a: Vec3::splat(-size), b: Vec3::splat(size), c: Vec3::new(size, -size, 0.0) }
        };
        let triangles: Vec<Triangle> = (0..count).map(triangle).collect();
        let leaf = |at: usize| Node { container: triangles[at].bounds(), first: at as u32, count: 1 };
        let mut nodes = vec![Node { container: triangles[0].bounds(), first: 1, count: 0 }];
        for at in 0..count - 1 {
            let rest = Node { container: triangles[at + 1].bounds(), first: 2 * at as u32 + 3, count: 0 };
            nodes.extend([leaf(at), if at + 2 == count { leaf(at + 1) } else { rest }]);
        }
        (Tree { nodes, primitive_indices: (0..count as u32).collect(), max_depth: count as u32 - 1 }, triangles)
    }

    #[test]
    fn a_list_becomes_a_tree_with_its_leaves_in_order() {
        for count in [40, 41, 1000, 5000] {
            let (mut tree, triangles) = degenerate_tree(count);
            assert_eq!(limit_depth(&mut tree, &CancelToken::new()), Ok(true));
            assert!(tree.max_depth <= depth_limit(count), "{} of {count}", tree.max_depth);
            let depths = tree.depths(&CancelToken::new()).unwrap_or_default();
            assert_eq!(depths.into_iter().max(), Some(tree.max_depth));
            assert!(tree.primitive_indices.iter().copied().eq(0..count as u32));
            // The top is unchanged.
            assert!(tree.nodes[1].is_leaf() && tree.nodes[1].first == 0);
            assert_eq!(validate(&AnyTree::Aabb(tree), &triangles), Ok(()));
        }
    }

    /// Containers whose unions depend on their order are fitted above the balanced subtree, too.
    #[test]
    fn a_balanced_tree_of_spheres_holds_its_children() {
        let (boxes, mut triangles) = degenerate_tree(3000);
        for (at, triangle) in triangles.iter_mut().enumerate() {
            // Each in a direction of its own, so that no sphere lies in the next.
            let askew = Vec3::new((at as f32).sin(), (at as f32 * 1.7).cos(), (at as f32 * 2.3).sin()) * 30.0;
            *triangle = Triangle { a: triangle.a + askew, b: triangle.b + askew, c: triangle.c - askew };
        }
        let mut nodes: Vec<Node<Sphere>> = boxes
            .nodes
            .iter()
            .map(|node| Node { container: Sphere::EMPTY, first: node.first, count: node.count })
            .collect();
        for index in (0..nodes.len()).rev() {
            let first = nodes[index].first as usize;
            nodes[index].container = if nodes[index].is_leaf() {
                Sphere::of_triangle(&triangles[first])
            } else {
                nodes[first].container.union(&nodes[first + 1].container)
            };
        }
        let mut tree = Tree { nodes, primitive_indices: boxes.primitive_indices, max_depth: boxes.max_depth };
        assert_eq!(validate(&AnyTree::Sphere(tree.clone()), &triangles), Ok(()));
        assert_eq!(limit_depth(&mut tree, &CancelToken::new()), Ok(true));
        assert_eq!(validate(&AnyTree::Sphere(tree), &triangles), Ok(()));
    }

    #[test]
    fn a_tree_within_the_limit_stays_as_it_is() {
        let (tree, _) = degenerate_tree(20);
        let mut limited = tree.clone();
        assert_eq!(limit_depth(&mut limited, &CancelToken::new()), Ok(false));
        assert_eq!(limited, tree);
    }

    #[test]
    fn it_stops_when_cancelled() {
        let token = CancelToken::new();
        token.cancel();
        assert_eq!(limit_depth(&mut degenerate_tree(100).0, &token), Err(Cancelled));
    }
}
