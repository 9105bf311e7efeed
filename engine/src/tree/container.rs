//! What stands around primitives: boxes or spheres, behind one trait. ("Bounding volume" in the literature.)

use fearless_simd::Simd;

use crate::geometry::{Aabb, Sphere, Triangle};
pub use crate::geometry::{PairEntry, PreparedRay};

/// Which container a tree is made of.
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
    /// Both, boxes first.
    pub const ALL: [Self; 2] = [Self::Aabb, Self::Sphere];

    /// The name on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Aabb => "box",
            Self::Sphere => "sphere",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Aabb => "Box",
            Self::Sphere => "Sphere",
        }
    }
}

/// A bounding volume. Both kinds go through the same builder, traversal and statistics.
pub trait Container: Copy + Send + Sync + PartialEq + std::fmt::Debug + 'static {
    /// Which kind this is.
    const KIND: ContainerKind;
    /// Holds nothing; neutral in [`Container::union`].
    const EMPTY: Self;
    /// The container of one triangle.
    fn of_triangle(triangle: &Triangle) -> Self;
    /// The smallest container around both.
    #[must_use]
    fn union(&self, other: &Self) -> Self;
    /// Surface area up to a constant factor of the kind: half of it for boxes, r² for spheres. Enough for ratios.
    fn relative_area(&self) -> f32;
    /// Where a ray enters, at least `t_min`; `None` where it misses or enters beyond `t_max`. Never misses because of NaN.
    fn entry(&self, ray: &PreparedRay, t_min: f32, t_max: f32) -> Option<f32>;
    /// [`Container::entry`] of two siblings at once, neither of them empty.
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
    /// Volume-free measure of how much two containers overlap: the relative area of the intersection (boxes) or of
    /// the largest sphere in the lens (spheres); 0 where they do not touch.
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

/// Relative error allowed for in a ray's test against a sphere: about seven roundings.
pub(crate) const SPHERE_ENTRY_ERROR: f32 = 4e-7;
/// Allowed for in the difference of two squares, which are exact to a share of themselves only where they are normal numbers.
pub(crate) const SPHERE_SQUARE_ERROR: f32 = f32::MIN_POSITIVE;
/// Radii whose square is no longer a normal number.
pub(crate) const SPHERE_TINY_RADIUS: f32 = 1e-18;
/// Allowed for in `t`, which is exact to a share of itself only where it is a normal number.
pub(crate) const SPHERE_T_ERROR: f32 = f32::MIN_POSITIVE;

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
        if self.is_empty() {
            return None;
        }
        // The distance from the middle to the ray's nearest point, rather than the quadratic formula, keeps small
        // spheres far away exact (Haines and others, *Precision Improvements for Ray/Sphere Intersection*, 2019).
        // In world units up to the end: in `t` they would vanish for long directions.
        let to_center = self.center - ray.ray.origin;
        let middle = to_center.dot(ray.unit_direction);
        let nearest = to_center - ray.unit_direction * middle;
        let radius = self.radius + SPHERE_ENTRY_ERROR * (to_center.abs().element_sum() + self.radius);
        let inside = radius * radius - nearest.length_squared() + SPHERE_SQUARE_ERROR;
        // Negated comparisons: a NaN counts as a hit.
        if inside < 0.0 {
            return None;
        }
        let half_chord = if radius < SPHERE_TINY_RADIUS { radius } else { inside.sqrt() };
        let half_chord = half_chord + SPHERE_ENTRY_ERROR * (middle.abs() + half_chord);
        let near = (middle - half_chord) * ray.inverse_length - SPHERE_T_ERROR;
        let far = (middle + half_chord) * ray.inverse_length + SPHERE_T_ERROR;
        // f32::max drops a NaN in favour of t_min.
        if far < t_min || near > t_max || t_min > t_max { None } else { Some(near.max(t_min)) }
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
    use crate::geometry::Ray;

    /// A fixed sequence of numbers between -1 and 1.
    fn numbers() -> impl FnMut() -> f32 {
        let mut state = 1_u32;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        }
    }

    fn triangles(scale: f32, offset: f32) -> Vec<Triangle> {
        let mut number = numbers();
        let mut corner = || Vec3::new(number(), number(), number()) * scale + Vec3::splat(offset);
        (0..300).map(|_| Triangle { a: corner(), b: corner(), c: corner() }).collect()
    }

    #[test]
    fn a_triangles_sphere_holds_its_corners_and_is_small() {
        for (scale, offset) in [(1.0, 0.0), (1e-3, 100.0), (1e30, 0.0), (f32::MAX, 0.0), (1e-30, 0.0), (1e-42, 0.0)] {
            for triangle in triangles(scale, offset) {
                let sphere = Sphere::of_triangle(&triangle);
                assert!(sphere.center.is_finite() && sphere.radius.is_finite(), "{triangle:?} → {sphere:?}");
                for corner in [triangle.a, triangle.b, triangle.c] {
                    assert!(
                        sphere.contains_point(corner, 0.0) || sphere.radius == f32::MAX,
                        "{triangle:?} → {sphere:?}"
                    );
                }
                if scale == 1.0 {
                    let [a, b, c] =
                        [triangle.a - triangle.b, triangle.b - triangle.c, triangle.c - triangle.a].map(Vec3::length);
                    // Jung: no smallest circle is larger than this.
                    assert!(sphere.radius <= a.max(b).max(c) / 3.0_f32.sqrt() * 1.0001, "{triangle:?} → {sphere:?}");
                }
            }
        }
    }

    #[test]
    fn flat_triangles_have_finite_spheres() {
        let points = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0, Vec3::NEG_X];
        for a in points {
            for b in points {
                for c in points {
                    let sphere = Sphere::of_triangle(&Triangle { a, b, c });
                    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
                    assert!((sphere.radius - longest * 0.5).abs() < 1e-6, "{a} {b} {c} → {sphere:?}");
                }
            }
        }
    }

    #[test]
    fn a_union_holds_both_and_is_the_smallest() {
        for scale in [1.0, 1e-3, 1e30, 1e-30] {
            let spheres: Vec<Sphere> = triangles(scale, 0.0).iter().map(Sphere::of_triangle).collect();
            for pair in spheres.windows(2) {
                let union = pair[0].union(&pair[1]);
                assert!(union.contains(&pair[0], 0.0) && union.contains(&pair[1], 0.0), "{pair:?} → {union:?}");
                let (a, b) = (pair[0], pair[1]);
                let distance = a.center.as_dvec3().distance(b.center.as_dvec3());
                let (ra, rb) = (f64::from(a.radius), f64::from(b.radius));
                let exact = (0.5 * (distance + ra + rb)).max(ra).max(rb);
                // The bound of what rounding may have done is some twenty epsilons.
                assert!(f64::from(union.radius) <= exact * 1.000_003, "{pair:?} → {union:?}");
                assert_eq!(union, pair[1].union(&pair[0]), "the order does not matter");
            }
            assert_eq!(spheres[0].union(&Sphere::EMPTY), spheres[0]);
            assert_eq!(Sphere::EMPTY.union(&spheres[0]), spheres[0]);
            assert_eq!(spheres[0].union(&spheres[0]), spheres[0]);
        }
    }

    #[test]
    fn a_ray_to_a_point_inside_enters_before_it() {
        let mut number = numbers();
        // Scenes of any size, near and far, and directions of any length.
        for (size, distance, length) in [
            (1.0, 1.0, 1.0),
            (1.0, 1e3, 1.0),
            (1.0, 1e6, 1e-12),
            (1e-12, 1e-12, 1e16),
            (1e-21, 1e-20, 1e18),
            (1e-30, 1e-29, 1e18),
            (1e-12, 1.0, 1e-18),
            (1e15, 1e17, 1e18),
        ] {
            let mut point = |scale: f32| Vec3::new(number(), number(), number()) * scale;
            for _ in 0..2_000 {
                let sphere = Sphere { center: point(size), radius: point(size).x.abs() * 0.1 };
                let direction = point(1.0).normalize_or(Vec3::X);
                let inside = sphere.center + direction.any_orthonormal_vector() * sphere.radius * point(1.0).x;
                let from = inside + point(distance);
                let towards = (inside - from).normalize_or(Vec3::X) * length;
                let reached = from.distance(inside) / length * 1.000_001 + f32::MIN_POSITIVE;
                let ray = PreparedRay::new(Ray::new(from, towards));
                let entry = sphere.entry(&ray, 0.0, f32::INFINITY);
                assert!(entry.is_some_and(|t| (0.0..=reached).contains(&t)), "{sphere:?} {ray:?} → {entry:?}");
            }
        }
    }

    #[test]
    fn rays_beside_or_away_from_a_sphere_miss() {
        let sphere = Sphere { center: Vec3::new(5.0, 0.0, 0.0), radius: 1.0 };
        let ray = |direction: Vec3| PreparedRay::new(Ray::new(Vec3::ZERO, direction));
        let hit = sphere.entry(&ray(Vec3::X * 2.0), 0.0, 10.0);
        assert!(hit.is_some_and(|t| (t - 2.0).abs() < 1e-4), "{hit:?}");
        assert_eq!(sphere.entry(&ray(Vec3::NEG_X), 0.0, 100.0), None, "behind");
        assert_eq!(sphere.entry(&ray(Vec3::X), 0.0, 3.5), None, "too far");
        assert_eq!(sphere.entry(&ray(Vec3::X), 6.5, 10.0), None, "passed already");
        assert_eq!(sphere.entry(&ray(Vec3::new(5.0, 1.1, 0.0)), 0.0, 10.0), None, "beside");
        assert_eq!(Sphere::EMPTY.entry(&ray(Vec3::X), 0.0, 10.0), None, "empty");
        assert_eq!(sphere.entry(&PreparedRay::new(Ray::new(sphere.center, Vec3::X)), 0.25, 10.0), Some(0.25), "inside");
    }

    #[test]
    fn spheres_overlap_by_the_lens_between_them() {
        let at = |x: f32| Sphere { center: Vec3::X * x, radius: 1.0 };
        assert_eq!(at(0.0).overlap(&at(3.0)), 0.0);
        assert_eq!(at(0.0).overlap(&at(1.0)), 0.25);
        assert_eq!(at(0.0).overlap(&at(0.0)), 1.0);
        assert_eq!(at(0.0).overlap(&Sphere::EMPTY), 0.0);
    }
}
