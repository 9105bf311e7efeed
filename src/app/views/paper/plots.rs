//! Plots of the measured curves. A click on a point builds the tree that it was measured on.

use std::sync::Arc;

use egui::{self, Color32, CursorIcon, Rect, RichText, Role, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo, vec2};

use crate::app::state::AppState;
use crate::app::state::paper::{PaperResult, apply_row};
use crate::app::views::axes::{Axes, Lettering};
use crate::app::{format, theme};
use crate::lab::Measurement;
use crate::lab::plot::{COLORS, Chart, Curve, Look, Point};

/// Smallest width of a plot in points.
const MIN_WIDTH: f32 = 200.0;
/// Height of a plot in points where they take several rows.
const WRAPPED_HEIGHT: f32 = 184.0;
/// Smallest height of a plot in points.
const MIN_HEIGHT: f32 = 140.0;
/// Height of a row of a plot with rows in points, and of such a plot without its rows.
const ROW_HEIGHT: f32 = 18.0;
const ROWS_FRAME: f32 = 52.0;
/// Width of a character of the name of a row in points.
const CHARACTER: f32 = 6.5;
/// Radius of a marker in points.
const MARKER: f32 = 3.0;

/// Shows the plots side by side, in as many lines as they need.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState, result: &PaperResult) {
    let charts = &result.figure.charts;
    // Those of one container have rows of their own.
    for family in charts.chunk_by(|a, b| a.title.is_empty() == b.title.is_empty() && a.rows == b.rows) {
        legend(ui, family);
        let names = names_width(&family[0]);
        let gap = ui.spacing().item_spacing.x;
        let columns = columns(ui.available_width() - names, MIN_WIDTH, gap, family.len());
        let width = (ui.available_width() - names - gap * (columns as f32 - 1.0)) / columns as f32;
        let height = match (family[0].rows.len(), family.len() == charts.len() && columns == family.len()) {
            (0, true) => (ui.available_height() - 14.0).max(MIN_HEIGHT),
            (0, false) => WRAPPED_HEIGHT,
            (rows, _) => rows as f32 * ROW_HEIGHT + ROWS_FRAME,
        };
        for line in family.chunks(columns) {
            ui.horizontal_top(|ui| {
                for (column, chart) in line.iter().enumerate() {
                    // Names of rows are at the left of a line only.
                    let names = if column == 0 { names } else { 0.0 };
                    let rows = Arc::clone(&result.rows);
                    plot(ui, state, chart, &rows, (vec2(width + names, height), names));
                }
            });
        }
    }
}

/// Width in points that the names of the rows take.
fn names_width(chart: &Chart) -> f32 {
    chart.rows.iter().map(|name| name.chars().count()).max().map_or(0.0, |most| most as f32 * CHARACTER + 8.0)
}

/// Number of plots of the `needed` width in a line of `width` points, with a gap between them: at least 1, and as even over the
/// lines as they can be.
fn columns(width: f32, needed: f32, gap: f32, count: usize) -> usize {
    let most = (((width + gap) / (needed + gap)).floor().max(1.0) as usize).min(count.max(1));
    count.div_ceil(count.div_ceil(most).max(1)).max(1)
}

/// Names of the curves of `charts`, each once.
fn legend(ui: &mut Ui, charts: &[Chart]) {
    let palette = theme::palette(ui);
    let mut named: Vec<&str> = Vec::new();
    ui.horizontal_wrapped(|ui| {
        for curve in charts.iter().flat_map(|chart| &chart.curves) {
            if named.contains(&curve.name.as_str()) {
                continue;
            }
            named.push(&curve.name);
            let (rect, _) = ui.allocate_exact_size(vec2(16.0, theme::ROW_HEIGHT), Sense::hover());
            let color = color(ui, curve);
            ui.painter().hline(rect.x_range(), rect.center().y, Stroke::new(line_width(curve.look), color));
            if curve.look == Look::Measured {
                ui.painter().circle_filled(rect.center(), 3.5, color);
            }
            ui.label(RichText::new(&curve.name).color(palette.dim));
        }
    });
}

fn line_width(look: Look) -> f32 {
    if look == Look::Measured { 1.5 } else { 1.0 }
}

/// Colour of a curve, as in exported plots; black becomes the text colour, which is visible in both themes.
fn color(ui: &Ui, curve: &Curve) -> Color32 {
    let palette = theme::palette(ui);
    match COLORS[curve.color % COLORS.len()] {
        _ if curve.look == Look::Reference => palette.dim,
        [0, 0, 0] => palette.text,
        [r, g, b] => Color32::from_rgb(r, g, b),
    }
}

/// One plot. A click on a point requests its tree.
fn plot(ui: &mut Ui, state: &mut AppState, chart: &Chart, rows: &[Measurement], (size, rows_width): (Vec2, f32)) {
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let [across, up] = &chart.labels;
    let quantity = if chart.rows.is_empty() { up } else { across };
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("Plot of {quantity}")));
    let heading = if chart.title.is_empty() { quantity.clone() } else { format!("{quantity} · {}", chart.title) };
    let across = if chart.rows.is_empty() { across } else { "" };
    let axes =
        Axes::paint(ui, rect, chart.axes, &Lettering { heading: &heading, across, rows: &chart.rows, rows_width });
    if let Some(x) = wanted_x(state, chart, rows) {
        let at = axes.at([x, chart.axes[1].low]);
        let warm = theme::palette(ui).warm.gamma_multiply(0.7);
        axes.painter(ui).vline(at.x, axes.plot.y_range(), Stroke::new(1.0, warm));
    }
    for curve in &chart.curves {
        draw(ui, &axes, chart, curve);
    }
    if let Some(row) = clicked(ui, chart, rows, &axes, response.id).and_then(|row| rows.get(row)) {
        apply_row(row, &mut state.wanted);
    }
}

/// Position of the present threshold on the horizontal axis of a sweep; `None` for other experiments.
fn wanted_x(state: &AppState, chart: &Chart, rows: &[Measurement]) -> Option<f64> {
    let sweep = rows.first().is_some_and(|row| row.command == "sweep");
    let threshold = f64::from(state.wanted.build.threshold);
    (sweep && chart.rows.is_empty() && (0.0..=1.0).contains(&chart.axes[0].at(threshold))).then_some(threshold)
}

/// Draws a curve: spread of the repetitions, line, markers.
fn draw(ui: &Ui, axes: &Axes, chart: &Chart, curve: &Curve) {
    let (painter, color) = (axes.painter(ui), color(ui, curve));
    for ends in curve.points.iter().filter_map(|point| chart.whisker(point)) {
        let faint = Stroke::new(1.0, color.gamma_multiply(0.5));
        painter.line_segment(ends.map(|end| axes.at(end)), faint);
    }
    let places = || curve.points.iter().map(|point| axes.at([point.x, point.y]));
    if chart.is_joined() {
        painter.add(Shape::line(places().collect(), Stroke::new(line_width(curve.look), color)));
    }
    if curve.look == Look::Measured {
        painter.extend(places().map(|at| Shape::circle_filled(at, MARKER, color)));
    }
}

/// Index of the row whose point was clicked. Each point is a widget with an accessible name.
fn clicked(ui: &Ui, chart: &Chart, rows: &[Measurement], axes: &Axes, id: egui::Id) -> Option<usize> {
    let mut row = None;
    for (index, curve) in chart.curves.iter().enumerate() {
        let places: Vec<_> = curve.points.iter().map(|point| axes.at([point.x, point.y])).collect();
        // Widgets of neighbouring points do not overlap.
        let steps = places.windows(2).map(|pair| pair[1].x - pair[0].x).filter(|step| *step > 0.0);
        let width = if chart.is_joined() { steps.fold(16.0, f32::min).max(4.0) } else { 16.0 };
        for (at, (point, &place)) in curve.points.iter().zip(&places).enumerate() {
            let Some(source) = point.row.and_then(|row| rows.get(row)) else { continue };
            let response =
                ui.interact(Rect::from_center_size(place, vec2(width, 16.0)), id.with((index, at)), Sense::CLICK);
            let name = point_name(chart, curve, point);
            response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
            if response.hovered() {
                ui.painter().circle_stroke(place, 5.0, Stroke::new(1.5, theme::palette(ui).text));
            }
            let verb = if source.tree.is_some() { "read" } else { "build" };
            let tip = format!("{name}\nClick to {verb} this tree");
            if response.on_hover_cursor(CursorIcon::PointingHand).on_hover_text_at_pointer(tip).clicked() {
                row = point.row;
            }
        }
    }
    row
}

/// Accessible name of a point: "Tests per ray 11.2 at threshold 6, boxes".
fn point_name(chart: &Chart, curve: &Curve, point: &Point) -> String {
    let (value, label) = chart.value(point);
    let (name, unit) = label.split_once(" (").unwrap_or((label, ""));
    let unit = unit.trim_end_matches(')');
    let value = format::significant(value);
    let at = if let Some(row) = chart.rows.get(point.y.round() as usize) {
        format!("for {row}")
    } else {
        let across = chart.labels[0].split([' ', '(']).next().unwrap_or_default().to_lowercase();
        format!("at {across} {}", point.x.round())
    };
    let space = if unit.is_empty() || unit == "×" { "" } else { " " };
    format!("{name} {value}{space}{unit} {at}, {}", curve.name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plots_take_as_many_lines_as_they_need() {
        assert_eq!(columns(1000.0, 200.0, 8.0, 4), 4);
        assert_eq!(columns(700.0, 200.0, 8.0, 4), 2, "two and two rather than three and one");
        assert_eq!(columns(100.0, 200.0, 8.0, 4), 1);
        assert_eq!(columns(1000.0, 200.0, 8.0, 1), 1);
        assert_eq!(columns(1000.0, 200.0, 8.0, 0), 1);
    }
}
