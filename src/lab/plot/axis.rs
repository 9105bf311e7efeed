//! An axis of a plot, linear or logarithmic: where values are on it, and which of them are labelled.

/// Part of the range that is left free at each end of a fitted axis.
const MARGIN: f64 = 0.06;
/// Digits of the labelled values of a logarithmic axis, from many to few.
const FINE: [&[f64]; 4] = [&[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0], &[1.0, 2.0, 3.0, 5.0], &[1.0, 2.0, 5.0], &[1.0]];

/// An axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// The value at its beginning; above 0 where it is logarithmic.
    pub low: f64,
    /// The value at its end, above `low`.
    pub high: f64,
    /// It is logarithmic.
    pub is_log: bool,
    /// It is an axis of counts, of which 0 has a band of its own from `low` to 1: a logarithm has no place for it.
    pub has_never: bool,
}

impl Axis {
    /// A linear axis on which all of `values` are.
    pub fn linear(values: impl Iterator<Item = f64>) -> Self {
        let [low, high] = ends(values).unwrap_or([0.0, 1.0]);
        let size = if high > low { high - low } else { low.abs().max(1.0) };
        let least = low - size * MARGIN;
        // Counts, times and costs are never below 0.
        let low = if low >= 0.0 { least.max(0.0) } else { least };
        Self { low, high: high + size * MARGIN, is_log: false, has_never: false }
    }

    /// A logarithmic axis on which all of `values` above 0 are, at least a factor of 2 long.
    pub fn logarithmic(values: impl Iterator<Item = f64>) -> Self {
        let [low, high] = ends(values.filter(|&value| value > 0.0)).unwrap_or([1.0, 10.0]).map(f64::ln);
        let margin = ((high - low) * MARGIN).max((std::f64::consts::LN_2 - (high - low)) * 0.5).max(0.02);
        Self { low: (low - margin).exp(), high: (high + margin).exp(), is_log: true, has_never: false }
    }

    /// A logarithmic axis from 1 to `high`, of which a band for 0 takes the first `share`.
    pub fn of_counts(high: f64, share: f64) -> Self {
        Self { low: high.powf(-share / (1.0 - share)), high, is_log: true, has_never: true }
    }

    /// Whether `value` is in the band for 0.
    pub fn is_never(&self, value: f64) -> bool {
        self.has_never && value < 1.0
    }

    /// Where a value is: 0 at the beginning, 1 at the end, beyond these outside of the axis.
    pub fn at(&self, value: f64) -> f64 {
        let value = if self.is_never(value) { self.low.sqrt() } else { value };
        if self.is_log {
            (value.max(f64::MIN_POSITIVE).ln() - self.low.ln()) / (self.high.ln() - self.low.ln())
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// At most `most` round values on the axis, in ascending order; 1 at least.
    pub fn ticks(&self, most: usize) -> Vec<f64> {
        let most = most.max(1);
        if self.has_never {
            let above = Self { low: 1.0, has_never: false, ..*self }.log_ticks((most - 1).max(1));
            return std::iter::once(0.0).chain(above).take(most).collect();
        }
        if self.is_log { self.log_ticks(most) } else { self.linear_ticks(most) }
    }

    fn linear_ticks(&self, most: usize) -> Vec<f64> {
        let least_step = (self.high - self.low) / most as f64;
        let magnitude = 10.0_f64.powf(least_step.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0, 20.0].map(|factor| factor * magnitude);
        let of_step = |step: f64| -> Vec<f64> {
            let [first, last] = [(self.low / step).ceil(), (self.high / step).floor()];
            (0..=(last - first).max(0.0) as usize).map(|index| (first + index as f64) * step).collect()
        };
        step.into_iter().map(of_step).find(|ticks| ticks.len() <= most).unwrap_or_default()
    }

    fn log_ticks(&self, most: usize) -> Vec<f64> {
        let [first, last] = [self.low.log10().floor() as i32, self.high.log10().ceil() as i32];
        let all = |digits: &'static [f64], decades: usize| -> Vec<f64> {
            let decades = (first..=last).filter(|decade| decade.rem_euclid(decades as i32) == 0);
            let values = decades.flat_map(|decade| digits.iter().map(move |digit| digit * 10.0_f64.powi(decade)));
            values.filter(|value| (self.low..=self.high).contains(value)).collect()
        };
        let of_digits = FINE.into_iter().map(|digits| all(digits, 1));
        let of_decades = (2..=16).map(|decades| all(&[1.0], decades));
        of_digits.chain(of_decades).find(|ticks| ticks.len() <= most).unwrap_or_default()
    }
}

/// The smallest and the largest of the values that are numbers.
fn ends(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let [low, high] = values
        .filter(|value| value.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
    (low <= high).then_some([low, high])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_between_the_ends_of_their_axis() {
        for values in [&[3.0, 7.0, 4.0][..], &[5.0], &[0.0, 1e-9], &[], &[f64::NAN, 2.0]] {
            for axis in [Axis::linear(values.iter().copied()), Axis::logarithmic(values.iter().copied())] {
                assert!(axis.low < axis.high && axis.low.is_finite() && axis.high.is_finite(), "{axis:?}");
                let shown = values.iter().filter(|&&value| value.is_finite() && (value > 0.0 || !axis.is_log));
                assert!(shown.clone().all(|&value| (0.0..=1.0).contains(&axis.at(value))), "{axis:?} {values:?}");
                assert!(!axis.is_log || axis.high / axis.low > 1.9, "{axis:?}");
            }
        }
        let log = Axis { low: 1.0, high: 100.0, is_log: true, has_never: false };
        assert!((log.at(10.0) - 0.5).abs() < 1e-12);
        assert!((Axis { is_log: false, ..log }.at(50.5) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn ticks_are_round_and_not_too_many() {
        let linear = |low, high, most| Axis { low, high, is_log: false, has_never: false }.ticks(most);
        assert_eq!(linear(0.0, 10.0, 6), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        let fine = linear(12.3, 13.1, 4);
        assert!(
            fine.len() == 4 && fine.iter().zip([12.4, 12.6, 12.8, 13.0]).all(|(a, b)| (a - b).abs() < 1e-9),
            "{fine:?}"
        );
        let log = |low, high, most| Axis { low, high, is_log: true, has_never: false }.ticks(most);
        assert_eq!(log(1.0, 1000.0, 4), [1.0, 10.0, 100.0, 1000.0]);
        assert_eq!(log(1.0, 100.0, 7), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]);
        assert_eq!(log(1.0, 1e8, 5), [1.0, 100.0, 1e4, 1e6, 1e8]);
        for most in 1..9 {
            assert!(linear(3.0, 17.0, most).len() <= most && log(0.1, 3e6, most).len() <= most, "{most}");
        }
    }

    #[test]
    fn counts_have_a_band_for_never() {
        let axis = Axis::of_counts(1000.0, 0.1);
        assert!((axis.at(1.0) - 0.1).abs() < 1e-9 && (axis.at(1000.0) - 1.0).abs() < 1e-9);
        assert!((axis.at(0.0) - 0.05).abs() < 1e-9, "in the middle of its band");
        assert_eq!(axis.ticks(5), [0.0, 1.0, 10.0, 100.0, 1000.0]);
        assert!((1..9).all(|most| axis.ticks(most).len() <= most && axis.ticks(most)[0] == 0.0));
    }
}
