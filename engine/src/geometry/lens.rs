//! The intersection of two spheres.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::sphere::Sphere;

/// The intersection of two spheres: two caps back to back, or the smaller sphere where the larger one contains it.
///
/// ```
/// use bvhscope_engine::Sphere;
/// use bvhscope_engine::glam::Vec3;
///
/// let at = |x: f32| Sphere { center: Vec3::X * x, radius: 5.0 };
/// let lens = at(0.0).lens(&at(8.0)).expect("they intersect");
/// assert_eq!((lens.rim_center, lens.rim_normal, lens.rim_radius), (Vec3::X * 4.0, Vec3::X, 3.0));
/// assert_eq!(at(0.0).lens(&at(11.0)), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Surface area: that of both caps.
    pub area: f64,
    /// The smallest sphere around it.
    pub bounds: Sphere,
    /// Centre of the rim, the circle in which the surfaces of the spheres meet.
    pub rim_center: Vec3,
    /// Unit normal of the plane of the rim, from the first sphere's centre towards the second's.
    pub rim_normal: Vec3,
    /// Radius of the rim; 0 where one sphere contains the other and the lens is all of the smaller one.
    pub rim_radius: f32,
}

impl Sphere {
    /// The intersection of both; `None` where they have no point in common.
    ///
    /// A cap of height h of a sphere of radius r has the surface 2πrh; Weisstein: *Sphere-Sphere Intersection*, MathWorld, has
    /// the heights.
    pub fn lens(&self, other: &Self) -> Option<Lens> {
        let (a, b) = (f64::from(self.radius), f64::from(other.radius));
        let offset = other.center.as_dvec3() - self.center.as_dvec3();
        let distance = offset.length();
        if self.is_empty() || other.is_empty() || distance > a + b {
            return None;
        }
        let normal = offset.try_normalize().unwrap_or(DVec3::X);
        let smaller = if a <= b { self } else { other };
        if distance <= (a - b).abs() {
            let area = 4.0 * PI * a.min(b).powi(2);
            let rim_normal = normal.as_vec3();
            return Some(Lens { area, bounds: *smaller, rim_center: smaller.center, rim_normal, rim_radius: 0.0 });
        }
        // Distances of the rim's plane from the two centres; negative where a centre lies on the far side of it.
        let to_plane = (distance * distance + (a + b) * (a - b)) / (2.0 * distance);
        let from_plane = distance - to_plane;
        let rim_radius = ((a - to_plane) * (a + to_plane)).max(0.0).sqrt();
        let rim_center = self.center.as_dvec3() + normal * to_plane;
        // A cap of more than half a sphere is as wide as the sphere.
        let is_wide = to_plane < 0.0 || from_plane < 0.0;
        let around_rim = Self { center: rim_center.as_vec3(), radius: rim_radius as f32 };
        Some(Lens {
            area: 2.0 * PI * (a * (a - to_plane) + b * (b - from_plane)),
            bounds: if is_wide { *smaller } else { around_rim },
            rim_center: rim_center.as_vec3(),
            rim_normal: normal.as_vec3(),
            rim_radius: rim_radius as f32,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Container as _;
    use crate::geometry::sphere::tests::numbers;

    /// Points spread evenly over `sphere`: a spiral of equal areas.
    fn surface(sphere: &Sphere, count: usize) -> impl Iterator<Item = DVec3> {
        let (center, radius) = (sphere.center.as_dvec3(), f64::from(sphere.radius));
        (0..count).map(move |i| {
            let z = 1.0 - (2 * i + 1) as f64 / count as f64;
            let (sin, cos) = (i as f64 * PI * (3.0 - 5.0_f64.sqrt())).sin_cos();
            let r = (1.0 - z * z).sqrt();
            center + DVec3::new(r * cos, r * sin, z) * radius
        })
    }

    fn is_inside(point: DVec3, sphere: &Sphere, slack: f64) -> bool {
        point.distance(sphere.center.as_dvec3()) <= f64::from(sphere.radius) * (1.0 + slack)
    }

    #[test]
    fn the_surface_of_a_lens_is_what_each_sphere_has_inside_the_other() {
        const POINTS: usize = 20_000;
        let mut number = numbers();
        let mut kinds = [0; 3];
        for _ in 0..60 {
            let mut sphere =
                || Sphere { center: Vec3::new(number(), number(), number()), radius: number().abs() + 0.2 };
            let (a, b) = (sphere(), sphere());
            let lens = a.lens(&b);
            let inside = |own: &Sphere, other: &Sphere| {
                let count = surface(own, POINTS).filter(|&point| is_inside(point, other, 0.0)).count();
                4.0 * PI * f64::from(own.radius).powi(2) * count as f64 / POINTS as f64
            };
            let measured = inside(&a, &b) + inside(&b, &a);
            let area = lens.map_or(0.0, |lens| lens.area);
            assert!((area - measured).abs() < 0.02, "{a:?} {b:?}: {area} instead of {measured}");
            let Some(lens) = lens else {
                kinds[0] += 1;
                continue;
            };
            kinds[if lens.rim_radius > 0.0 { 1 } else { 2 }] += 1;
            // The bounds hold all of it, and a sphere smaller by a fiftieth would not.
            let points = surface(&a, POINTS).filter(|&point| is_inside(point, &b, 0.0));
            let points: Vec<_> = points.chain(surface(&b, POINTS).filter(|&point| is_inside(point, &a, 0.0))).collect();
            assert!(points.iter().all(|&point| is_inside(point, &lens.bounds, 1e-5)), "{a:?} {b:?}: {lens:?}");
            let reach = points.iter().map(|point| point.distance(lens.bounds.center.as_dvec3())).fold(0.0, f64::max);
            assert!(reach > 0.98 * f64::from(lens.bounds.radius) || points.len() < 300, "{a:?} {b:?}: {lens:?}");
            if lens.rim_radius > 0.0 {
                let on_rim = lens.rim_center + lens.rim_normal.any_orthonormal_vector() * lens.rim_radius;
                assert!([a, b].iter().all(|sphere| (on_rim.distance(sphere.center) - sphere.radius).abs() < 1e-5));
            }
        }
        assert!(kinds.iter().all(|&count| count > 3), "disjoint, lenses and nested: {kinds:?}");
    }

    #[test]
    fn points_and_empty_spheres_have_no_lens_to_speak_of() {
        let point = Sphere { center: Vec3::ONE, radius: 0.0 };
        assert_eq!(point.lens(&point).map(|lens| (lens.area, lens.bounds)), Some((0.0, point)));
        assert_eq!(point.lens(&Sphere::EMPTY), None);
        assert_eq!(Sphere::EMPTY.lens(&Sphere::EMPTY), None);
    }
}
