//! Bounding volume hierarchies over triangles, built by approximate agglomerative clustering: fast to build, fast to trace, and
//! open to inspection.
//!
//! ```
//! use bvhscope_engine::glam::Vec3;
//! use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle, build};
//!
//! // A floor of two triangles.
//! let [a, b, c, d] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| Vec3::new(x, 0.0, z));
//! let triangles = [Triangle { a, b, c }, Triangle { a, b: c, c: d }];
//!
//! let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
//!
//! let hit = bvh.closest_hit(&Ray::new(Vec3::new(0.5, 2.0, 0.2), Vec3::NEG_Y)).expect("the floor is below");
//! assert_eq!((hit.primitive_index, hit.t), (0, 2.0));
//! # Ok::<(), bvhscope_engine::BuildError>(())
//! ```
//!
//! Start with [`build`] and [`Bvh`]: everything that most programs need is re-exported here. The modules are for those who look
//! inside a tree, compare builders or choose a SIMD level.
//!
//! # Map
//!
//! Modules in reading order; each imports only what is above it.
//!
//! | module | what it does | what it must not know | start at |
//! |---|---|---|---|
//! | [`geometry`] | boxes, spheres, polytopes, oriented boxes, triangles, rays and their intersection | trees | [`Triangle`], [`Ray`] |
//! | [`task_log`] | what each piece of a computation took and waited for | what is computed | [`task_log::TaskLog`] |
//! | [`cancel`] | cancellation and progress | what is cancelled | [`CancelToken`] |
//! | [`kernel`] | SIMD levels, forks, parallel collect, prefetch, bit sets | trees, rays | [`SimdLevel`] |
//! | [`tree`] | the tree, of any arity: nodes, ancestry, validation, statistics, metrics and visits of nodes, traversal | builders, the wide tree | [`tree::Tree`] |
//! | [`settings`] | builder, container, parameters, passes, presets | how they are carried out | [`BuildSettings`] |
//! | [`stage_times`] | duration of each stage of a build | | [`stage_times::StageTimes`] |
//! | `order` | Morton and Hilbert codes, radix sort, sorted primitives | clusters, trees | |
//! | `aac` | approximate agglomerative clustering, by the figures of the paper | other builders | |
//! | [`build_cache`] | what a build reuses of the one before | | [`build_cache::BuildCache`] |
//! | `optimize` | passes over a finished tree: collapse, restructure, reinsert, anneal, orient | which builder made it | [`fn@orient`] |
//! | [`builders`] | one entry for every builder; LBVH, PLOC, H-PLOC, binned and sweep SAH, SBVH, exact clustering; triangle splitting | rays | [`builders::build_binary`] |
//! | [`construction`] | a build as the record of its merges: standing clusters, cuts, why each pair was merged | rays | [`construction::Construction`] |
//! | [`query`] | all hits of a ray, the nearest point of a mesh, inside or outside | builders, the wide tree | [`query::closest_point`] |
//! | [`wide`] | the tree with eight children per node: collapse and SIMD traversal | builders | [`wide::AnyWideTree`] |
//! | [`layouts`] | wide trees of any layout, described: children, collapse, planes and leaves, with one walker that counts | builders | [`layouts::LaidTree`] |
//! | [`mod@refit`] | trees over triangles that move: containers fitted, subtrees rotated, moved or built again | pictures, frames | [`refit::refit`], [`refit::WideRefit`] |
//! | [`fingerprint`] | one number for a tree, to compare machines and versions by | builders | [`fingerprint::of_tree`] |
//! | `tree_file` | trees of any builder as files, with the feature `tree-file` | builders, rays | `tree_file::TreeFile` |
//! | `bvh` | both trees and the report of the build as one value, over triangles or items of the caller's own | | [`build`], [`Bvh`], [`ItemBvh`] |
//! | `instances` | copies of meshes in two levels | builders | [`Instances`] |
//! | [`follow`] | both trees behind one policy, which keep up with triangles that move from frame to frame | clips, seconds | [`follow::Follower`], [`follow::Policy`] |
//!
//! None of them depends on files, scenes, materials, cameras or pixels, and none starts a thread: builds run in the rayon pool of the
//! calling thread, rays on the calling thread.

pub mod geometry;

pub mod task_log;

pub mod cancel;

pub mod kernel;

pub mod tree;

pub mod settings;
pub mod stage_times;

mod order;

mod aac;

mod optimize;

pub mod builders;

pub mod construction;

pub mod query;

pub mod wide;

pub mod layouts;

pub mod refit;

pub mod fingerprint;

mod bvh;

mod instances;

pub mod follow;

#[cfg(feature = "tree-file")]
pub mod tree_file;

pub use aac::build_cache;
pub use builders::{BuildError, Items};
pub use bvh::{BinaryBvh, BuildReport, Bvh, ItemBvh, ItemHit, WideBvh, build};
pub use cancel::{CancelToken, Cancelled};
pub use geometry::{Aabb, Dop14, Hit, Placement, Ray, Sphere, Triangle};
pub use glam;
pub use instances::{
    BinaryLevels, Copies, CopyCost, CopyCosts, InstanceHit, Instances, LevelNode, MeshCopies, Placed, Unfolded,
    UnfoldedCopy,
};
pub use kernel::SimdLevel;
pub use optimize::orient;
pub use query::ClosestPoint;
pub use settings::{BuildSettings, BuilderKind, Curve, Pass, Passes, Preset};
pub use tree::statistics::TreeStats;
pub use tree::traverse::{TestCounts, Traversal};
pub use tree::{AnyTree, ContainerKind};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
