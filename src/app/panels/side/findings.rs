//! Section "Findings": what in the model or its tree makes rays slow, each with where it can be seen.

use egui::{self, Label, RichText, Role, Ui, WidgetInfo};

use crate::app::commands::show_finding;
use crate::app::state::{AppState, Presented};
use crate::app::theme;
use crate::app::widgets::{Header, Tip as _, section};
use crate::lab::diagnose::{Finding, Place};

/// Shows the section, folded until the user unfolds it: only then the model is examined.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, shown: &Presented) {
    let findings = state.lab.findings.get(&shown.accel, &()).cloned();
    let summary = match findings.as_ref().map(|findings| findings.len()) {
        None => String::new(),
        Some(0) => "none".to_owned(),
        Some(count) => count.to_string(),
    };
    let header = Header { folded: true, summary: &summary, ..Header::default() };
    section(ui, "FINDINGS", header, |ui| match findings {
        None if state.lab.findings.is_cancelled(&shown.accel, &()) => {
            note(ui, "Stopped before everything was examined");
            if ui.button("Examine again").clicked() {
                state.lab.findings.resume();
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
