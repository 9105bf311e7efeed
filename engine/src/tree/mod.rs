//! The binary tree: containers and nodes, levels and ancestry, validation, statistics, end-point overlap, and the traversal that
//! counts tests. Knows no builder and no wide tree.

pub mod container;
pub mod node;

pub mod ancestry;
pub mod levels;
pub mod validate;

pub mod statistics;

pub mod overlap;

pub mod traverse;

pub use container::{Container, ContainerKind};
pub use node::{AnyTree, Node, Tree};
