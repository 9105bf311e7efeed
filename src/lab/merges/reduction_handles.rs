//! The parameters of the reduction function f(x) = ½·δ^(½+ε)·x^(½−ε) from a point that its curve is dragged through.

use bvhscope_engine::settings::BuildSettings;

/// The threshold δ whose curve passes through (δ, δ/2) at `x`, within the limits of the setting.
pub fn threshold_at(x: f64) -> u32 {
    let [low, high] = [BuildSettings::MIN_THRESHOLD, BuildSettings::MAX_THRESHOLD].map(f64::from);
    if x.is_finite() { x.round().clamp(low, high) as u32 } else { BuildSettings::MIN_THRESHOLD }
}

/// The ε whose curve of `threshold` passes through (`x`, `y`), in steps of 0.01 within the limits of the setting; `None` at x = δ,
/// through which the curves of all ε pass.
pub fn reduction_through(threshold: u32, [x, y]: [f64; 2]) -> Option<f32> {
    let (delta, log_x) = (f64::from(threshold).ln(), x.ln());
    let epsilon = (0.5 * (delta + log_x) - (2.0 * y).ln()) / (log_x - delta);
    let limited = epsilon.clamp(0.0, f64::from(BuildSettings::MAX_EPSILON));
    epsilon.is_finite().then(|| ((limited * 100.0).round() / 100.0) as f32)
}

#[cfg(test)]
mod tests {
    use bvhscope_engine::construction::Reduction;

    use super::*;

    #[test]
    fn a_point_of_the_curve_gives_its_parameters() {
        for (threshold, epsilon) in [(6, 0.2), (12, 0.1), (20, 0.37), (4, 0.0)] {
            let y = Reduction::new(threshold, epsilon).value(50_000.0);
            assert_eq!(reduction_through(threshold, [50_000.0, y]), Some(epsilon));
        }
        assert_eq!(reduction_through(6, [6.0, 3.0]), None);
        assert_eq!(reduction_through(6, [1000.0, 1e9]), Some(0.0));
        assert_eq!(reduction_through(6, [1000.0, 0.5]), Some(0.5));
    }

    #[test]
    fn thresholds_stay_within_their_limits() {
        assert_eq!([0.1, 6.4, 1e9, f64::NAN].map(threshold_at), [2, 6, 64, 2]);
    }
}
