//! The tree: containers and nodes, levels and ancestry, validation, statistics, metrics of single nodes, end-point overlap, the
//! traversal that counts tests or records them, visits of nodes by many rays, and the nodes that two trees have in common. All
//! of it takes trees of any arity; builders make binary ones. Knows no builder and no wide tree.

pub mod node;

pub mod ancestry;
pub mod binarize;
pub mod levels;
pub mod validate;

pub mod statistics;

pub mod largest;
pub mod node_metrics;

pub mod overlap;

pub mod traverse;

pub mod random_lines;
pub mod visits;

pub mod survival;

pub use crate::geometry::{Container, ContainerKind};
pub(crate) use node::with_built_tree;
pub use node::{AnyTree, Node, Tree};
