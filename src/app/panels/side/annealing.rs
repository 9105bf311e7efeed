//! The SAH cost over the time of annealing, of the tree that is being built and of the one on the screen.

use std::time::Duration;

use egui::{Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2};

use crate::app::state::AppState;
use crate::app::widgets::{Statistic, Tip as _, statistic};
use crate::app::{format, theme};

/// Height of the curve.
const HEIGHT: f32 = 44.0;

/// Shows how the cost falls in the build that runs, if it anneals.
pub(super) fn running(ui: &mut Ui, state: &mut AppState) {
    let Some(job) = &state.activity.build else { return };
    let (costs, left) = (job.costs.clone(), job.time_left(std::time::Instant::now()));
    if costs.is_empty() {
        return;
    }
    let left = left.map_or_else(String::new, |left| format!(", {} left", format::duration(left)));
    curve(ui, state, "Annealing", &left, &costs);
}

/// Shows how the cost fell in a build that is finished; nothing where it did not anneal.
pub(super) fn finished(ui: &mut Ui, state: &mut AppState, costs: &[(Duration, f64)]) {
    if !costs.is_empty() {
        curve(ui, state, "Annealed", "", costs);
    }
}

fn curve(ui: &mut Ui, state: &mut AppState, label: &'static str, note: &str, costs: &[(Duration, f64)]) {
    let (Some(&(_, first)), Some(&(duration, last))) = (costs.first(), costs.last()) else { return };
    let [before, after] = [first, last].map(number);
    let gain = format::change(first, last);
    let rounds = costs.len() - 1;
    let tip = format!("SAH cost before the first round and after the last of {rounds} so far, with the best leaves");
    statistic(ui, state, &Statistic::new(label, format!("{before} to {after}, {gain}")).tip(tip));
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
    let time = format!("{} rounds in {}{note}", format::count(rounds as u64), format::duration(duration));
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("SAH cost: {before} to {after}, {time}")));
    let palette = theme::palette(ui);
    let plot = rect.shrink2(vec2(8.0, 4.0));
    let lowest = costs.iter().map(|&(_, cost)| cost).fold(f64::INFINITY, f64::min);
    let highest = costs.iter().map(|&(_, cost)| cost).fold(f64::NEG_INFINITY, f64::max);
    let point = |time: Duration, cost: f64| {
        let x = time.as_secs_f64() / duration.as_secs_f64().max(1e-9);
        let y = (highest - cost) / (highest - lowest).max(1e-9);
        pos2(plot.left() + plot.width() * x as f32, plot.top() + plot.height() * y as f32)
    };
    let painter = ui.painter();
    let level = point(Duration::ZERO, first).y;
    painter.hline(plot.x_range(), level, Stroke::new(1.0, palette.line));
    let points = costs.iter().map(|&(time, cost)| point(time, cost)).collect();
    painter.add(Shape::line(points, Stroke::new(1.5, palette.accent)));
    let at = |x: f32| duration.mul_f32(((x - plot.left()) / plot.width()).clamp(0.0, 1.0));
    let text = match response.hover_pos().map(|pointer| at(pointer.x)) {
        Some(hovered) => {
            let round = costs.partition_point(|&(time, _)| time <= hovered).max(1) - 1;
            let (time, cost) = costs[round];
            painter.circle_filled(point(time, cost), 3.0, palette.accent);
            format!("SAH cost {} after round {round}, {}", number(cost), format::duration(time))
        }
        None => time,
    };
    ui.label(egui::RichText::new(text).small().color(palette.dim));
    response.tip("SAH cost over the time of annealing: at first it may rise, so that better trees can be reached");
}

/// A cost with the digits in which late rounds differ.
fn number(cost: f64) -> String {
    format!("{cost:.3}")
}
