//! Spheres.

use glam::Vec3;

/// A sphere. A negative radius marks the empty sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Sphere {
    /// The middle.
    pub center: Vec3,
    /// The distance from the middle to the surface, in world units.
    pub radius: f32,
}
