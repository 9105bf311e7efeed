//! Predicted against measured visits: cells of nodes, the worst ones ringed, and what pointing and clicking do.

use std::sync::Arc;

use egui::{self, Mesh, Rect, RichText, Role, Sense, Stroke, Ui, WidgetInfo};

use super::PlotsView;
use crate::accel::node_values::NodeValues;
use crate::app::state::action::Action;
use crate::app::state::{AppState, Presented, Request};
use crate::app::views::axes::{Axes, Lettering, rest};
use crate::app::views::parts;
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::lab::visit_scatter::{ScatterNode, VisitScatter, node_in};

/// Distance in points within which the pointer is at a node.
const REACH: f32 = 9.0;
/// Least size of a cell in points: a single node must be seen.
const LEAST_CELL: f32 = 3.0;

/// Labels of the axes.
pub(super) const LABELS: [&str; 2] = ["Predicted visits", "Measured visits"];

/// Shows the plot with the counts below the controls.
pub(super) fn show(ui: &mut Ui, view: &mut PlotsView, state: &mut AppState, shown: &Presented) {
    if let Some(reason) = parts::no_rays(state, shown) {
        parts::waiting(ui, false, reason);
        return;
    }
    let Some(scatter) = view.scatter.of_tree(&shown.accel).cloned() else {
        let derived = &mut state.model.derived;
        let inputs = PlotsView::inputs(derived, &shown.accel);
        parts::wait_for(ui, derived, &shown.accel, (&mut view.scatter, inputs), "Counting the visits");
        return;
    };
    counts(ui, &scatter, shown);
    plot(ui, state, shown, &scatter);
}

/// The sums of the measurement in a line.
fn counts(ui: &mut Ui, scatter: &VisitScatter, shown: &Presented) {
    let sums = &scatter.sums;
    let [rays, hits, entering] =
        [sums.rays, sums.root_hits, sums.entering_rays.unwrap_or(0)].map(|count| format::count(u64::from(count)));
    let each = |visits: f64| format::significant(visits / f64::from(sums.root_hits.max(1)));
    let text = format!(
        "{}: {hits} of {rays} rays enter the root · {} visits each, {} predicted · cost {}, SAH {} · {} never visited · {entering} enter the scene's box{}",
        sums.population.label(),
        each(sums.visits as f64),
        each(sums.predicted_visits),
        format::significant(sums.cost),
        format::significant(f64::from(shown.accel.report.stats.sah_cost)),
        format::counted(scatter.never as u64, "node"),
        // Of copies there are none: those below the tree over them are counted elsewhere.
        sums.tests_per_entering_ray
            .map_or_else(String::new, |tests| format!(": {} tests each", format::significant(tests))),
    );
    let tip = format!(
        "{}. Cost: what the tests of a ray that enters the root cost, in the unit of the SAH cost, which predicts it. {} with less than one predicted visit are not drawn",
        sums.population.meaning(),
        format::counted(scatter.left_out as u64, "node")
    );
    let label = egui::Label::new(RichText::new(text).color(theme::palette(ui).dim)).truncate();
    ui.add(label).tip(tip);
}

/// The plot.
fn plot(ui: &mut Ui, state: &mut AppState, shown: &Presented, scatter: &Arc<VisitScatter>) {
    let (rect, response) = ui.allocate_exact_size(rest(ui), Sense::click());
    let name = format!("Plot of measured against predicted visits, {}", format::counted(scatter.shown as u64, "node"));
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
    let heading = format!("{} · {}, worst ringed", LABELS[1], format::counted(scatter.shown as u64, "node"));
    let lettering = Lettering { heading: &heading, across: LABELS[0], ..Lettering::default() };
    let axes = Axes::paint(ui, rect, scatter.axes, &lettering);
    axes.diagonal(ui, theme::palette(ui).dim);
    cells(ui, &axes, scatter);
    marks(ui, state, shown, &axes, scatter);

    let pointed = response.hover_pos().filter(|at| axes.plot.expand(REACH).contains(*at));
    let found = pointed.and_then(|at| node_at(&axes, scatter, at));
    if let Some((node, count)) = found {
        state.selection.point_at(node.node);
        if response.clicked() {
            state.select_node(node.node);
        }
        if response.double_clicked() {
            state.activity.requests.push(Request::Perform(Action::FrameSelection));
        }
        response.on_hover_text_at_pointer(text_of(shown, &node, count));
    }
}

/// The node at a point of the screen and how many are drawn there: one of the worst before any other.
fn node_at(axes: &Axes, scatter: &VisitScatter, at: egui::Pos2) -> Option<(ScatterNode, u32)> {
    let distance = |node: &ScatterNode| Some(axes.place(scatter.place(node)?).distance(at));
    let worst = scatter.worst.iter().filter_map(|node| Some((distance(node)?, *node)));
    let nearest = worst.filter(|(distance, _)| *distance <= REACH * 0.6).min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((_, node)) = nearest {
        return Some((node, 1));
    }
    let reach = [REACH / axes.plot.width(), REACH / axes.plot.height()].map(f64::from);
    scatter.nearest(axes.place_of(at), reach).map(|cell| (cell.first, cell.count))
}

/// The cells as one mesh: the more nodes, the brighter.
fn cells(ui: &Ui, axes: &Axes, scatter: &VisitScatter) {
    let [width, height] = VisitScatter::cell_size();
    let [width, height] = [axes.plot.width() * width as f32, axes.plot.height() * height as f32];
    let size = egui::Vec2::splat(width.min(height).max(LEAST_CELL));
    let most = scatter.cells.iter().map(|cell| cell.count).max().unwrap_or(1);
    let scale = f64::from(most).ln().max(1.0);
    let mut mesh = Mesh::default();
    mesh.reserve_vertices(scatter.cells.len() * 4);
    mesh.reserve_triangles(scatter.cells.len() * 2);
    for cell in &scatter.cells {
        let color = theme::scale_color(0.25 + 0.75 * (f64::from(cell.count).ln() / scale) as f32);
        let place = Rect::from_center_size(axes.place(VisitScatter::center(cell)), size);
        mesh.add_colored_rect(place, color);
    }
    axes.painter(ui).add(mesh);
}

/// Rings the worst nodes, the selected and the hovered one.
fn marks(ui: &Ui, state: &AppState, shown: &Presented, axes: &Axes, scatter: &VisitScatter) {
    let palette = theme::palette(ui);
    let painter = axes.painter(ui);
    for node in &scatter.worst {
        if let Some(place) = scatter.place(node) {
            painter.circle_stroke(axes.place(place), 4.0, Stroke::new(1.0, palette.worse));
        }
    }
    let visits = state.model.derived.known_visits(&shown.accel);
    let values = NodeValues { accel: &shown.accel, visits: visits.as_ref().map(|visits| &*visits.0) };
    let nodes = &state.selection.nodes;
    let marks = [(nodes.selected, palette.warm, 6.0), (nodes.hovered, ui.visuals().strong_text_color(), 5.0)];
    for (node, color, radius) in marks {
        let node = node.filter(|&node| (node as usize) < shown.table.len()).and_then(|node| node_in(&values, node));
        if let Some(place) = node.and_then(|node| scatter.place(&node)) {
            painter.circle_stroke(axes.place(place), radius, Stroke::new(2.0, color));
        }
    }
}

/// A node as text: "node 12: 300 visits, 120 predicted (2.5 ×)".
fn text_of(shown: &Presented, node: &ScatterNode, count: u32) -> String {
    let kind = if shown.table.is_leaf(node.node) { "leaf" } else { "node" };
    let others = if count > 1 {
        format!("\nand {} here", format::counted(u64::from(count - 1), "other"))
    } else {
        String::new()
    };
    format!(
        "{kind} {}: {} visits, {} predicted ({} ×){others}",
        format::count(u64::from(node.node)),
        format::count(u64::from(node.measured)),
        format::significant(node.predicted),
        format::significant(f64::from(node.measured) / node.predicted)
    )
}
