//! The steps as a list, of which only the rows in view are laid out, and the stack after the present step, its top
//! first.

use egui::{self, CornerRadius, Rect, RichText, ScrollArea, Ui, vec2};

use crate::app::state::AppState;
use crate::app::views::parts::{self, Cell};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::lab::ray::{RayRecord, RayStep, Step};
use bvhscope_engine::tree::traverse::RayEvent;

/// Widths of the columns of distance, container tests and triangle tests in points.
const COLUMNS: [f32; 3] = [52.0, 34.0, 30.0];

/// Shows it.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, record: &RayRecord) {
    heading(ui);
    let revealed = state.model.ray.reveal().then_some(state.model.ray.cursor + 1);
    parts::list(ui, "ray steps", revealed).show_rows(ui, parts::ROW_HEIGHT, record.steps.len(), |ui, range| {
        for index in range {
            let Some(step) = record.steps.get(index) else { continue };
            row(ui, state, record, index, step);
        }
    });
}

fn heading(ui: &mut Ui) {
    let palette = theme::palette(ui);
    let text = |text: &str| RichText::new(text).color(palette.dim);
    ui.horizontal(|ui| {
        ui.label(text("Steps")).tip("What the traversal does, in order. A click goes to the step and selects its node");
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 12.0;
            ui.add_space(8.0);
            ui.label(text("tri.")).tip("Triangle tests up to here");
            ui.label(text("cont.")).tip("Container tests up to here");
            ui.label(text("distance")).tip("Where the ray enters the container, or hits the triangle");
        });
    });
}

fn row(ui: &mut Ui, state: &mut AppState, record: &RayRecord, index: usize, step: &RayStep) {
    if index == state.model.ray.cursor {
        let rect = Rect::from_min_size(ui.cursor().min, vec2(ui.available_width(), parts::ROW_HEIGHT));
        ui.painter().rect_filled(rect, CornerRadius::same(3), ui.visuals().selection.bg_fill.gamma_multiply(0.6));
    }
    let name = format!("{}  {}", index + 1, step_text(record, step));
    let distance = step.what.t().map_or_else(String::new, |t| format::significant(t.into()));
    let [containers, triangles] = [step.counts.containers, step.counts.primitives].map(format::count);
    let cells = [
        Cell { text: &distance, width: COLUMNS[0] },
        Cell { text: &containers, width: COLUMNS[1] },
        Cell { text: &triangles, width: COLUMNS[2] },
    ];
    if parts::node_row(ui, state, step.tree_node, (&name, 6.0), &cells).clicked() {
        state.model.ray.choose(index, record.steps.len());
    }
}

/// A step in words: "Enter node 12".
pub(super) fn step_text(record: &RayRecord, step: &RayStep) -> String {
    let is_leaf = step.span.and_then(|span| record.spans.get(span as usize)).is_some_and(|span| span.is_leaf);
    let node = format!("{} {}", if is_leaf { "leaf" } else { "node" }, format::count(step.tree_node.into()));
    match step.what {
        Step::Again { .. } => "Again, behind a hidden triangle".to_owned(),
        Step::Event(event) => match event {
            RayEvent::Enter { .. } => format!("Enter {node}"),
            RayEvent::Miss { .. } => format!("Miss {node}"),
            RayEvent::Cull { .. } => format!("Cull {node}"),
            RayEvent::Push { .. } => format!("Push {node}"),
            RayEvent::Pop { .. } => format!("Pop {node}"),
            RayEvent::Visit { .. } => format!("Visit {node}"),
            RayEvent::Triangle { index, t } => {
                let result = if t.is_some() { "hit" } else { "no" };
                format!("Test triangle {}: {result}", format::count(index.into()))
            }
            RayEvent::Nearer { .. } => "Nearest hit so far".to_owned(),
        },
    }
}

/// Shows the stack after the present step, its top first.
pub(super) fn stack(ui: &mut Ui, state: &mut AppState, record: &RayRecord) {
    let stack = record.stack_after(state.model.ray.cursor);
    let palette = theme::palette(ui);
    let title = if stack.is_empty() { "Stack: empty".to_owned() } else { format!("Stack: {}", stack.len()) };
    let tip = "Nodes that the ray enters and that wait to be visited, the next one first, with the distance of entry";
    ui.horizontal(|ui| ui.label(RichText::new(title).color(palette.dim)).tip(tip));
    ScrollArea::vertical().id_salt("ray stack").auto_shrink(false).show_rows(
        ui,
        parts::ROW_HEIGHT,
        stack.len(),
        |ui, range| {
            for &span in stack.get(range).unwrap_or_default() {
                let Some(span) = record.spans.get(span as usize) else { continue };
                let kind = if span.is_leaf { "leaf" } else { "node" };
                let name = format!("{kind} {}", format::count(span.tree_node.into()));
                let entry = format::significant(span.t[0].into());
                parts::node_row(ui, state, span.tree_node, (&name, 6.0), &[Cell { text: &entry, width: 50.0 }]);
            }
        },
    );
}
