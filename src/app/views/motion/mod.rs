//! The view "Motion": over the frames of a clip, what becomes of the tree by each policy, and which policy is the cheapest.

mod plot;

use std::sync::Arc;

use egui::{self, Align, Key, Layout, RichText, Sense, Slider, Ui, WidgetInfo, vec2};

use crate::accel::{Accel, Follow};
use crate::app::state::AppState;
use crate::app::state::lab::{MotionCurves, MotionInputs, MotionQuantity, MotionState, PolicyCurve};
use crate::app::studies::{Studies, StudyPlan};
use crate::app::views::{View, parts};
use crate::app::widgets::{Tip as _, empty_view};
use crate::app::{format, theme};
use crate::lab::LabError;
use crate::lab::motion::{MotionPlan, MotionStudy};
use crate::lab::population::Population;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::follow::Policy;
use bvhscope_engine::settings::Pass;

/// Times that the rays of a frame are traced to take the median.
const REPEAT: usize = 3;
/// Width of the slider over the rays of a frame in points.
const RAYS_WIDTH: f32 = 120.0;

const PURPOSE: &str = "What motion does to the tree: over the frames of a clip, update time, cost and tests by each policy, and when rebuilding pays";

/// Policies over the frames of a clip.
pub(super) const VIEW: View = View { add_studies: add_study, ..View::new(MotionState::VIEW, PURPOSE, Key::T, show) };

fn show(ui: &mut Ui, state: &mut AppState) {
    let Some(shown) = parts::presented(ui, state, "Open a model that moves to see what becomes of its tree") else {
        return;
    };
    if shown.accel.scene.motion.is_none() {
        empty_view(ui, "This model stands still. Open one with clips of animation, such as the sample walker");
        return;
    }
    controls(ui, state);
    let Some(curves) = state.lab.motion.curves().cloned() else {
        waiting(ui, state);
        return;
    };
    match &*curves {
        Err(reason) => empty_view(ui, &format!("Nothing is measured: {reason}")),
        Ok(curves) => {
            legend(ui, state, curves);
            plot::show(ui, state, curves);
        }
    }
}

/// The line until the first measurements are there.
fn waiting(ui: &mut Ui, state: &mut AppState) {
    let wanted = wanted(state);
    let is_stopped = wanted.is_some_and(|(basis, inputs)| state.lab.motion.study.is_cancelled(&basis, &inputs));
    let text = if state.model.playback.playing {
        "Measured once the clip is paused"
    } else {
        "Following the clip by each policy"
    };
    if parts::waiting(ui, is_stopped, text) {
        state.lab.motion.study.resume();
    }
}

/// Quantity, rays and frames.
fn controls(ui: &mut Ui, state: &mut AppState) {
    let present = state.view_rays();
    ui.horizontal_wrapped(|ui| {
        let tip = "What is plotted over the frames of the clip";
        parts::drop_down(ui, "Plot", tip, &mut state.lab.motion.quantity, &MotionQuantity::ALL);
        let choices = Population::ALL.map(|population| (population, population.label(), population.meaning()));
        parts::drop_down(ui, "Rays", "The rays that are traced in each frame", &mut state.lab.population, &choices);
        let choices = Follow::FRAMES.map(|frames| (frames, format!("{frames}")));
        let tip = "Number of frames, at equal distances from the first key of the clip to the last";
        let choices: Vec<_> = choices.iter().map(|(frames, name)| (*frames, name.as_str(), tip)).collect();
        parts::drop_down(ui, "Frames", tip, &mut state.wanted.follow.frames, &choices);
        rays_of_frame(ui, state);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let known = state.lab.motion.view_rays();
            let response =
                ui.add_enabled(known.is_some_and(|rays| rays != present), egui::Button::new("Measure this view"));
            let tip = "Trace the rays of the view that you see now. Until then they stay those of an earlier view";
            let response = response.tip(tip).disabled_tip("The rays are those of the view that you see");
            if response.clicked() {
                state.lab.motion.measure_by(present);
            }
        });
    });
}

/// The slider over the number of rays that are traced in a frame, by which policies are compared.
fn rays_of_frame(ui: &mut Ui, state: &mut AppState) {
    let rays = &mut state.lab.motion.rays;
    ui.weak("Rays a frame");
    ui.spacing_mut().slider_width = RAYS_WIDTH;
    let [least, most] = MotionState::RAYS;
    let response = ui.add(Slider::new(rays, least..=most).logarithmic(true).show_value(false));
    let value = *rays;
    response.widget_info(|| WidgetInfo::slider(true, value, "Rays a frame"));
    response.tip("The more rays a frame traces, the sooner a better tree pays for its update");
    ui.label(format::significant(value / 1e6) + " million");
}

/// The policies, each in the colour of its curve; a click hides it or shows it.
fn legend(ui: &mut Ui, state: &mut AppState, curves: &[PolicyCurve]) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        for PolicyCurve { policy, .. } in curves {
            let hidden = &mut state.lab.motion.hidden;
            let on = !hidden.contains(policy);
            let color = if on { plot::color(ui, *policy) } else { theme::palette(ui).dim.gamma_multiply(0.6) };
            let (dot, _) = ui.allocate_exact_size(vec2(8.0, theme::ROW_HEIGHT), Sense::hover());
            ui.painter().circle_filled(dot.center(), 4.0, color);
            let text = RichText::new(policy.label()).color(color);
            let response = ui.add(egui::Button::new(text).frame(false));
            response.widget_info(|| WidgetInfo::selected(egui::Role::Button, true, on, policy.label()));
            let verb = if on { "hides" } else { "shows" };
            if response.tip(format!("{}. A click {verb} it", policy.meaning())).clicked() {
                if on {
                    hidden.push(*policy);
                } else {
                    hidden.retain(|hidden| hidden != policy);
                }
            }
        }
    });
}

/// The plan of the measurements.
fn plan_of(inputs: &MotionInputs, policies: Vec<Policy>) -> MotionPlan {
    MotionPlan {
        policies,
        build: inputs.build,
        clip: inputs.clip,
        frames: inputs.frames as usize,
        rays: vec![inputs.rays],
        simd: bvhscope_engine::kernel::SimdLevel::best(),
        repeat: REPEAT,
    }
}

/// What is to be measured, of which model; `None` while the view is closed or a clip plays, which would disturb the times.
fn wanted(state: &mut AppState) -> Option<(Arc<Accel>, MotionInputs)> {
    let accel = state.presented_tree();
    state.lab.motion.follow(accel.as_ref().map(|accel| &accel.scene));
    let accel =
        accel.filter(|accel| accel.scene.motion.is_some() && state.preferences.dock.shows(MotionState::VIEW))?;
    if state.model.playback.playing {
        return None;
    }
    let present = state.view_rays();
    let (basis, rays) = state.lab.motion.basis(&accel, present);
    let mut build = state.wanted.build;
    build.optimize = build.optimize.without(Pass::Anneal);
    let clip = state.clip().map_or(0, |(moment, _)| moment.clip);
    let rays = rays.of(state.lab.population);
    Some((basis, MotionInputs { clip, frames: state.wanted.follow.frames, build, rays }))
}

fn add_study(studies: &mut Studies) -> std::io::Result<()> {
    let plan =
        StudyPlan::new("motion", "Following the clip", |state| &mut state.lab.motion.study, |state, _| wanted(state));
    studies.add(plan, |accel, inputs: &MotionInputs, token| measure(accel, inputs, token))
}

/// The rows of each policy that takes the settings, frame by frame.
fn measure(accel: &Arc<Accel>, inputs: &MotionInputs, token: &CancelToken) -> Result<MotionCurves, Cancelled> {
    let applies = |policy: &Policy| Follow::refusal(*policy, &inputs.build, &accel.scene).is_none();
    let policies: Vec<Policy> = Policy::ALL.into_iter().filter(applies).collect();
    if policies.is_empty() {
        return Ok(Err(inputs.build.refusal(accel.scene.triangles.len()).unwrap_or_default()));
    }
    let (frames, plan) = (inputs.frames as usize, plan_of(inputs, policies.clone()));
    let mut curves: Vec<PolicyCurve> =
        policies.into_iter().map(|policy| PolicyCurve { policy, rows: Vec::with_capacity(frames) }).collect();
    let mut run = || {
        let mut study = MotionStudy::new(&accel.scene, plan.clone(), &token.part(0, frames + 1))?;
        for frame in 0..frames {
            let rows = study.next_frame(&token.part(frame + 1, frames + 1))?;
            for (curve, row) in curves.iter_mut().zip(rows.into_iter().flatten()) {
                curve.rows.push(row);
            }
        }
        Ok(())
    };
    match run() {
        Ok(()) => Ok(Ok(curves)),
        Err(LabError::Cancelled(cancelled)) => Err(cancelled),
        Err(LabError::Refused(reason)) => Ok(Err(reason)),
    }
}
