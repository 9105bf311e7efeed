//! The view "Motion": over the frames of a clip, what becomes of the tree by each policy, and which policy is the cheapest.

mod plot;
mod state;

pub use state::{MotionQuantity, MotionView};

use std::sync::Arc;

use egui::{self, Align, Key, Layout, RichText, Sense, Slider, Ui, WidgetInfo, vec2};

use self::state::{MotionCurves, MotionInputs, PolicyCurve};
use crate::accel::{Accel, Follow};
use crate::app::state::{AppState, ViewState as _};
use crate::app::studies::{Studies, StudyPlan};
use crate::app::views::{View, parts};
use crate::app::widgets::{DropDown, Tip as _, empty_view};
use crate::app::{format, theme};
use crate::lab::LabError;
use crate::lab::motion::{MotionPlan, MotionStudy};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::follow::Policy;
use bvhscope_engine::settings::Pass;

/// Times that the rays of a frame are traced to take the median.
const REPEAT: usize = 3;
/// Width of the slider over the rays of a frame in points.
const RAYS_WIDTH: f32 = 120.0;

impl View for MotionView {
    const PURPOSE: &'static str = "What motion does to the tree: over the frames of a clip, update time, cost and tests by each policy, and when rebuilding pays";
    const KEY: Key = Key::T;

    fn ui(&mut self, ui: &mut Ui, state: &mut AppState) {
        let hint = "Open a model that moves to see what becomes of its tree";
        let Some(shown) = parts::presented(ui, state, hint) else { return };
        if shown.accel.scene.motion.is_none() {
            empty_view(ui, "This model stands still. Open one with clips of animation, such as the sample walker");
            return;
        }
        controls(ui, self, state);
        let Some(curves) = self.curves().cloned() else {
            waiting(ui, self, state);
            return;
        };
        match &*curves {
            Err(reason) => empty_view(ui, &format!("Nothing is measured: {reason}")),
            Ok(curves) => {
                legend(ui, self, curves);
                plot::show(ui, self, state, curves);
            }
        }
    }

    fn add_studies(studies: &mut Studies) -> std::io::Result<()> {
        let plan = StudyPlan::new(
            "motion",
            "Following the clip",
            |state| &mut state.views.get_mut::<Self>().study,
            |state, _| {
                let mut view = std::mem::take(state.views.get_mut::<Self>());
                let wanted = view.wanted(state);
                *state.views.get_mut() = view;
                wanted
            },
        );
        studies.add(plan, |accel, inputs: &MotionInputs, token| measure(accel, inputs, token))
    }
}

/// The line until the first measurements are there.
fn waiting(ui: &mut Ui, view: &mut MotionView, state: &AppState) {
    let wanted = view.wanted(state);
    let is_stopped = wanted.is_some_and(|(basis, inputs)| view.study.is_cancelled(&basis, &inputs));
    let text = if state.model.playback.playing {
        "Measured once the clip is paused"
    } else {
        "Following the clip by each policy"
    };
    if parts::waiting(ui, is_stopped, text) {
        view.study.resume();
    }
}

/// Quantity, rays and frames.
fn controls(ui: &mut Ui, view: &mut MotionView, state: &mut AppState) {
    let present = state.view_rays();
    ui.horizontal_wrapped(|ui| {
        let tip = "What is plotted over the frames of the clip";
        DropDown::new("Plot", &MotionQuantity::ALL).beside(ui, "Plot", tip, &mut view.quantity);
        parts::population(ui, state, "The rays that are traced in each frame");
        let choices = Follow::FRAMES.map(|frames| (frames, format!("{frames}")));
        let tip = "Number of frames, at equal distances from the first key of the clip to the last";
        let choices: Vec<_> = choices.iter().map(|(frames, name)| (*frames, name.as_str(), tip)).collect();
        DropDown::new("Frames", &choices).beside(ui, "Frames", tip, &mut state.wanted.follow.frames);
        rays_of_frame(ui, view);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let known = view.view_rays();
            let response =
                ui.add_enabled(known.is_some_and(|rays| rays != present), egui::Button::new("Measure this view"));
            let tip = "Trace the rays of the view that you see now. Until then they stay those of an earlier view";
            let response = response.tip(tip).disabled_tip("The rays are those of the view that you see");
            if response.clicked() {
                view.measure_by(present);
            }
        });
    });
}

/// The slider over the number of rays that are traced in a frame, by which policies are compared.
fn rays_of_frame(ui: &mut Ui, view: &mut MotionView) {
    let rays = &mut view.rays;
    ui.weak("Rays a frame");
    ui.spacing_mut().slider_width = RAYS_WIDTH;
    let [least, most] = MotionView::RAYS;
    let response = ui.add(Slider::new(rays, least..=most).logarithmic(true).show_value(false));
    let value = *rays;
    response.widget_info(|| WidgetInfo::slider(true, value, "Rays a frame"));
    response.tip("The more rays a frame traces, the sooner a better tree pays for its update");
    ui.label(format::significant(value / 1e6) + " million");
}

/// The policies, each in the colour of its curve; a click hides it or shows it.
fn legend(ui: &mut Ui, view: &mut MotionView, curves: &[PolicyCurve]) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        for PolicyCurve { policy, .. } in curves {
            let hidden = &mut view.hidden;
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
        rays: vec![inputs.rays.clone()],
        simd: bvhscope_engine::kernel::SimdLevel::best(),
        repeat: REPEAT,
        epo_samples: None,
    }
}

impl MotionView {
    /// The model and the inputs to be measured; `None` while the view is closed or a clip plays, which would disturb the times.
    fn wanted(&mut self, state: &AppState) -> Option<(Arc<Accel>, MotionInputs)> {
        let accel = state.presented_tree();
        self.follow(accel.as_ref().map(|accel| &accel.scene));
        let accel = accel.filter(|accel| accel.scene.motion.is_some() && state.preferences.dock.shows(Self::NAME))?;
        if state.model.playback.playing {
            return None;
        }
        let (basis, rays) = self.basis(&accel, state.view_rays());
        let mut build = state.wanted.build;
        build.optimize = build.optimize.without(Pass::Anneal);
        let clip = state.clip().map_or(0, |(moment, _)| moment.clip);
        let rays = state.model.derived.with_file(rays).of(state.model.derived.population);
        Some((basis, MotionInputs { clip, frames: state.wanted.follow.frames, build, rays }))
    }
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
