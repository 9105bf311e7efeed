//! Samples that were taken in turn: the sign test over the ratios of each pair.

use super::factor::{CONFIDENCE, Factor};
use crate::catalog::reading::quantile;

/// The factor of pairs, of which there are enough.
pub(super) fn factor(a: &[f64], b: &[f64]) -> Factor {
    let mut ratios: Vec<f64> = a.iter().zip(b).map(|(a, b)| b / a).collect();
    ratios.sort_by(f64::total_cmp);
    let less = ratios.iter().filter(|ratio| **ratio < 1.0).count();
    let interval = median_interval(&ratios);
    Factor { median: quantile(&ratios, 0.5), interval, count: ratios.len(), less: Some(less), margin: 1.0 }
}

/// The number of sorted values at each end that lie outside of the interval of the median of `count`: so few of `count` fair coins show
/// heads, or tails, with at most the probability that [`CONFIDENCE`] leaves. `None` where even one is too many.
pub(super) fn left_out(count: usize) -> Option<usize> {
    let allowed = (1.0 - CONFIDENCE) / 2.0;
    // Logarithms, since a probability of 2^-2000 is no number.
    let (mut log, mut sum) = (-(count as f64) * std::f64::consts::LN_2, 0.0);
    for heads in 0..count {
        sum += log.exp();
        if sum > allowed {
            return heads.checked_sub(1);
        }
        log += ((count - heads) as f64 / (heads + 1) as f64).ln();
    }
    None
}

/// The interval between two of `sorted` values that contains their median; `None` of fewer than [`LEAST_PAIRS`](super::LEAST_PAIRS).
pub fn median_interval(sorted: &[f64]) -> Option<[f64; 2]> {
    left_out(sorted.len()).map(|out| [sorted[out], sorted[sorted.len() - 1 - out]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::verdict::{LEAST_PAIRS, Order};
    use std::cmp::Ordering;

    /// Ranks of the two-sided sign test at 1 %: Conover, Practical Nonparametric Statistics, table A3 of the binomial.
    #[test]
    fn as_many_values_are_left_out_as_tables_of_the_sign_test_say() {
        let expected =
            [(7, None), (8, Some(0)), (11, Some(0)), (12, Some(1)), (15, Some(2)), (20, Some(3)), (30, Some(7))];
        for (count, out) in expected {
            assert_eq!(left_out(count), out, "{count}");
        }
        assert_eq!((left_out(0), left_out(LEAST_PAIRS - 1)), (None, None));
        // By the normal approximation 5,000 - 2.576 · 50.
        assert!(left_out(10_000).is_some_and(|out| out.abs_diff(4871) <= 1), "{:?}", left_out(10_000));
    }

    #[test]
    fn a_drift_that_both_share_does_not_hide_a_difference() {
        let a: Vec<f64> = (0..9).map(|round| 10.0 * 1.2_f64.powi(round)).collect();
        let b: Vec<f64> = a.iter().zip(0..).map(|(a, round)| a * (1.02 + 0.001 * f64::from(round))).collect();
        let factor = Factor::of(&a, &b, Order::InTurn);
        assert_eq!(factor.and_then(|factor| factor.decided()), Some(Ordering::Greater));
        let [least, most] = factor.and_then(|factor| factor.interval).unwrap_or_default();
        assert!((least - 1.02).abs() < 1e-9 && (most - 1.028).abs() < 1e-9, "{least} {most}");
        let apart = Factor::of(&a, &b, Order::OneAfterOther);
        assert_eq!(apart.and_then(|factor| factor.decided()), None);
    }

    #[test]
    fn one_disturbed_round_swallows_no_factor() {
        for count in [9, 12] {
            let (a, mut b) = (vec![8.0; count], vec![3.0; count]);
            b[4] = 900.0;
            let factor = Factor::of(&a, &b, Order::InTurn);
            assert_eq!(factor.and_then(|factor| factor.decided()), Some(Ordering::Less));
            assert_eq!(factor.map(|factor| (factor.median, factor.less)), Some((0.375, Some(count - 1))));
        }
    }
}
