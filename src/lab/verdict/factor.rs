//! The factor between two measured trees with its interval, and whether that decides.

use std::cmp::Ordering;

/// Probability that an interval contains the true factor, so that of a hundred equal pairs of trees one is called different.
pub const CONFIDENCE: f64 = 0.99;
/// The least number of pairs that can decide: eight in one direction have a probability of 2 in 256.
pub const LEAST_PAIRS: usize = 8;
/// Factor by which samples must differ that were not taken in turn: the machine may have changed its clock or its load in between.
pub const DRIFT: f64 = 1.1;

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
    pub(super) margin: f64,
}

impl Factor {
    /// Whether B's value is less or greater than A's; `None` where that is not decided.
    pub fn decided(&self) -> Option<Ordering> {
        let [least, most] = self.interval?;
        if least > self.margin {
            return Some(Ordering::Greater);
        }
        (most < 1.0 / self.margin).then_some(Ordering::Less)
    }
}
