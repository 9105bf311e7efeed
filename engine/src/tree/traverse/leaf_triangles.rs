//! Where a traversal finds the triangles of a leaf.

use std::ops::Range;

use crate::geometry::Triangle;
#[cfg(doc)]
use crate::tree::Tree;

/// Access to the triangles of a tree's leaves.
pub trait LeafTriangles: Copy {
    /// The triangles in a range of slots of [`Tree::primitive_indices`].
    fn in_slots(&self, slots: Range<usize>) -> impl Iterator<Item = &Triangle>;
}

/// Triangles in leaf order, as [`Tree::leaf_triangles`] returns them: the fastest for many rays.
impl LeafTriangles for &[Triangle] {
    #[inline(always)]
    fn in_slots(&self, slots: Range<usize>) -> impl Iterator<Item = &Triangle> {
        self[slots].iter()
    }
}

impl LeafTriangles for &Vec<Triangle> {
    #[inline(always)]
    fn in_slots(&self, slots: Range<usize>) -> impl Iterator<Item = &Triangle> {
        self[slots].iter()
    }
}

/// Triangles in the order in which the builder got them: for so few rays that bringing them into leaf order would take longer.
#[derive(Debug, Clone, Copy)]
pub struct IndexedTriangles<'a> {
    /// The list that the tree was built from.
    pub triangles: &'a [Triangle],
    /// The tree's [`Tree::primitive_indices`].
    pub indices: &'a [u32],
}

impl LeafTriangles for IndexedTriangles<'_> {
    #[inline(always)]
    fn in_slots(&self, slots: Range<usize>) -> impl Iterator<Item = &Triangle> {
        self.indices[slots].iter().map(|&index| &self.triangles[index as usize])
    }
}
