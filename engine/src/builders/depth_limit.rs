//! Keeps a tree from becoming a list. Agglomerative clustering does that to containers within one another: the closest two
//! are always the two smallest, and so the next larger one takes them in, one after the other.

use crate::cancel::{CancelToken, Cancelled};
use crate::tree::{Container, Node, Tree};

/// Nodes between two looks at the token.
const NODES_BETWEEN_CHECKS: usize = 1 << 16;

/// Depth that an agglomerative tree of `count` primitives, of which there is one at least, may have: 2·log2(n) + 16.
pub fn depth_limit(count: usize) -> u32 {
    2 * count.ilog2() + 16
}

/// Halves what lies too deep in `tree`, as low down as the limit allows: the leaves stay in their order, and all other nodes
/// stay as they are. Containers within one another cost the same however they are paired. Says whether anything did.
pub fn limit_depth<C: Container>(tree: &mut Tree<C>, token: &CancelToken) -> Result<bool, Cancelled> {
    let limit = depth_limit(tree.primitive_indices.len().max(1));
    if tree.max_depth <= limit {
        return Ok(false);
    }
    let below = measure(tree, token)?;
    let mut open = vec![(0_u32, 0_u32)];
    let mut max_depth = 0;
    while let Some((index, depth)) = open.pop() {
        let node = tree.nodes[index as usize];
        if node.is_leaf() || depth + below[index as usize].height <= limit {
            max_depth = max_depth.max(depth + below[index as usize].height);
            continue;
        }
        // Each of the children must be able to keep within the limit, if need be as halves.
        let children = [node.first, node.first + 1];
        if children.iter().all(|&child| depth + 1 + halvings(below[child as usize].leaves) <= limit) {
            open.extend(children.map(|child| (child, depth + 1)));
        } else {
            halve(tree, index, &below, token)?;
            max_depth = max_depth.max(depth + halvings(below[index as usize].leaves));
        }
    }
    tree.max_depth = max_depth;
    Ok(true)
}

/// What lies below a node.
#[derive(Clone, Copy, Default, bytemuck::Zeroable)]
struct Below {
    /// Leaves.
    leaves: u32,
    /// Levels.
    height: u32,
}

/// [`Below`] for each node.
fn measure<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<Vec<Below>, Cancelled> {
    let mut below: Vec<Below> = bytemuck::zeroed_vec(tree.nodes.len());
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        if index % NODES_BETWEEN_CHECKS == 0 {
            token.check()?;
        }
        below[index] = if node.is_leaf() {
            Below { leaves: 1, height: 0 }
        } else {
            let [a, b] = [0, 1].map(|side| below[node.first as usize + side]);
            Below { leaves: a.leaves + b.leaves, height: 1 + a.height.max(b.height) }
        };
    }
    Ok(below)
}

/// Levels below the root of a tree of so many leaves whose lists are halved.
fn halvings(leaves: u32) -> u32 {
    leaves.next_power_of_two().ilog2()
}

/// Gives the node `root` a tree of halves of its leaves, in their order, in the places of those that it has.
fn halve<C: Container>(tree: &mut Tree<C>, root: u32, below: &[Below], token: &CancelToken) -> Result<(), Cancelled> {
    // All leaves from left to right, and the places of all pairs.
    let count = below[root as usize].leaves as usize;
    let mut leaves = Vec::with_capacity(count);
    let mut places = Vec::with_capacity(count - 1);
    let mut open = vec![root];
    while let Some(index) = open.pop() {
        if leaves.len() % NODES_BETWEEN_CHECKS == 0 {
            token.check()?;
        }
        let node = tree.nodes[index as usize];
        if node.is_leaf() {
            leaves.push(node);
        } else {
            places.push(node.first);
            open.extend([node.first + 1, node.first]);
        }
    }
    places.sort_unstable();

    // Breadth first into rising places, so that children come after their parents.
    let mut halves = vec![(root, 0..count)];
    for (at, &first) in places.iter().enumerate() {
        if at % NODES_BETWEEN_CHECKS == 0 {
            token.check()?;
        }
        let (node, range) = halves[at].clone();
        let middle = range.start + range.len() / 2;
        tree.nodes[node as usize] = Node { container: C::EMPTY, first, count: 0 };
        for (child, half) in [(first, range.start..middle), (first + 1, middle..range.end)] {
            match half.len() {
                1 => tree.nodes[child as usize] = leaves[half.start],
                _ => halves.push((child, half)),
            }
        }
    }
    for (node, _) in halves.iter().rev() {
        let first = tree.nodes[*node as usize].first as usize;
        tree.nodes[*node as usize].container = tree.nodes[first].container.union(&tree.nodes[first + 1].container);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Aabb, Triangle};
    use crate::tree::AnyTree;
    use crate::tree::validate::validate;
    use glam::Vec3;

    /// Triangles around one another and a chain of them, the largest at the top.
    fn chain(count: usize) -> (Tree<Aabb>, Vec<Triangle>) {
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
            let (mut tree, triangles) = chain(count);
            assert_eq!(limit_depth(&mut tree, &CancelToken::new()), Ok(true));
            assert!(tree.max_depth <= depth_limit(count), "{} of {count}", tree.max_depth);
            let depths = tree.depths(&CancelToken::new()).unwrap_or_default();
            assert_eq!(depths.into_iter().max(), Some(tree.max_depth));
            assert!(tree.primitive_indices.iter().copied().eq(0..count as u32));
            // The top keeps the shape that it had.
            assert!(tree.nodes[1].is_leaf() && tree.nodes[1].first == 0);
            assert_eq!(validate(&AnyTree::Aabb(tree), &triangles), Ok(()));
        }
    }

    #[test]
    fn a_tree_within_the_limit_stays_as_it_is() {
        let (tree, _) = chain(20);
        let mut limited = tree.clone();
        assert_eq!(limit_depth(&mut limited, &CancelToken::new()), Ok(false));
        assert_eq!(limited, tree);
    }

    #[test]
    fn it_stops_when_cancelled() {
        let token = CancelToken::new();
        token.cancel();
        assert_eq!(limit_depth(&mut chain(100).0, &token), Err(Cancelled));
    }
}
