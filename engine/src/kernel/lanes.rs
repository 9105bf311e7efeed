//! Shapes of the builder's vectors: fields per container, primitives per batch, clusters per vector.
//!
//! Kernels fill arrays of vectors in loops, not by `std::array::from_fn`: that may stay a function of its own, which has not the
//! instructions of the level that calls it, so that each operation in it becomes a call.

use fearless_simd::{Simd, SimdFloat};

/// Number of `f32` fields of a container: the two corners of a box; the centre and radius of a sphere, which leaves two unused.
pub const FIELDS: usize = 6;
/// Number of primitives whose containers and codes are computed at a time.
pub const LANES: usize = 8;

/// A SIMD vector of `f32`, one lane per cluster or child.
pub trait Lanes<S: Simd>: SimdFloat<S, Element = f32> {}

impl<S: Simd, V: SimdFloat<S, Element = f32>> Lanes<S> for V {}
