//! The binary tree and everything that is asked of one: its containers and nodes, levels and ancestry, checks, statistics and
//! overlap, and the traversal that counts tests. Knows no builder.

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
