//! Bounding volume hierarchies over triangles: built by approximate agglomerative clustering and by others to compare with,
//! made better, measured, checked and traced. Knows no file, scene, camera, pixel or window.

pub mod geometry;

pub mod cancel;

pub mod kernel;

pub mod tree;

pub mod settings;
pub mod stage_times;

mod order;

mod aac;

mod optimize;

pub mod builders;

pub mod wide;

mod bvh;

pub use aac::build_cache;
pub use builders::BuildError;
pub use bvh::{BinaryBvh, BuildReport, Bvh, WideBvh, build};
pub use cancel::{CancelToken, Cancelled};
pub use geometry::{Aabb, Hit, Ray, Sphere, Triangle};
pub use glam;
pub use kernel::SimdLevel;
pub use settings::{BuildSettings, BuilderKind, Curve, Pass, Passes, Preset};
pub use tree::statistics::TreeStats;
pub use tree::traverse::{TestCounts, Traversal};
pub use tree::{AnyTree, ContainerKind};
