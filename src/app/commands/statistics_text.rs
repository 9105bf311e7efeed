//! All statistics as text, for the clipboard.

use std::fmt::Write as _;

use bvhscope_engine::tree::ContainerKind;
use serde_json::Value;

use crate::app::format;
use crate::app::state::{AppState, Presented};
use crate::catalog::numbers::{Digits, NUMBERS, Number, Section};
use crate::catalog::settings::used;

/// All statistics, one per line as name and value separated by a tab; `None` before the first picture.
pub fn statistics_text(state: &AppState) -> Option<String> {
    let shown = state.model.presented.as_ref()?;
    let (scene, report, settings) = (&shown.accel.scene, &shown.accel.report, &shown.accel.settings);
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name}\t{value}");
    };
    line("Model", scene.source.to_string());
    line("Triangles", format::count(scene.triangles.len() as u64));
    for (name, value) in used(settings) {
        line(name, value);
    }
    line("Threads", report.threads.to_string());
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
    let reading = shown.reading();
    for number in NUMBERS.iter().filter(|number| !number.label.is_empty()) {
        if let Some(value) = (number.get)(&reading).filter(|value| !value.is_object()) {
            line(&copied_name(number), copied(number, &value));
        }
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
    for number in NUMBERS.iter().filter(|number| number.compared.is_some()) {
        if let Some(value) = numbers.value(number) {
            let _ = writeln!(text, "B: {}\t{}", copied_name(number), copied(number, &value.into()));
        }
    }
    text
}

/// Name of a number among all others.
fn copied_name(number: &Number) -> String {
    if number.panel == Some(Section::Memory) { format!("Memory: {}", number.label) } else { number.label.to_owned() }
}

/// A number with its unit.
fn copied(number: &Number, value: &Value) -> String {
    let text = format::of_number(number, value);
    if number.digits == Digits::Bytes { text } else { format!("{text} {}", number.unit).trim_end().to_owned() }
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
