//! Job strip at the bottom: facts about the picture, and the progress of the running job.

use std::time::Instant;

use egui::{self, Align, CornerRadius, Layout, Rect, Role, Sense, Ui, WidgetInfo, vec2};

use crate::app::state::{AppState, JobStatus, PROGRESS_DELAY, Request};
use crate::app::widgets::icon_button;
use crate::app::widgets::{Icon, Tip as _};
use crate::app::{format, theme};

/// Shows the bar.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let palette = theme::palette(ui);
    ui.horizontal(|ui| {
        ui.set_height(theme::ROW_HEIGHT);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            running(ui, state);
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                folded(ui, state);
                let text = egui::RichText::new(facts(state)).color(palette.dim);
                let label = ui.add(egui::Label::new(text).truncate());
                if state.layout.graphics.is_software {
                    label.tip(format!(
                        "Containers are drawn by the software adapter {}; a graphics driver is much faster",
                        state.layout.graphics.adapter_name
                    ));
                } else if !state.layout.graphics.adapter_name.is_empty() {
                    label.tip(format!("Containers are drawn by {}", state.layout.graphics.adapter_name));
                }
            });
        });
    });
}

/// Numbers of warnings and errors that are no longer over the viewport; a click lists them.
fn folded(ui: &mut Ui, state: &mut AppState) {
    let palette = theme::palette(ui);
    let [warnings, errors] = state.messages.folded;
    for (count, noun, color) in [(errors, "error", palette.error), (warnings, "warning", palette.warning)] {
        if count == 0 {
            continue;
        }
        let text = egui::RichText::new(format::counted(count as u64, noun)).color(color);
        if ui.add(egui::Button::new(text).frame(false)).tip("List all messages (F2)").clicked() {
            state.layout.messages_open = true;
        }
    }
}

/// Facts about the presented frame: "1003×612 · pass 3 of 16 · 24.1 Mray/s · 2 threads".
fn facts(state: &AppState) -> String {
    let mut parts = Vec::new();
    if let Some(shown) = &state.model.presented {
        let frame = &shown.frame;
        parts.push(format!("{}×{}", frame.width_px, frame.height_px));
        if frame.coarseness > 1.0 {
            parts.push(format!("coarse 1:{}", frame.coarseness));
        } else {
            let wanted = frame.settings.wanted_samples();
            parts.push(format!("pass {} of {}", frame.samples, wanted.max(frame.samples)));
        }
        parts.push(format!("{} Mray/s", format::significant(state.mrays_per_s())));
        let threads = shown.accel.report.threads;
        parts.push(format!("{threads} {}", if threads == 1 { "thread" } else { "threads" }));
    }
    if state.layout.graphics.failed {
        parts.push("graphics driver failed: no containers".to_owned());
    } else if state.layout.graphics.is_software {
        parts.push("software rendering".to_owned());
    }
    parts.join(" · ")
}

/// The running job that matters most to the user: label, progress bar and cancel button.
fn running(ui: &mut Ui, state: &mut AppState) {
    let jobs = &state.activity;
    let stale = jobs.load.as_ref().or(jobs.build.as_ref());
    let measuring = stale.is_none() && jobs.measure.is_some();
    let studying = stale.is_none() && !measuring && jobs.study.is_some();
    let job = stale.or(jobs.measure.as_ref()).or(jobs.study.as_ref()).or(jobs.render.as_ref());
    let Some(job) = job.cloned() else { return };
    // Short jobs are not shown: text that flashes distracts, and painting it takes time from the job.
    if jobs.load.is_none() && job.since.elapsed() < PROGRESS_DELAY {
        return;
    }
    let (rect, _) = ui.allocate_exact_size(vec2(theme::ROW_HEIGHT, theme::ROW_HEIGHT), Sense::hover());
    if icon_button(ui, rect, Icon::Close, "Cancel").tip("Cancel it and keep what is shown (Esc)").clicked() {
        if studying {
            state.activity.stop_study = true;
        } else {
            state.activity.requests.push(if measuring { Request::CancelMeasuring } else { Request::CancelJobs });
        }
    }
    // A measurement takes long enough that it matters; others would only count down their last seconds.
    let left = job.time_left(Instant::now()).filter(|_| measuring);
    progress(ui, &job, &left.map_or_else(String::new, |left| format!(", about {} left", format::age(left))));
}

/// Progress bar and label of a job, with the time that is `left`.
fn progress(ui: &mut Ui, job: &JobStatus, left: &str) {
    let palette = theme::palette(ui);
    let fraction = job.progress.clamp(0.0, 1.0);
    let percent = format!("{:.0} %", fraction * 100.0);
    let (rect, response) = ui.allocate_exact_size(vec2(120.0, 6.0), Sense::hover());
    response.widget_info(|| {
        let mut info = WidgetInfo::labeled(Role::ProgressIndicator, true, &job.label);
        info.current_text_value = Some(percent.clone());
        info.value = Some(f64::from(fraction));
        info
    });
    ui.painter().rect_filled(rect, CornerRadius::same(3), palette.rail);
    let filled = Rect::from_min_size(rect.min, vec2((rect.width() * fraction).max(6.0), rect.height()));
    ui.painter().rect_filled(filled, CornerRadius::same(3), palette.accent);
    ui.label(
        egui::RichText::new(format::elide_middle(&format!("{} {percent}{left}", job.label), 60)).color(palette.text),
    );
}
