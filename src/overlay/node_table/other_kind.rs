//! Containers of the kind that a tree is not made of.

use crate::accel::Accel;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::kernel::par_collect;
use bvhscope_engine::tree::{Container, Node, Tree};

/// Poll for cancellation every 16,384 nodes.
const NODES_PER_CHECK: usize = 1 << 14;

/// Containers of kind `C` for all nodes of a tree of another kind: leaves from their triangles, interior nodes bottom-up.
pub(super) fn containers<K: Container, C: Container>(
    tree: &Tree<K>,
    triangles: &[Triangle],
    token: &CancelToken,
) -> Result<Vec<C>, Cancelled> {
    let of_leaf = |node: &Node<K>| {
        let own = &tree.primitive_indices[node.slots()];
        own.iter().fold(C::EMPTY, |all, &index| all.union(&C::of_triangle(&triangles[index as usize])))
    };
    let mut all = par_collect(tree.nodes.len(), token, |at| of_leaf(&tree.nodes[at]))?;
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        if index.is_multiple_of(NODES_PER_CHECK) {
            token.check()?;
        }
        all[index] = node.children().fold(all[index], |around, child| around.union(&all[child as usize]));
    }
    Ok(all)
}

/// [`containers`] without a way to cancel.
pub(super) fn containers_at_once<K: Container, C: Container>(tree: &Tree<K>, accel: &Accel) -> Vec<C> {
    containers(tree, &accel.scene.triangles, &CancelToken::new()).unwrap_or_else(|_| unreachable!("nobody cancels"))
}
