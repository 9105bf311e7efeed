//! Quasi-random numbers that depend only on pixel and sample, so pictures are the same on any number of threads.

use glam::{Vec2, Vec3};

/// Roberts' R2 sequence: 1/g and 1/g² with g the plastic number (Martin Roberts, *The Unreasonable Effectiveness of
/// Quasirandom Sequences*, 2018).
const R2: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// Point `index` of the R2 sequence in the unit square, shifted by `shift` modulo 1.
fn r2(index: u32, shift: Vec2) -> Vec2 {
    let step = |factor: f64| (f64::from(index) * factor).fract() as f32;
    let point = Vec2::new(step(R2[0]), step(R2[1])) + shift;
    point - point.floor()
}

/// Position of sample `sample` within its pixel, 0 to 1 on both axes; the first is the centre.
pub(super) fn subpixel(sample: u32) -> Vec2 {
    r2(sample, Vec2::splat(0.5))
}

/// Identifies a sample of a pixel; seeds everything that varies between pixels.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SampleId {
    /// Column of the traced pixel.
    pub x: u32,
    /// Row of the traced pixel.
    pub y: u32,
    /// Index of the sample pass, from 0.
    pub sample: u32,
}

impl SampleId {
    /// Point `index` of this pixel's sequence in the unit square.
    pub(super) fn point(self, index: u32) -> Vec2 {
        r2(index, shift(hash(self.x, self.y)))
    }

    /// This sample's point of another sequence of the pixel, for the direction to a light.
    pub(super) fn light_point(self) -> Vec2 {
        r2(self.sample, shift(hash(!self.y, self.x)))
    }
}

/// A point of the unit square from the two halves of a hash.
fn shift(hash: u32) -> Vec2 {
    Vec2::new((hash & 0xffff) as f32, (hash >> 16) as f32) / 65_536.0
}

/// Hashes two numbers into 32 bits (the finaliser of `MurmurHash3`, public domain).
fn hash(x: u32, y: u32) -> u32 {
    let mut h = x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b).rotate_left(13);
    h ^= h >> 16;
    h = h.wrapping_mul(0x85eb_ca6b);
    h ^= h >> 13;
    h = h.wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

/// A cosine-distributed unit direction around `normal` from a point of the unit square.
pub(super) fn cosine_direction(normal: Vec3, point: Vec2) -> Vec3 {
    let (sin, cos) = (point.x * std::f32::consts::TAU).sin_cos();
    let radius = point.y.sqrt();
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    tangent * (radius * cos) + bitangent * (radius * sin) + normal * (1.0 - point.y).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_sample_is_the_centre_and_the_others_spread() {
        assert_eq!(subpixel(0), Vec2::splat(0.5));
        let mean = (0..64).map(subpixel).sum::<Vec2>() / 64.0;
        assert!((mean - Vec2::splat(0.5)).length() < 0.03, "{mean}");
        assert!((0..64).map(subpixel).all(|p| p.min_element() >= 0.0 && p.max_element() < 1.0));
    }

    #[test]
    fn cosine_directions_have_unit_length_and_mean_two_thirds_of_the_normal() {
        let normal = Vec3::new(1.0, 2.0, -2.0) / 3.0;
        let id = SampleId { x: 3, y: 5, sample: 0 };
        let directions: Vec<_> = (0..1024).map(|index| cosine_direction(normal, id.point(index))).collect();
        assert!(directions.iter().all(|d| (d.length() - 1.0).abs() < 1e-4 && d.dot(normal) > -1e-4));
        let mean = directions.iter().sum::<Vec3>() / 1024.0;
        assert!((mean - normal * (2.0 / 3.0)).length() < 0.01, "{mean}");
    }
}
