//! Trees of other libraries as trees of this crate.

use bvhscope_engine::geometry::Aabb;
use bvhscope_engine::tree::{Node, Tree};

/// The children or primitives of a node of another library.
pub enum Below<'a, K> {
    /// The primitives of a leaf.
    Primitives(&'a [u32]),
    /// The children of an interior node, 1 to 32.
    Children(Vec<K>),
}

/// The tree below `root`, whose nodes `read` returns: siblings are neighbours behind their parent, and the
/// primitives below any node are contiguous.
pub fn tree_below<'a, K>(root: K, read: impl Fn(&K) -> (Aabb, Below<'a, K>)) -> Tree<Aabb> {
    let unknown = Node { container: Aabb::EMPTY, first: 0, count: 0 };
    let mut tree = Tree { nodes: vec![unknown], primitive_indices: Vec::new(), max_depth: 0 };
    let mut stack = vec![(root, 0, 0)];
    while let Some((key, number, depth)) = stack.pop() {
        tree.max_depth = tree.max_depth.max(depth);
        let (container, below) = read(&key);
        tree.nodes[number] = match below {
            Below::Primitives(primitives) => {
                let first = tree.primitive_indices.len() as u32;
                tree.primitive_indices.extend_from_slice(primitives);
                Node { container, first, count: primitives.len() as u32 }
            }
            Below::Children(children) => {
                let first = tree.nodes.len();
                let arity = children.len();
                tree.nodes.resize(first + arity, unknown);
                // The leftmost child, whose primitives come first, is taken from the stack next.
                let numbered = children.into_iter().enumerate().rev();
                stack.extend(numbered.map(|(slot, child)| (child, first + slot, depth + 1)));
                Node::interior(container, first as u32, arity as u32)
            }
        };
    }
    tree
}
