//! The shapes of the builder's vectors: how many numbers describe a container, how many primitives are prepared at a time.

use fearless_simd::{Simd, SimdFloat};

/// Numbers that describe a container; a sphere leaves two unused.
pub const FIELDS: usize = 6;
/// Primitives prepared at a time.
pub const LANES: usize = 8;

/// A vector of numbers of as many clusters.
pub trait Lanes<S: Simd>: SimdFloat<S, Element = f32> {}

impl<S: Simd, V: SimdFloat<S, Element = f32>> Lanes<S> for V {}
