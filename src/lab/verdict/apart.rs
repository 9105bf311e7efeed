//! Samples that are no pairs: the rank-sum test over the ratios of each sample of one to each of the other.

use super::factor::{CONFIDENCE, DRIFT, Factor, Order};
use crate::catalog::reading::quantile;

/// The factor of two lists of at least two samples.
pub(super) fn factor(a: &[f64], b: &[f64], order: Order) -> Factor {
    let mut ratios: Vec<f64> = a.iter().flat_map(|a| b.iter().map(move |b| b / a)).collect();
    ratios.sort_by(f64::total_cmp);
    let interval = left_out(a.len(), b.len()).map(|out| [ratios[out], ratios[ratios.len() - 1 - out]]);
    let less = (order == Order::InTurn).then(|| a.iter().zip(b).filter(|(a, b)| b < a).count());
    Factor { median: quantile(&ratios, 0.5), interval, count: a.len().min(b.len()), less, margin: DRIFT }
}

/// The number of sorted ratios at each end that lie outside of the interval of the factor, with `m` samples of one and `n` of the other:
/// the largest number of pairs in the other order that has at most the probability that [`CONFIDENCE`] leaves, where both are alike.
/// `None` where even one order without any is too probable.
fn left_out(m: usize, n: usize) -> Option<usize> {
    let orders = orders(m, n);
    let all: f64 = orders.iter().sum();
    let allowed = (1.0 - CONFIDENCE) / 2.0;
    let sums = orders.iter().scan(0.0, |sum, count| {
        *sum += count / all;
        Some(*sum)
    });
    sums.take_while(|sum| *sum <= allowed).count().checked_sub(1)
}

/// In how many of the orders of `m` and `n` samples 0, 1, … `m·n` pairs have the sample of the second first: the coefficients of the
/// Gaussian binomial, each the product of (1 − q^(n+i)) / (1 − q^i) for i from 1 to `m`.
fn orders(m: usize, n: usize) -> Vec<f64> {
    let mut counts = vec![0.0; m * n + 1];
    counts[0] = 1.0;
    for i in 1..=m {
        for power in (n + i..counts.len()).rev() {
            counts[power] -= counts[power - n - i];
        }
        for power in i..counts.len() {
            counts[power] += counts[power - i];
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cmp::Ordering;

    #[test]
    fn orders_are_counted_as_by_hand() {
        assert_eq!(orders(2, 2), [1.0, 1.0, 2.0, 1.0, 1.0]);
        assert_eq!(orders(3, 1), [1.0; 4]);
        assert_eq!(orders(5, 5).iter().sum::<f64>(), 252.0);
    }

    /// Critical values of U, two-sided at 1 %: Mann and Whitney's tables as in Siegel, Nonparametric Statistics, table K.
    #[test]
    fn as_many_ratios_are_left_out_as_tables_of_the_rank_sum_say() {
        let expected = [
            ((4, 4), None),
            ((5, 5), Some(0)),
            ((6, 6), Some(2)),
            ((8, 8), Some(7)),
            ((10, 10), Some(16)),
            ((20, 20), Some(105)),
        ];
        for ((m, n), out) in expected {
            assert_eq!(left_out(m, n), out, "{m} {n}");
        }
    }

    #[test]
    fn five_rounds_decide_a_factor_and_no_small_difference() {
        let a = [8.0, 8.1, 8.2, 8.3, 24.4];
        let decided = |b: [f64; 5]| factor(&a, &b, Order::OneAfterOther).decided();
        assert_eq!(decided([3.1, 3.2, 3.15, 3.3, 3.12]), Some(Ordering::Less));
        assert_eq!(decided([7.7, 7.8, 7.75, 7.72, 7.74]), None, "the machine may have changed");
        assert_eq!(factor(&a[..3], &[3.1, 3.2, 3.15], Order::OneAfterOther).interval, None);
    }
}
