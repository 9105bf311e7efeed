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
mod pairs;

mod number;
mod rows;

pub use number::{Reading, Verdict, judge};
pub use rows::{RowVerdict, Word, add_verdicts, base_of, judge_rows, sort_by_speed};

use std::cmp::Ordering;

/// Probability that an interval contains the true factor, so that of a hundred equal pairs of trees one is called different.
pub const CONFIDENCE: f64 = 0.99;
/// The least number of pairs that can decide: eight in one direction have a probability of 2 in 256.
pub const LEAST_PAIRS: usize = 8;
/// Factor by which samples must differ that were not taken in turn: the machine may have changed its clock or its load in between.
pub const DRIFT: f64 = 1.1;

/// Of more pairs ratios are not compared all to all: one disturbed pair is none of them.
const MOST_TO_ALL: usize = 64;

/// How two lists of samples belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// In turn: the samples of one place in both lists were taken in the same round or frame.
    InTurn,
    /// First all of one, then all of the other.
    OneAfterOther,
}

/// The factor between two measured trees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factor {
    /// The median of the ratios, B over A.
    pub median: f64,
    /// The interval in which the true factor is; `None` where there are too few samples for one.
    pub interval: Option<[f64; 2]>,
    /// Number of rounds or frames: of pairs, or of the samples of the tree that has fewer.
    pub count: usize,
    /// B's value is less in so many of them; `None` where the samples are no pairs.
    pub less: Option<usize>,
    /// Factor beyond which the interval must lie.
    margin: f64,
}

impl Factor {
    /// B's factor over A from samples of both, all positive; `None` where one has fewer than two.
    pub fn of(a: &[f64], b: &[f64], order: Order) -> Option<Self> {
        let pairs = a.len().min(b.len());
        match order {
            Order::InTurn if pairs >= LEAST_PAIRS => {
                let (a, b) = (&a[..pairs], &b[..pairs]);
                let paired = pairs::factor(a, b);
                // Of few pairs a single disturbed one swallows any factor; not that of all to all.
                let all = || (pairs <= MOST_TO_ALL).then(|| apart::factor(a, b, order));
                let is_decided = |factor: &Self| factor.decided().is_some();
                Some(Some(paired).filter(is_decided).or_else(|| all().filter(is_decided)).unwrap_or(paired))
            }
            _ => (pairs >= 2).then(|| apart::factor(a, b, order)),
        }
    }

    /// Whether B's value is less or greater than A's; `None` where that is not decided.
    pub fn decided(&self) -> Option<Ordering> {
        let [least, most] = self.interval?;
        if least > self.margin {
            return Some(Ordering::Greater);
        }
        (most < 1.0 / self.margin).then_some(Ordering::Less)
    }
}

/// Whether one of several trees, of which these are the times, is decidedly the fastest: it takes less than each other. A tree without times
/// decides nothing.
pub fn has_fastest(times: &[&[f64]], order: Order) -> bool {
    let beats = |best: usize, other: usize| {
        best == other
            || Factor::of(times[other], times[best], order).and_then(|factor| factor.decided()) == Some(Ordering::Less)
    };
    times.len() > 1 && (0..times.len()).any(|best| (0..times.len()).all(|other| beats(best, other)))
}

/// The interval between two of `sorted` values that contains their median; `None` of fewer than [`LEAST_PAIRS`].
pub fn median_interval(sorted: &[f64]) -> Option<[f64; 2]> {
    pairs::left_out(sorted.len()).map(|out| [sorted[out], sorted[sorted.len() - 1 - out]])
}

#[cfg(test)]
mod noise_tests;
