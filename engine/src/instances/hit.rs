//! Hits with copies.

use crate::geometry::Hit;
use crate::query::Listed;

/// Where a ray hits a copy of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InstanceHit {
    /// Distance along the ray, in lengths of its direction.
    pub t: f32,
    /// Index of the copy.
    pub instance: u32,
    /// Index of the triangle in the list that the tree of its mesh was built from.
    pub primitive_index: u32,
    /// Barycentric weight of the triangle's second corner.
    pub u: f32,
    /// Barycentric weight of the triangle's third corner.
    pub v: f32,
}

impl InstanceHit {
    /// A hit with a triangle of a copy.
    pub(super) fn new(instance: u32, Hit { t, primitive_index, u, v }: Hit) -> Self {
        Self { t, instance, primitive_index, u, v }
    }

    /// The nearer of two hits; of equal distances that of the lower copy, then that of the lower triangle, as in the flat scene.
    pub(super) fn nearer(self, other: Option<Self>) -> Self {
        let comes_first = |other: &Self| other.t < self.t || other.t == self.t && other.index() < self.index();
        other.filter(comes_first).unwrap_or(self)
    }
}

impl Listed for InstanceHit {
    fn t(&self) -> f32 {
        self.t
    }

    fn index(&self) -> impl Ord {
        (self.instance, self.primitive_index)
    }
}
