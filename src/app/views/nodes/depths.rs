//! The tree by depth: how many nodes there are, how large, how empty, and how often rays visit them.

use egui::{self, Align, Layout, RichText, Ui};

use super::NodesView;
use crate::app::state::{AppState, Presented};
use crate::app::views::parts::{self, Cell};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::lab::by_depth::Depth;

/// The columns: name, width in points, and meaning.
const COLUMNS: [(&str, f32, &str); 4] = [
    ("nodes", 64.0, "Nodes of this depth, leaves included"),
    (
        "area",
        56.0,
        "Their surface areas together, over the root's: the expected visits by a random line that meets the root",
    ),
    ("empty", 56.0, "The part of interior nodes that their children leave empty, by area"),
    ("visits", 56.0, "Measured visits by a ray that enters the root, by the rays that are chosen on the right"),
];

impl NodesView {
    /// Shows the list, a row for each depth.
    pub(super) fn list_depths(&mut self, ui: &mut Ui, state: &mut AppState, shown: &Presented) {
        let palette = theme::palette(ui);
        ui.horizontal(|ui| {
            let tip = "The root is 0. A click draws the containers of a depth";
            ui.label(RichText::new("depth").color(palette.dim)).tip(tip);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.spacing_mut().item_spacing.x = parts::GAP;
                ui.add_space(4.0);
                for (name, width, meaning) in COLUMNS.into_iter().rev() {
                    let size = egui::vec2(width, ui.available_height());
                    let right = Layout::right_to_left(Align::Center);
                    let label = egui::Label::new(RichText::new(name).color(palette.dim));
                    ui.allocate_ui_with_layout(size, right, |ui| ui.add(label).tip(meaning));
                }
            });
        });
        let Some(list) = self.depths.of_tree(&shown.accel).cloned() else {
            let inputs = Some(Self::depth_inputs(&state.model.derived, &shown.accel));
            let derived = &mut state.model.derived;
            parts::wait_for(ui, derived, &shown.accel, (&mut self.depths, inputs), "Counting nodes by depth");
            return;
        };
        ui.spacing_mut().item_spacing.y = 0.0;
        parts::list(ui, "by depth", None).show_rows(ui, parts::ROW_HEIGHT, list.depths.len(), |ui, range| {
            for depth in list.depths.get(range).unwrap_or_default() {
                row(ui, state, depth, list.entering);
            }
        });
    }
}

/// A row; `entering` is the number of measured rays that enter the root.
fn row(ui: &mut Ui, state: &mut AppState, depth: &Depth, entering: u32) {
    let visits = depth.visits.values().next().filter(|_| entering > 0).map(|&of| of as f64 / f64::from(entering));
    let texts = [
        format::count(depth.nodes.into()),
        format::significant(depth.area),
        depth.empty_space.map_or_else(|| "–".to_owned(), format::percent),
        visits.map_or_else(|| "–".to_owned(), format::significant),
    ];
    let cells = std::array::from_fn::<_, 4, _>(|at| Cell { text: &texts[at], width: COLUMNS[at].1 });
    let only = Some([depth.depth; 2]);
    let is_drawn = state.wanted.overlay.depth == only;
    if parts::text_row(ui, (&depth.depth.to_string(), 4.0), &cells, is_drawn, false).clicked() {
        state.wanted.overlay.depth = if is_drawn { None } else { only };
    }
}
