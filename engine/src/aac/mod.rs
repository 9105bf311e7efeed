//! Approximate agglomerative clustering (AAC). *The paper* is Mahmuda, Yuniarti, Nurul K., *Konstruksi Bounding Volume Hierarchy
//! dengan Metode Agglomerative Clustering untuk Meningkatkan Performa Ray Tracing*, which describes the algorithm of Gu, He,
//! Fatahalian, Blelloch, *Efficient BVH Construction via Approximate Agglomerative Clustering*, HPG 2013. Its figures:
//!
//! | figure | function | file |
//! | --- | --- | --- |
//! | 5 | [`build_bvh`]: codes, radix sort, `build_tree`, `combine_clusters(C, 1)` | `build_bvh.rs`, `order/` |
//! | 6 | `build_tree`: downward, partition the primitives | `build_tree.rs`, its parallel tasks in `tasks.rs` |
//! | 7 | [`combine_clusters`]: upward, merge the closest clusters | `combine.rs`, by length of the list: `combine_short.rs`, `combine_long.rs` |
//! | – | f(x), the reduction function | `reduction.rs` |
//!
//! `recursion.rs` lists the steps of the recursion afterwards. A tree is then made ready for rays by `leaf_order.rs`, and [`build_cache`]
//! holds the parts that the next build reuses. The preset Swift clusters blocks of primitives, which `leaf_blocks.rs` joins before.

mod build_bvh;

mod build_tree;
mod tasks;

mod combine;
mod combine_long;
mod combine_short;

mod reduction;

mod recursion;

mod cluster;
mod cluster_container;
mod cluster_row;
mod pair_writer;

mod leaf_blocks;
mod leaf_order;

pub mod build_cache;

pub(crate) use build_bvh::{build_bvh, build_bvh_with_recursion};
pub(crate) use cluster::{Cluster, ClusterStack};
pub(crate) use cluster_container::{ClusterContainer, splat_fields};
pub(crate) use combine::combine_clusters;
pub(crate) use combine_long::Scratch;
pub(crate) use combine_short::combine_short;
pub(crate) use leaf_order::{Primitives, order_leaves};
pub(crate) use pair_writer::PairWriter;
pub(crate) use recursion::Recursion;
pub use recursion::ReductionStep;
pub use reduction::Reduction;
