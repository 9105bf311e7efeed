//! The construction of a tree, to be looked at. Of an agglomerative one: which clusters were merged when, in which call of the recursion, from
//! which list, and why. The tree is the one that [`crate::builders`] makes before any pass, node for node; nothing is recorded
//! while it is built, since the order of its merges follows from the recursion ([`MergeRecord`]). Of one that was built from the top:
//! its splits ([`SplitTree`]). Both are a [`Timeline`], in which each step is a cut through the tree.
//!
//! ```
//! use bvhscope_engine::construction::{Construction, Cut, MergeOrder};
//! use bvhscope_engine::{BuildSettings, CancelToken, Triangle, glam::Vec3};
//!
//! let at = |x: f32| Triangle { a: Vec3::X * x, b: Vec3::X * x + Vec3::Y, c: Vec3::X * x + Vec3::Z };
//! let triangles = [0.0, 1.0, 5.0, 7.0, 20.0].map(at);
//! let token = CancelToken::new();
//! let construction = Construction::new(&triangles, &BuildSettings::default(), &token)?;
//!
//! // Four merges; after two of them three clusters are left.
//! assert_eq!(construction.record.len(), 4);
//! let timeline = construction.timeline(MergeOrder::Built, &token)?;
//! assert_eq!(timeline.largest_at(2, 10).len(), 3);
//! let cut = Cut::Clusters(3).nodes(&construction.tree, None, &token)?;
//! assert_eq!(cut.len(), 3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! With the pass Split the primitives of the record are the proxies of triangles, and [`crate::tree::Tree::primitive_indices`] names
//! the triangle of each. Nothing else of [`crate::BuildSettings::optimize`] is carried out.

mod construct;
mod record;
mod reduction_levels;

mod splits;

mod cut;
mod snapshots;
mod timeline;

mod explain;

mod against_exact;
mod regret;

mod curve_cells;

pub use crate::aac::{Reduction, ReductionStep};
pub use against_exact::{DifferentMerge, ExactComparison, MAX_EXACT_LEAVES, compare_with_exact};
pub use construct::Construction;
pub use curve_cells::{CellLimits, CellSplit, CellSplitKind, CurveCell, CurveOrder, curve_order};
pub use cut::{Cut, CutError};
pub use explain::{ClusterPair, ListedCluster, MergeChoice, merge_area};
pub use record::MergeRecord;
pub use reduction_levels::{ReductionLevel, Spread};
pub use regret::{BYTES_PER_TRIANGLE, RegretLimits, Regrets, regrets};
pub use splits::SplitTree;
pub use timeline::{MergeOrder, Timeline};
