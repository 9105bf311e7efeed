//! The legend of the containers' colours.

use crate::catalog::metric_scale::MetricScale;
use crate::catalog::metrics::{Form, Scale};
use crate::overlay::node_table::Shown;
use crate::overlay::ramp::ColorScale;

/// Most labels of a legend.
const MOST_STOPS: usize = 7;

/// The legend of the colour scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Legend {
    /// The quantity that colours encode.
    pub title: &'static str,
    /// Positions along the ramp, 0 to 1 and ascending, with their labels.
    pub stops: Vec<(f32, String)>,
    /// The part of the ramp that the drawn containers have colours of.
    pub drawn: [f32; 2],
}

/// The legend of the containers `shown`.
pub fn legend(shown: &Shown) -> Legend {
    let named = |stops: &[(f32, &str)]| stops.iter().map(|&(at, name)| (at, name.to_owned())).collect();
    let (title, stops) = match &shown.colors {
        ColorScale::Metric(scale) => (scale.metric.quantity, stops(scale)),
        ColorScale::Survival => ("Nodes of both trees", named(&[(0.0, "in both trees"), (1.0, "in this one only")])),
        ColorScale::Planes => ("Planes of the box", named(&[(0.0, "plain"), (0.5, "fitted"), (1.0, "skewed")])),
    };
    Legend { title, stops, drawn: shown.span }
}

/// Round values within a scale, with their places; its ends where it has no two of them.
fn stops(scale: &MetricScale) -> Vec<(f32, String)> {
    let (form, [low, high]) = (scale.metric.form, scale.ends);
    let quarters = (0..=4_u8).map(|step| f32::from(step) * 0.25);
    let mut values: Vec<f32> = match scale.metric.scale {
        Scale::Linear => quarters.map(|part| low + (high - low) * part).collect(),
        // Evenly spaced on the ramp.
        Scale::SquareRoot => quarters.map(|part| low + (high - low) * part * part).collect(),
        Scale::Logarithmic => {
            let base = if form == Form::Ratio { 2.0_f32 } else { 10.0 };
            let powers = (-12..=16).map(|exponent| base.powi(exponent));
            let within: Vec<f32> = powers.filter(|value| (low..=high).contains(value)).collect();
            let step = within.len().div_ceil(MOST_STOPS).max(1);
            if within.len() < 2 { scale.ends.into() } else { within.into_iter().step_by(step).collect() }
        }
    };
    if form == Form::Count {
        for value in &mut values {
            *value = value.round();
        }
    }
    values.dedup();
    values.into_iter().map(|value| (scale.position(value), short(form, value))).collect()
}

/// A value in few characters.
fn short(form: Form, value: f32) -> String {
    match form {
        Form::Share => percent_text(value * 100.0),
        Form::Ratio => format!("{} ×", short_ratio(value)),
        Form::Count => short_count(value as u32),
    }
}

/// A percentage with up to two significant digits.
fn percent_text(percent: f32) -> String {
    let digits = (1 - percent.max(1e-12).log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{percent:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text} %")
}

/// A ratio with up to two decimals, a small one with three.
fn short_ratio(ratio: f32) -> String {
    let text = if ratio < 0.2 { format!("{ratio:.3}") } else { format!("{ratio:.2}") };
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A count in few characters: 1, 10, 100, 1k, 10k, 100k, 1M.
fn short_count(count: u32) -> String {
    match count {
        1_000_000.. => format!("{}M", count / 1_000_000),
        1_000.. => format!("{}k", count / 1_000),
        _ => count.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentages_are_short() {
        let texts = [100.0, 12.3, 1.0, 0.25, 0.001].map(percent_text);
        assert_eq!(texts, ["100 %", "12 %", "1 %", "0.25 %", "0.001 %"]);
    }
}
