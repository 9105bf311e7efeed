//! Shapes of the builder's vectors: fields per container, primitives per batch, clusters per vector.
//!
//! Kernels fill arrays of vectors in loops, not by `std::array::from_fn`: that may stay a function of its own, which has not the
//! instructions of the level that calls it, so that each operation in it becomes a call.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use std::ops::IndexMut;

use fearless_simd::{Simd, SimdFloat};

/// One value for each field of a container.
pub trait Fields<T>: Copy + Send + IndexMut<usize, Output = T> {
    /// The same value for all.
    fn splat(value: T) -> Self;
}

impl<T: Copy + Send, const N: usize> Fields<T> for [T; N] {
    #[inline(always)]
    fn splat(value: T) -> Self {
        [value; N]
    }
}

/// Number of primitives whose containers and codes are computed at a time.
pub const LANES: usize = 8;

/// A SIMD vector of `f32`, one lane per cluster or child.
pub trait Lanes<S: Simd>: SimdFloat<S, Element = f32> {}

impl<S: Simd, V: SimdFloat<S, Element = f32>> Lanes<S> for V {}
