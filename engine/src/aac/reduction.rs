//! How many clusters agglomerative clustering leaves of how many primitives.

/// f(x) = ½·δ^(½+ε)·x^(½−ε), rounded up: how many clusters are left of x primitives.
pub struct Reduction {
    /// δ.
    threshold: usize,
    /// [`Self::left_of`] for small numbers.
    table: Vec<u32>,
    factor: f64,
    exponent: f64,
}

impl Reduction {
    /// For the threshold δ and the exponent ε.
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

    /// δ: fewer primitives are clustered, not split.
    pub fn threshold(&self) -> usize {
        self.threshold
    }

    /// How many clusters are left of `count` primitives: f(`count`), f(δ) where there are fewer than δ, and no more than
    /// there are primitives. Two ranges never leave fewer than their union does, as f is concave.
    #[inline(always)]
    pub fn left_of(&self, count: usize) -> usize {
        self.table.get(count).map_or_else(|| self.formula(count), |left| *left as usize)
    }

    fn formula(&self, count: usize) -> usize {
        let x = count.max(self.threshold) as f64;
        // A hair less, so that whole numbers are not rounded up to the next.
        let left = (self.factor * x.powf(self.exponent) - 1e-9).ceil().max(1.0);
        (left as usize).min(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_follows_the_formula() {
        let fast = Reduction::new(6, 0.2);
        // ½·6^0.7·x^0.3, by hand.
        for (count, left) in [(0, 0), (1, 1), (2, 2), (3, 3), (5, 3), (6, 3), (12, 4), (100, 7), (10_000, 28)] {
            assert_eq!(fast.left_of(count), left, "of {count}");
        }
        assert_eq!(Reduction::new(2, 0.5).left_of(1_000_000), 1);
    }

    #[test]
    fn two_ranges_leave_no_fewer_than_both_together() {
        for threshold in [2, 3, 6, 12, 64] {
            for epsilon in [0.0, 0.1, 0.2, 0.5] {
                let reduction = Reduction::new(threshold, epsilon);
                for count in (2..3000).chain([100_000, 1_234_567]) {
                    for part in (1..count).take(300).chain([count / 2, count / 3 + 1]) {
                        let parts = reduction.left_of(part) + reduction.left_of(count - part);
                        assert!(parts >= reduction.left_of(count), "{threshold} {epsilon}: {part} of {count}");
                    }
                }
            }
        }
    }
}
