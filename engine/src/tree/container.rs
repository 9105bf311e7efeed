//! Containers, called bounding volumes in the literature: boxes, spheres, polytopes and oriented boxes, behind one trait.

use fearless_simd::Simd;
use glam::Vec3;

use crate::geometry::{
    Aabb, DiagonalRay, Dop14, OrientedBox, OrientedRay, PairEntry, PreparedRay, Ray, Sphere, Triangle,
};

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
    /// [`INTERSECTION_COST`](super::statistics::INTERSECTION_COST): 1 for boxes and spheres, half as much again for
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
    /// range of single precision where coordinates are near its ends; [`Tree::area`](super::Tree::area) does not.
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
        let [a, b] = [pair[0].entry(ray, part, t_min, t_max), pair[1].entry(ray, part, t_min, t_max)];
        let hits = u32::from(a.is_some()) | u32::from(b.is_some()) << 1;
        PairEntry { entry: [a.unwrap_or(f32::INFINITY), b.unwrap_or(f32::INFINITY)], hits }
    }
    /// Square of a distance, in world units, that nothing inside is nearer to `point` than, but for the rounding of a few operations:
    /// 0 inside, infinite for the empty container.
    fn distance_squared(&self, point: Vec3) -> f32;
    /// The smallest box around it; of an oriented box, around what it encloses.
    fn bounds(&self) -> Aabb;
    /// Whether `point` lies inside, within `slack` in world units.
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

impl Container for Aabb {
    const KIND: ContainerKind = ContainerKind::Aabb;
    type RayPart = ();
    const EMPTY: Self = Aabb::EMPTY;

    fn of_triangle(triangle: &Triangle) -> Self {
        triangle.bounds()
    }

    #[inline]
    fn union(&self, other: &Self) -> Self {
        Aabb::union(self, other)
    }

    #[inline]
    fn relative_area(&self) -> f32 {
        self.half_area()
    }

    #[inline]
    fn scaled(&self, factor: f32) -> Self {
        Self { min: self.min * factor, max: self.max * factor }
    }

    #[inline(always)]
    fn ray_part(_: &PreparedRay) {}

    #[inline]
    fn entry(&self, ray: &PreparedRay, (): &(), t_min: f32, t_max: f32) -> Option<f32> {
        Aabb::entry(self, ray, t_min, t_max)
    }

    #[inline(always)]
    fn entry_pair<S: Simd>(simd: S, pair: [&Self; 2], ray: &PreparedRay, (): &(), t_min: f32, t_max: f32) -> PairEntry {
        Aabb::entry_pair(simd, pair, ray, t_min, t_max)
    }

    fn distance_squared(&self, point: Vec3) -> f32 {
        Aabb::distance_squared(self, point)
    }

    fn bounds(&self) -> Aabb {
        *self
    }

    fn contains_point(&self, point: Vec3, slack: f32) -> bool {
        self.contains(&Aabb { min: point, max: point }, slack)
    }

    fn contains(&self, other: &Self, slack: f32) -> bool {
        Aabb::contains(self, other, slack)
    }

    fn intersection_area(&self, other: &Self) -> f32 {
        self.intersection(other).half_area()
    }

    fn intersection_bounds(&self, other: &Self) -> Self {
        let common = self.intersection(other);
        if common.is_empty() { Self::EMPTY } else { common }
    }

    fn random_line(&self, random: impl FnMut() -> f64) -> Ray {
        Aabb::random_line(self, random)
    }
}

impl Container for Sphere {
    const KIND: ContainerKind = ContainerKind::Sphere;
    type RayPart = ();
    const EMPTY: Self = Sphere::EMPTY;

    fn of_triangle(triangle: &Triangle) -> Self {
        Self::around_triangle(triangle)
    }

    #[inline]
    fn union(&self, other: &Self) -> Self {
        Sphere::union(self, other)
    }

    #[inline]
    fn relative_area(&self) -> f32 {
        if self.is_empty() { 0.0 } else { self.radius * self.radius }
    }

    #[inline]
    fn scaled(&self, factor: f32) -> Self {
        Self { center: self.center * factor, radius: self.radius * factor }
    }

    #[inline(always)]
    fn ray_part(_: &PreparedRay) {}

    #[inline(always)]
    fn entry(&self, ray: &PreparedRay, (): &(), t_min: f32, t_max: f32) -> Option<f32> {
        Sphere::entry(self, ray, t_min, t_max)
    }

    fn distance_squared(&self, point: Vec3) -> f32 {
        Sphere::distance_squared(self, point)
    }

    fn bounds(&self) -> Aabb {
        Sphere::bounds(self)
    }

    fn contains_point(&self, point: Vec3, slack: f32) -> bool {
        self.contains(&Sphere { center: point, radius: 0.0 }, slack)
    }

    fn contains(&self, other: &Self, slack: f32) -> bool {
        Sphere::contains(self, other, slack)
    }

    fn intersection_area(&self, other: &Self) -> f32 {
        self.lens(other).map_or(0.0, |lens| (lens.area / (4.0 * std::f64::consts::PI)) as f32)
    }

    fn intersection_bounds(&self, other: &Self) -> Self {
        self.lens(other).map_or(Self::EMPTY, |lens| lens.bounds)
    }

    fn random_line(&self, random: impl FnMut() -> f64) -> Ray {
        Sphere::random_line(self, random)
    }
}

impl Container for Dop14 {
    const KIND: ContainerKind = ContainerKind::Dop14;
    type RayPart = DiagonalRay;
    const EMPTY: Self = Dop14::EMPTY;

    fn of_triangle(triangle: &Triangle) -> Self {
        Self::around_triangle(triangle)
    }

    fn union(&self, other: &Self) -> Self {
        Dop14::union(self, other)
    }

    fn relative_area(&self) -> f32 {
        self.half_area()
    }

    fn scaled(&self, factor: f32) -> Self {
        Dop14::scaled(self, factor)
    }

    fn ray_part(ray: &PreparedRay) -> DiagonalRay {
        DiagonalRay::new(ray)
    }

    fn entry(&self, ray: &PreparedRay, part: &DiagonalRay, t_min: f32, t_max: f32) -> Option<f32> {
        Dop14::entry(self, ray, part, t_min, t_max)
    }

    #[inline(always)]
    fn entry_pair<S: Simd>(
        _: S,
        pair: [&Self; 2],
        ray: &PreparedRay,
        part: &DiagonalRay,
        t_min: f32,
        t_max: f32,
    ) -> PairEntry {
        let [a, b] = [pair[0].entry_inlined(ray, part, t_min, t_max), pair[1].entry_inlined(ray, part, t_min, t_max)];
        let hits = u32::from(a.is_some()) | u32::from(b.is_some()) << 1;
        PairEntry { entry: [a.unwrap_or(f32::INFINITY), b.unwrap_or(f32::INFINITY)], hits }
    }

    fn distance_squared(&self, point: Vec3) -> f32 {
        Dop14::distance_squared(self, point)
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn contains_point(&self, point: Vec3, slack: f32) -> bool {
        self.excess_of_point(point) <= f64::from(slack)
    }

    fn contains(&self, other: &Self, slack: f32) -> bool {
        Dop14::contains(self, other, slack)
    }

    fn intersection_area(&self, other: &Self) -> f32 {
        self.intersection(other).half_area()
    }

    fn intersection_bounds(&self, other: &Self) -> Self {
        self.intersection(other)
    }

    fn random_line(&self, random: impl FnMut() -> f64) -> Ray {
        Dop14::random_line(self, random)
    }
}

impl Container for OrientedBox {
    const KIND: ContainerKind = ContainerKind::Oriented;
    type RayPart = OrientedRay;
    const EMPTY: Self = OrientedBox::EMPTY;

    fn of_triangle(triangle: &Triangle) -> Self {
        Self::around_triangle(triangle)
    }

    fn union(&self, other: &Self) -> Self {
        OrientedBox::union(self, other)
    }

    fn relative_area(&self) -> f32 {
        self.half_area()
    }

    fn scaled(&self, factor: f32) -> Self {
        OrientedBox::scaled(self, factor)
    }

    fn ray_part(ray: &PreparedRay) -> OrientedRay {
        OrientedRay::new(ray)
    }

    #[inline]
    fn entry(&self, _: &PreparedRay, part: &OrientedRay, t_min: f32, t_max: f32) -> Option<f32> {
        OrientedBox::entry(self, part, t_min, t_max)
    }

    fn distance_squared(&self, point: Vec3) -> f32 {
        OrientedBox::distance_squared(self, point)
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn contains_point(&self, point: Vec3, slack: f32) -> bool {
        self.excess_of_point(point) <= f64::from(slack)
    }

    fn contains(&self, other: &Self, slack: f32) -> bool {
        OrientedBox::contains(self, other, slack)
    }

    fn intersection_area(&self, other: &Self) -> f32 {
        self.intersection_half_area(other)
    }

    fn intersection_bounds(&self, other: &Self) -> Self {
        OrientedBox::intersection_bounds(self, other)
    }

    fn random_line(&self, random: impl FnMut() -> f64) -> Ray {
        OrientedBox::random_line(self, random)
    }
}
