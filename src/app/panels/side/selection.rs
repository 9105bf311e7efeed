//! The dock at the bottom of the left panel: the selected triangle and node.

use bvhscope_engine::tree::ContainerKind;
use egui::Ui;
use glam::{DVec3, Vec3};

use crate::accel::node_values::NodeValues;
use crate::app::commands::{Action, entries};
use crate::app::state::{AppState, Presented, TreeSide};
use crate::app::widgets::{Statistic, Tip as _, check, statistic};
use crate::app::{format, theme};
use crate::catalog::metrics;
use crate::catalog::terms;

/// Label of the area of a container in percent of that of the box along the axes around the same triangles.
const OF_PLAIN_BOX: &str = "Area of its plain box";

/// Shows the section.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let Some(first) = state.model.presented.clone() else { return };
    let selected = state.selected().map(|(shown, node)| (shown.clone(), node));
    ui.spacing_mut().item_spacing.y = 2.0;
    heading(ui, state, selected.as_ref());
    if let Some((shown, node)) = &selected {
        node_rows(ui, state, shown, *node);
        other_row(ui, state);
    } else {
        let color = crate::app::theme::palette(ui).dim;
        let [name, _] = first.primitive_names(0);
        let text = format!("Click the model to select a {name} with its leaf, or Alt+Down for the root");
        ui.add(egui::Label::new(egui::RichText::new(text).color(color)).wrap());
    }
    ui.add_space(4.0);
    buttons(ui, state);
    hidden_rows(ui, state, &first);
    if let Some((shown, node)) = &selected {
        ui.add_space(4.0);
        place_rows(ui, state, shown, *node);
    }
}

/// The node of the other of two trees that is lit up with the selected one.
fn other_row(ui: &mut Ui, state: &mut AppState) {
    if state.model.second.is_none() {
        return;
    }
    let selection = &state.selection;
    let (name, node) = match selection.side {
        TreeSide::A => ("In tree B", selection.second.selected),
        TreeSide::B => ("In tree A", selection.nodes.selected),
    };
    let text =
        node.map_or_else(|| "no such node".to_owned(), |node| format!("node {}", format::count(u64::from(node))));
    let tip =
        "The node of the other tree with the same triangles, or its leaf of the picked triangle; it is lit up too";
    statistic(ui, state, &Statistic::new(name, text).tip(tip));
}

/// The dock's title with the selected node.
fn heading(ui: &mut Ui, state: &AppState, selected: Option<&(Presented, u32)>) {
    let palette = theme::palette(ui);
    ui.horizontal(|ui| {
        ui.label(egui::RichText::new("SELECTION").heading().color(palette.dim));
        let Some((shown, node)) = selected else { return };
        let kind = if shown.table.is_leaf(*node) { "leaf" } else { "interior node" };
        let tree =
            if state.model.second.is_some() { format!(" of {}", state.selection.side.name()) } else { String::new() };
        let kind = format!("{kind}{tree}");
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(egui::RichText::new(kind).color(palette.warm));
        });
    });
}

/// Rows of the hidden nodes, with the switch that hides their triangles.
fn hidden_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let missing = state.selection.hidden.missing();
    if missing > 0 {
        let tip = "Nodes that were hidden in another tree. No node of this one has the same triangles; a tree that has one hides it again. Alt+H forgets them";
        statistic(ui, state, &Statistic::new("Hidden, not in this tree", format::count(missing as u64)).tip(tip));
    }
    let Some(visibility) = shown.table.visibility(&state.selection.nodes) else { return };
    if let Some(node) = state.selection.nodes.isolated {
        let tip = "Only what is below this node is shown; Alt+H shows all again";
        statistic(ui, state, &Statistic::new("Isolated node", format::count(u64::from(node))).tip(tip));
    }
    if let Some(only) = state.selection.nodes.only.clone() {
        let tip = "The triangles of a finding: all others are left out, with the nodes that hold none of these; Alt+H shows all again";
        statistic(ui, state, &Statistic::new("Shown alone", format::counted(only.len() as u64, "triangle")).tip(tip));
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

/// The clicked triangle or copy.
fn picked_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented, primitive: u32) {
    let scene = &shown.accel.scene;
    let mut row = |name: &str, number: u32, tip: &str| {
        statistic(ui, state, &Statistic::new(name, format::count(u64::from(number))).tip(tip));
    };
    let Some(((copy, triangle), copies)) = scene.copy_of(primitive).zip(scene.copies.as_ref()) else {
        return row("Triangle", primitive, "Its index in the file, from 0");
    };
    if let Some(triangle) = triangle {
        row("Triangle", triangle, "Its index in the mesh, from 0");
    }
    row("Copy", copy, "Its index among the copies, from 0");
    if let Some(id) = shown.accel.copy_id(copy) {
        row("Id of the copy", id, "The number that the file of the tree gives to it");
    }
    row("Mesh", copies.copies().mesh(copy), "Index of the mesh that it is a copy of, from 0");
}

/// Facts about the selected node.
#[expect(clippy::too_many_lines, reason = "a list of rows")]
fn node_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented, node: u32) {
    let table = &shown.table;
    let several = format::capital(shown.primitive_names(node)[1]);
    if let Some(picked) = state.selection.picked.as_ref().map(|picked| picked.primitive) {
        picked_rows(ui, state, shown, picked);
    }
    let index = Statistic::new("Node", format::count(u64::from(node))).tip("Its index in the tree");
    statistic(ui, state, &index.term(terms::NODE));
    if let Some(place) = shown.place_in_mesh(node) {
        let tip = "The copy below which it is, and its index in the tree of the mesh";
        statistic(ui, state, &Statistic::new("In its mesh", place).tip(tip));
    }
    let depth = table.depth(node);
    statistic(
        ui,
        state,
        &Statistic::new("Depth", depth.to_string()).tip("Levels below the root, which has depth 0").term(terms::DEPTH),
    );
    let children = table.children(node).len();
    if children > 0 && children != 2 {
        let tip = "Children of this node; a ray that visits it tests the container of each";
        statistic(ui, state, &Statistic::new("Children", children.to_string()).tip(tip).term(terms::NODE));
    }
    let primitives = table.known_primitives(node);
    let below = format!("{several} below");
    let count = primitives.map_or_else(|| "…".to_owned(), |count| format::count(u64::from(count)));
    statistic(ui, state, &Statistic::new(&below, count).tip(format!("{below} this node")));
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
        ContainerKind::Oriented => {
            let container = table.node_oriented(node);
            let kind = Statistic::new("Planes", container.kind().label().to_owned());
            let tip = "A plain box lies along the axes, a fitted one is turned, a skewed one lies between planes of the 14-DOP";
            statistic(ui, state, &kind.tip(tip));
            let tip = "Its surface area as a share of that of the plain box: the less, the more the turned planes help";
            let text = format::percent(f64::from(container.share_of_plain()));
            statistic(ui, state, &Statistic::new(OF_PLAIN_BOX, text).tip(tip));
        }
        ContainerKind::Dop14 => {
            let dop = table.node_dop(node);
            let of_box = f64::from(dop.half_area()) / f64::from(dop.bounds.half_area());
            let text = if of_box.is_finite() { format::percent(of_box) } else { "–".to_owned() };
            let tip =
                "Its surface area as a share of that of the box around it: the less, the more its cut corners help";
            statistic(ui, state, &Statistic::new(OF_PLAIN_BOX, text).tip(tip));
        }
    }
    let area = f64::from(table.area_share(node));
    let tip = "Surface area relative to the root's: how likely a ray that hits the root hits it";
    statistic(ui, state, &Statistic::new("Area share", format::percent(area)).tip(tip).term(terms::AREA_SHARE));
    if shown.accel.report.stats.sah_cost > 0.0 {
        let fraction = f64::from(table.sah_share(node));
        let tip = "What this node alone adds to the SAH cost of the tree";
        statistic(ui, state, &Statistic::new("SAH share", format::percent(fraction)).tip(tip).term(terms::SAH_COST));
    }
    let visits = state.model.derived.known_visits(&shown.accel);
    let values = NodeValues { accel: &shown.accel, visits: visits.as_ref().map(|visits| &*visits.0) };
    for metric in [metrics::OVERLAP, metrics::EMPTY_SPACE, metrics::REGRET] {
        if let Some(value) = values.get(metric, node) {
            let row = Statistic::new(metric.label, format::of_metric(metric, value)).tip(metric.meaning);
            statistic(ui, state, &if let Some(term) = metric.term { row.term(term) } else { row });
        }
    }
    if let Some((measured, predicted)) = values.visits(node) {
        let tip = format!(
            "Rays of the measured view that went into this node. Its area predicts {}: area / root's area × rays that hit the root",
            format::significant(predicted)
        );
        let text = format!("{} of {}", format::count(u64::from(measured)), format::significant(predicted));
        statistic(ui, state, &Statistic::new("Visits, predicted", text).tip(tip));
    }
}

/// Where the selected node is: in space and in the tree.
fn place_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented, node: u32) {
    let table = &shown.table;
    let Some(bounds) = table.bounds(node) else { return };
    let scene = &shown.accel.scene;
    // Far from the origin, three digits would say nothing.
    let number =
        |number: f64| if scene.offset == DVec3::ZERO { format::significant(number) } else { number.to_string() };
    let corner = |corner: Vec3| scene.in_file(corner).to_array().map(number).join(", ");
    let box_of = match table.container_kind() {
        ContainerKind::Aabb => "the box",
        ContainerKind::Sphere => "the box around the sphere",
        ContainerKind::Dop14 => "the box around the 14-DOP",
        ContainerKind::Oriented => "the plain box",
    };
    for (name, which, at) in [("From", "Lower", bounds.min), ("To", "Upper", bounds.max)] {
        let tip = format!("{which} corner of {box_of}: x, y and z in the file's unit");
        statistic(ui, state, &Statistic::new(name, corner(at)).tip(tip));
    }
    let mut path = vec![node];
    while let Some(parent) = path.last().and_then(|&node| table.parent(node)) {
        path.push(parent);
    }
    let path: Vec<String> = path.iter().rev().map(u32::to_string).collect();
    let path = path.join(" › ");
    let tip = format!("The nodes from the root to this one: {path}");
    statistic(ui, state, &Statistic::new("Path", format::elide_middle(&path, 26)).tip(tip));
}

/// Buttons that walk the tree, hide nodes and frame the selection. Without one, the button that shows hidden nodes, if any.
fn buttons(ui: &mut Ui, state: &mut AppState) {
    let selected = state.selected().is_some();
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for (action, label) in [
            (Action::SelectParent, "Parent"),
            (Action::SelectNextSibling, "Sibling"),
            (Action::SelectChild, "Child 1"),
            (Action::SelectSecondChild, "Child 2"),
            (Action::HideSelected, "Hide"),
            (Action::IsolateSelected, "Isolate"),
            (Action::ShowAll, "Show all"),
            (Action::FrameSelection, "Frame"),
            (Action::ToggleUnfolded, "Unfold"),
        ] {
            let is_shown = action != Action::ToggleUnfolded || action.is_enabled(state);
            if (selected && is_shown) || (action == Action::ShowAll && action.is_enabled(state)) {
                button(ui, state, action, label);
            }
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
