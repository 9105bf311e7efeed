//! Checks a tree against everything that the rest of the program takes for granted.

use super::AnyTree;
use crate::geometry::Triangle;

/// The first broken promise of `tree` over `triangles`, in words: each primitive in exactly one leaf, each container inside
/// its parent's and around its triangles, every node reached once, parents before children, finite numbers, the right depth.
pub fn validate(_tree: &AnyTree, _triangles: &[Triangle]) -> Result<(), String> {
    todo!("bvh")
}
