//! The smallest spheres around triangles, eight at a time.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f32x8};

use crate::geometry::{Container as _, Sphere, Triangle};
use crate::kernel::lanes::LANES;

/// Range of the longest edge's squared length within which the computation neither underflows nor overflows.
const SAFE_SQUARES: [f32; 2] = [1e-24, 1e30];
/// Ratio of the shortest to the longest squared edge below which a triangle gets the sphere of its longest edge: at most 0.1 %
/// larger than the smallest, while the circumcircle of such a sliver would be dominated by rounding errors.
const SLIVER: f32 = 1e-3;
/// Exceeds the relative rounding error of the differences, the square root and this product.
const ROUND_UP: f32 = 1.0 + 4.0 * f32::EPSILON;

/// Centre and radius (x, y, z, r) of the bounding sphere of each of `triangles`, see [`Sphere::of_triangle`]: never smaller
/// than that, and larger by rounding only.
#[inline(always)]
pub fn spheres_around<S: Simd>(simd: S, triangles: &[Triangle; LANES]) -> [[f32; 4]; LANES] {
    let mut columns = [[0.0; LANES]; 9];
    for (lane, triangle) in triangles.iter().enumerate() {
        let coordinates: &[f32; 9] = bytemuck::cast_ref(triangle);
        for (column, coordinate) in columns.iter_mut().zip(coordinates) {
            column[lane] = *coordinate;
        }
    }
    let [ax, ay, az, bx, by, bz, cx, cy, cz] = columns.map(|column| f32x8::from_slice(simd, &column));
    let ab = squared(bx - ax, by - ay, bz - az);
    let bc = squared(cx - bx, cy - by, cz - bz);
    let ca = squared(ax - cx, ay - cy, az - cz);
    let longest = ab.max(bc).max(ca);
    let shortest = ab.min(bc).min(ca);

    // Squared edge lengths relative to the longest one's.
    let zero = f32x8::splat(simd, 0.0);
    let unit = f32x8::splat(simd, 1.0) / longest;
    let (rab, rbc, rca) = (ab * unit, bc * unit, ca * unit);
    // Acute triangle: barycentric weights of the circumcentre.
    let wa = rbc * (rab + rca - rbc);
    let wb = rca * (rab + rbc - rca);
    let wc = rab * (rbc + rca - rab);
    let total = wa + wb + wc;
    // Obtuse or right triangle, or sliver: the longest edge is a diameter.
    let half = f32x8::splat(simd, 0.5);
    let (at_ab, at_bc) = (ab.simd_eq(longest), bc.simd_eq(longest));
    let edge = (longest + longest).simd_ge(ab + bc + ca) | (longest * SLIVER).simd_ge(shortest);
    let inverse_total = f32x8::splat(simd, 1.0) / total;
    let wa = edge.select(at_ab.select(half, at_bc.select(zero, half)), wa * inverse_total);
    let wb = edge.select(at_ab.select(half, at_bc.select(half, zero)), wb * inverse_total);
    let wc = edge.select(at_ab.select(zero, half), wc * inverse_total);
    let x = ax * wa + bx * wb + cx * wc;
    let y = ay * wa + by * wb + cy * wc;
    let z = az * wa + bz * wb + cz * wc;
    // Measured from the rounded centre, so that rounding cannot leave a corner outside.
    let radius_squared =
        squared(ax - x, ay - y, az - z).max(squared(bx - x, by - y, bz - z)).max(squared(cx - x, cy - y, cz - z));
    let radius = radius_squared.sqrt() * ROUND_UP;

    let safe =
        longest.simd_ge(f32x8::splat(simd, SAFE_SQUARES[0])) & longest.simd_le(f32x8::splat(simd, SAFE_SQUARES[1]));
    let safe = safe.to_bitmask();
    let columns: [[f32; LANES]; 4] = [x.into(), y.into(), z.into(), radius.into()];
    let mut spheres = [[0.0; 4]; LANES];
    for (lane, (sphere, triangle)) in spheres.iter_mut().zip(triangles).enumerate() {
        *sphere = [columns[0][lane], columns[1][lane], columns[2][lane], columns[3][lane]];
        if safe >> lane & 1 == 0 {
            let Sphere { center, radius } = Sphere::of_triangle(triangle);
            *sphere = [center.x, center.y, center.z, radius];
        }
    }
    spheres
}

#[inline(always)]
fn squared<S: Simd>(x: f32x8<S>, y: f32x8<S>, z: f32x8<S>) -> f32x8<S> {
    x * x + y * y + z * z
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::kernel::SimdLevel;
    use crate::kernel::simd::dispatch_plain;

    /// Triangles of all shapes: any, thin, right, flat, in a point; at many sizes, near the origin and far from it.
    fn triangles() -> Vec<Triangle> {
        let mut state = 1_u32;
        let mut number = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        let mut all = Vec::new();
        for scale in [1.0, 1e-3, 1e14, 1e-11, 1e-14, 1e20, 1e-30, 1e-42] {
            for offset in [0.0, 100.0] {
                for shape in 0..6 {
                    for _ in 0..40 {
                        let mut corner = || Vec3::new(number(), number(), number());
                        let (a, b) = (corner(), corner());
                        let c = match shape {
                            0 => corner(),
                            1 => a + corner() * 1e-2,
                            2 => a + corner() * 1e-5,
                            3 => a + (b - a).any_orthonormal_vector(),
                            4 => a.lerp(b, 0.3),
                            _ => a,
                        };
                        let place = |point: Vec3| (point + Vec3::splat(offset)) * scale;
                        all.push(Triangle { a: place(a), b: place(b), c: place(c) });
                    }
                }
            }
        }
        all
    }

    #[test]
    fn they_hold_their_triangles_and_are_small_at_every_level() {
        for triangles in triangles().as_chunks::<LANES>().0 {
            let expected = dispatch_plain!(SimdLevel::of_builds().level(), simd => spheres_around(simd, triangles));
            for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
                let found = dispatch_plain!(level.level(), simd => spheres_around(simd, triangles));
                assert_eq!(found, expected, "{}", level.name());
            }
            for (triangle, [x, y, z, radius]) in triangles.iter().zip(expected) {
                let sphere = Sphere { center: Vec3::new(x, y, z), radius };
                let smallest = Sphere::of_triangle(triangle);
                // The centre moves by half a unit in the last place of its coordinates.
                let rounding = smallest.center.abs().max_element() * f32::EPSILON * 2.0;
                assert!(radius <= smallest.radius * 1.001 + rounding, "{triangle:?} → {sphere:?}, {smallest:?}");
                for corner in [triangle.a, triangle.b, triangle.c] {
                    let distance = sphere.center.as_dvec3().distance(corner.as_dvec3());
                    assert!(distance <= f64::from(radius), "{triangle:?} → {sphere:?}");
                }
            }
        }
    }
}
