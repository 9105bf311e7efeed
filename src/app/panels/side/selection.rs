//! The dock at the bottom of the left panel: the selected triangle and node.

use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};
use egui::Ui;

use crate::app::commands::{Action, entries};
use crate::app::glossary::Term;
use crate::app::panels::widgets::{Statistic, Tip as _, check, statistic};
use crate::app::state::{AppState, Presented};
use crate::app::{format, theme};

/// Shows the section.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let Some(shown) = state.model.presented.clone() else { return };
    ui.spacing_mut().item_spacing.y = 2.0;
    heading(ui, state, &shown);
    if let Some(node) = state.selection.nodes.selected.filter(|&node| (node as usize) < shown.table.len()) {
        node_rows(ui, state, &shown, node);
    } else {
        let color = crate::app::theme::palette(ui).dim;
        let text = "Click the model to select a triangle with its leaf, or Alt+Down for the root";
        ui.add(egui::Label::new(egui::RichText::new(text).color(color)).wrap());
    }
    ui.add_space(4.0);
    buttons(ui, state);
    hidden_rows(ui, state, &shown);
}

/// The dock's title with the selected node.
fn heading(ui: &mut Ui, state: &AppState, shown: &Presented) {
    let palette = theme::palette(ui);
    ui.horizontal(|ui| {
        ui.label(egui::RichText::new("SELECTION").heading().color(palette.dim));
        let Some(node) = state.selection.nodes.selected.filter(|&node| (node as usize) < shown.table.len()) else {
            return;
        };
        let kind = if shown.table.is_leaf(node) { "leaf" } else { "interior node" };
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(egui::RichText::new(kind).color(palette.warm));
        });
    });
}

/// What is hidden, and whether its triangles are.
fn hidden_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let Some(visibility) = shown.table.visibility(&state.selection.nodes) else { return };
    if let Some(node) = state.selection.nodes.isolated {
        let tip = "Only what is below this node is shown; Alt+H shows all again";
        statistic(ui, state, &Statistic::new("Isolated node", format::count(u64::from(node))).tip(tip));
    }
    let hidden = state.selection.nodes.hidden.len();
    if hidden > 0 {
        let tip = "Left out with everything below them; Alt+H shows them again";
        statistic(ui, state, &Statistic::new("Hidden nodes", format::count(hidden as u64)).tip(tip));
    }
    let tip = "Triangles below hidden nodes. Of a split triangle all parts must be hidden";
    let triangles = format::count(visibility.triangles.len() as u64);
    statistic(ui, state, &Statistic::new("Hidden triangles", triangles).tip(tip));
    let tip = "Leave hidden triangles out of the picture, so that what is behind them is seen";
    check(ui, &mut state.wanted.overlay.hide_triangles, "With triangles", tip);
}

/// Facts about the selected node.
fn node_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented, node: u32) {
    let table = &shown.table;
    let leaf = table.is_leaf(node);
    if let Some(picked) = &state.selection.picked {
        let triangle = format::count(u64::from(picked.primitive));
        statistic(ui, state, &Statistic::new("Triangle", triangle).tip("Its index in the file, from 0"));
    }
    let index = Statistic::new("Node", format::count(u64::from(node))).tip("Its index in the tree");
    statistic(ui, state, &index.term(Term::Node));
    let depth = table.depth(node);
    statistic(
        ui,
        state,
        &Statistic::new("Depth", depth.to_string()).tip("Levels below the root, which has depth 0").term(Term::Depth),
    );
    let primitives = table.known_primitives(node);
    let tip = "Triangles below this node";
    let count = primitives.map_or_else(|| "…".to_owned(), |count| format::count(u64::from(count)));
    statistic(ui, state, &Statistic::new("Triangles below", count).tip(tip));
    match table.container_kind() {
        ContainerKind::Aabb => {
            let extent = table.node_box(node).extent();
            let size = [extent.x, extent.y, extent.z].map(|side| format::significant(f64::from(side))).join(" × ");
            statistic(ui, state, &Statistic::new("Box", size).tip("Sides of its box, in the file's unit"));
        }
        ContainerKind::Sphere => {
            let radius = format::significant(f64::from(table.node_sphere(node).radius));
            statistic(ui, state, &Statistic::new("Radius", radius).tip("Radius of its sphere, in the file's unit"));
        }
    }
    let area = f64::from(table.area_share(node));
    let tip = "Surface area relative to the root's: how likely a ray that hits the root hits it";
    statistic(ui, state, &Statistic::new("Area share", format::percent(area)).tip(tip).term(Term::AreaShare));
    // Cost of the node alone, before it is weighted by its area.
    let cost = match primitives {
        Some(primitives) if leaf => INTERSECTION_COST * primitives as f32,
        _ => TRAVERSAL_COST,
    };
    let sah = shown.accel.report.stats.sah_cost;
    if sah > 0.0 {
        let fraction = area * f64::from(cost) / f64::from(sah);
        let tip = "What this node alone adds to the SAH cost of the tree";
        statistic(ui, state, &Statistic::new("SAH share", format::percent(fraction)).tip(tip).term(Term::SahCost));
    }
    if node != 0 {
        let overlap = format::percent(f64::from(table.overlap(node)));
        let tip = "Overlap with its sibling, as a fraction of its own area: rays there must visit both";
        statistic(ui, state, &Statistic::new("Overlap", overlap).tip(tip).term(Term::Overlap));
    }
}

/// Buttons that walk the tree, hide nodes and frame the selection.
fn buttons(ui: &mut Ui, state: &mut AppState) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for (action, label) in [
            (Action::SelectParent, "Parent"),
            (Action::SelectSibling, "Sibling"),
            (Action::SelectChild, "Child 1"),
            (Action::SelectSecondChild, "Child 2"),
            (Action::HideSelected, "Hide"),
            (Action::IsolateSelected, "Isolate"),
            (Action::ShowAll, "Show all"),
            (Action::FrameSelection, "Frame"),
        ] {
            button(ui, state, action, label);
        }
    });
}

fn button(ui: &mut Ui, state: &mut AppState, action: Action, label: &str) {
    let response = ui.add_enabled(action.is_enabled(state), egui::Button::new(label));
    let tip = entries()
        .iter()
        .find(|entry| entry.action == action)
        .map_or_else(String::new, |entry| format!("{} ({})", entry.description, entry.first_key()));
    if response.tip(tip).clicked() {
        action.perform(state);
    }
}
