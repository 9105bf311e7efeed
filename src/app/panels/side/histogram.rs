//! Value range of the heat map, dragged on a histogram of the picture's counts.

use std::sync::Arc;

use egui::{self, Color32, CornerRadius, CursorIcon, Id, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use crate::app::commands::Action;
use crate::app::state::AppState;
use crate::app::widgets::{chip, row};
use crate::app::{format, theme};
use crate::render::{Frame, Shading};

/// Number of bins.
const BINS: usize = 64;
/// Height of the histogram in points.
const HEIGHT: f32 = 56.0;

/// Histogram of the values of one frame.
#[derive(Debug)]
struct Histogram {
    frame_id: u64,
    /// Upper bound of the last bin: the largest value; the first bin starts at 0.
    top: f32,
    bins: [u32; BINS],
}

impl Histogram {
    fn of(frame: &Frame, frame_id: u64) -> Self {
        let top = frame.values.iter().copied().filter(|value| value.is_finite()).fold(1.0, f32::max);
        let mut bins = [0; BINS];
        for value in frame.values.iter().filter(|value| value.is_finite()) {
            bins[((value / top * BINS as f32) as usize).min(BINS - 1)] += 1;
        }
        Self { frame_id, top, bins }
    }

    /// Tooltip of a bin: number of pixels, range of counts, what a drag does.
    fn tip(&self, bin: usize, counted: &str) -> String {
        let end = |bin: usize| format::count((bin as f32 / BINS as f32 * self.top).ceil() as u64);
        format!(
            "{} pixels of {} to {} {counted}\nDrag the ends of the range: counts below and above share the first and last colour",
            format::count(u64::from(self.bins[bin])),
            end(bin),
            end(bin + 1),
        )
    }

    /// The histogram of the presented frame, cached until the next frame.
    fn load(ui: &Ui, state: &AppState) -> Option<Arc<Self>> {
        let shown = state.model.presented.as_ref().filter(|shown| !shown.frame.values.is_empty())?;
        let id = Id::unique("histogram");
        let cached: Option<Arc<Self>> = ui.data(|data| data.get_temp(id));
        if let Some(cached) = cached.filter(|cached| cached.frame_id == shown.frame_id) {
            return Some(cached);
        }
        let fresh = Arc::new(Self::of(&shown.frame, shown.frame_id));
        ui.data_mut(|data| data.insert_temp(id, Arc::clone(&fresh)));
        Some(fresh)
    }
}

/// The fixed range of values where one is set, else that of the presented frame.
fn range(state: &AppState) -> [f32; 2] {
    let shown = state.model.presented.as_ref().map_or([0.0, 1.0], |shown| shown.frame.value_range);
    state.wanted.render.heat_range.unwrap_or(shown)
}

/// Shows the range as numbers, and the histogram.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let Some(histogram) = Histogram::load(ui, state) else {
        ui.label(egui::RichText::new("Counting…").color(theme::palette(ui).dim));
        return;
    };
    let [mut low, mut high] = range(state);
    let mut changed = false;
    let tip = "The counts at both ends of the colours. Drag the ends in the histogram or the numbers; Fit spreads them over this picture (C)";
    row(ui, "Heat range", tip, |ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let number = |ui: &mut Ui, value: &mut f32, limits: std::ops::RangeInclusive<f32>, name: &'static str| {
            let current = f64::from(*value);
            let response = ui.add_sized(
                vec2(34.0, theme::ROW_HEIGHT),
                egui::DragValue::new(value).range(limits).speed(0.5).max_decimals(0),
            );
            response.widget_info(|| {
                let mut info = WidgetInfo::drag_value(ui.is_enabled(), current);
                info.label = Some(name.to_owned());
                info
            });
            response
        };
        let numbers = number(ui, &mut low, 0.0..=high - 1.0, "Heat range from")
            | number(ui, &mut high, low + 1.0..=100_000.0, "Heat range to");
        changed |= numbers.changed();
        if chip(ui, "Fit", false, "Spread the colours over the counts of this picture; the range then stays (C)") {
            Action::FitHeatRange.perform(state);
        }
        let auto = state.wanted.render.heat_range.is_none();
        if chip(ui, "Auto", auto, "Fit the range to every picture") {
            state.wanted.render.heat_range = if auto { Some(range(state)) } else { None };
        }
        numbers
    });
    changed |= bars(ui, state, &histogram, &mut low, &mut high);
    if changed {
        state.wanted.render.heat_range = Some([low.min(high - 1.0).max(0.0), high]);
    }
}

/// Paints the bins in the colours of the map and moves the end of the range that is dragged. Returns whether it moved.
fn bars(ui: &mut Ui, state: &AppState, histogram: &Histogram, low: &mut f32, high: &mut f32) -> bool {
    let palette = theme::palette(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
    let counted = match state.wanted.render.shading {
        Shading::Heat(kind) => kind.counted(),
        _ => "tests",
    };
    let summary = format!("Histogram of {counted}, 0 to {}", format::count(histogram.top as u64));
    response.widget_info(|| WidgetInfo::labeled(Role::Image, ui.is_enabled(), &summary));
    ui.painter().rect_filled(rect, CornerRadius::same(4), ui.visuals().extreme_bg_color);
    let most = histogram.bins.iter().copied().max().unwrap_or(1).max(1) as f32;
    let plot = Rect::from_min_max(rect.min + vec2(4.0, 4.0), rect.max - vec2(4.0, 16.0));
    let step = plot.width() / BINS as f32;
    for (bin, count) in histogram.bins.iter().enumerate() {
        // Logarithmic, so that the few expensive pixels stay visible.
        let height = (1.0 + *count as f32).ln() / (1.0 + most).ln();
        let value = (bin as f32 + 0.5) / BINS as f32 * histogram.top;
        let [r, g, b] = state.wanted.render.value_color((value - *low) / (*high - *low).max(1e-6));
        let left = plot.left() + bin as f32 * step;
        let bar = Rect::from_min_max(
            pos2(left, plot.bottom() - height * plot.height()),
            pos2(left + step - 0.5, plot.bottom()),
        );
        ui.painter().rect_filled(bar, CornerRadius::ZERO, Color32::from_rgb(r, g, b));
    }
    let x_of = |value: f32| plot.left() + (value / histogram.top).clamp(0.0, 1.0) * plot.width();
    for end in [*low, *high] {
        ui.painter().vline(x_of(end), rect.top() + 2.0..=plot.bottom() + 2.0, Stroke::new(1.5, palette.text));
    }
    let font = egui::FontId::proportional(10.5);
    let below = rect.bottom() - 2.0;
    ui.painter().text(pos2(plot.left(), below), egui::Align2::LEFT_BOTTOM, "0", font.clone(), palette.dim);
    let top = format::count(histogram.top as u64);
    ui.painter().text(pos2(plot.right(), below), egui::Align2::RIGHT_BOTTOM, top, font, palette.dim);
    let response = response.on_hover_cursor(CursorIcon::ResizeHorizontal);
    let response = match response.hover_pos() {
        Some(pointer) => {
            let bin = (((pointer.x - plot.left()) / step).max(0.0) as usize).min(BINS - 1);
            response.on_hover_text_at_pointer(histogram.tip(bin, counted))
        }
        None => response,
    };
    let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged()) else { return false };
    let value = ((pointer.x - plot.left()) / plot.width()).clamp(0.0, 1.0) * histogram.top;
    let value = value.round();
    if (value - *low).abs() < (value - *high).abs() {
        *low = value.min(*high - 1.0).max(0.0);
    } else {
        *high = value.max(*low + 1.0);
    }
    true
}
