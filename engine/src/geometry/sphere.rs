//! Spheres.

use glam::Vec3;

/// Bound of the relative error of a ray-sphere test: about seven roundings.
pub(crate) const SPHERE_ENTRY_ERROR: f32 = 4e-7;
/// Bound of the absolute error of a difference of two squares, whose relative error is bounded only for normal numbers.
pub(crate) const SPHERE_SQUARE_ERROR: f32 = f32::MIN_POSITIVE;
/// Radius below which the square is no longer a normal number.
pub(crate) const SPHERE_TINY_RADIUS: f32 = 1e-18;
/// Bound of the absolute error of `t`, whose relative error is bounded only for normal numbers.
pub(crate) const SPHERE_T_ERROR: f32 = f32::MIN_POSITIVE;

/// A bounding sphere. A negative radius marks the empty sphere.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Sphere {
    /// The centre.
    pub center: Vec3,
    /// The radius, in world units.
    pub radius: f32,
}

impl Sphere {
    /// Whether the sphere contains no point.
    pub fn is_empty(&self) -> bool {
        self.radius < 0.0
    }
}

#[cfg(test)]
pub(super) mod tests {
    /// Scenes of any size, near and far, and rays of any length: size of what is hit, distance of the origin and length of the
    /// direction.
    pub(in crate::geometry) const SCALES: [(f32, f32, f32); 8] = [
        (1.0, 1.0, 1.0),
        (1.0, 1e3, 1.0),
        (1.0, 1e6, 1e-12),
        (1e-12, 1e-12, 1e16),
        (1e-21, 1e-20, 1e18),
        (1e-30, 1e-29, 1e18),
        (1e-12, 1.0, 1e-18),
        (1e15, 1e17, 1e18),
    ];

    /// A fixed sequence of numbers between -1 and 1.
    pub(in crate::geometry) fn numbers() -> impl FnMut() -> f32 {
        let mut state = 1_u32;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        }
    }
}
