//! All statistics as text, for the clipboard.

use std::fmt::Write as _;

use bvhscope_engine::WideBvh;
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::levels::Levels;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};

use crate::app::format;
use crate::app::state::comparison::Quantity;
use crate::app::state::{AppState, Presented};
use crate::catalog::settings::used;

/// All statistics, one per line as name and value separated by a tab; `None` before the first picture.
pub fn statistics_text(state: &AppState) -> Option<String> {
    let shown = state.model.presented.as_ref()?;
    let (scene, report, frame) = (&shown.accel.scene, &shown.accel.report, &shown.frame);
    let (stats, settings) = (&report.stats, &shown.accel.settings);
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name}\t{value}");
    };
    let number = |value: f32| format::significant(f64::from(value));
    line("Model", scene.source.to_string());
    line("Triangles", format::count(scene.triangles.len() as u64));
    for (name, value) in used(settings) {
        line(name, value);
    }
    line("Threads", report.threads.to_string());
    line("Build time", format::duration(report.build_time));
    if let Some(wide) = shown.accel.known_wide() {
        line("Ready to trace", format::duration(report.build_time + wide.collapse_time));
    }
    for stage in &report.stages.reused {
        line(&format!("Build: {stage}"), "reused".to_owned());
    }
    for (stage, time) in &report.stages.stages {
        line(&format!("Build: {stage}"), format::duration(*time));
        if let Some([before, after]) = report.stages.cost_change(stage) {
            let change = format!("{} to {}", format::significant(before), format::significant(after));
            line(&format!("SAH cost: {stage}"), change);
        }
    }
    line("Mtri/s", format::significant(report.mtriangles_per_s()));
    line("SAH cost", format!("{} (container {TRAVERSAL_COST}, triangle {INTERSECTION_COST})", number(stats.sah_cost)));
    if let Some(epo) = shown.accel.known_epo() {
        let note = epo.estimate_note().map_or_else(String::new, |note| format!(" ({note})"));
        line("End-point overlap", format!("{}{note}", number(epo.value)));
    }
    line("Nodes", format::count(stats.nodes as u64));
    line("Leaves", format::count(stats.leaves as u64));
    line("Depth", stats.max_depth.to_string());
    if !stats.is_binary() {
        let mean = number(stats.mean_arity);
        line("Children of a node", format!("{} to {}, mean {mean}", stats.min_arity(), stats.max_arity));
    }
    line(
        "Leaf size",
        format!("{} to {}, mean {}", stats.min_leaf_size, stats.max_leaf_size, number(stats.mean_leaf_size)),
    );
    line("Tree memory", format::bytes(report.tree_bytes));
    line("Triangle memory", format::bytes(report.triangle_bytes));
    let wide = shown.accel.known_wide();
    if let Some(wide) = wide {
        line("Wide tree memory", format::bytes(wide.tree.node_bytes()));
        line("Wide triangle memory", format::bytes(wide.tree.leaf_bytes()));
    }
    line("Overlay memory", format::bytes(Levels::bytes(stats.nodes)));
    let bytes = report.bytes_per_triangle() + wide.map_or(0.0, WideBvh::bytes_per_triangle);
    line("Bytes per triangle", format::significant(bytes));
    line("Trace time", format::duration(frame.stats.trace_time));
    line("Primary rays", format::count(frame.stats.primary_rays));
    line("Hits", format::count(frame.stats.hits));
    line("Mray/s", format::significant(state.mrays_per_s()));
    if let Some([containers, primitives]) = shown.tests_per_ray {
        line("Tests per ray", number(containers + primitives));
        line("Container tests per ray", number(containers));
        line("Triangle tests per ray", number(primitives));
    }
    if let Some(second) = &state.model.second {
        text.push_str(&second_text(second));
    }
    Some(text)
}

/// The numbers of the second tree, in the same form.
fn second_text(second: &Presented) -> String {
    let (settings, numbers) = (&second.accel.settings, second.numbers());
    let mut text = String::new();
    for (name, value) in used(settings) {
        let _ = writeln!(text, "B: {name}\t{value}");
    }
    let build_time = second.accel.report.build_time;
    let _ = writeln!(text, "B: Build time\t{}", format::duration(build_time));
    for (name, quantity) in [
        ("SAH cost", Quantity::SahCost),
        ("End-point overlap", Quantity::Epo),
        ("Nodes", Quantity::Nodes),
        ("Leaves", Quantity::Leaves),
        ("Depth", Quantity::Depth),
        ("Mray/s", Quantity::Speed),
        ("Tests per ray", Quantity::TestsPerRay),
        ("Container tests per ray", Quantity::ContainerTests),
        ("Triangle tests per ray", Quantity::TriangleTests),
    ] {
        if let Some(value) = numbers.value(quantity) {
            let _ = writeln!(text, "B: {name}\t{}", format::significant(value));
        }
    }
    text
}

/// The numbers of the selected node, one per line as name and value separated by a tab; `None` where none is selected.
pub fn node_text(state: &AppState) -> Option<String> {
    let (shown, node) = state.selected()?;
    let table = &shown.table;
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name}\t{value}");
    };
    line("Model", shown.accel.scene.source.to_string());
    line("Node", node.to_string());
    line("Kind", if table.is_leaf(node) { "leaf" } else { "interior" }.to_owned());
    line("Depth", table.depth(node).to_string());
    let children = table.children(node).len();
    if children > 0 && children != 2 {
        line("Children", children.to_string());
    }
    if let Some(triangles) = table.known_primitives(node) {
        line("Triangles", triangles.to_string());
    }
    let vector = |v: glam::Vec3| shown.accel.scene.in_file(v).to_array().map(|number| number.to_string()).join(",");
    match table.container_kind() {
        ContainerKind::Aabb => {
            let bounds = table.node_box(node);
            line("Box from", vector(bounds.min));
            line("Box to", vector(bounds.max));
        }
        ContainerKind::Sphere => {
            let sphere = table.node_sphere(node);
            line("Centre", vector(sphere.center));
            line("Radius", sphere.radius.to_string());
        }
    }
    line("Area over the root's", table.area_share(node).to_string());
    if let Some(overlap) = table.overlap(node) {
        line("Overlap of the children", overlap.to_string());
    }
    Some(text)
}
