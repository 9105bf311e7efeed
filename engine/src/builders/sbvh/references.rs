//! References to triangles, of which several can stand for one, each for the part in its box.

use bytemuck::Zeroable;

use crate::geometry::{Aabb, Triangle};

/// Maximum number of references that are built by one thread.
pub const FORK_ABOVE: usize = 4096;

/// A part of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Zeroable)]
pub struct Reference {
    /// Box around the part.
    pub bounds: Aabb,
    /// Index of the triangle.
    pub triangle: u32,
}

/// The triangles, and what all nodes share.
pub struct Scene<'a> {
    pub triangles: &'a [Triangle],
    /// Distance by which parts extend beyond planes.
    pub overlap: f64,
    /// Area that both sides of a node have in common above which planes are tried.
    pub min_common_area: f32,
}

/// The box around `references`.
pub fn around(references: &[Reference]) -> Aabb {
    references.iter().fold(Aabb::EMPTY, |all, reference| all.union(&reference.bounds))
}
