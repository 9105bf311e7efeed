//! Dialog "About bvhscope": what a bug report needs to say about program and machine.

use egui::{self, Button, Label, RichText, Ui};

use crate::app::panels::dialogs::frame;
use crate::app::state::AppState;
use crate::app::theme;
use crate::app::widgets::Tip as _;
use crate::budget::{Budget, format_bytes};

/// Interval in seconds at which the used memory is asked for.
const MEMORY_INTERVAL_SECS: f64 = 1.0;

/// Shows the dialog while it is open.
pub(crate) fn show(ctx: &egui::Context, state: &mut AppState) {
    if !state.layout.about_open {
        return;
    }
    let facts = facts(state, used_memory(ctx));
    let mut open = true;
    let mut copy = false;
    frame::show(ctx, "About bvhscope", [440.0, 300.0], &mut open, |ui| copy = content(ui, &facts));
    state.layout.about_open = open;
    if copy {
        let lines: Vec<String> = facts.iter().map(|(name, value)| format!("{name}: {value}")).collect();
        state.copy(format!("bvhscope {}\n{}", env!("CARGO_PKG_VERSION"), lines.join("\n")), "Copied these facts");
    }
    ctx.request_repaint_after_secs(MEMORY_INTERVAL_SECS as f32);
}

/// Shows the facts. Returns whether they are to be copied.
fn content(ui: &mut Ui, facts: &[(&str, String)]) -> bool {
    let palette = theme::palette(ui);
    ui.label(RichText::new(format!("bvhscope {}", env!("CARGO_PKG_VERSION"))).size(17.0).strong());
    ui.add(Label::new(RichText::new("An oscilloscope for bounding volume hierarchies").color(palette.dim)).wrap());
    ui.add_space(8.0);
    egui::Grid::new("about").num_columns(2).spacing([16.0, 6.0]).show(ui, |ui| {
        for (name, value) in facts {
            ui.label(RichText::new(*name).color(palette.dim));
            ui.add(Label::new(value).wrap());
            ui.end_row();
        }
    });
    ui.add_space(8.0);
    ui.add(Button::new("Copy")).tip("Copy all of this as text, for a bug report").clicked()
}

/// Names and values of what the dialog shows.
fn facts(state: &AppState, used: u64) -> Vec<(&'static str, String)> {
    let graphics = &state.layout.graphics;
    let mut adapter = match graphics.adapter_name.as_str() {
        "" => "none: containers are not drawn".to_owned(),
        name => format!("{name}, {}", graphics.backend),
    };
    if graphics.is_software {
        adapter += " (software)";
    }
    let threads = crate::threads::count(state.wanted.threads);
    vec![
        ("Graphics", adapter),
        ("SIMD level", state.wanted.render.simd.name().to_owned()),
        ("Threads", format!("{threads} of {}", crate::threads::available_threads())),
        ("Memory", format!("{} used, at most {}", format_bytes(used), format_bytes(Budget::of_process().limit()))),
        ("System", format!("{}, {}", std::env::consts::OS, std::env::consts::ARCH)),
        ("Licence", "MIT or Apache-2.0, at your option".to_owned()),
    ]
}

/// Memory of the process in bytes, asked for once a second.
fn used_memory(ctx: &egui::Context) -> u64 {
    let id = egui::Id::unique("used memory");
    let now = ctx.input(|input| input.time);
    let known: Option<(f64, u64)> = ctx.data(|data| data.get_temp(id));
    if let Some((_, used)) = known.filter(|(then, _)| now - then < MEMORY_INTERVAL_SECS) {
        return used;
    }
    let used = Budget::used();
    ctx.data_mut(|data| data.insert_temp(id, (now, used)));
    used
}
