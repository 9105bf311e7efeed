//! Updates of trees of oriented boxes, by way of their plain ones.

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{OrientedBox, Triangle};
use crate::optimize::orient;
use crate::tree::{AnyTree, Tree};

/// Does `work` with the plain boxes of `tree`, then chooses oriented ones again.
pub(super) fn on_boxes<R, E: From<Cancelled>>(
    tree: &mut Tree<OrientedBox>,
    triangles: &[Triangle],
    token: &CancelToken,
    work: impl FnOnce(&mut AnyTree) -> Result<R, E>,
) -> Result<R, E> {
    let mut boxes = AnyTree::Aabb(tree.to_plain(token)?);
    let result = work(&mut boxes)?;
    if let AnyTree::Oriented(oriented) = orient(&boxes, triangles, token)? {
        *tree = oriented;
    }
    Ok(result)
}
