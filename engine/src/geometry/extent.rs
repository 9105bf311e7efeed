//! The box around coordinates in double precision, and the offset without which single precision would lose their decimals.

use glam::DVec3;

/// Largest error of rounding to single precision, as a fraction of the model's size, that needs no offset.
const MAX_RELATIVE_ERROR: f64 = 1e-6;

/// The box around coordinates in double precision.
#[derive(Debug, Clone, Copy)]
pub struct Extent {
    min: DVec3,
    max: DVec3,
}

impl Extent {
    /// The empty box.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Enlarges the box by a point; points that are not finite are ignored.
    pub fn add(&mut self, point: DVec3) {
        if point.is_finite() {
            (self.min, self.max) = (self.min.min(point), self.max.max(point));
        }
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The box around `points`.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        let mut extent = Self::EMPTY;
        points.into_iter().for_each(|point| extent.add(point));
        extent
    }

    /// The offset to subtract from all coordinates: a point near the centre, whose coordinates are multiples of a power of two; zero
    /// where single precision is good enough.
    pub fn offset(&self) -> DVec3 {
        let size = (self.max - self.min).max_element();
        let reach = self.min.abs().max(self.max.abs()).max_element();
        // Rounding errs by up to half of the distance between neighbouring numbers.
        let error = reach * f64::from(f32::EPSILON) * 0.5;
        if !(size > 0.0 && error > size * MAX_RELATIVE_ERROR) {
            return DVec3::ZERO;
        }
        let step = size.log2().ceil().exp2();
        let offset = (self.min.midpoint(self.max) / step).round() * step;
        if offset.is_finite() { offset } else { DVec3::ZERO }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_coordinates_that_lose_a_millionth_of_the_size_are_moved() {
        let of = |min: DVec3, max: DVec3| Extent::around([min, max, DVec3::NAN]).offset();
        // A wall in UTM coordinates: 408201.58 rounds to 408201.59375.
        let wall = of(DVec3::new(408_201.58, 4_080_928.0, 0.0), DVec3::new(408_205.58, 4_080_928.1, 2.5));
        assert_eq!(wall, DVec3::new(408_204.0, 4_080_928.0, 0.0));
        // Half of 2^-23 times 16 is just below a millionth, times 17 above it.
        assert_eq!(of(DVec3::splat(15.0), DVec3::splat(16.0)), DVec3::ZERO);
        assert_eq!(of(DVec3::splat(-17.0), DVec3::splat(-16.0)), DVec3::splat(-17.0));
        assert_eq!(of(DVec3::splat(1e-30), DVec3::splat(1e-28)), DVec3::ZERO);
        assert_eq!(of(DVec3::splat(1e9), DVec3::splat(1e9)), DVec3::ZERO, "a point has no size");
        assert_eq!(Extent::EMPTY.offset(), DVec3::ZERO);
        assert!(of(DVec3::splat(1e300), DVec3::splat(1e300 + 1e285)).is_finite());
        let halves = [17.0, 16.0].map(|at| Extent::around([DVec3::splat(at)]));
        assert_eq!(halves[0].union(&halves[1]).offset(), DVec3::splat(17.0), "the box around both");
    }
}
