//! What every room of the engine uses: the level of vector instructions, lanes, sets of bits, parallel lists, prefetching. Knows
//! nothing of trees and rays.

pub(crate) mod bits;
mod each;
pub(crate) mod lanes;
pub(crate) mod par_collect;
pub(crate) mod prefetch;
pub(crate) mod simd;

pub(crate) use each::each;
pub use par_collect::par_collect;
pub use simd::SimdLevel;
