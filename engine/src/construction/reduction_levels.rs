//! The reduction that a build really had, level by level.

use super::record::MergeRecord;

/// Smallest, median and largest of some numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Spread {
    /// The smallest.
    pub min: u32,
    /// The median; of an even count the upper one.
    pub median: u32,
    /// The largest.
    pub max: u32,
}

impl Spread {
    /// The spread of `numbers`, which it reorders; all 0 where there are none.
    fn of(numbers: &mut [u32]) -> Self {
        let middle = numbers.len() / 2;
        if numbers.is_empty() {
            return Self::default();
        }
        let (below, median, above) = numbers.select_nth_unstable(middle);
        let median = *median;
        let min = below.iter().copied().min().unwrap_or(median);
        let max = above.iter().copied().max().unwrap_or(median);
        Self { min, median, max }
    }
}

/// The steps of one level of the recursion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReductionLevel {
    /// Depth of the recursion of `build_tree`; 0 over all primitives.
    pub level: u32,
    /// Number of steps.
    pub steps: u32,
    /// Number of merges.
    pub merges: u32,
    /// Number of primitives of each range, x.
    pub primitives: Spread,
    /// Length of each list before.
    pub before: Spread,
    /// Length of each list after, f(x).
    pub after: Spread,
}

impl MergeRecord {
    /// The steps summed up by level, the root's first. The last `combine_clusters(C, 1)` is left out: it does not follow f.
    pub fn levels(&self) -> Vec<ReductionLevel> {
        let steps = self.steps();
        // Exact clustering has that last call alone.
        let steps = if steps.len() > 1 { &steps[..steps.len() - 1] } else { steps };
        let mut sorted: Vec<_> = steps.to_vec();
        sorted.sort_by_key(|step| step.level);
        let summary = |steps: &[crate::aac::ReductionStep]| {
            let spread = |value: fn(&crate::aac::ReductionStep) -> u32| {
                Spread::of(&mut steps.iter().map(value).collect::<Vec<_>>())
            };
            ReductionLevel {
                level: steps[0].level,
                steps: steps.len() as u32,
                merges: steps.iter().map(|step| step.before - step.after).sum(),
                primitives: spread(|step| step.primitives),
                before: spread(|step| step.before),
                after: spread(|step| step.after),
            }
        };
        sorted.chunk_by(|a, b| a.level == b.level).map(summary).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_that_of_the_sorted_numbers() {
        assert_eq!(Spread::of(&mut []), Spread::default());
        assert_eq!(Spread::of(&mut [7]), Spread { min: 7, median: 7, max: 7 });
        assert_eq!(Spread::of(&mut [9, 1, 4, 3, 8]), Spread { min: 1, median: 4, max: 9 });
        assert_eq!(Spread::of(&mut [9, 1, 4, 8]), Spread { min: 1, median: 8, max: 9 });
    }
}
