//! Section "Memory": what scene, tree and overlay take.

use bvhscope_engine::WideBvh;
use egui::Ui;

use crate::app::format;
use crate::app::state::{AppState, Presented};
use crate::app::widgets::{Header, Statistic, section, statistic};
use crate::catalog::numbers::{NUMBERS, Section};

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
    let sizes = NUMBERS.iter().filter(|number| number.panel == Some(Section::Memory));
    let of_scene = ("Scene", "Triangles, attributes and textures as loaded", Some(scene.bytes() as u64));
    let reading = shown.reading();
    let of_tree = sizes.map(|number| {
        let bytes = (number.get)(&reading).and_then(|bytes| bytes.as_u64());
        (number.label, number.meaning, bytes)
    });
    let rows: Vec<_> = std::iter::once(of_scene).chain(of_tree).collect();
    for (name, tip, bytes) in rows {
        let Some(bytes) = bytes else {
            statistic(ui, state, &Statistic::new(name, "…".to_owned()).tip(tip));
            continue;
        };
        let (number, unit) = format::bytes_parts(bytes as usize);
        let each = format::significant(bytes as f64 / triangles as f64);
        let tip = format!("{tip}: {each} bytes a triangle");
        statistic(ui, state, &Statistic::new(name, number).unit(unit).tip(tip));
    }
    let wide = shown.accel.known_wide();
    let [binary, wide] = [report.bytes_per_triangle(), wide.map_or(0.0, WideBvh::bytes_per_triangle)];
    let [all, binary, wide] = [binary + wide, binary, wide].map(format::significant);
    let tip = format!("Both trees with their triangles, for each triangle: binary {binary}, wide {wide}");
    statistic(ui, state, &Statistic::new("Per triangle", all).unit("B").tip(tip));
}
