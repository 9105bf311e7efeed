//! The list of worst nodes, sorted by a click on a column.

use std::fmt::Write as _;

use egui::{self, Align, Align2, Layout, Rect, RichText, Sense, TextStyle, Ui, pos2, vec2};

use super::NodesView;
use crate::accel::node_values::NodeValues;
use crate::app::state::action::Action;
use crate::app::state::{AppState, Presented};
use crate::app::views::parts::{self, Cell};
use crate::app::widgets::table::HeaderCell;
use crate::app::widgets::{DropDown, Tip as _};
use crate::app::{format, theme};
use crate::catalog::metrics::{GROWTH, METRICS, Metric, RANKED};

/// The metrics in columns: growth only where the tree was built at another moment.
fn columns(shown: &Presented) -> impl DoubleEndedIterator<Item = &'static Metric> {
    let is_followed = shown.accel.built_areas().is_some();
    RANKED.into_iter().filter(move |metric| *metric != GROWTH || is_followed)
}

/// Width of the column of a metric in points.
fn column(metric: &Metric) -> f32 {
    if metric.label.chars().count() > 12 { 116.0 } else { 72.0 }
}

impl NodesView {
    /// Shows the list.
    pub(super) fn list(&mut self, ui: &mut Ui, state: &mut AppState, shown: &Presented) {
        let ranked = self.ranking.of_tree(&shown.accel).cloned();
        let ranked = ranked.as_deref().map_or(&[][..], |ranked| &ranked[..]);
        self.controls(ui, state, shown, ranked);
        ui.spacing_mut().item_spacing.y = 0.0;
        self.header(ui, shown);
        if ranked.is_empty() {
            self.nothing(ui, state, shown);
            return;
        }
        let area = parts::list(ui, "ranking", self.reveal(state.selection.nodes.selected, ranked));
        let visits = state.model.derived.known_visits(&shown.accel);
        let values = NodeValues { accel: &shown.accel, visits: visits.as_ref().map(|visits| &*visits.0) };
        area.show_rows(ui, parts::ROW_HEIGHT, ranked.len(), |ui, range| {
            for &node in ranked.get(range).unwrap_or_default() {
                let texts: Vec<_> =
                    columns(shown).map(|metric| (metric, value_text(metric, values.get(metric, node)))).collect();
                let cells: Vec<_> = texts.iter().map(|(metric, text)| Cell { text, width: column(metric) }).collect();
                parts::node_row(ui, state, node, (&name(shown, node), 4.0), &cells);
            }
        });
    }

    /// The line in place of an empty list.
    fn nothing(&mut self, ui: &mut Ui, state: &mut AppState, shown: &Presented) {
        let is_ranked = self.ranking.of_tree(&shown.accel).is_some();
        let otherwise = if is_ranked { "No node is that large and has this number" } else { "Ranking the nodes" };
        let text = parts::missing(state, shown, self.order.metric).unwrap_or(otherwise);
        let derived = &mut state.model.derived;
        let inputs = self.inputs(derived, &shown.accel);
        parts::wait_for(ui, derived, &shown.accel, (&mut self.ranking, inputs), text);
    }

    /// Title, filter and buttons.
    fn controls(&mut self, ui: &mut Ui, state: &mut AppState, shown: &Presented, ranked: &[u32]) {
        ui.horizontal(|ui| {
            let title = RichText::new("Worst nodes").color(theme::palette(ui).dim);
            let tip = "The 1,000 worst nodes of the tree. A click selects one, a double click looks at it";
            ui.label(title).tip(tip);
            let meaning = "Leave out nodes whose surface area is a smaller part of the root's: few rays meet them";
            let choices =
                [(0.0, "any", meaning), (1e-4, "0.01 %", meaning), (1e-3, "0.1 %", meaning), (1e-2, "1 %", meaning)];
            DropDown::new("Larger than", &choices).beside(ui, "Larger than", meaning, &mut self.order.min_area);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let copy = ui.add_enabled(!ranked.is_empty(), egui::Button::new("Copy"));
                if copy.tip("Copy the list as tab-separated text").clicked() {
                    let text = tsv(state, shown, ranked);
                    state.copy(text, &format!("{} copied", format::counted(ranked.len() as u64, "node")));
                }
                parts::steps(ui, state, !ranked.is_empty(), "node", Action::StepRanking, ["Alt+.", "Alt+,"]);
            });
        });
        ui.horizontal(|ui| parts::rays(ui, state, shown));
    }

    /// The names of the columns, which sort by a click.
    fn header(&mut self, ui: &mut Ui, shown: &Presented) {
        let palette = theme::palette(ui);
        let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), parts::ROW_HEIGHT), Sense::hover());
        let order = self.order;
        let font = TextStyle::Body.resolve(ui.style());
        ui.painter().text(rect.left_center() + vec2(4.0, 0.0), Align2::LEFT_CENTER, "node", font.clone(), palette.dim);
        // The list beside its scroll bar has rows of this width.
        let mut right = rect.right() - ui.spacing().scroll.allocated_width() - 4.0;
        for metric in columns(shown).rev() {
            let place = Rect::from_min_max(pos2(right - column(metric), rect.top()), pos2(right, rect.bottom()));
            let cell = HeaderCell {
                label: metric.label,
                tip: &format!("{}. A click sorts by it, a second one the other way round", metric.meaning),
                sorted: (order.metric == metric).then_some(order.ascending),
                align: Align2::RIGHT_CENTER,
            };
            if cell.show(ui, place, ui.scope_id().with(("sort", metric))) {
                self.sort_by(metric);
            }
            right -= column(metric) + parts::GAP;
        }
    }
}

/// The list with all columns, separated by tabs.
fn tsv(state: &AppState, shown: &Presented, ranked: &[u32]) -> String {
    let visits = state.model.derived.known_visits(&shown.accel);
    let values = NodeValues { accel: &shown.accel, visits: visits.as_ref().map(|visits| &*visits.0) };
    let mut text = String::from("Node\tKind");
    for metric in METRICS {
        text.push('\t');
        text.push_str(metric.label);
    }
    for &node in ranked {
        let kind = if shown.table.is_leaf(node) { "leaf" } else { "interior" };
        // Writing into a string cannot fail.
        let _ = write!(text, "\n{node}\t{kind}");
        for metric in METRICS {
            text.push('\t');
            if let Some(value) = values.get(metric, node) {
                let _ = write!(text, "{value}");
            }
        }
    }
    text.push('\n');
    text
}

/// "leaf 12" or "node 3".
fn name(shown: &Presented, node: u32) -> String {
    format!("{} {}", if shown.table.is_leaf(node) { "leaf" } else { "node" }, format::count(u64::from(node)))
}

/// A value of a metric as text: a fraction in percent, visits as a factor.
fn value_text(metric: &'static Metric, value: Option<f32>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format::of_metric(metric, value))
}
