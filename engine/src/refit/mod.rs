//! Trees over triangles that move: the containers are fitted to where the triangles are now, and the tree is kept, or changed where it has
//! become poor.
//!
//! The list of triangles keeps its length and order. Each way gives a valid tree over the moved triangles, so rays hit the very same
//! as in a rebuilt tree; only the number of tests and the time differ:
//!
//! | function | what it does | time |
//! |---|---|---|
//! | [`grow`] | each container also encloses where its triangles were: one tree for a whole clip | once for each moment of the clip |
//! | [`refit()`] | fits all containers (Wald, Boulos, Shirley, *Ray Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies*, 2007) | a tenth of a build |
//! | [`refit_and_rotate`] | and exchanges children for grandchildren where areas fall (Kopta et al., *Fast, Effective BVH Updates for Animated Scenes*, 2012) | twice as long, and writing nodes in order |
//! | [`refit_and_reinsert`] | and moves the most inefficient subtrees to where they cost less (Bittner, Hapala, Havran, *Fast Insertion-Based Optimization of Bounding Volume Hierarchies*, 2013) | by their number |
//! | [`partial_rebuild`] | and builds those subtrees again whose cost has grown | by their size |
//! | [`build_for_poses`] | makes one tree for a whole clip, which is then fitted (Bittner, Meister, *T-SAH: Animation Optimized Bounding Volume Hierarchies*, 2015) | seconds, once |
//!
//! Oriented boxes are chosen again, around triangles that have moved, by all ways but [`grow`], which leaves plain ones.
//!
//! [`WideRefit`] does the same as [`refit()`] for the wide tree. The other ways change the tree, so that the wide one is made again.
//!
//! ```
//! use bvhscope_engine::builders::build_binary;
//! use bvhscope_engine::glam::Vec3;
//! use bvhscope_engine::{AnyTree, BuildSettings, CancelToken, Triangle, refit};
//!
//! let at = |x: f32| Triangle { a: Vec3::X * x, b: Vec3::X * x + Vec3::Y, c: Vec3::X * x + Vec3::Z };
//! let token = CancelToken::new();
//! let (mut tree, _) = build_binary(&[at(0.0), at(1.0)], &BuildSettings::default(), &token)?;
//! refit::refit(&mut tree, &[at(0.0), at(5.0)], &token)?;
//! let AnyTree::Aabb(tree) = tree else { panic!("the default containers are boxes") };
//! assert_eq!(tree.nodes[0].container.max, Vec3::new(5.0, 1.0, 1.0));
//! # Ok::<(), bvhscope_engine::BuildError>(())
//! ```

mod bottom_up;
mod on_boxes;
mod partial;
mod rotate;
mod whole_clip;
mod wide;

pub use partial::{BuiltCosts, GrownParts, partial_rebuild};
pub use whole_clip::build_for_poses;
pub use wide::WideRefit;

use bottom_up::{ToChildren, fit};
use on_boxes::on_boxes;
use rotate::rotate;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Container as _, Triangle};
use crate::optimize::{reinsert_worst, write_in_order};
use crate::tree::{AnyTree, Tree, with_built_tree};

/// Fits all containers of a tree of any arity to its triangles, in the calling thread's rayon pool. `triangles` is the list that the tree
/// was built from, wherever they are now. The same for any number of threads.
///
/// Triangles of which a builder put parts into several leaves are in each of them as a whole afterwards.
///
/// # Panics
///
/// Where the list is shorter than the one that the tree was built from.
pub fn refit(tree: &mut AnyTree, triangles: &[Triangle], token: &CancelToken) -> Result<(), Cancelled> {
    with_built_tree!(tree, tree => fit(tree, triangles, |_, fitted| fitted, &ToChildren, token), tree => {
        on_boxes(tree, triangles, token, |tree| refit(tree, triangles, token))
    })
}

/// [`refit()`], except that containers keep what they enclosed before: after each moment of a clip, the tree is valid for all of them.
pub fn grow(tree: &mut AnyTree, triangles: &[Triangle], token: &CancelToken) -> Result<(), Cancelled> {
    with_built_tree!(
        tree,
        tree => fit(tree, triangles, |node, fitted| node.container.union(&fitted), &ToChildren, token),
        tree => {
            let mut boxes = tree.to_plain(token)?;
            fit(&mut boxes, triangles, |node, fitted| node.container.union(&fitted), &ToChildren, token)?;
            *tree = Tree::from_plain(&boxes, token)?;
            Ok(())
        }
    )
}

/// [`refit()`] of a binary tree with at most one rotation of each node, once everything below it is done: a child changes places with a
/// child of its sibling, or two grandchildren change places, whichever reduces the summed area most. Returns the number of rotations.
///
/// # Panics
///
/// As [`refit()`], and where a node has another number of children than two.
pub fn refit_and_rotate(tree: &mut AnyTree, triangles: &[Triangle], token: &CancelToken) -> Result<usize, Cancelled> {
    with_built_tree!(tree, tree => rotate(tree, triangles, token), tree => {
        on_boxes(tree, triangles, token, |tree| refit_and_rotate(tree, triangles, token))
    })
}

/// [`refit()`] of a binary tree of boxes, plain or oriented, after which up to `max_moves` of the subtrees with the most inefficient
/// parents move to their best positions. A tree of other containers is only fitted. Returns the reduction of the summed half areas of all
/// interior nodes.
///
/// # Panics
///
/// As [`refit()`], and where a node has another number of children than two.
pub fn refit_and_reinsert(
    tree: &mut AnyTree,
    triangles: &[Triangle],
    max_moves: usize,
    token: &CancelToken,
) -> Result<f64, Cancelled> {
    if let AnyTree::Oriented(tree) = tree {
        return on_boxes(tree, triangles, token, |tree| refit_and_reinsert(tree, triangles, max_moves, token));
    }
    refit(tree, triangles, token)?;
    let AnyTree::Aabb(tree) = tree else { return Ok(0.0) };
    let gain = reinsert_worst(&mut tree.nodes, max_moves, token)?;
    if gain > 0.0 {
        write_in_order(tree, token)?;
    }
    Ok(gain)
}
