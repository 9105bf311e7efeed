//! "Why these two?": the list that a merge chose from as a matrix of distances, the winner and the runner-up.

use std::fmt::Write as _;

use bvhscope_engine::construction::{ClusterPair, MergeChoice, merge_area};
use bvhscope_engine::settings::BuilderKind;
use bvhscope_engine::tree::ContainerKind;
use egui::{
    self, Color32, CornerRadius, Label, Rect, RichText, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

use crate::app::state::picture_cut::MergeStudy;
use crate::app::state::{AppState, Presented};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};

/// Largest number of clusters in the matrix.
const MOST: usize = 24;
/// Smallest and largest side of a cell in points.
const CELL: [f32; 2] = [7.0, 22.0];

/// Height of the legend below the matrix in points.
const LEGEND: f32 = 2.0 * (LEGEND_ROW + LEGEND_GAP) + 4.0;
/// Height of each of its two rows in points.
const LEGEND_ROW: f32 = 14.0;
/// Distance between them in points.
const LEGEND_GAP: f32 = 2.0;

/// Shows why the present merge was made, or the last that was explained.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, shown: &Presented, study: &MergeStudy) {
    let merges = &state.model.cut;
    let history = &study.merges.history;
    let Some(construction) = history.construction() else {
        note(
            ui,
            "No merges of this builder are recorded. Choose AAC as the builder to see how clusters are chosen; cuts by area and by triangles work with every tree",
        );
        return;
    };
    if !construction.chooses_closest() {
        let lists = if construction.builder == BuilderKind::Ploc {
            "all clusters along the curve"
        } else {
            "the up to 32 clusters of a range of the curve"
        };
        note(
            ui,
            &format!(
                "{} merges in rounds: of {lists}, all pairs merge at once that are each other's nearest among the 8 on either side. So no merge is chosen before the others of its round; AAC chooses one pair at a time",
                construction.builder.label()
            ),
        );
        return;
    }
    if merges.step(&study.merges).is_none_or(|step| step == 0) {
        note(ui, "Choose a merge in the plot to see the list that it chose from");
        return;
    }
    let wanted = merges.wanted_choice(&shown.accel);
    let exact = wanted.as_ref().and_then(|wanted| merges.choice.get(&shown.accel, wanted)).cloned();
    let Some(found) = exact.or_else(|| merges.choice.of_tree(&shown.accel).cloned()) else {
        note(
            ui,
            if merges.playing.is_some() { "Pause to see why a merge was made" } else { "Comparing the clusters …" },
        );
        return;
    };
    let Some(choice) = found.as_ref() else {
        note(ui, "Nothing is recorded of this merge");
        return;
    };
    ui.horizontal_top(|ui| {
        let side = (ui.available_height() - LEGEND).clamp(64.0, 240.0).min(ui.available_width() * 0.45);
        ui.vertical(|ui| {
            matrix(ui, state, study, choice, side);
            legend(ui, choice.runner_up.is_some());
        });
        ui.vertical(|ui| {
            words(ui, shown, study, choice);
            let tip = "Copy the list with all its distances as tab-separated text";
            if ui.button("Copy matrix").tip(tip).clicked() {
                state.copy(tsv(choice, container_kind(study)), "Distances copied");
            }
        });
    });
}

fn note(ui: &mut Ui, text: &str) {
    ui.add(Label::new(RichText::new(text).color(theme::palette(ui).dim)).wrap());
}

/// The clusters of the matrix: those of winner and runner-up first, then the closest others.
fn listed(choice: &MergeChoice, most: usize) -> Vec<usize> {
    let place = |node: u32| choice.clusters.iter().take(choice.matrix_size()).position(|cluster| cluster.node == node);
    let first = choice.winner.nodes.into_iter().chain(choice.runner_up.iter().flat_map(|pair| pair.nodes));
    let mut places: Vec<usize> = Vec::new();
    for at in first.filter_map(place).chain(0..choice.matrix_size()) {
        if places.len() < most && !places.contains(&at) {
            places.push(at);
        }
    }
    places
}

/// The distances between the clusters, bright where they are close.
fn matrix(ui: &mut Ui, state: &mut AppState, study: &MergeStudy, choice: &MergeChoice, side: f32) {
    let palette = theme::palette(ui);
    let places = listed(choice, MOST.min((side / CELL[0]) as usize));
    let size = choice.matrix_size();
    let distance = |row: usize, column: usize| choice.distances[places[row] * size + places[column]];
    let cell = (side / places.len().max(1) as f32).clamp(CELL[0], CELL[1]);
    let (rect, response) = ui.allocate_exact_size(vec2(cell, cell) * places.len() as f32, Sense::click());
    let name =
        format!("Distances between {} of {} clusters: bright pairs are close", places.len(), choice.clusters.len());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
    let finite = || choice.distances.iter().copied().filter(|distance| distance.is_finite() && *distance > 0.0);
    let [low, high] = [finite().fold(f32::INFINITY, f32::min), finite().fold(f32::MIN_POSITIVE, f32::max)].map(f32::ln);
    let painter = ui.painter();
    for row in 0..places.len() {
        for column in (0..places.len()).filter(|&column| column != row) {
            let far =
                ((distance(row, column).max(f32::MIN_POSITIVE).ln() - low) / (high - low).max(1e-6)).clamp(0.0, 1.0);
            let gap = if cell > 10.0 { 0.5 } else { 0.0 };
            let place = at(rect, cell, row, column).shrink(gap);
            painter.rect_filled(place, CornerRadius::ZERO, theme::scale_color(1.0 - far));
        }
    }
    let node = |place: usize| choice.clusters[places[place]].node;
    let outline = |pair: &ClusterPair, color: Color32| {
        let find = |wanted: u32| (0..places.len()).find(|&place| node(place) == wanted);
        if let (Some(a), Some(b)) = (find(pair.nodes[0]), find(pair.nodes[1])) {
            for (row, column) in [(a, b), (b, a)] {
                let stroke = Stroke::new(2.0, color);
                painter.rect_stroke(at(rect, cell, row, column), CornerRadius::ZERO, stroke, StrokeKind::Inside);
            }
        }
    };
    if let Some(runner_up) = &choice.runner_up {
        outline(runner_up, palette.text);
    }
    outline(&choice.winner, palette.warm);
    let Some(pointer) = response.hover_pos() else { return };
    let place = |offset: f32| ((offset / cell) as usize).min(places.len().saturating_sub(1));
    let (row, column) = (place(pointer.y - rect.top()), place(pointer.x - rect.left()));
    // Nodes of a tree before its passes are others than those on the screen.
    if study.table.is_none() {
        state.selection.nodes.hovered = Some(node(row));
        if response.clicked() {
            state.select_node(node(row));
        }
    }
    let kind = container_kind(study);
    let text = if row == column {
        let cluster = &choice.clusters[places[row]];
        let triangles = format::counted(u64::from(cluster.primitives), "triangle");
        let [node, nearest] = [cluster.node, cluster.nearest].map(|node| format::count(node.into()));
        format!("Node {node} with {triangles}\nIts closest is node {nearest}")
    } else {
        let times = merge_area(kind, distance(row, column)) / merge_area(kind, choice.winner.distance);
        let times = format::significant(f64::from(times));
        format!("{}\nTogether {times} times the area of what was merged", pair("Nodes", [node(row), node(column)]))
    };
    let hint = if study.table.is_none() { "\nClick to select the node of this row, and see its own merge" } else { "" };
    response.on_hover_text_at_pointer(format!("{text}{hint}"));
}

/// The colours of the matrix, and the frames in it.
fn legend(ui: &mut Ui, has_runner_up: bool) {
    let palette = theme::palette(ui);
    ui.spacing_mut().item_spacing = vec2(6.0, LEGEND_GAP);
    ui.spacing_mut().interact_size.y = LEGEND_ROW;
    let small = |text: &str| Label::new(RichText::new(text).small().color(palette.dim));
    ui.horizontal(|ui| {
        ui.add(small("close"));
        let (bar, _) = ui.allocate_exact_size(vec2(48.0, 8.0), Sense::hover());
        theme::paint_gradient(ui.painter(), bar, 24, |position| theme::scale_color(1.0 - position));
        ui.add(small("far"));
    });
    ui.horizontal(|ui| {
        let frames = [(palette.warm, "winner"), (palette.text, "runner-up")];
        for (color, name) in frames.into_iter().take(1 + usize::from(has_runner_up)) {
            let (frame, _) = ui.allocate_exact_size(vec2(8.0, 8.0), Sense::hover());
            ui.painter().rect_stroke(frame, CornerRadius::ZERO, Stroke::new(2.0, color), StrokeKind::Inside);
            ui.add(small(name));
        }
    });
}

fn at(rect: Rect, cell: f32, row: usize, column: usize) -> Rect {
    Rect::from_min_size(pos2(rect.left() + column as f32 * cell, rect.top() + row as f32 * cell), vec2(cell, cell))
}

fn container_kind(study: &MergeStudy) -> ContainerKind {
    let construction = study.merges.history.construction();
    construction.map_or(ContainerKind::Aabb, |construction| construction.tree.container_kind())
}

/// The choice in sentences.
fn words(ui: &mut Ui, shown: &Presented, study: &MergeStudy, choice: &MergeChoice) {
    let palette = theme::palette(ui);
    ui.spacing_mut().item_spacing.y = 3.0;
    let mut line = |text: String, color: Color32| {
        ui.add(Label::new(RichText::new(text).color(color)).wrap());
    };
    let count = choice.clusters.len() as u64;
    let pairs = format::counted(count * (count - 1) / 2, "pair");
    let number = format::count(u64::from(choice.merge) + 1);
    line(format!("Merge {number} as built chose from {} clusters, {pairs}", format::count(count)), palette.dim);
    let share = area_share(shown, study, choice.node);
    let winner = pair("Winner: nodes", choice.winner.nodes);
    line(format!("{winner}. Their union has {} of the root's area, the least", format::percent(share)), palette.warm);
    line(margin(choice, container_kind(study)), palette.text);
    if places_left_out(choice) {
        line("The matrix has the closest of the list".to_owned(), palette.dim);
    }
}

/// The list that the merge chose from, one row and one column for each cluster: the area of the union of both as a multiple of that of
/// the winner.
fn tsv(choice: &MergeChoice, kind: ContainerKind) -> String {
    let size = choice.matrix_size();
    let clusters = &choice.clusters[..size.min(choice.clusters.len())];
    let own = merge_area(kind, choice.winner.distance);
    let mut text = String::from("Node\tTriangles");
    for cluster in clusters {
        // Writing into a string cannot fail.
        let _ = write!(text, "\t{}", cluster.node);
    }
    for (row, cluster) in clusters.iter().enumerate() {
        let _ = write!(text, "\n{}\t{}", cluster.node, cluster.primitives);
        for column in 0..clusters.len() {
            text.push('\t');
            if row != column {
                let _ = write!(text, "{}", merge_area(kind, choice.distances[row * size + column]) / own);
            }
        }
    }
    text.push('\n');
    text
}

fn places_left_out(choice: &MergeChoice) -> bool {
    choice.clusters.len() > MOST
}

/// Two nodes behind their noun: "Nodes 1,286 and 9".
fn pair(noun: &str, nodes: [u32; 2]) -> String {
    let [a, b] = nodes.map(|node| format::count(node.into()));
    format!("{noun} {a} and {b}")
}

/// By how much the runner-up lost.
fn margin(choice: &MergeChoice, kind: ContainerKind) -> String {
    let Some(runner_up) = &choice.runner_up else { return "There was no other pair".to_owned() };
    let name = pair("Runner-up: nodes", runner_up.nodes);
    let [won, lost] =
        [choice.winner.distance, runner_up.distance].map(|distance| f64::from(merge_area(kind, distance)));
    if lost > won && won > 0.0 {
        return format!("{name}, with {} more area", format::percent(lost / won - 1.0));
    }
    let [own, other] = [choice.winner.primitives, runner_up.primitives].map(|count| format::count(u64::from(count)));
    let why = if own == other {
        "and as many triangles: the first in the list wins".to_owned()
    } else {
        format!("but {other} triangles, where the winner has {own}: fewer win")
    };
    format!("{name}, with the same area, {why}")
}

/// Area of a node of the record as a fraction of the root's.
fn area_share(shown: &Presented, study: &MergeStudy, node: u32) -> f64 {
    let table = study.table.as_ref().unwrap_or(&shown.table);
    if (node as usize) < table.len() { f64::from(table.area_share(node)) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choice(distances: [f32; 2], primitives: [u32; 2]) -> MergeChoice {
        let pair = |at: usize| ClusterPair {
            nodes: [1003 + 2 * at as u32, 4 + 2 * at as u32],
            distance: distances[at],
            primitives: primitives[at],
        };
        MergeChoice {
            merge: 0,
            node: 1,
            step: 0,
            clusters: Vec::new(),
            distances: Vec::new(),
            pairs: Vec::new(),
            winner: pair(0),
            runner_up: Some(pair(1)),
        }
    }

    #[test]
    fn the_margin_is_of_areas() {
        let text = |kind| margin(&choice([2.0, 3.0], [2, 2]), kind);
        assert!(text(ContainerKind::Aabb).ends_with("50.0 % more area"), "{}", text(ContainerKind::Aabb));
        assert!(text(ContainerKind::Aabb).starts_with("Runner-up: nodes 1,005 and 6, with "));
        assert!(text(ContainerKind::Sphere).ends_with("125 % more area"), "{}", text(ContainerKind::Sphere));
    }

    #[test]
    fn ties_are_decided_by_triangles() {
        let text = margin(&choice([2.0, 2.0], [2, 5]), ContainerKind::Aabb);
        assert!(text.contains("but 5 triangles, where the winner has 2"), "{text}");
        let text = margin(&choice([2.0, 2.0], [2, 2]), ContainerKind::Aabb);
        assert!(text.contains("the first in the list wins"), "{text}");
    }
}
