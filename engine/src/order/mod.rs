//! Primitives along a space-filling curve: their codes, the radix sort, and where a range of them splits.

pub(crate) mod morton;

pub(crate) mod curve;
pub(crate) mod primitive;
pub(crate) mod radix_sort;
pub(crate) mod sorted_primitives;
mod triangle_spheres;
