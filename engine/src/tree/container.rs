//! Containers, called bounding volumes in the literature: boxes and spheres, behind one trait.

use fearless_simd::Simd;

use crate::geometry::{Aabb, PairEntry, PreparedRay, Ray, Sphere, Triangle};

/// Kind of bounding volume that a tree consists of.
///
/// ```
/// use bvhscope_engine::ContainerKind;
///
/// assert_eq!(ContainerKind::ALL.map(ContainerKind::name), ["box", "sphere"]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum ContainerKind {
    /// Axis-aligned boxes.
    #[cfg_attr(feature = "serde", serde(rename = "box"))]
    Aabb,
    /// Spheres.
    Sphere,
}

impl ContainerKind {
    /// Both kinds, boxes first.
    pub const ALL: [Self; 2] = [Self::Aabb, Self::Sphere];

    /// Name in text such as JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Aabb => "box",
            Self::Sphere => "sphere",
        }
    }

    /// Name in a user interface.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Aabb => "Box",
            Self::Sphere => "Sphere",
        }
    }
}

/// A bounding volume. Builders, traversals and statistics are generic over it.
pub trait Container: Copy + Send + Sync + PartialEq + std::fmt::Debug + 'static {
    /// Kind of this container.
    const KIND: ContainerKind;
    /// The container of nothing; the neutral element of [`Container::union`].
    const EMPTY: Self;
    /// The smallest container around `triangle`.
    fn of_triangle(triangle: &Triangle) -> Self;
    /// The smallest container around both.
    #[must_use]
    fn union(&self, other: &Self) -> Self;
    /// Surface area up to a constant factor of the kind: half of it for boxes, r² for spheres. Leaves the range of single precision
    /// where coordinates are near its ends; [`Tree::area`](super::Tree::area) does not.
    fn relative_area(&self) -> f32;
    /// The container with all coordinates multiplied by `factor`, which is positive.
    #[must_use]
    fn scaled(&self, factor: f32) -> Self;
    /// Entry distance of a ray, at least `t_min`; `None` where it misses or enters beyond `t_max`. NaN never makes a miss.
    fn entry(&self, ray: &PreparedRay, t_min: f32, t_max: f32) -> Option<f32>;
    /// [`Container::entry`] of two siblings, neither of them empty.
    #[inline(always)]
    fn entry_pair<S: Simd>(_: S, pair: [&Self; 2], ray: &PreparedRay, t_min: f32, t_max: f32) -> PairEntry {
        let [a, b] = [pair[0].entry(ray, t_min, t_max), pair[1].entry(ray, t_min, t_max)];
        let hits = u32::from(a.is_some()) | u32::from(b.is_some()) << 1;
        PairEntry { entry: [a.unwrap_or(f32::INFINITY), b.unwrap_or(f32::INFINITY)], hits }
    }
    /// The smallest box around it.
    fn bounds(&self) -> Aabb;
    /// Whether `point` lies inside, within `slack` in world units.
    fn contains_point(&self, point: glam::Vec3, slack: f32) -> bool;
    /// Whether `other` lies inside, within `slack` in world units.
    fn contains(&self, other: &Self, slack: f32) -> bool;
    /// Surface area of the intersection, in the unit of [`Container::relative_area`]: of the common box, of the [`Lens`] between
    /// two spheres. 0 where the two are disjoint.
    ///
    /// [`Lens`]: crate::geometry::Lens
    fn intersection_area(&self, other: &Self) -> f32;
    /// The smallest container around the intersection: the common box itself, the smallest sphere around the lens between two
    /// spheres. Empty where the two are disjoint.
    #[must_use]
    fn intersection_bounds(&self, other: &Self) -> Self;
    /// A random line through the container, distributed as in [`RandomLines`](crate::tree::random_lines::RandomLines). `random`
    /// gives independent numbers, uniform in 0 to 1 (exclusive).
    fn random_line(&self, random: impl FnMut() -> f64) -> Ray;
}

impl Container for Aabb {
    const KIND: ContainerKind = ContainerKind::Aabb;
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

    #[inline]
    fn entry(&self, ray: &PreparedRay, t_min: f32, t_max: f32) -> Option<f32> {
        Aabb::entry(self, ray, t_min, t_max)
    }

    #[inline(always)]
    fn entry_pair<S: Simd>(simd: S, pair: [&Self; 2], ray: &PreparedRay, t_min: f32, t_max: f32) -> PairEntry {
        Aabb::entry_pair(simd, pair, ray, t_min, t_max)
    }

    fn bounds(&self) -> Aabb {
        *self
    }

    fn contains_point(&self, point: glam::Vec3, slack: f32) -> bool {
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
    fn entry(&self, ray: &PreparedRay, t_min: f32, t_max: f32) -> Option<f32> {
        Sphere::entry(self, ray, t_min, t_max)
    }

    fn bounds(&self) -> Aabb {
        Sphere::bounds(self)
    }

    fn contains_point(&self, point: glam::Vec3, slack: f32) -> bool {
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
