//! The reduction function f: how many clusters `combine_clusters` leaves of a number of primitives (Gu et al., section 3).

use crate::settings::BuildSettings;

/// The reduction function f(x) = ½·δ^(½+ε)·x^(½−ε), rounded up: number of clusters that are left of x primitives.
///
/// ```
/// use bvhscope_engine::construction::Reduction;
///
/// let fast = Reduction::new(6, 0.2);
/// assert_eq!(fast.reduced_count(100), 7);
/// // Before it is rounded up: ½·6^0.7·100^0.3.
/// assert!((fast.value(100.0) - 6.98).abs() < 0.01);
/// ```
#[derive(Debug, Clone)]
pub struct Reduction {
    /// The traversal stopping threshold δ.
    threshold: usize,
    /// [`Self::reduced_count`] of small arguments.
    table: Vec<u32>,
    factor: f64,
    exponent: f64,
}

impl Reduction {
    /// The reduction function of the threshold δ and the exponent ε.
    pub fn new(threshold: u32, epsilon: f32) -> Self {
        let threshold = threshold.max(2);
        let (delta, epsilon) = (f64::from(threshold), f64::from(epsilon));
        let mut reduction = Self {
            threshold: threshold as usize,
            table: Vec::new(),
            factor: 0.5 * delta.powf(0.5 + epsilon),
            exponent: 0.5 - epsilon,
        };
        reduction.table = (0..1024).map(|x| reduction.formula(x) as u32).collect();
        reduction
    }

    /// The reduction function of AAC with `settings`.
    pub fn of(settings: &BuildSettings) -> Self {
        Self::new(settings.threshold, settings.epsilon)
    }

    /// The traversal stopping threshold δ: fewer primitives are clustered, not partitioned.
    pub fn threshold(&self) -> usize {
        self.threshold
    }

    /// Number of clusters that are left of `count` primitives: f(`count`), f(δ) for fewer than δ primitives, and at most
    /// `count`. Two ranges never leave fewer clusters than their union does, as f is concave.
    #[inline(always)]
    pub fn reduced_count(&self, count: usize) -> usize {
        self.table.get(count).map_or_else(|| self.formula(count), |reduced| *reduced as usize)
    }

    /// ½·δ^(½+ε)·x^(½−ε) of any `x`, not rounded: for curves.
    pub fn value(&self, x: f64) -> f64 {
        self.factor * x.powf(self.exponent)
    }

    fn formula(&self, count: usize) -> usize {
        let x = count.max(self.threshold) as f64;
        // Slightly less, so that rounding errors do not lift an integer to the next.
        let reduced = (self.value(x) - 1e-9).ceil().max(1.0);
        (reduced as usize).min(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_follows_the_formula() {
        let fast = Reduction::new(6, 0.2);
        // ½·6^0.7·x^0.3, by hand.
        for (count, reduced) in [(0, 0), (1, 1), (2, 2), (3, 3), (5, 3), (6, 3), (12, 4), (100, 7), (10_000, 28)] {
            assert_eq!(fast.reduced_count(count), reduced, "of {count}");
        }
        // f(8) = 3.27, f(20) = 4.31, f(2000) = 17.14; for δ 12 and ε 0.1: f(13) = 6.20, f(100) = 14.01.
        for (count, rounded_up) in [(8, 4), (20, 5), (2_000, 18)] {
            assert_eq!(fast.reduced_count(count), rounded_up, "f({count}) is rounded up, not to the nearest");
        }
        // Fewer than δ leave as many as δ do: f(12) = 6, where 7 alone would be 4.84.
        assert_eq!(Reduction::new(12, 0.1).reduced_count(7), 6, "f(δ) below δ");
        for (count, rounded_up) in [(13, 7), (100, 15)] {
            assert_eq!(Reduction::new(12, 0.1).reduced_count(count), rounded_up, "f({count}) is rounded up");
        }
        assert_eq!(Reduction::new(2, 0.5).reduced_count(1_000_000), 1);
    }

    #[test]
    fn two_ranges_leave_no_fewer_than_both_together() {
        for threshold in [2, 3, 6, 12, 64] {
            for epsilon in [0.0, 0.1, 0.2, 0.5] {
                let reduction = Reduction::new(threshold, epsilon);
                for count in (2..3000).chain([100_000, 1_234_567]) {
                    for part in (1..count).take(300).chain([count / 2, count / 3 + 1]) {
                        let parts = reduction.reduced_count(part) + reduction.reduced_count(count - part);
                        assert!(parts >= reduction.reduced_count(count), "{threshold} {epsilon}: {part} of {count}");
                    }
                }
            }
        }
    }
}
