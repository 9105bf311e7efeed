//! The comparison of a number of two trees: which way is better, as far as that is decided.

use std::cmp::Ordering;

use super::factor::{Factor, Order};
use crate::catalog::numbers::{Compared, Direction};

/// Relative change of a count or cost below which it counts as none.
const EQUAL: f64 = 0.0005;

/// A number with the values of its rounds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Reading {
    /// The number; NaN where it is not known.
    pub value: f64,
    /// Its value in each round, of a time or speed that was repeated.
    pub rounds: Vec<f64>,
    /// Half-width of the interval around an estimate; 0 of an exact number.
    pub margin: f64,
}

/// The direction in which a number went from one tree to another, and of a time or speed the factor that decides it.
pub fn judge(compared: &Compared, before: &Reading, now: &Reading, order: Order) -> (Verdict, Option<Factor>) {
    let change = now.value - before.value;
    if change.is_nan() {
        return (Verdict::Different, None);
    }
    let (direction, factor) = if compared.is_timed {
        let Some(factor) = Factor::of(&before.rounds, &now.rounds, order) else { return (Verdict::Once, None) };
        let Some(direction) = factor.decided() else { return (Verdict::Undecided, Some(factor)) };
        (direction, Some(factor))
    } else if change != 0.0 && change.abs() <= before.margin.hypot(now.margin) {
        return (Verdict::Undecided, None);
    } else if change.abs() <= before.value.abs() * EQUAL {
        return (Verdict::Same, None);
    } else {
        (now.value.total_cmp(&before.value), None)
    };
    let verdict = match compared.better {
        None => Verdict::Different,
        Some(better) if (better == Direction::Less) == (direction == Ordering::Less) => Verdict::Better,
        Some(_) => Verdict::Worse,
    };
    (verdict, factor)
}

/// The direction in which a number went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The tree now is better.
    Better,
    /// The tree before was better.
    Worse,
    /// No difference.
    Same,
    /// The rounds, or the intervals of estimates, do not decide.
    Undecided,
    /// One of the two was measured only once, so that chance cannot be told from difference.
    Once,
    /// There is a difference, and neither direction is better; or one of the two is not known.
    Different,
}

impl Verdict {
    /// The word beside the difference; empty where neither direction is better.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Better => "better",
            Self::Worse => "worse",
            Self::Same => "same",
            Self::Undecided => "not decided",
            Self::Once | Self::Different => "",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::numbers::Number;
    use crate::catalog::numbers::rows::{BUILD_MS, MRAYS_PER_S, NODES, SAH_COST};

    #[test]
    fn times_are_judged_by_their_rounds_and_counts_by_themselves() {
        let of = |number: &Number, before: &Reading, now: &Reading| {
            number.compared.map(|compared| judge(&compared, before, now, Order::InTurn).0)
        };
        let rounds = |times: [f64; 9]| Reading { value: times[4], rounds: times.to_vec(), margin: 0.0 };
        let single = |value| Reading { value, ..Reading::default() };
        let before = rounds([19.0, 20.0, 21.0, 20.0, 20.0, 24.0, 20.0, 19.5, 20.0]);
        let less = rounds([18.0, 19.0, 20.0, 19.0, 19.0, 23.0, 19.0, 18.5, 19.0]);
        assert_eq!(of(BUILD_MS, &before, &less), Some(Verdict::Better), "1 ms in each round, of which 5 varies");
        assert_eq!(of(BUILD_MS, &less, &before), Some(Verdict::Worse));
        assert_eq!(of(MRAYS_PER_S, &less, &before), Some(Verdict::Better));
        let mixed = rounds([18.0, 19.0, 22.0, 19.0, 19.0, 25.0, 19.0, 20.5, 19.0]);
        assert_eq!(of(BUILD_MS, &before, &mixed), Some(Verdict::Undecided));
        assert_eq!(of(BUILD_MS, &before, &single(1.0)), Some(Verdict::Once));
        assert_eq!(of(SAH_COST, &single(20.0), &single(20.005)), Some(Verdict::Same));
        assert_eq!(of(SAH_COST, &single(20.0), &single(19.0)), Some(Verdict::Better));
        assert_eq!(of(NODES, &single(20.0), &single(19.0)), Some(Verdict::Different));
        assert_eq!(of(SAH_COST, &single(f64::NAN), &single(19.0)), Some(Verdict::Different));
    }
}
