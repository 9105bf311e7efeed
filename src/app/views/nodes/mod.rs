//! The view "Nodes": the outline of the tree or its depths, and beside it the worst nodes.

mod depths;
mod ranking;
mod state;

pub use state::NodesView;

use std::sync::Arc;

use egui::{self, Key, Rect, RichText, Ui, UiBuilder, pos2, vec2};

use self::state::{DepthInputs, DepthList, OutlineRow, RankingInputs};
use crate::accel::node_values::NodeValues;
use crate::app::state::{AppState, Presented};
use crate::app::studies::{Studies, StudyPlan};
use crate::app::views::parts::{self, Cell};
use crate::app::views::{Needs, View};
use crate::app::widgets::{Icon, Tip as _, chip, icon_button};
use crate::app::{format, theme};
use crate::lab::by_depth::by_depth;
use crate::lab::node_ranking::rank_nodes;

/// Share of the width that the outline takes.
const OUTLINE_SHARE: f32 = 0.4;
/// Gap between outline and list in points.
const GAP: f32 = 24.0;

/// Indentation a level in points.
const INDENT: f32 = 12.0;
/// Width of the icon that folds and unfolds, in points.
const FOLD: f32 = 16.0;
/// Widths of the columns of triangles and area in points.
const COLUMNS: [f32; 2] = [72.0, 56.0];

impl View for NodesView {
    const PURPOSE: &'static str =
        "Which nodes make rays slow: the worst by regret, cost, overlap, empty space or measured visits";
    const KEY: Key = Key::F9;

    fn ui(&mut self, ui: &mut Ui, state: &mut AppState) {
        let Some(shown) = parts::presented(ui, state, "Open a model to see the nodes of its tree") else { return };
        let [left, right] = parts::beside(ui, OUTLINE_SHARE, GAP);
        let (whole, split) = (left.union(right), (left.right() + right.left()) * 0.5);
        ui.painter().vline(split, whole.y_range(), ui.visuals().widgets.noninteractive.bg_stroke);
        ui.scope_builder(UiBuilder::new().max_rect(left), |ui| {
            ui.horizontal(|ui| {
                let outline = "The tree, node by node. Alt+arrows walk from the selected node";
                let depths = "The tree by depth: number, area, empty space and measured visits of the nodes of each";
                for (is_by_depth, label, tip) in [(false, "Outline", outline), (true, "Depths", depths)] {
                    if chip(ui, label, self.is_by_depth == is_by_depth, tip) {
                        self.is_by_depth = is_by_depth;
                    }
                }
            });
            if self.is_by_depth {
                self.list_depths(ui, state, &shown);
            } else {
                self.outline(ui, state, &shown);
            }
        });
        ui.scope_builder(UiBuilder::new().max_rect(right), |ui| self.list(ui, state, &shown));
        ui.advance_cursor_after_rect(whole);
    }

    fn needs(&self) -> Needs {
        Needs { visits: true, regrets: true, counts: true }
    }

    fn add_studies(studies: &mut Studies) -> std::io::Result<()> {
        let plan = StudyPlan::new(
            "ranking",
            "Ranking nodes",
            |state| &mut state.views.get_mut::<Self>().ranking,
            |state, _| state.inputs_of(|view: &Self, model, accel| view.inputs(&model.derived, accel)),
        );
        studies.add(plan, |accel, inputs: &RankingInputs, token| {
            let visits = inputs.visits.as_ref().map(|visits| &*visits.0);
            rank_nodes(&NodeValues { accel, visits }, &inputs.order, token)
        })?;
        let plan = StudyPlan::new(
            "depths",
            "Counting nodes by depth",
            |state| &mut state.views.get_mut::<Self>().depths,
            |state, _| {
                state.inputs_of(|view: &Self, model, accel| {
                    view.is_by_depth.then(|| Self::depth_inputs(&model.derived, accel))
                })
            },
        );
        studies.add(plan, |accel, inputs: &DepthInputs, token| {
            let visits = inputs.iter().map(|(population, visits)| (*population, &visits.0.counts[..]));
            let entering = inputs.as_ref().map_or(0, |(_, visits)| visits.0.root_hits());
            Ok(Arc::new(DepthList { depths: by_depth(accel, visits, token)?, entering }))
        })
    }
}

impl NodesView {
    /// Shows the outline: the tree as rows that unfold. Only the rows in view are laid out.
    fn outline(&mut self, ui: &mut Ui, state: &mut AppState, shown: &Presented) {
        heading(ui, shown.primitive_names(0)[1]);
        let selected = state.selection.nodes.selected.filter(|&node| (node as usize) < shown.table.len());
        self.outline.follow(&shown.accel, &shown.table);
        let revealed = selected.and_then(|node| self.outline.reveal(node, &shown.table));
        let rows = self.outline.rows().len();
        ui.spacing_mut().item_spacing.y = 0.0;
        let area = parts::list(ui, "outline", revealed);
        area.show_rows(ui, parts::ROW_HEIGHT, rows, |ui, range| {
            let visible = self.outline.rows().get(range).unwrap_or_default().to_vec();
            // A level deep in the tree would leave no room for its text.
            let indents = (ui.available_width() * 0.4 / INDENT) as u32;
            let first = visible.iter().map(|row| row.depth).max().unwrap_or(0).saturating_sub(indents);
            for row in visible {
                self.row(ui, state, shown, row, INDENT * row.depth.saturating_sub(first) as f32);
            }
        });
    }

    /// A row of the outline, with the icon that folds and unfolds it.
    fn row(&mut self, ui: &mut Ui, state: &mut AppState, shown: &Presented, row: OutlineRow, indent: f32) {
        let OutlineRow { node, .. } = row;
        let table = &shown.table;
        let leaf = table.is_leaf(node);
        let name = format!("{} {}", if leaf { "leaf" } else { "node" }, format::count(u64::from(node)));
        let triangles =
            table.known_primitives(node).map_or_else(|| "…".to_owned(), |count| format::count(u64::from(count)));
        let area = format::percent(f64::from(table.area_share(node)));
        let cells = [Cell { text: &triangles, width: COLUMNS[0] }, Cell { text: &area, width: COLUMNS[1] }];
        let response = parts::node_row(ui, state, node, (&name, indent + FOLD), &cells);
        if !leaf {
            let min = pos2(response.rect.left() + indent, response.rect.top());
            let rect = Rect::from_min_size(min, vec2(FOLD, response.rect.height()));
            let unfolded = self.outline.is_unfolded(node);
            let label = format!("{} node {}", if unfolded { "Fold" } else { "Unfold" }, format::count(node.into()));
            if icon_button(ui, rect, Icon::Fold(unfolded), &label).clicked() {
                self.outline.toggle(node, table);
            }
        }
    }
}

/// The names of the columns.
fn heading(ui: &mut Ui, several: &str) {
    let palette = theme::palette(ui);
    let text = |text: &str| RichText::new(text).color(palette.dim);
    ui.horizontal(|ui| {
        ui.label(text("node"));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.add_space(16.0);
            ui.label(text("area")).tip("Surface area relative to the root's");
            ui.add_space(24.0);
            ui.label(text(several)).tip(format!("{} below the node", format::capital(several)));
        });
    });
}
