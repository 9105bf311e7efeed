//! Judging measurements: whether two trees differ in a time, by which factor, and how sure that is.
//!
//! Pure functions of samples, which tables, JSON, plots and the window share. Each interval and each verdict has the confidence
//! [`CONFIDENCE`], and assumes no distribution of the noise: other programs make it drift, come in bursts and have a heavy tail.
//!
//! - Measured in turn, A and B in each round or frame, the *pairs* are compared: the sign test (Arbuthnot 1710) over the ratios of a
//!   pair, and the interval between two of the sorted ratios that contains the median (Thompson 1936).
//! - Measured one after the other, or in so few rounds that a disturbed one of them would hide any factor, all ratios of a sample of each are compared: the rank-sum
//!   test (Mann and Whitney 1947) with the interval of Hodges and Lehmann (1963). The machine may have changed in between, so that
//!   factors below [`DRIFT`] are not judged.

mod apart;
mod compare;
mod factor;
pub(super) mod number;
mod pairs;
mod rows;
pub(super) mod word;

pub use compare::has_fastest;
pub use factor::{CONFIDENCE, DRIFT, Factor, LEAST_PAIRS, Order};
pub use number::{Reading, Verdict, judge};
pub use pairs::median_interval;
pub use rows::{add_verdicts, base_of, judge_rows, sort_by_speed};
pub use word::{RowVerdict, Word};

#[cfg(test)]
mod noise_tests;
