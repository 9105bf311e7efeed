//! Boxes along the axes and oriented ones, spheres, polytopes, triangles and rays, and where they intersect. Knows nothing of trees.

mod aabb;
mod dop;
mod dop_faces;
mod extent;
mod extremes;
mod lens;
mod oriented;
mod oriented_faces;
mod oriented_fit;
mod sphere;
mod triangle;

mod prepared_ray;
mod ray;

mod intersect;
mod nearest_point;
mod needle;
mod placement;
mod ray_dop;
mod ray_oriented;

mod container;
mod scale;

pub use aabb::Aabb;
pub use container::{Container, ContainerKind};
pub use dop::Dop14;
pub(crate) use dop::{DIAGONAL_PAD, PER_DIAGONAL, half_area_between};
pub use dop_faces::DopFace;
pub(crate) use dop_faces::cut;
pub use extent::Extent;
pub(crate) use extremes::Extremes;
pub(crate) use intersect::{EDGE_MAX, EDGE_MIN, FAR_SLACK};
pub use intersect::{PairEntry, TriangleHit};
pub use lens::Lens;
pub(crate) use nearest_point::reach;
pub use nearest_point::{Feature, TrianglePoint};
pub(crate) use needle::{ExactPlane, NEEDLE_ASPECT};
pub(crate) use oriented::ORIENTED_PAD;
pub use oriented::{OrientedBox, OrientedKind};
pub(crate) use oriented_fit::intervals;
pub use placement::Placement;
#[cfg(feature = "tree-file")]
pub(crate) use placement::transform_of;
pub(crate) use placement::{CarriedRay, LARGEST_DIRECTION, LEAST_WIDENING};
pub(crate) use prepared_ray::PARALLEL_PAD;
pub use prepared_ray::{PreparedRay, Shear};
pub use ray::{Hit, Ray};
pub use ray_dop::DiagonalRay;
pub(crate) use ray_oriented::FARTHEST;
pub use ray_oriented::OrientedRay;
pub(crate) use scale::area_scale;
pub use sphere::Sphere;
pub(crate) use sphere::{SPHERE_ENTRY_ERROR, SPHERE_SQUARE_ERROR, SPHERE_T_ERROR, SPHERE_TINY_RADIUS};
pub use triangle::Triangle;
