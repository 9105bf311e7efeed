//! Lengths and directions of vectors of any size: models may be 1e-30 or 1e18 across, and the squares of such coordinates leave the
//! range of single precision.

use std::ops::Range;

use glam::Vec3;

/// Squared lengths that are neither rounded coarsely nor close to overflow.
const SAFE_SQUARES: Range<f32> = 1e-30..1e30;

/// The length of a vector.
pub fn length(vector: Vec3) -> f32 {
    let squared = vector.length_squared();
    let largest = vector.abs().max_element();
    if SAFE_SQUARES.contains(&squared) || largest == 0.0 || !largest.is_finite() {
        return squared.sqrt();
    }
    (vector / largest).length() * largest
}

/// The unit vector along a vector; `None` for one without a direction.
pub fn direction(vector: Vec3) -> Option<Vec3> {
    if SAFE_SQUARES.contains(&vector.length_squared()) {
        return vector.try_normalize();
    }
    let largest = vector.abs().max_element();
    (vector / largest).try_normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_of_any_size_have_a_length_and_a_direction() {
        for size in [1e-38_f32, 1e-30, 1e-20, 1e-9, 1.0, 1e9, 1e18, 1e37] {
            let vector = Vec3::new(3.0, 0.0, -4.0) * size;
            assert!((length(vector) / size - 5.0).abs() < 1e-4, "{size}: {}", length(vector));
            let unit = direction(vector).unwrap_or_default();
            assert!((unit - Vec3::new(0.6, 0.0, -0.8)).length() < 1e-5, "{size}: {unit}");
        }
        assert_eq!((length(Vec3::ZERO), direction(Vec3::ZERO)), (0.0, None));
        assert_eq!(direction(Vec3::INFINITY), None);
        assert_eq!(direction(Vec3::NAN), None);
    }
}
