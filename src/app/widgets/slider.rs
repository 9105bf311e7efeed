//! A labelled slider with an editable number and a default.

use std::ops::RangeInclusive;

use egui::emath::Numeric;
use egui::{self, Rect, Stroke, Ui, WidgetInfo, vec2};

use super::row::row;
use crate::app::theme::ROW_HEIGHT;
use crate::app::{format, theme};

/// Smallest width of the number field in points.
const NUMBER_WIDTH: f32 = 52.0;
/// Width of a digit in the number field in points.
const DIGIT_WIDTH: f32 = 7.6;

/// Decimals that a typed number may have in addition to [`SliderSpec::decimals`].
const TYPED_DECIMALS: usize = 1;

/// Description of a slider.
pub(crate) struct SliderSpec<'a> {
    /// Label, also the accessible name.
    pub(crate) label: &'a str,
    /// Tooltip: what the setting does, what to expect, its keys.
    pub(crate) tip: &'a str,
    /// Smallest and largest value that the slider sets.
    pub(crate) range: RangeInclusive<f64>,
    /// Value that a double click restores; marked with a tick.
    pub(crate) default: f64,
    /// Whether the scale is logarithmic.
    pub(crate) logarithmic: bool,
    /// Number of decimals; 0 for whole numbers.
    pub(crate) decimals: usize,
    /// Text shown for the value 0; empty to show the number.
    pub(crate) zero: &'a str,
}

impl<'a> SliderSpec<'a> {
    /// A linear slider over whole numbers.
    pub(crate) const fn new(label: &'a str, tip: &'a str, range: RangeInclusive<f64>, default: f64) -> Self {
        Self { label, tip, range, default, logarithmic: false, decimals: 0, zero: "" }
    }
}

/// A labelled slider with a number field. Returns whether the user changed the value. A value from the command line or the
/// settings file that lies outside the range or between two steps stays as it is until then.
pub(crate) fn slider<T: Numeric>(ui: &mut Ui, value: &mut T, spec: &SliderSpec<'_>) -> bool {
    let mut number = value.to_f64();
    let changed = number_slider(ui, &mut number, spec);
    if changed {
        *value = T::from_f64(number);
    }
    changed
}

#[expect(clippy::too_many_lines, reason = "the layout of a widget")]
fn number_slider(ui: &mut Ui, value: &mut f64, spec: &SliderSpec<'_>) -> bool {
    let before = *value;
    let mut touched = false;
    row(ui, spec.label, spec.tip, |ui| {
        // A number that is wider than its field would widen the panel with each UI frame.
        let digits = value.abs().max(*spec.range.end()).max(1.0).log10().floor() as f32 + 1.0;
        let number_width = NUMBER_WIDTH.max(digits * DIGIT_WIDTH + 2.0 * ui.spacing().button_padding.x);
        let width = (ui.available_width() - number_width - ui.spacing().item_spacing.x).max(40.0);
        ui.spacing_mut().slider_width = width;
        let step = if spec.decimals == 0 { 1.0 } else { 0.1f64.powi(spec.decimals as i32) };
        // Without steps, an arrow key moves the handle by a point; on a wide logarithmic scale a fixed step would not be visible.
        let wide = spec.logarithmic && spec.range.end() - spec.range.start() > 1000.0;
        let rail = ui.add(
            egui::Slider::new(value, spec.range.clone())
                .logarithmic(spec.logarithmic)
                .show_value(false)
                .clamping(egui::SliderClamping::Edits)
                .step_by(if wide { 0.0 } else { step }),
        );
        let current = *value;
        rail.widget_info(|| WidgetInfo::slider(ui.is_enabled(), current, spec.label));
        paint_tick(ui, rail.rect, spec);
        if rail.contains_pointer()
            && ui.input(|input| input.pointer.button_double_clicked(egui::PointerButton::Primary))
        {
            *value = spec.default;
            touched = true;
        }
        // Show the additional decimal only where a typed value uses it.
        let max_decimals = if spec.decimals == 0 { 0 } else { spec.decimals + TYPED_DECIMALS };
        let shown = if is_round(*value, spec.decimals) { spec.decimals } else { max_decimals };
        let mut drag = egui::DragValue::new(value)
            .range(spec.range.clone())
            .clamp_existing_to_range(false)
            .speed(step * 0.25)
            .fixed_decimals(shown);
        if spec.decimals == 0 {
            let is_zero = |text: &str| !spec.zero.is_empty() && text.trim() == spec.zero;
            drag = drag
                .custom_formatter(|number, _| match number.max(0.0).round() as u64 {
                    0 if !spec.zero.is_empty() => spec.zero.to_owned(),
                    whole => format::count(whole),
                })
                .custom_parser(
                    move |text| if is_zero(text) { Some(0.0) } else { text.replace([',', ' '], "").parse().ok() },
                );
        }
        let number = ui.add_sized(vec2(number_width, ROW_HEIGHT), drag);
        number.widget_info(|| {
            let mut info = WidgetInfo::drag_value(ui.is_enabled(), current);
            info.label = Some(format!("{} value", spec.label));
            info
        });
        let decimals = if number.changed() && !number.dragged() { max_decimals } else { spec.decimals };
        if rail.changed() || number.changed() {
            touched = true;
            let scale = 10f64.powi(decimals as i32);
            *value = (*value * scale).round() / scale;
        }
        rail | number
    });
    if !touched {
        *value = before;
    }
    *value != before
}

/// Whether `value` has at most `decimals` decimals, up to the rounding errors of single precision.
fn is_round(value: f64, decimals: usize) -> bool {
    let scaled = value * 10f64.powi(decimals as i32);
    (scaled - scaled.round()).abs() < 1e-3
}

/// Paints a tick at the default value on the slider's rail.
fn paint_tick(ui: &Ui, rail: Rect, spec: &SliderSpec<'_>) {
    let (low, high) = (*spec.range.start(), *spec.range.end());
    let fraction = if spec.logarithmic {
        (spec.default.ln() - low.ln()) / (high.ln() - low.ln())
    } else {
        (spec.default - low) / (high - low)
    };
    let positions = rail.x_range().shrink(rail.height() / 2.5);
    let x = egui::lerp(positions.min..=positions.max, fraction as f32);
    let color = theme::palette(ui).dim;
    ui.painter().vline(x, rail.bottom() - 3.0..=rail.bottom(), Stroke::new(1.0, color));
}
