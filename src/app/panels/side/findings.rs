//! Sections "Findings": what in the model or its tree makes rays slow, each with where it can be seen; and "Memory":
//! what scene, tree and overlay take.

use egui::{self, Label, RichText, Role, Ui, WidgetInfo};

use crate::app::commands::show_finding;
use crate::app::state::{AppState, Presented};
use crate::app::widgets::{Header, Statistic, Tip as _, section, statistic};
use crate::app::{format, theme};
use crate::catalog::numbers::{NUMBERS, Section};
use crate::lab::diagnose::{Finding, Place};
use bvhscope_engine::WideBvh;

/// Shows the section, folded until the user unfolds it: only then the model is examined.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let findings = state.model.derived.findings.get(&shown.accel, &()).cloned();
    let summary = match findings.as_ref().map(|findings| findings.len()) {
        None => String::new(),
        Some(0) => "none".to_owned(),
        Some(count) => count.to_string(),
    };
    let header = Header { folded: true, summary: &summary, ..Header::default() };
    section(ui, "FINDINGS", header, |ui| match findings {
        None if state.model.derived.findings.is_cancelled(&shown.accel, &()) => {
            note(ui, "Stopped before everything was examined");
            if ui.button("Examine again").clicked() {
                state.model.derived.findings.resume();
            }
        }
        None => note(ui, "Examining the model and its tree"),
        Some(findings) if findings.is_empty() => note(ui, "Nothing here makes rays slower than they need be"),
        Some(findings) => findings.iter().for_each(|finding| row(ui, state, finding)),
    });
}

fn note(ui: &mut Ui, text: &str) {
    ui.add(Label::new(RichText::new(text).color(theme::palette(ui).dim)).wrap());
}

/// A finding: what it is, and the button that shows it.
fn row(ui: &mut Ui, state: &mut AppState, finding: &Finding) {
    ui.add(Label::new(sentence(&finding.text)).wrap());
    if finding.place == Place::Scene {
        return;
    }
    let response = ui.button("Show me");
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Show me {}", finding.kind)));
    let tip = match finding.place {
        Place::Node(_) => "Select the leaf, hide all else and look at it; Alt+H shows all again",
        _ => "Hide all other triangles and look at these; Alt+H shows all again",
    };
    if response.tip(tip).clicked() {
        show_finding(state, finding);
    }
    ui.add_space(4.0);
}

/// The text with a capital letter at its beginning.
fn sentence(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |first| first.to_uppercase().chain(chars).collect())
}

/// Shows the section, collapsed until the user expands it.
pub(super) fn memory(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let report = &shown.accel.report;
    let summary = format::bytes(shown.accel.scene.bytes() + report.tree_bytes + report.triangle_bytes);
    let header = Header { folded: true, summary: &summary, ..Header::default() };
    section(ui, "MEMORY", header, |ui| memory_rows(ui, state, shown));
}

fn memory_rows(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
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
