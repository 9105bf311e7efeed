//! A single ray against eight boxes with one fused multiply-add per plane.
//!
//! The distance of a plane is here plane · inverse - origin · inverse, with the second product computed once per ray, where
//! [`Aabb::entry`](crate::geometry::Aabb::entry) computes (plane - origin) · inverse. It rounds differently, and not the same on
//! machines without fused multiply-add. So the distances of entry are padded to come out no farther, and those of exit no
//! nearer, than there, on every machine: a ray visits the same nodes and rarely one more, and the triangles decide what is hit.

use fearless_simd::{Simd, SimdBase, SimdFloat, SimdMask, f32x4, f32x8};

use crate::kernel::each;
use crate::wide::box_lanes::{BoxLanes, LaneTest};
use crate::wide::layout::WIDTH;
use crate::wide::ray_lanes::RayLanes;

/// Factor on entry distances: more than the rounding of this test and of the other together (1.5 and 1 units of 2⁻²³).
const NEAR_FACTOR: f32 = 1.0 - 4.0 * f32::EPSILON;

/// Factor on exit distances: [`FAR_SLACK`](crate::geometry::FAR_SLACK), and more than the rounding of both tests.
const FAR_FACTOR: f32 = 1.0 + 24.0 * f32::EPSILON;

/// Part of origin · inverse by which distances are padded, more than its own rounding and that of plane · inverse.
const PRODUCT_PAD: f32 = 4.0 * f32::EPSILON;

/// Limits of inverse and origin · inverse: coordinates up to 1e18, for which triangles are watertight, cannot overflow.
const INVERSE_MAX: f32 = 1e18;
const PRODUCT_MAX: f32 = 1e37;

/// A single ray prepared for tests against eight boxes.
pub struct FusedBoxRay<S: Simd> {
    /// For each axis the offset of the near planes: 0 for the lower ones, [`WIDTH`] for the upper ones.
    near: [usize; 3],
    near_inverse: [f32x8<S>; 3],
    /// Origin · inverse, padded.
    near_product: [f32x8<S>; 3],
    far_inverse: [f32x8<S>; 3],
    far_product: [f32x8<S>; 3],
    t_min: f32x8<S>,
}

impl<S: Simd> FusedBoxRay<S> {
    /// `None` for a ray that is parallel to an axis's planes, or so nearly that numbers could overflow.
    #[inline(always)]
    pub(crate) fn new(simd: S, ray: &RayLanes<1>) -> Option<Self> {
        let splat = |value| f32x4::splat(simd, value);
        let vector = |[[x], [y], [z]]: [[f32; 1]; 3]| f32x4::load_array_ref(simd, &[x, y, z, 0.0]);
        let (origin, inverse) = (vector(ray.origin), -vector(ray.negative_inverse));
        let (near_inverse, far_inverse) = (inverse * splat(NEAR_FACTOR), inverse * splat(FAR_FACTOR));
        let (near, far) = (origin * near_inverse, origin * far_inverse);
        let is_bounded = inverse.abs().simd_le(splat(INVERSE_MAX)) & far.abs().simd_le(splat(PRODUCT_MAX));
        if !is_bounded.all_true() {
            return None;
        }
        let pad = far.abs() * splat(PRODUCT_PAD) + splat(f32::MIN_POSITIVE);
        let (near_product, far_product) = (near + pad, far - pad);
        let lanes = |vector: f32x4<S>| each!(axis => f32x8::splat(simd, vector.to_array()[axis]));
        Some(Self {
            near: each!(axis => ray.near[axis][0] as usize),
            near_inverse: lanes(near_inverse),
            near_product: lanes(near_product),
            far_inverse: lanes(far_inverse),
            far_product: lanes(far_product),
            t_min: f32x8::splat(simd, ray.t_min[0]),
        })
    }
}

impl<S: Simd> LaneTest<S, BoxLanes> for FusedBoxRay<S> {
    const EXACT: bool = false;

    #[inline(always)]
    fn intersect(&self, simd: S, bounds: &BoxLanes, t_max: f32) -> (u32, [f32; WIDTH]) {
        let coordinates: &[f32; 6 * WIDTH] = bytemuck::cast_ref(&bounds.0);
        let planes =
            |axis: usize, side: usize| f32x8::from_slice(simd, &coordinates[2 * WIDTH * axis + side..][..WIDTH]);
        let near = each!(axis => {
            planes(axis, self.near[axis] & WIDTH).mul_sub(self.near_inverse[axis], self.near_product[axis])
        });
        let far = each!(axis => {
            planes(axis, self.near[axis] & WIDTH ^ WIDTH).mul_sub(self.far_inverse[axis], self.far_product[axis])
        });
        let entry = near[0].max(near[1]).max(near[2].max(self.t_min));
        let exit = far[0].min(far[1]).min(far[2].min(f32x8::splat(simd, t_max)));
        (entry.simd_le(exit).to_bitmask() as u32, entry.to_array())
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;
    use glam::Vec3;

    use super::*;
    use crate::geometry::{Aabb, Ray};
    use crate::kernel::SimdLevel;
    use crate::kernel::mix::next_unit;
    use crate::wide::bounds::WideContainer;

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
                    let Some(lanes) = RayLanes::single(simd, &ray) else { return };
                    let Some(fused) = FusedBoxRay::new(simd, &lanes) else { return };
                    let exact = LaneTest::intersect(&Aabb::prepare(simd, &lanes, 0), simd, &bounds, f32::MAX);
                    let found = fused.intersect(simd, &bounds, f32::MAX);
                    assert_eq!(exact.0 & !found.0, 0, "{level:?} {ray:?} {bounds:?}");
                    assert_eq!(found.0 >> (WIDTH - 1), 0, "an empty box");
                    for lane in (0..WIDTH).filter(|lane| exact.0 >> lane & 1 != 0) {
                        assert!(found.1[lane] <= exact.1[lane], "{level:?} {ray:?} {bounds:?}");
                        count += 1;
                    }
                });
            }
        }
        assert!(count > 20_000, "only {count} boxes were entered");
    }
}
