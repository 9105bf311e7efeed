//! Section "Memory": what scene, tree and overlay take.

use bvhscope_engine::WideBvh;
use bvhscope_engine::tree::levels::Levels;
use egui::Ui;

use crate::app::format;
use crate::app::state::{AppState, Presented};
use crate::app::widgets::{Header, Statistic, section, statistic};

/// Shows the section, collapsed until the user expands it.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let report = &shown.accel.report;
    let summary = format::bytes(shown.accel.scene.bytes() + report.tree_bytes + report.triangle_bytes);
    let header = Header { folded: true, summary: &summary, ..Header::default() };
    section(ui, "MEMORY", header, |ui| rows(ui, state, shown));
}

fn rows(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let report = &shown.accel.report;
    let scene = &shown.accel.scene;
    let triangles = scene.triangles.len().max(1);
    let wide = shown.accel.known_wide();
    for (name, bytes, tip) in [
        ("Scene", Some(scene.bytes()), "Triangles, attributes and textures as loaded"),
        ("Tree", Some(report.tree_bytes), "Nodes and triangle indices"),
        ("Leaf triangles", Some(report.triangle_bytes), "Triangles in leaf order"),
        (
            "Wide tree",
            wide.map(|wide| wide.tree.node_bytes()),
            "Nodes with up to eight children, which camera rays traverse",
        ),
        ("Wide triangles", wide.map(|wide| wide.tree.leaf_bytes()), "Triangles in leaf order, without gaps"),
        ("Overlay", Some(Levels::bytes(report.stats.nodes)), "Indices of the nodes at each depth, for the overlay"),
    ] {
        let Some(bytes) = bytes else {
            statistic(ui, state, &Statistic::new(name, "…".to_owned()).tip(tip));
            continue;
        };
        let (number, unit) = format::bytes_parts(bytes);
        let each = format::significant(bytes as f64 / triangles as f64);
        let tip = format!("{tip}: {each} bytes a triangle");
        statistic(ui, state, &Statistic::new(name, number).unit(unit).tip(tip));
    }
    let [binary, wide] = [report.bytes_per_triangle(), wide.map_or(0.0, WideBvh::bytes_per_triangle)];
    let [all, binary, wide] = [binary + wide, binary, wide].map(format::significant);
    let tip = format!("Both trees with their triangles, for each triangle: binary {binary}, wide {wide}");
    statistic(ui, state, &Statistic::new("Per triangle", all).unit("B").tip(tip));
}
