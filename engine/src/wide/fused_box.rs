//! A single ray against eight boxes with one fused multiply-add per plane.
//!
//! The distance of a plane is here plane · inverse - origin · inverse, with the second product computed once per ray, where
//! [`Aabb::entry`](crate::geometry::Aabb::entry) computes (plane - origin) · inverse. It rounds differently, and not the same on
//! machines without fused multiply-add. So the products are padded, and a box counts as entered also a little beyond its exit or the
//! end of the ray: a ray visits the same nodes as there and rarely one more, on every machine, and the triangles decide what is hit.

use fearless_simd::{Simd, SimdBase, SimdFloat, SimdMask, f32x4, f32x8, mask32x8};

use crate::geometry::Ray;
use crate::kernel::each;
use crate::wide::box_lanes::{BoxLanes, LaneTest};
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::{AXES, TriangleLanes, origin_and_direction};

/// Part of origin · inverse by which distances are padded, more than its own rounding and that of plane · inverse.
const PRODUCT_PAD: f32 = 4.0 * f32::EPSILON;

/// Limits of inverse and origin · inverse: coordinates up to 1e18, for which triangles are watertight, cannot overflow.
const INVERSE_MAX: f32 = 1e18;
const PRODUCT_MAX: f32 = 1e37;

/// A single ray prepared for tests against eight boxes. The fourth of each four numbers is not used.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(16))]
pub struct FusedBoxRay {
    /// Reciprocals of the direction.
    inverse: [f32; 4],
    /// Origin · inverse, padded so that near planes come out no farther than they are, and far planes no nearer.
    near_product: [f32; 4],
    far_product: [f32; 4],
    t_min: f32,
    /// For each axis the offset of the near planes: 0 for the lower ones, [`WIDTH`] for the upper ones.
    near: [u32; 3],
}

impl FusedBoxRay {
    /// The ray also as tests against triangles need it. `None` for a ray that cannot hit anything, is parallel to an axis's planes, or
    /// so nearly that numbers could overflow.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(simd: S, ray: &Ray) -> Option<(Self, TriangleLanes<1>)> {
        let splat = |value| f32x4::splat(simd, value);
        let [origin, direction] = origin_and_direction(simd, ray);
        let inverse = splat(1.0) / direction;
        let product = origin * inverse;
        // NaN fails each comparison, and so does an origin that is not finite.
        let is_bounded = inverse.abs().simd_le(splat(INVERSE_MAX)) & product.abs().simd_le(splat(PRODUCT_MAX));
        let t_min = ray.t_min.max(0.0);
        let squared = ray.direction.length_squared();
        if !(is_bounded.to_bitmask() & AXES == AXES
            && (f32::MIN_POSITIVE..=f32::MAX).contains(&squared)
            && t_min <= ray.t_max
            && t_min <= f32::MAX)
        {
            return None;
        }
        let pad = product.abs() * splat(PRODUCT_PAD) + splat(f32::MIN_POSITIVE);
        let is_negative = direction.simd_lt(splat(0.0)).to_bitmask() as u32;
        // Never -0, like a sum with a pad of zero.
        let origin = origin + splat(0.0);
        let boxes = Self {
            inverse: inverse.to_array(),
            near_product: (product + pad).to_array(),
            far_product: (product - pad).to_array(),
            t_min,
            near: each!(axis => (is_negative >> axis & 1) * WIDTH as u32),
        };
        Some((boxes, TriangleLanes::new(simd, ray, direction, [origin; 2], inverse, t_min)))
    }

    /// A ray that enters boxes as if they were larger by `widening` on both sides of each axis.
    #[inline(always)]
    pub(crate) fn widened<S: Simd>(simd: S, ray: &Ray, widening: [f32; 3]) -> Option<Self> {
        let (mut boxes, _) = Self::new(simd, ray)?;
        for (axis, widening) in widening.into_iter().enumerate() {
            let pad = widening * boxes.inverse[axis].abs();
            boxes.near_product[axis] += pad;
            boxes.far_product[axis] -= pad;
        }
        Some(boxes)
    }
}

impl<S: Simd> LaneTest<S, BoxLanes> for FusedBoxRay {
    const EXACT: bool = false;
    /// [`FAR_SLACK`](crate::geometry::FAR_SLACK), and more than the rounding of entry and exit, here and there (2.5 units of 2⁻²³ in each).
    const SLACK: f32 = 1.0 + 24.0 * f32::EPSILON;

    #[inline(always)]
    fn intersect_lanes(&self, simd: S, bounds: &BoxLanes, t_max: f32) -> (mask32x8<S>, f32x8<S>) {
        let splat = |value| f32x8::splat(simd, value);
        let coordinates: &[f32; 6 * WIDTH] = bytemuck::cast_ref(&bounds.0);
        let planes =
            |axis: usize, side: usize| f32x8::from_slice(simd, &coordinates[2 * WIDTH * axis + side..][..WIDTH]);
        let inverse = each!(axis => splat(self.inverse[axis]));
        let near = each!(axis => {
            let side = self.near[axis] as usize & WIDTH;
            planes(axis, side).mul_sub(inverse[axis], splat(self.near_product[axis]))
        });
        let far = each!(axis => {
            let side = self.near[axis] as usize & WIDTH ^ WIDTH;
            planes(axis, side).mul_sub(inverse[axis], splat(self.far_product[axis]))
        });
        let entry = near[0].max(near[1]).max(near[2].max(splat(self.t_min)));
        let exit = far[0].min(far[1]).min(far[2].min(splat(t_max))) * splat(<Self as LaneTest<S, BoxLanes>>::SLACK);
        (entry.simd_le(exit), entry)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::Aabb;
    use crate::kernel::SimdLevel;
    use crate::kernel::mix::next_unit;
    use crate::kernel::simd::dispatch;
    use crate::wide::bounds::WideContainer;
    use crate::wide::ray_lanes::RayLanes;

    /// More than the rounding of both tests: a small part of the slack.
    const LATEST: f32 = 1.0 + 3.0 * f32::EPSILON;

    /// A coordinate whose size varies by orders of magnitude, sometimes one of a few, so that rays begin on planes.
    fn coordinate(state: &mut u64) -> f32 {
        let [size, sign, choice] = [(); 3].map(|()| next_unit(state) as f32);
        let value = if choice < 0.3 { (size * 4.0).floor() } else { 10_f32.powf(size * 16.0 - 8.0) };
        if sign < 0.5 { -value } else { value }
    }

    fn vector(state: &mut u64) -> Vec3 {
        Vec3::from_array([(); 3].map(|()| coordinate(state)))
    }

    #[test]
    fn what_the_exact_test_enters_is_entered_no_later() {
        let mut state = 1;
        let mut count = 0;
        for _ in 0..20_000 {
            let mut bounds = Aabb::EMPTY_BOUNDS;
            let (origin, direction) = (vector(&mut state), vector(&mut state));
            for lane in 0..WIDTH - 1 {
                let (a, b) = (vector(&mut state), vector(&mut state));
                // Some begin at the ray, some are flat.
                let a = if lane < 3 { origin + direction * coordinate(&mut state) } else { a };
                let b = if lane == 0 { a } else { b };
                Aabb { min: a.min(b), max: a.max(b) }.store(&mut bounds, lane);
            }
            let ray = Ray { t_min: coordinate(&mut state).max(0.0), ..Ray::new(origin, direction) };
            for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
                dispatch!(level.level(), simd => {
                    let Some(lanes) = RayLanes::single::<_, Aabb>(simd, &ray) else { return };
                    let Some((fused, _)) = FusedBoxRay::new(simd, &ray) else { return };
                    let exact = LaneTest::intersect(&Aabb::prepare(simd, &lanes, 0), simd, &bounds, f32::MAX);
                    let found = fused.intersect(simd, &bounds, f32::MAX);
                    assert_eq!(exact.0 & !found.0, 0, "{level:?} {ray:?} {bounds:?}");
                    assert_eq!(found.0 >> (WIDTH - 1), 0, "an empty box");
                    for lane in (0..WIDTH).filter(|lane| exact.0 >> lane & 1 != 0) {
                        assert!(found.1[lane] <= exact.1[lane] * LATEST, "{level:?} {ray:?} {bounds:?}");
                        count += 1;
                    }
                });
            }
        }
        assert!(count > 20_000, "only {count} boxes were entered");
    }
}
