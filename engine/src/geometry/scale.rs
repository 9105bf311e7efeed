//! Sizes whose areas leave the range of `f32`, and the powers of two that bring them back without rounding.

/// Largest size above which areas exceed the range of `f32`.
const MAX_SIZE: f32 = 1e15;
/// Largest size below which areas vanish.
const MIN_SIZE: f32 = 1e-10;
/// Binary logarithm of the size that others are scaled to. With a single triangle far away, such a size still keeps the areas
/// of all the others normal numbers: arithmetic with subnormal ones is ten times as slow.
const LOG2_SCALED_SIZE: f32 = 40.0;

/// The factor, a power of two, by which coordinates of this size are multiplied before areas are computed; 1 for ordinary ones.
pub(crate) fn area_scale(size: f32) -> f32 {
    if size == 0.0 || !size.is_finite() || (MIN_SIZE..=MAX_SIZE).contains(&size) {
        return 1.0;
    }
    (LOG2_SCALED_SIZE - size.log2()).floor().clamp(-126.0, 126.0).exp2()
}
