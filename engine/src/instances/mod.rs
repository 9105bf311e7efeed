//! Two levels: copies of meshes, each with a tree of its own, below a tree over the copies.
//!
//! [`MeshCopies`] are the lower level, and find hits below any tree over the copies' boxes; [`Instances`] have such a tree.
//! [`BinaryLevels`] count and observe rays through the binary trees of both, and [`Unfolded`] makes one tree of them, to be looked at.

mod copies;
mod costs;
mod counted;
mod hit;
mod two_levels;
mod unfolded;

pub use copies::{Copies, MeshCopies, Placed};
pub use costs::{CopyCost, CopyCosts};
pub use counted::BinaryLevels;
pub use hit::InstanceHit;
pub use two_levels::Instances;
pub use unfolded::{LevelNode, Unfolded, UnfoldedCopy};
