//! Shapes and rays, one idea a file. Knows nothing of trees, scenes or pixels.

mod aabb;
mod intersect;
mod prepared_ray;
mod ray;
mod sphere;
mod triangle;

pub use aabb::Aabb;
pub(crate) use intersect::{EDGE_MAX, EDGE_MIN, FAR_SLACK};
pub use intersect::{PairEntry, TriangleHit};
pub(crate) use prepared_ray::PARALLEL_PAD;
pub use prepared_ray::{PreparedRay, Shear};
pub use ray::{Hit, Ray};
pub use sphere::Sphere;
pub use triangle::Triangle;
