//! The wide tree: up to eight children per node and four triangles per block, tested side by side with SIMD. Collapsed
//! from a binary tree, with exactly the same hits.
//!
//! Knows only geometry, cancellation, kernels and the binary tree: neither builders nor settings. Start at [`tree`] for
//! the layout, at [`collapse()`] for how it is made, and at [`trace`] for traversal.

pub mod layout;

pub(crate) mod fused_box;
pub(crate) mod ray_lanes;

pub mod block;
pub mod bounds;
pub mod box_bounds;
pub mod box_lanes;
pub mod child;
pub mod compact;
pub mod dop_bounds;
pub mod leaves;
mod needles;
pub mod oriented_bounds;
pub mod sphere_bounds;
pub mod tree;

mod collapse;
mod to_tree;
pub mod trace;

pub use block::TriangleBlock;
pub use bounds::{CompactBounds, WideContainer};
pub use child::Child;
pub(crate) use child::LeafRange;
pub(crate) use collapse::Sources;
pub use collapse::collapse;
pub use leaves::Leaves;
pub use tree::{AnyWideTree, NodeForm, NodeRef, WideNode, WideTree};
