//! An axis of a chart: the places of values on it, and its labelled values.

/// Part of the range that is left free at each end of a fitted axis.
const MARGIN: f64 = 0.06;
/// Digits of the labelled values of a logarithmic axis, from many to few.
const FINE: [&[f64]; 4] = [&[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0], &[1.0, 2.0, 3.0, 5.0], &[1.0, 2.0, 5.0], &[1.0]];
/// Largest over smallest value from which a fitted axis is logarithmic.
const DECADES: f64 = 20.0;
/// Shortest fitted range relative to its values, so that noise does not fill an axis.
const LEAST_RANGE: f64 = 0.04;
/// Largest magnitude on an axis; values beyond are left out of its range.
const LARGEST: f64 = 1e100;

/// How values are spread over an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// Evenly, labelled at whole numbers only: an axis of numbers of things, and of the rows of a chart.
    Whole,
    /// By their logarithm.
    Log,
    /// By their logarithm, labelled at powers of two.
    Doublings,
    /// By their logarithm from 1 on, with a band for 0 from `low` to 1.
    Counts,
}

/// An axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// The value at its beginning; above 0 where it is logarithmic.
    pub low: f64,
    /// The value at its end, above `low`.
    pub high: f64,
    /// How values are spread over it.
    pub scale: Scale,
}

impl Axis {
    /// A linear axis that holds all of `values`.
    pub fn linear(values: impl Iterator<Item = f64>) -> Self {
        let [low, high] = ends(values).unwrap_or([0.0, 1.0]);
        let magnitude = low.abs().max(high.abs());
        let least_size = if high > low { magnitude * LEAST_RANGE } else { magnitude.max(1.0) };
        let size = (high - low).max(least_size).max(1.0 / LARGEST);
        let margin = size * MARGIN + (size - (high - low)) * 0.5;
        // Counts, times and costs are never below 0.
        let start = if low >= 0.0 { (low - margin).max(0.0) } else { low - margin };
        Self { low: start, high: high + margin, scale: Scale::Linear }
    }

    /// A logarithmic axis that holds all of `values` above 0, at least a factor of 2 long.
    pub fn logarithmic(values: impl Iterator<Item = f64>) -> Self {
        let [low, high] = ends(values.filter(|&value| value > 1.0 / LARGEST)).unwrap_or([1.0, 10.0]).map(f64::ln);
        let margin = ((high - low) * MARGIN).max((std::f64::consts::LN_2 - (high - low)) * 0.5).max(0.02);
        Self { low: (low - margin).exp(), high: (high + margin).exp(), scale: Scale::Log }
    }

    /// The axis that shows how `values` differ: logarithmic if they are positive and span more than a decade.
    pub fn fitted(values: impl Iterator<Item = f64> + Clone) -> Self {
        match ends(values.clone()) {
            Some([low, high]) if low > 0.0 && high / low > DECADES => Self::logarithmic(values),
            _ => Self::linear(values),
        }
    }

    /// A fitted axis of whole numbers.
    pub fn whole(values: impl Iterator<Item = f64> + Clone) -> Self {
        match Self::fitted(values) {
            axis @ Self { scale: Scale::Log, .. } => axis,
            axis => Self { scale: Scale::Whole, ..axis },
        }
    }

    /// An axis from a little below 1 to a little above `most`, labelled at 1, 2, 4 and so on.
    pub fn doublings(most: f64) -> Self {
        Self { scale: Scale::Doublings, ..Self::logarithmic([1.0, most.max(1.0)].into_iter()) }
    }

    /// An axis with places for `count` rows, at 0, 1, 2 and so on.
    pub fn of_rows(count: usize) -> Self {
        Self { low: -0.5, high: count.max(1) as f64 - 0.5, scale: Scale::Whole }
    }

    /// A logarithmic axis from 1 to `high`, of which a band for 0 takes the first `share`.
    pub fn of_counts(high: f64, share: f64) -> Self {
        Self { low: high.powf(-share / (1.0 - share)), high, scale: Scale::Counts }
    }

    /// `value` is in the band for 0.
    pub fn is_never(&self, value: f64) -> bool {
        self.scale == Scale::Counts && value < 1.0
    }

    /// The place of a value: 0 at the beginning, 1 at the end, beyond these outside of the axis.
    pub fn at(&self, value: f64) -> f64 {
        let value = if self.is_never(value) { self.low.sqrt() } else { value };
        if matches!(self.scale, Scale::Linear | Scale::Whole) {
            (value - self.low) / (self.high - self.low)
        } else {
            (value.max(f64::MIN_POSITIVE).ln() - self.low.ln()) / (self.high.ln() - self.low.ln())
        }
    }

    /// At most `most` round values on the axis, in ascending order; `most` is at least 1.
    pub fn ticks(&self, most: usize) -> Vec<f64> {
        let most = most.max(1);
        match self.scale {
            Scale::Linear => self.linear_ticks(most, 0.0),
            Scale::Whole => self.linear_ticks(most, 1.0),
            Scale::Log => self.log_ticks(most),
            Scale::Doublings => {
                let powers = || (0..64).map(|power| 2.0_f64.powi(power)).filter(|value| self.holds(*value));
                powers().step_by(powers().count().div_ceil(most).max(1)).collect()
            }
            Scale::Counts => {
                let above = Self { low: 1.0, scale: Scale::Log, ..*self }.log_ticks((most - 1).max(1));
                std::iter::once(0.0).chain(above).take(most).collect()
            }
        }
    }

    /// As many labelled values as fit without overlap into `length`, where `size_of` is the length of a label. Lengths have
    /// any one unit.
    pub fn labels(&self, length: f64, gap: f64, most: usize, size_of: impl Fn(f64) -> f64) -> Vec<f64> {
        let fits = |ticks: &[f64]| {
            ticks.windows(2).all(|pair| {
                let distance = (self.at(pair[1]) - self.at(pair[0])) * length;
                distance >= (size_of(pair[0]) + size_of(pair[1])) * 0.5 + gap
            })
        };
        (1..=most.max(1)).rev().map(|most| self.ticks(most)).find(|ticks| fits(ticks)).unwrap_or_default()
    }

    fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Multiples of 1, 2 or 5 times a power of ten, which is at least `least_step`.
    fn linear_ticks(&self, most: usize, least_step: f64) -> Vec<f64> {
        let step = ((self.high - self.low) / most as f64).max(least_step);
        let magnitude = 10.0_f64.powf(step.log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0, 20.0].map(|factor| factor * magnitude);
        let of_step = |step: f64| -> Option<Vec<f64>> {
            let [first, last] = [(self.low / step).ceil(), (self.high / step).floor()];
            let count = (last - first).max(-1.0) + 1.0;
            // Also excludes what is not a number.
            (count <= most as f64).then(|| (0..count as usize).map(|index| (first + index as f64) * step).collect())
        };
        steps.into_iter().find_map(of_step).unwrap_or_default()
    }

    fn log_ticks(&self, most: usize) -> Vec<f64> {
        // A few hundred decades at most, whatever the ends are.
        let [low, high] = [self.low, self.high].map(|end| end.clamp(f64::MIN_POSITIVE, f64::MAX));
        let [first, last] = [low.log10().floor() as i32, high.log10().ceil() as i32];
        let all = |digits: &'static [f64], decades: usize| -> Vec<f64> {
            let decades = (first..=last).filter(|decade| decade.rem_euclid(decades as i32) == 0);
            let values = decades.flat_map(|decade| digits.iter().map(move |digit| digit * 10.0_f64.powi(decade)));
            values.filter(|value| self.holds(*value)).collect()
        };
        let of_digits = FINE.into_iter().map(|digits| all(digits, 1));
        let of_decades = (2..=16).map(|decades| all(&[1.0], decades));
        of_digits.chain(of_decades).find(|ticks| ticks.len() <= most).unwrap_or_default()
    }
}

/// The smallest and the largest of the values that are numbers of at most [`LARGEST`].
fn ends(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let [low, high] = values
        .filter(|value| value.abs() <= LARGEST)
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
                let shown =
                    values.iter().filter(|&&value| value.is_finite() && (value > 0.0 || axis.scale == Scale::Linear));
                assert!(shown.clone().all(|&value| (0.0..=1.0).contains(&axis.at(value))), "{axis:?} {values:?}");
                assert!(axis.scale == Scale::Linear || axis.high / axis.low > 1.9, "{axis:?}");
            }
        }
        let log = Axis { low: 1.0, high: 100.0, scale: Scale::Log };
        assert!((log.at(10.0) - 0.5).abs() < 1e-12);
        assert!((Axis { scale: Scale::Linear, ..log }.at(50.5) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn ticks_are_round_and_not_too_many() {
        let linear = |low, high, most| Axis { low, high, scale: Scale::Linear }.ticks(most);
        let endless = Axis { low: 0.0, high: f64::INFINITY, scale: Scale::Log }.ticks(7);
        assert!(endless.len() <= 7, "{endless:?}");
        assert_eq!(linear(0.0, 10.0, 6), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        let fine = linear(12.3, 13.1, 4);
        assert!(
            fine.len() == 4 && fine.iter().zip([12.4, 12.6, 12.8, 13.0]).all(|(a, b)| (a - b).abs() < 1e-9),
            "{fine:?}"
        );
        let log = |low, high, most| Axis { low, high, scale: Scale::Log }.ticks(most);
        assert_eq!(log(1.0, 1000.0, 4), [1.0, 10.0, 100.0, 1000.0]);
        assert_eq!(log(1.0, 100.0, 7), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]);
        assert_eq!(log(1.0, 1e8, 5), [1.0, 100.0, 1e4, 1e6, 1e8]);
        for most in 1..9 {
            assert!(linear(3.0, 17.0, most).len() <= most && log(0.1, 3e6, most).len() <= most, "{most}");
        }
    }

    #[test]
    fn extreme_values_have_few_ticks() {
        let extremes = [1e308, 1e-320, -1e308, 1e9, 0.0, f64::INFINITY, 1e30, 1e-30];
        for (a, b) in extremes.into_iter().flat_map(|a| extremes.map(|b| (a, b))) {
            let values = [a, b].into_iter();
            let axes = [
                Axis::linear(values.clone()),
                Axis::logarithmic(values.clone()),
                Axis::fitted(values.clone()),
                Axis::whole(values),
                Axis::doublings(a),
            ];
            for axis in axes {
                assert!(axis.low < axis.high, "{a} {b}: {axis:?}");
                assert!((1..9).all(|most| axis.ticks(most).len() <= most), "{a} {b}: {axis:?}");
            }
        }
    }

    #[test]
    fn a_fitted_axis_shows_what_varies() {
        let fitted = |values: &[f64]| Axis::fitted(values.iter().copied());
        assert_eq!(fitted(&[1.0, 50.0]).scale, Scale::Log);
        let near = fitted(&[100.0, 120.0]);
        assert!(near.scale == Scale::Linear && near.low > 90.0 && near.high < 130.0, "{near:?}");
        let noise = fitted(&[100.0, 100.1]);
        assert!(noise.at(100.1) - noise.at(100.0) < 0.05, "noise does not fill the axis: {noise:?}");
    }

    #[test]
    fn whole_numbers_and_doublings_are_labelled_as_such() {
        assert_eq!(Axis::whole([2.0, 5.0].into_iter()).ticks(8), [2.0, 3.0, 4.0, 5.0]);
        assert_eq!(Axis::of_rows(3).ticks(3), [0.0, 1.0, 2.0]);
        assert_eq!(Axis::doublings(64.0).ticks(7), [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]);
        assert_eq!(Axis::doublings(64.0).ticks(4), [1.0, 4.0, 16.0, 64.0]);
        assert_eq!(Axis::doublings(3.0).ticks(7), [1.0, 2.0]);
    }

    #[test]
    fn labels_do_not_overlap() {
        let axis = Axis { low: 1.0, high: 1000.0, scale: Scale::Log };
        for length in [20.0, 60.0, 150.0, 400.0] {
            let labels = axis.labels(length, 4.0, 9, |_| 30.0);
            let apart = |pair: &[f64]| (axis.at(pair[1]) - axis.at(pair[0])) * length;
            assert!(!labels.is_empty() && labels.windows(2).all(|pair| apart(pair) >= 34.0), "{length}: {labels:?}");
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
