//! Low-level helpers of the whole engine: SIMD levels and lanes, bit sets, forks, parallel tasks and lists, prefetching. Knows nothing of
//! trees and rays.

pub(crate) mod bits;
mod each;
pub mod fork;
pub(crate) mod lanes;
pub(crate) mod mix;
pub mod parallel;
pub(crate) mod prefetch;
pub(crate) mod simd;

pub(crate) use each::each;
pub use simd::SimdLevel;
