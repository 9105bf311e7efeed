//! Bounding volume hierarchies over triangles: containers, the agglomerative builder and those to compare with, statistics,
//! validation and traversal. Knows no files, scenes, cameras or pixels.

mod aac;
mod bits;
pub mod builders;
mod cluster;
mod combine;
pub mod container;
mod curve;
pub mod depth_limit;
mod flatten;
mod fragments;
mod leaf_order;
pub mod leavings;
pub mod levels;
pub mod lineage;
pub(crate) mod lists;
mod long_list;
mod morton;
mod morton_order;
pub mod node;
mod optimize;
pub mod overlap;
mod radix_sort;
mod reduction;
pub mod settings;
mod short_list;
pub mod simd;
mod stage_times;
pub mod stats;
mod subtree;
pub mod traverse;
mod triangle_spheres;
pub mod validate;
pub mod wide;

pub use container::{Container, ContainerKind};
pub use node::{AnyTree, Node, Tree};
pub use settings::{BuildSettings, BuilderKind, Curve, Pass, Passes, Preset};
pub use simd::SimdLevel;
