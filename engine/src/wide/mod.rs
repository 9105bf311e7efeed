//! The tree that rays are traced through: up to eight children a node and four triangles a block, tested side by side. Made
//! from the binary tree, whose hits it gives exactly.

pub mod layout;

pub(crate) mod ray_lanes;

pub mod block;
pub mod bounds;
pub mod tree;

mod collapse;
pub mod trace;

pub use block::TriangleBlock;
pub use bounds::WideContainer;
pub use collapse::collapse;
pub use tree::{AnyWideTree, Child, WideNode, WideTree};
