//! Shapes and rays, one idea a file. Knows nothing of trees, scenes or pixels.

mod aabb;
mod ray;
mod sphere;
mod triangle;

pub use aabb::Aabb;
pub use ray::{Hit, Ray};
pub use sphere::Sphere;
pub use triangle::Triangle;
