//! Containers, called bounding volumes in the literature: boxes, spheres, polytopes and oriented boxes, behind one trait.
//!
//! A method of the trait stands once, in the file of the shape below. Boxes alone also have `EMPTY`, `union`, `contains` and `entry` of
//! their own, because they are geometry for programs that build no tree and have no need of the trait.

mod boxes;
mod oriented_boxes;
mod polytopes;
mod spheres;

use std::f64::consts::TAU;

use fearless_simd::Simd;
use glam::{DVec3, Vec3};

use super::aabb::Aabb;
use super::intersect::PairEntry;
use super::prepared_ray::PreparedRay;
use super::ray::Ray;
use super::triangle::Triangle;

/// Kind of bounding volume that a tree consists of.
///
/// ```
/// use bvhscope_engine::ContainerKind;
///
/// assert_eq!(ContainerKind::ALL.map(ContainerKind::name), ["box", "sphere", "dop"]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum ContainerKind {
    /// Axis-aligned boxes.
    #[cfg_attr(feature = "serde", serde(rename = "box"))]
    Aabb,
    /// Spheres.
    Sphere,
    /// Discrete oriented polytopes of fourteen planes (k-DOPs with k = 14).
    #[cfg_attr(feature = "serde", serde(rename = "dop"))]
    Dop14,
    /// Boxes each of which may be turned or skewed. No builder makes them: the pass [`Orient`](crate::Pass::Orient) does, of boxes.
    Oriented,
}

impl ContainerKind {
    /// Every kind that builders make, boxes first.
    pub const ALL: [Self; 3] = [Self::Aabb, Self::Sphere, Self::Dop14];

    /// Every kind, those that builders make first.
    pub const WITH_ORIENTED: [Self; 4] = [Self::Aabb, Self::Sphere, Self::Dop14, Self::Oriented];

    /// The kinds that the paper compares.
    pub const OF_PAPER: [Self; 2] = [Self::Aabb, Self::Sphere];

    /// Name in text such as JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Aabb => "box",
            Self::Sphere => "sphere",
            Self::Dop14 => "dop",
            Self::Oriented => "oriented",
        }
    }

    /// Name in a user interface.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Aabb => "Box",
            Self::Sphere => "Sphere",
            Self::Dop14 => "14-DOP",
            Self::Oriented => "Oriented box",
        }
    }

    /// Several of them, in a sentence.
    pub const fn plural(self) -> &'static str {
        match self {
            Self::Aabb => "boxes",
            Self::Sphere => "spheres",
            Self::Dop14 => "14-DOPs",
            Self::Oriented => "oriented boxes",
        }
    }

    /// Cost of a test of one container by the surface area heuristic, in the unit of
    /// [`INTERSECTION_COST`](crate::tree::statistics::INTERSECTION_COST): 1 for boxes and spheres, half as much again for
    /// polytopes and oriented boxes, the ratio of 4.5 to 3 that Káčerik and Bittner (*SOBB: Skewed Oriented Bounding Boxes for Ray
    /// Tracing*, 2025) take.
    pub const fn traversal_cost(self) -> f32 {
        match self {
            Self::Aabb | Self::Sphere => 1.0,
            Self::Dop14 | Self::Oriented => 1.5,
        }
    }
}

/// A bounding volume. Builders, traversals and statistics are generic over it.
pub trait Container: Copy + Send + Sync + PartialEq + std::fmt::Debug + 'static {
    /// Kind of this container.
    const KIND: ContainerKind;
    /// The part of a ray that tests of this container need beside [`PreparedRay`].
    type RayPart: Copy;
    /// The container of nothing; the neutral element of [`Container::union`].
    const EMPTY: Self;
    /// The smallest container around `triangle`.
    fn of_triangle(triangle: &Triangle) -> Self;
    /// The smallest container around both.
    #[must_use]
    fn union(&self, other: &Self) -> Self;
    /// Surface area up to a constant factor of the kind: half of it for boxes of all kinds and polytopes, r² for spheres. Leaves the
    /// range of single precision where coordinates are near its ends; [`Tree::area`](crate::tree::Tree::area) does not.
    fn relative_area(&self) -> f32;
    /// The container with all coordinates multiplied by `factor`, which is positive.
    #[must_use]
    fn scaled(&self, factor: f32) -> Self;
    /// The part of `ray` for [`Container::entry`].
    fn ray_part(ray: &PreparedRay) -> Self::RayPart;
    /// Entry distance of a ray, at least `t_min`; `None` where it misses or enters beyond `t_max`. NaN never makes a miss.
    fn entry(&self, ray: &PreparedRay, part: &Self::RayPart, t_min: f32, t_max: f32) -> Option<f32>;
    /// [`Container::entry`] of two siblings, neither of them empty.
    #[inline(always)]
    fn entry_pair<S: Simd>(
        _: S,
        pair: [&Self; 2],
        ray: &PreparedRay,
        part: &Self::RayPart,
        t_min: f32,
        t_max: f32,
    ) -> PairEntry {
        PairEntry::of([pair[0].entry(ray, part, t_min, t_max), pair[1].entry(ray, part, t_min, t_max)])
    }
    /// Square of a distance, in world units, that nothing inside is nearer to `point` than, but for the rounding of a few operations:
    /// 0 inside, infinite for the empty container.
    fn distance_squared(&self, point: Vec3) -> f32;
    /// The smallest box around it; of an oriented box, around what it encloses.
    fn bounds(&self) -> Aabb;
    /// True if `point` lies inside, within `slack` in world units.
    fn contains_point(&self, point: Vec3, slack: f32) -> bool;
    /// True if `other` lies inside, within `slack` in world units; for oriented boxes, if its contents may.
    fn contains(&self, other: &Self, slack: f32) -> bool;
    /// Surface area of the intersection, in the unit of [`Container::relative_area`]: of the common part of boxes or polytopes, of the
    /// [`Lens`] between two spheres. 0 where the two are disjoint.
    ///
    /// [`Lens`]: crate::geometry::Lens
    fn intersection_area(&self, other: &Self) -> f32;
    /// The smallest container around the intersection: the common box or polytope itself, the smallest sphere around the lens between two
    /// spheres, the smallest box along the axes around what oriented boxes have in common. Empty where the two are disjoint.
    #[must_use]
    fn intersection_bounds(&self, other: &Self) -> Self;
    /// A random line through the container, distributed as in [`RandomLines`](crate::tree::random_lines::RandomLines). `random`
    /// gives independent numbers, uniform in 0 to 1 (exclusive).
    fn random_line(&self, random: impl FnMut() -> f64) -> Ray;
}

/// The line that enters a body at `entry`, where its inward unit normal is `normal`, in a direction of density cosine over π. It
/// begins `distance` before.
pub(super) fn line_entering(entry: DVec3, normal: DVec3, distance: f64, mut random: impl FnMut() -> f64) -> Ray {
    let (sine_squared, angle) = (random(), TAU * random());
    let (sin, cos) = angle.sin_cos();
    let (x, y) = normal.any_orthonormal_pair();
    let direction = (x * cos + y * sin) * sine_squared.sqrt() + normal * (1.0 - sine_squared).sqrt();
    Ray::new((entry - direction * distance).as_vec3(), direction.as_vec3())
}
