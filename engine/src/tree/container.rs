//! Containers, called bounding volumes in the literature: boxes and spheres, behind one trait.

use fearless_simd::Simd;

use crate::geometry::{Aabb, PairEntry, PreparedRay, Sphere, Triangle};

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
    /// Surface area up to a constant factor of the kind: half of it for boxes, r² for spheres.
    fn relative_area(&self) -> f32;
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
    /// Relative area of the intersection (boxes) or of the largest sphere in the lens between them (spheres); 0 where the two
    /// are disjoint.
    fn overlap(&self, other: &Self) -> f32;
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

    fn overlap(&self, other: &Self) -> f32 {
        self.intersection(other).half_area()
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

    fn overlap(&self, other: &Self) -> f32 {
        let depth = 0.5 * (self.radius + other.radius - self.center.distance(other.center));
        let radius = depth.min(self.radius).min(other.radius).max(0.0);
        radius * radius
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn spheres_overlap_by_the_lens_between_them() {
        let at = |x: f32| Sphere { center: Vec3::X * x, radius: 1.0 };
        assert_eq!(at(0.0).overlap(&at(3.0)), 0.0);
        assert_eq!(at(0.0).overlap(&at(1.0)), 0.25);
        assert_eq!(at(0.0).overlap(&at(0.0)), 1.0);
        assert_eq!(at(0.0).overlap(&Sphere::EMPTY), 0.0);
    }
}
