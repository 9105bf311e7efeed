//! The comparison of the times of trees.

use std::cmp::Ordering;

use super::factor::{Factor, LEAST_PAIRS, Order};
use super::{apart, pairs};

/// Of more pairs ratios are not compared all to all: one disturbed pair is none of them.
const MOST_TO_ALL: usize = 64;

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
