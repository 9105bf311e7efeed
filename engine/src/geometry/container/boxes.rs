//! Boxes along the axes as containers.

use fearless_simd::{Simd, SimdBase, SimdMask, f32x4};
use glam::{DVec3, Vec3};

use super::{Container, ContainerKind, line_entering};
use crate::geometry::aabb::Aabb;
use crate::geometry::intersect::{FAR_SLACK, PairEntry};
use crate::geometry::prepared_ray::PreparedRay;
use crate::geometry::ray::Ray;
use crate::geometry::triangle::Triangle;

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
        let load = |array: &[f32; 4]| f32x4::load_array_ref(simd, array);
        let [a, b] = pair.map(bytemuck::cast_ref::<Aabb, [f32; 6]>);
        // Two loads per box: (min.x, min.y, min.z, max.x) and (min.z, max.x, max.y, max.z).
        let (a0, b0) = (load(&[a[0], a[1], a[2], a[3]]), load(&[b[0], b[1], b[2], b[3]]));
        let (a1, b1) = (load(&[a[2], a[3], a[4], a[5]]), load(&[b[2], b[3], b[4], b[5]]));
        // Lanes, alternating between the boxes: lower x and y; lower z and upper x; upper y and z.
        let planes = [a0.zip_low(b0), a1.zip_low(b1), a1.zip_high(b1)];
        let t = |part: usize| (planes[part] - load(&ray.pair_origins[part])) * load(&ray.pair_inverses[part]);
        let (t0, t1, t2) = (t(0), t(1), t(2));
        // From here on only the first two lanes are used.
        let swapped = |lanes: f32x4<S>| lanes.slide::<2>(lanes);
        let upper_xy = t1.slide::<2>(t2);
        let (near_xy, far_xy) = (t0.min(upper_xy), t0.max(upper_xy));
        let (lower_z, upper_z) = (t1, swapped(t2));
        let near_z = lower_z.min(upper_z).max(f32x4::splat(simd, t_min));
        let near = near_xy.max(swapped(near_xy)).max(near_z);
        let far = far_xy.min(swapped(far_xy)).min(lower_z.max(upper_z)) * FAR_SLACK;
        let hit = near.simd_le(far) & near.simd_le(f32x4::splat(simd, t_max));
        let near = near.to_array();
        PairEntry { entry: [near[0], near[1]], hits: hit.to_bitmask() as u32 & 3 }
    }

    #[inline]
    fn distance_squared(&self, point: Vec3) -> f32 {
        let outside = (self.min - point).max(point - self.max).max(Vec3::ZERO);
        outside.length_squared()
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

    /// Enters at a point uniform over the surface, in a direction of density cosine over π: a uniform choice among all lines that meet
    /// the box. Begins a diagonal before, as the lines of the other containers do, or a diameter.
    fn random_line(&self, mut random: impl FnMut() -> f64) -> Ray {
        let (low, extent) = (self.min.as_dvec3(), self.extent().as_dvec3());
        let faces = [extent.y * extent.z, extent.z * extent.x, extent.x * extent.y];
        // One number chooses a face in proportion to the areas.
        let mut at = random() * 2.0 * faces.iter().sum::<f64>();
        let is_upper = at >= faces.iter().sum::<f64>();
        at -= if is_upper { faces.iter().sum() } else { 0.0 };
        let axis = if at < faces[0] { 0 } else { 1 + usize::from(at >= faces[0] + faces[1]) };
        let mut position = DVec3::new(random(), random(), random());
        position[axis] = f64::from(u8::from(is_upper));
        let normal = Vec3::AXES[axis].as_dvec3() * if is_upper { -1.0 } else { 1.0 };
        line_entering(low + position * extent, normal, extent.length(), random)
    }
}
