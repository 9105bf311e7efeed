//! The price of the approximation: a selected subtree beside the one that exact clustering makes of its leaves.

use bvhscope_engine::construction::{ExactComparison, MAX_EXACT_LEAVES};
use bvhscope_engine::settings::Pass;
use egui::{self, Grid, Label, RichText, Ui, vec2};

use crate::accel::Accel;
use crate::app::state::{AppState, Presented};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::lab::merges::merges_clusters;

/// Shows the comparison of the selected node, or how to get one.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let selected = state.selection.nodes.selected.filter(|&node| (node as usize) < shown.table.len());
    match selected {
        None => note(
            ui,
            "Select a node to compare its subtree with the one that exact clustering makes of the same leaves: click the model, then Alt+Up walks up",
        ),
        Some(node) => button(ui, state, shown, node),
    }
    let Some(node) = state.model.cut.price_of.filter(|&node| (node as usize) < shown.table.len()) else { return };
    let price = &state.model.cut.price;
    match price.get(&shown.accel, &node).cloned().as_deref() {
        Some(Ok(comparison)) => result(ui, state, node, comparison, &shown.accel),
        Some(Err(reason)) => note(ui, &format!("Node {} cannot be compared: {reason}", format::count(node.into()))),
        None if price.is_cancelled(&shown.accel, &node) => note(ui, "The comparison was cancelled"),
        None => note(ui, &format!("Clustering the leaves of node {} exactly …", format::count(node.into()))),
    }
}

fn note(ui: &mut Ui, text: &str) {
    ui.add(Label::new(RichText::new(text).color(theme::palette(ui).dim)).wrap());
}

/// The button that compares `node`.
fn button(ui: &mut Ui, state: &mut AppState, shown: &Presented, node: u32) {
    let triangles = shown.table.known_primitives(node);
    // A leaf holds at least one triangle, so a subtree has no more leaves than triangles.
    let small = triangles.is_none_or(|count| count as usize <= MAX_EXACT_LEAVES);
    let count = triangles.map_or_else(|| "…".to_owned(), |count| format::counted(count.into(), "triangle"));
    let label = format!("Compare node {} ({count})", format::count(node.into()));
    let tip = "Merges the leaves below it again, each time the closest pair of all, and compares both subtrees";
    if ui.add_enabled(small, egui::Button::new(label)).tip(tip).clicked() {
        state.model.cut.want_price(&shown.accel, node);
    }
    if !small {
        let most = format::count(MAX_EXACT_LEAVES as u64);
        note(
            ui,
            &format!(
                "Exact clustering takes quadratic time: select a node of at most {most} triangles. Alt+Down walks down"
            ),
        );
    }
}

/// The `ratio` of the subtree's cost to that of the exact one in words, with what else has changed the subtree.
fn verdict(ratio: f64, accel: &Accel) -> String {
    let percent = format::percent((ratio - 1.0).abs());
    let passes = accel.settings.passes().iter().filter(|_| accel.file.is_none());
    let passes: Vec<&str> = passes.map(Pass::label).collect();
    if merges_clusters(accel) && passes.is_empty() {
        return if ratio > 1.0 {
            format!("The approximation costs {percent}")
        } else if ratio < 1.0 {
            format!("The approximation is {percent} cheaper: always merging the closest pair is a heuristic, too")
        } else {
            "The approximation costs nothing here".to_owned()
        };
    }
    let (after, unchanged) = match &passes[..] {
        [] => (String::new(), ""),
        passes => (format!(", after its passes ({}),", passes.join(", ")), ", which no pass has changed"),
    };
    if ratio == 1.0 {
        return format!("The subtree{after} costs as much as the exact one");
    }
    let more = if ratio > 1.0 { "more" } else { "less" };
    format!("The subtree{after} costs {percent} {more} than the exact one{unchanged}")
}

/// The result of the comparison.
fn result(ui: &mut Ui, state: &mut AppState, node: u32, comparison: &ExactComparison, accel: &Accel) {
    let palette = theme::palette(ui);
    ui.add(Label::new(RichText::new(verdict(comparison.ratio(), accel)).color(palette.text)).wrap());
    let first = comparison.first_difference.as_ref();
    let merges = format::count(comparison.leaves.saturating_sub(1) as u64);
    Grid::new("price").num_columns(2).spacing(vec2(12.0, 2.0)).show(ui, |ui| {
        let mut row = |name: String, value: String, tip: &str| {
            ui.label(RichText::new(name).color(palette.dim)).tip(tip);
            ui.label(value);
            ui.end_row();
        };
        let tip = "SAH cost of the subtree, relative to the area of its own root";
        row(format!("SAH cost of node {}", format::count(node.into())), format::significant(comparison.cost), tip);
        row("SAH cost of the exact one".to_owned(), format::significant(comparison.exact_cost), tip);
        row(
            "Leaves".to_owned(),
            format::count(comparison.leaves as u64),
            "Leaves of both subtrees, which stay as they are",
        );
        let tip = "By distance, the first merge that groups triangles as no node of the exact subtree does";
        let value = first.map_or_else(
            || "none: both group the same triangles".to_owned(),
            |first| {
                let number = format::count(u64::from(first.merges_before) + 1);
                format!("{number} of {merges}, area {} of the subtree's", format::percent(f64::from(first.area)))
            },
        );
        row("First merge that differs".to_owned(), value, tip);
    });
    ui.horizontal(|ui| {
        let tip = "Select the node that this merge makes, to see it in the picture";
        if let Some(first) = first
            && ui.button("Select that node").tip(tip).clicked()
        {
            state.select_node(first.node);
        }
        if ui.button("Copy comparison").tip("Copy these numbers as tab-separated text").clicked() {
            let merge = first.map_or_else(String::new, |first| (first.merges_before + 1).to_string());
            let text = format!(
                "Node\tSAH cost\tExact\tRatio\tLeaves\tFirst merge that differs\n{node}\t{}\t{}\t{}\t{}\t{merge}\n",
                comparison.cost,
                comparison.exact_cost,
                comparison.ratio(),
                comparison.leaves
            );
            state.copy(text, "Comparison copied");
        }
    });
}
