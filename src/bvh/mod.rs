//! Bounding volume hierarchies over triangles: containers, the agglomerative builder and those to compare with, statistics,
//! validation and traversal. Knows no files, scenes, cameras or pixels.

mod aac;
pub mod builders;
mod cluster;
pub mod container;
pub mod details;
mod flatten;
pub mod lineage;
mod morton;
pub mod node;
pub mod overlap;
mod radix_sort;
pub mod settings;
pub mod simd;
pub mod stats;
pub mod traverse;
pub mod validate;
pub mod wide;

pub use container::{Container, ContainerKind};
pub use node::{AnyTree, Node, Tree};
pub use settings::{BuildSettings, BuilderKind, Preset};
pub use simd::SimdLevel;
