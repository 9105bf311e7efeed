//! The list of the copies with most tests.

use egui::{self, RichText, Ui};

use crate::app::state::action::Action;
use crate::app::state::{AppState, Presented, Request};
use crate::app::theme;
use crate::app::viewport::picking;
use crate::app::views::parts::{self, Cell};
use crate::app::widgets::Tip as _;
use crate::lab::copy_costs::CostInPart;
use crate::lab::report_table::number;

/// A copy in the list.
#[derive(Debug, Clone, Copy)]
pub(super) struct DearCopy {
    /// Its index.
    pub(super) copy: u32,
    /// The node that holds it.
    pub(super) node: Option<u32>,
    /// Its cost.
    pub(super) row: CostInPart,
}

/// Names, widths in points and meanings of the columns behind that of the copy.
const COLUMNS: [(&str, f32, &str); 4] = [
    ("entered", 54.0, "Part of the rays that are carried into the copy, whose tree they are tested with"),
    ("wasted", 54.0, "Part of them that end elsewhere or nowhere"),
    ("tests", 54.0, "Boxes and triangles of the copy that a ray is tested against, on average of all rays"),
    ("share", 54.0, "Part of the tests of the scene"),
];

/// Shows the list. A row lights up the node of its copy, selects the copy by a click and looks at it by a double click.
pub(super) fn show(
    ui: &mut Ui,
    state: &mut AppState,
    shown: &Presented,
    dearest: &[DearCopy],
    revealed: &mut Option<u32>,
) {
    heading(ui);
    if dearest.is_empty() {
        ui.weak("No ray is carried into a copy");
        return;
    }
    let picked = picking::picked_copy(state);
    let scrolled_to =
        if *revealed == picked { None } else { dearest.iter().position(|dear| Some(dear.copy) == picked) };
    *revealed = picked;
    ui.spacing_mut().item_spacing.y = 0.0;
    let area = parts::list(ui, "dearest copies", scrolled_to);
    area.show_rows(ui, parts::ROW_HEIGHT, dearest.len(), |ui, range| {
        for dear in dearest.get(range).unwrap_or_default() {
            row(ui, state, shown, dear, picked == Some(dear.copy));
        }
    });
}

fn row(ui: &mut Ui, state: &mut AppState, shown: &Presented, dear: &DearCopy, is_picked: bool) {
    let percent = |part: Option<f64>| part.map_or_else(|| "–".to_owned(), |part| format!("{:.1} %", part * 100.0));
    let cost = &dear.row.cost;
    let texts = [
        percent(Some(cost.entered_per_ray)),
        percent(cost.wasted_share),
        number(cost.tests_per_ray),
        percent(cost.share_of_tests),
    ];
    let cells: Vec<_> =
        texts.iter().zip(COLUMNS).map(|(text, (_, width, _))| Cell { text: text.as_str(), width }).collect();
    let mesh = dear.row.part.mesh.map_or_else(String::new, |mesh| format!(" of mesh {mesh}"));
    let name = shown.copy_name(dear.copy) + &mesh;
    let is_pointed = dear.node.is_some() && state.selection.nodes.hovered == dear.node;
    let response = parts::text_row(ui, (&name, 4.0), &cells, is_picked, is_pointed);
    if let Some(node) = dear.node.filter(|_| response.hovered()) {
        state.selection.point_at(node);
    }
    if response.clicked() {
        picking::pick_copy(state, dear.copy);
    }
    if response.double_clicked() {
        state.activity.requests.push(Request::Perform(Action::FrameSelection));
    }
}

/// The names of the columns.
fn heading(ui: &mut Ui) {
    let dim = theme::palette(ui).dim;
    ui.horizontal(|ui| {
        let tip = "The copies with most tests. A click selects one, a double click looks at it";
        ui.label(RichText::new("copy").color(dim)).tip(tip);
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 0.0;
            // The list beside its scroll bar has rows of this width.
            ui.add_space(ui.spacing().scroll.allocated_width() + 4.0);
            for (name, width, tip) in COLUMNS.into_iter().rev() {
                let size = egui::vec2(width, parts::ROW_HEIGHT);
                let layout = egui::Layout::right_to_left(egui::Align::Center);
                ui.allocate_ui_with_layout(size, layout, |ui| {
                    ui.set_min_width(width);
                    ui.label(RichText::new(name).color(dim)).tip(tip);
                });
                ui.add_space(parts::GAP);
            }
        });
    });
}
