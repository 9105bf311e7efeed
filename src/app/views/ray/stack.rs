//! The stack after the present step, its top first.

use egui::{RichText, ScrollArea, Ui};

use crate::app::state::AppState;
use crate::app::views::node_row::{self, Cell};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::lab::ray::RayRecord;

/// Shows it.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, record: &RayRecord) {
    let stack = record.stack_after(state.lab.ray.cursor);
    let palette = theme::palette(ui);
    let title = if stack.is_empty() { "Stack: empty".to_owned() } else { format!("Stack: {}", stack.len()) };
    let tip = "Nodes that the ray enters and that wait to be visited, the next one first, with the distance of entry";
    ui.horizontal(|ui| ui.label(RichText::new(title).color(palette.dim)).tip(tip));
    ScrollArea::vertical().id_salt("ray stack").auto_shrink(false).show_rows(
        ui,
        node_row::HEIGHT,
        stack.len(),
        |ui, range| {
            for &span in stack.get(range).unwrap_or_default() {
                let Some(span) = record.spans.get(span as usize) else { continue };
                let kind = if span.is_leaf { "leaf" } else { "node" };
                let name = format!("{kind} {}", format::count(span.tree_node.into()));
                let entry = format::significant(span.t[0].into());
                node_row::show(ui, state, span.tree_node, (&name, 6.0), &[Cell { text: &entry, width: 50.0 }]);
            }
        },
    );
}
