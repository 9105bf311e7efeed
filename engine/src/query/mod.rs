//! Queries beside the nearest hit of a ray: all hits of a ray in order, the point of a mesh that is nearest to another, and whether a
//! point lies inside of a closed mesh. Through the binary tree with every test counted; `wide` has the same with SIMD. All find what a
//! test of every triangle finds.

mod all_hits;
mod closest_point;

pub mod closed;

pub(crate) use all_hits::{HitList, Listed};
pub use all_hits::{HitLists, all_hits, all_hits_counted};
pub use closest_point::{ClosestPoint, closest_point};
pub(crate) use closest_point::{NearestPoint, each_near_leaf};
