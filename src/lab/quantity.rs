//! The comparison of a number of two trees: which way is better, beyond noise.

use crate::catalog::numbers::{Compared, Direction};

/// Relative change of a count or cost below which it counts as none.
const EQUAL: f64 = 0.0005;

/// A number with the spread of its repetitions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// The number; NaN where it is not known.
    pub value: f64,
    /// Smallest and largest value of the repetitions, where there are several.
    pub spread: Option<[f64; 2]>,
}

impl Reading {
    fn width(self) -> Option<f64> {
        self.spread.map(|[least, most]| most - least)
    }
}

/// The direction in which a number went from one tree to another. A time or speed is judged only where the difference exceeds
/// the spreads of both.
pub fn verdict(compared: &Compared, before: Reading, now: Reading) -> Verdict {
    let difference = (now.value - before.value).abs();
    if difference.is_nan() {
        return Verdict::Different;
    }
    if compared.is_timed {
        match before.width().zip(now.width()) {
            None => return Verdict::Once,
            Some((a, b)) if difference <= a.max(b) => return Verdict::Noise,
            Some(_) => {}
        }
    } else if difference <= before.value.abs() * EQUAL {
        return Verdict::Same;
    }
    match compared.better {
        None => Verdict::Different,
        Some(better) if (better == Direction::Less) == (now.value < before.value) => Verdict::Better,
        Some(_) => Verdict::Worse,
    }
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
    /// The difference is smaller than the spread of the repetitions.
    Noise,
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
            Self::Noise => "within noise",
            Self::Once | Self::Different => "",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::numbers::rows::{BUILD_MS, MRAYS_PER_S, NODES, SAH_COST};

    #[test]
    fn times_are_judged_beyond_both_spreads_alone() {
        let reading = |value, spread| Reading { value, spread };
        let of = |number: &crate::catalog::numbers::Number, before, now| {
            number.compared.map(|compared| verdict(&compared, before, now))
        };
        let narrow = reading(20.0, Some([19.0, 21.0]));
        assert_eq!(of(BUILD_MS, narrow, reading(17.0, Some([16.5, 18.0]))), Some(Verdict::Better));
        assert_eq!(of(BUILD_MS, narrow, reading(23.0, Some([22.5, 23.5]))), Some(Verdict::Worse));
        assert_eq!(of(BUILD_MS, narrow, reading(17.0, Some([16.0, 20.0]))), Some(Verdict::Noise), "a wide spread now");
        assert_eq!(of(BUILD_MS, reading(17.0, Some([16.0, 20.0])), narrow), Some(Verdict::Noise), "and before");
        assert_eq!(of(BUILD_MS, narrow, reading(1.0, None)), Some(Verdict::Once));
        assert_eq!(of(MRAYS_PER_S, narrow, reading(25.0, Some([24.0, 26.0]))), Some(Verdict::Better));
        assert_eq!(of(SAH_COST, reading(20.0, None), reading(20.005, None)), Some(Verdict::Same));
        assert_eq!(of(SAH_COST, reading(20.0, None), reading(19.0, None)), Some(Verdict::Better));
        assert_eq!(of(NODES, reading(20.0, None), reading(19.0, None)), Some(Verdict::Different));
        assert_eq!(of(SAH_COST, reading(f64::NAN, None), reading(19.0, None)), Some(Verdict::Different));
    }
}
