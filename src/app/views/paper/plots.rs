//! Plots of the measured curves. A click on a point builds the tree that it was measured on.

use std::sync::Arc;

use egui::{self, Color32, CursorIcon, Rangef, RichText, Role, Sense, Stroke, Ui, WidgetInfo, vec2};
use egui_plot::{AxisHints, GridMark, Line, MarkerShape, Plot, PlotPoint, PlotPoints, PlotTransform, Points, VLine};

use crate::app::state::AppState;
use crate::app::state::paper::{PaperResult, apply_row};
use crate::app::{format, theme};
use crate::lab::Measurement;
use crate::lab::plot::{COLORS, Panel, PlotCurve, Point};

/// Smallest width of a plot in points.
const MIN_WIDTH: f32 = 200.0;
/// Width of a category's label in points.
const CATEGORY_WIDTH: f32 = 84.0;
/// Height of a plot in points where they take several rows.
const WRAPPED_HEIGHT: f32 = 184.0;
/// Smallest height of a plot in points.
const MIN_HEIGHT: f32 = 140.0;

/// Shows the plots side by side, in as many rows as their labels need.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState, result: &PaperResult) {
    legend(ui, &result.panels);
    let count = result.panels.len();
    let gap = ui.spacing().item_spacing.x;
    let width = ui.available_width();
    let needed = result.panels.iter().map(needed_width).fold(MIN_WIDTH, f32::max);
    let columns = columns(width, needed, gap, count);
    let height = match count.div_ceil(columns) {
        1 => (ui.available_height() - 14.0).max(MIN_HEIGHT),
        _ => WRAPPED_HEIGHT,
    };
    let size = vec2((width - gap * (columns as f32 - 1.0)) / columns as f32, height);
    for (row, panels) in result.panels.chunks(columns).enumerate() {
        ui.horizontal_top(|ui| {
            for (index, panel) in panels.iter().enumerate() {
                ui.allocate_ui(size, |ui| {
                    ui.vertical(|ui| {
                        heading(ui, panel);
                        let rows = Arc::clone(&result.rows);
                        let id = row * columns + index;
                        plot(ui, state, (id, panel), &rows, vec2(size.x, (height - 24.0).max(96.0)));
                    });
                });
            }
        });
    }
}

/// Width in points at which all labels of a plot can be read.
fn needed_width(panel: &Panel) -> f32 {
    (panel.categories.len() as f32 * CATEGORY_WIDTH).max(MIN_WIDTH)
}

/// Number of plots of the `needed` width in a row of `width` points, with a gap between them: at least 1, and as even over the
/// rows as they can be.
fn columns(width: f32, needed: f32, gap: f32, count: usize) -> usize {
    let most = (((width + gap) / (needed + gap)).floor().max(1.0) as usize).min(count.max(1));
    count.div_ceil(count.div_ceil(most).max(1)).max(1)
}

/// Title of a plot: its quantity, and the series that it is relative to.
fn heading(ui: &mut Ui, panel: &Panel) {
    let text = match &panel.relative_of {
        Some(series) => format!("{} · {series}", panel.y_label),
        None => panel.y_label.clone(),
    };
    ui.add(egui::Label::new(RichText::new(text).color(theme::palette(ui).text)).truncate());
}

/// Names of the curves: once for the plots relative to a series, once for all others.
fn legend(ui: &mut Ui, panels: &[Panel]) {
    let palette = theme::palette(ui);
    ui.horizontal_wrapped(|ui| {
        let relative = panels.iter().find(|panel| panel.relative_of.is_some());
        let absolute = panels.iter().find(|panel| panel.relative_of.is_none());
        for panel in relative.into_iter().chain(absolute) {
            for (index, curve) in panel.curves.iter().enumerate() {
                let (rect, _) = ui.allocate_exact_size(vec2(16.0, theme::ROW_HEIGHT), Sense::hover());
                let stroke = Stroke::new(2.0, color(ui, panel, index));
                ui.painter().hline(rect.x_range(), rect.center().y, stroke);
                if !curve.reference {
                    ui.painter().circle_filled(rect.center(), 3.5, stroke.color);
                }
                ui.label(RichText::new(&curve.name).color(palette.dim));
            }
            ui.add_space(16.0);
        }
    });
}

/// Colour of a curve, as in exported plots; black becomes the text colour, which is visible in both themes.
fn color(ui: &Ui, panel: &Panel, curve: usize) -> Color32 {
    let palette = theme::palette(ui);
    if panel.curves[curve].reference {
        return palette.dim;
    }
    let index = curve + if panel.relative_of.is_some() { 3 } else { 0 };
    match COLORS[index % COLORS.len()] {
        [0, 0, 0] => palette.text,
        [r, g, b] => Color32::from_rgb(r, g, b),
    }
}

/// One plot. A click on a point requests its tree.
fn plot(ui: &mut Ui, state: &mut AppState, (id, panel): (usize, &Panel), rows: &[Measurement], size: egui::Vec2) {
    let points = || panel.curves.iter().flat_map(|curve| &curve.points);
    let low = points().map(|point| point.x).fold(f64::INFINITY, f64::min);
    let high = points().map(|point| point.x).fold(f64::NEG_INFINITY, f64::max);
    let top = points().map(|point| point.y).fold(0.0, f64::max);
    if low > high {
        return;
    }
    let named = !panel.categories.is_empty();
    let margin = if named { 0.5 } else { ((high - low) * 0.04).max(0.2) };
    let categories = panel.categories.clone();
    let x_text = move |mark: GridMark, _: &std::ops::RangeInclusive<f64>| {
        let nearest = mark.value.round();
        if (mark.value - nearest).abs() > 1e-6 || nearest < 0.0 {
            String::new()
        } else if named {
            categories.get(nearest as usize).cloned().unwrap_or_default()
        } else {
            nearest.to_string()
        }
    };
    let colors: Vec<Color32> = (0..panel.curves.len()).map(|curve| color(ui, panel, curve)).collect();
    let now = (id, wanted_x(state, panel, rows));
    let warm = theme::palette(ui).warm;
    // Denser labels than egui_plot's default, since the plots are narrow.
    let mut x_axis = AxisHints::new_x().formatter(x_text).label_spacing(Rangef::new(18.0, 28.0));
    if !panel.x_label.is_empty() {
        x_axis = x_axis.label(RichText::new(&panel.x_label).small());
    }
    let y_text = |mark: GridMark, _: &std::ops::RangeInclusive<f64>| format::significant(mark.value);
    let y_axis = AxisHints::new_y().formatter(y_text).label_spacing(Rangef::new(12.0, 18.0)).min_thickness(36.0);
    let mut plot = Plot::new(("paper plot", id))
        .width(size.x)
        .height(size.y)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .allow_axis_zoom_drag(false)
        .show_crosshair(false)
        .label_formatter(|_| None)
        .custom_x_axes(vec![x_axis])
        .custom_y_axes(vec![y_axis])
        .set_margin_fraction(vec2(0.0, 0.0));
    let step = if named { 1 } else { whole_step(f64::from(size.x) / (high - low + 2.0 * margin)) };
    plot = plot.x_grid_spacer(move |input| {
        let (from, to) = input.bounds;
        let marks = (from.ceil() as i64..=to.floor() as i64).filter(|at| at % step == 0);
        marks.map(|at| GridMark { value: at as f64, step_size: step as f64 }).collect()
    });
    let curves = panel.curves.clone();
    let shown = plot.show(ui, |plot| {
        plot.set_plot_bounds_x(low - margin..=high + margin);
        plot.set_plot_bounds_y(0.0..=if top > 0.0 { top * 1.12 } else { 1.0 });
        if let (_, Some(x)) = now {
            plot.vline(VLine::new("now", x).color(warm.gamma_multiply(0.7)).width(1.0).allow_hover(false));
        }
        for (curve, color) in curves.iter().zip(colors) {
            draw(plot, curve, color, named);
        }
    });
    shown.response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("Plot of {}", panel.y_label)));
    if let Some(row) = clicked(ui, panel, rows, &shown.transform, id).and_then(|row| rows.get(row)) {
        apply_row(row, &mut state.wanted);
    }
}

/// The smallest step between labels that leaves room for a number, where one unit has this many points.
fn whole_step(unit: f64) -> i64 {
    [1, 2, 5, 10].into_iter().find(|&step| step as f64 * unit >= 28.0).unwrap_or(20)
}

/// Position of the present threshold on the horizontal axis of a sweep; `None` for other experiments.
fn wanted_x(state: &AppState, panel: &Panel, rows: &[Measurement]) -> Option<f64> {
    let sweep = rows.first().is_some_and(|row| row.command == "sweep");
    (sweep && panel.categories.is_empty()).then(|| f64::from(state.wanted.build.threshold))
}

/// Draws a curve: line, spread of the repetitions, markers.
fn draw(plot: &mut egui_plot::PlotUi<'_>, curve: &PlotCurve, color: Color32, named: bool) {
    let points = || -> PlotPoints<'static> { curve.points.iter().map(|point| [point.x, point.y]).collect() };
    if !named {
        let width = if curve.reference { 1.0 } else { 1.5 };
        plot.line(Line::new(curve.name.clone(), points()).color(color).width(width).allow_hover(false));
    }
    if curve.reference {
        return;
    }
    for point in &curve.points {
        if let Some([fastest, slowest]) = point.spread {
            let whisker = vec![[point.x, fastest], [point.x, slowest]];
            let faint = color.gamma_multiply(0.5);
            plot.line(Line::new("", whisker).color(faint).width(1.0).allow_hover(false));
        }
    }
    let markers = Points::new(curve.name.clone(), points()).color(color).radius(3.0).shape(MarkerShape::Circle);
    plot.points(markers.allow_hover(false));
}

/// Index of the row whose point was clicked. Each point is a widget with an accessible name.
fn clicked(ui: &Ui, panel: &Panel, rows: &[Measurement], transform: &PlotTransform, id: usize) -> Option<usize> {
    let mut row = None;
    for (index, curve) in panel.curves.iter().enumerate() {
        // Widgets of neighbouring points do not overlap.
        let step = curve.points.windows(2).map(|pair| pair[1].x - pair[0].x).filter(|step| *step > 0.0);
        let step = step.fold(f64::INFINITY, f64::min) * transform.dpos_dvalue_x();
        let width = (step as f32).clamp(4.0, 16.0);
        for (at, point) in curve.points.iter().enumerate().filter(|(_, point)| point.row.is_some()) {
            let position = transform.position_from_point(&PlotPoint::new(point.x, point.y));
            let rect = egui::Rect::from_center_size(position, vec2(width, 16.0));
            let response = ui.interact(rect, ui.scope_id().with(("point", id, index, at)), Sense::CLICK);
            response.widget_info(|| WidgetInfo::labeled(Role::Button, true, point_name(panel, curve, point)));
            if response.hovered() {
                let stroke = Stroke::new(1.5, theme::palette(ui).text);
                ui.painter().circle_stroke(position, 5.0, stroke);
            }
            let from_file = point.row.and_then(|row| rows.get(row)).is_some_and(|row| row.tree.is_some());
            let verb = if from_file { "read" } else { "build" };
            let tip = format!("{}\nClick to {verb} this tree", point_name(panel, curve, point));
            if response.on_hover_cursor(CursorIcon::PointingHand).on_hover_text_at_pointer(tip).clicked() {
                row = point.row;
            }
        }
    }
    row
}

/// Accessible name of a point: "Tests per ray 11.2 at threshold 6, box".
fn point_name(panel: &Panel, curve: &PlotCurve, point: &Point) -> String {
    let (name, unit) = panel.y_label.split_once(" (").unwrap_or((&panel.y_label, ""));
    let unit = unit.trim_end_matches(')');
    let value = format::significant(point.y);
    let x = point.x.round() as usize;
    let at = match panel.categories.get(x) {
        Some(category) => format!("for {category}"),
        None => format!("at {} {x}", panel.x_label.split([' ', '(']).next().unwrap_or_default().to_lowercase()),
    };
    let space = if unit.is_empty() || unit == "×" { "" } else { " " };
    format!("{name} {value}{space}{unit} {at}, {}", curve.name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_room() {
        assert_eq!([60.0, 20.0, 6.0, 3.0, 1.0].map(whole_step), [1, 2, 5, 10, 20]);
    }

    #[test]
    fn plots_take_as_many_rows_as_they_need() {
        assert_eq!(columns(1000.0, 200.0, 8.0, 4), 4);
        assert_eq!(columns(700.0, 200.0, 8.0, 4), 2, "two and two rather than three and one");
        assert_eq!(columns(100.0, 200.0, 8.0, 4), 1);
        assert_eq!(columns(1000.0, 200.0, 8.0, 1), 1);
        assert_eq!(columns(1000.0, 200.0, 8.0, 0), 1);
    }
}
