//! Sections "Picture": render settings; and "Section plane": cuts model and containers open.

use egui::{self, Ui};

use crate::app::commands::{Action, SectionStep};
use crate::app::panels::side::control::{choose, control, number_slider};
use crate::app::panels::side::histogram;
use crate::app::state::AppState;
use crate::app::widgets::{Header, SliderSpec, Tip as _, row, section, slider};
use crate::catalog::settings::{Limits, Settings as _, Value};
use crate::render::rows::{CLUSTER_DEPTH, EXPOSURE, HEAT_RANGE, LIGHT};
use crate::render::{Exposure, Light, RenderSettings};

/// Shows the section: the rows of the settings, some with what belongs to them.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let header = Header { reset: Some("Reset the picture's settings"), ..Header::default() };
    let reset = section(ui, "PICTURE", header, |ui| {
        for &row in RenderSettings::rows() {
            let render = &mut state.wanted.render;
            if !(row.applies)(render) {
                continue;
            }
            match row.key {
                key if key == LIGHT.key => light(ui, state),
                key if key == EXPOSURE.key => exposure(ui, state),
                key if key == CLUSTER_DEPTH.key => cluster_depth(ui, state),
                key if key == HEAT_RANGE.key => histogram::show(ui, state),
                _ => control(ui, row, render),
            }
        }
    });
    if reset {
        state.wanted.render = RenderSettings::default();
    }
}

/// The light; that of the file where there is one.
fn light(ui: &mut Ui, state: &mut AppState) {
    let has_own = state.model.presented.as_ref().is_some_and(|shown| !shown.accel.scene.lights.is_empty());
    choose(ui, &LIGHT, &mut state.wanted.render, |light| has_own || light.name != Light::File.name());
}

/// The exposure: metered, or fixed by the slider.
fn exposure(ui: &mut Ui, state: &mut AppState) {
    let metered = state.model.presented.as_ref().map_or(0.0, |shown| shown.frame.exposure_stops);
    let setting = &mut state.wanted.render.exposure;
    let mut is_auto = *setting == Exposure::Auto;
    let tip = "Meter how much light arrives at the surfaces in view, so that interiors are as easy to see as scans outdoors. \
               Off: the brightness stays while the camera moves (K)";
    if row(ui, "Exposure", tip, |ui| ui.checkbox(&mut is_auto, "Metered")).changed() {
        *setting = if is_auto { Exposure::Auto } else { Exposure::Fixed(round(metered)) };
    }
    let mut stops = if let Exposure::Fixed(stops) = *setting { stops } else { metered };
    // No "-0.0".
    if stops.abs() < 0.05 {
        stops = 0.0;
    }
    if let Value::Optional { limits, .. } = &EXPOSURE.value
        && number_slider(ui, &EXPOSURE, limits, &mut stops, 0.0)
    {
        *setting = Exposure::Fixed(stops);
    }
}

/// Hundredths of a stop.
fn round(stops: f32) -> f32 {
    (stops * 100.0).round() / 100.0
}

/// The depth within the tree, unless the view Merges shows clusters of its own.
fn cluster_depth(ui: &mut Ui, state: &mut AppState) {
    if state.cluster_cut(state.model.presented.as_ref().map(|shown| &shown.accel)).is_some() {
        let tip =
            "Surfaces have the colours of the clusters that the view Merges shows; close it (F6) to choose a depth";
        row(ui, "Clusters", tip, |ui| ui.label("those of Merges"));
        return;
    }
    let max_depth = state.model.presented.as_ref().map_or(32, |shown| shown.accel.tree.max_depth()).max(1);
    let depth = &mut state.wanted.render.cluster_depth;
    let mut value = (*depth).min(max_depth) as f32;
    let default = RenderSettings::default().cluster_depth.min(max_depth) as f32;
    if number_slider(ui, &CLUSTER_DEPTH, &Limits::whole(0, max_depth), &mut value, default) {
        *depth = value as u32;
    }
}

/// Shows the section.
pub(crate) fn section_plane(ui: &mut Ui, state: &mut AppState) {
    section(ui, "SECTION PLANE", Header::default(), |ui| {
        let tip = "Cut model and containers open by a plane across an axis, or parallel to the picture (X)";
        row(ui, "Cut", tip, |ui| ui.horizontal_wrapped(|ui| choices(ui, state)).response);
        position(ui, state);
    });
}

/// Which plane cuts, if any.
fn choices(ui: &mut Ui, state: &mut AppState) {
    ui.spacing_mut().item_spacing.x = 4.0;
    let off = state.wanted.render.section.is_none();
    if ui.selectable_label(off, "Off").tip("Show the whole model").clicked() {
        state.wanted.render.section = None;
    }
    for (step, label, tip) in [
        (SectionStep::X, "x", "Cut across the x axis"),
        (SectionStep::Y, "y", "Cut across the y axis"),
        (SectionStep::Z, "z", "Cut across the z axis"),
        (SectionStep::Facing, "Facing", "Cut parallel to the picture as it is now"),
    ] {
        let action = Action::Section(step);
        if ui.selectable_label(action.is_on(state) == Some(true), label).tip(tip).clicked() {
            action.perform(state);
        }
    }
}

/// Where the plane is, and which half it keeps.
fn position(ui: &mut Ui, state: &mut AppState) {
    let (Some(plane), Some(bounds)) = (&mut state.wanted.render.section, state.model.bounds()) else { return };
    let [low, high] = plane.reach(&bounds);
    let size = (high - low).max(f32::MIN_POSITIVE);
    let mut percent = f64::from((plane.offset - low) / size * 100.0);
    let spec = SliderSpec {
        decimals: 1,
        ..SliderSpec::new(
            "Position",
            "Where the plane is, in percent of the model\u{2019}s size along its normal; the handle in the picture moves it too",
            0.0..=100.0,
            50.0,
        )
    };
    if slider(ui, &mut percent, &spec) {
        plane.offset = low + size * percent as f32 / 100.0;
    }
    row(ui, "Half", "Which half is kept", |ui| {
        ui.horizontal(|ui| {
            for (step, label, tip) in [
                (SectionStep::Flip, "Flip", "Keep the other half (Shift+X)"),
                (SectionStep::Snap, "Snap", "Turn the plane to the nearest axis"),
            ] {
                let action = Action::Section(step);
                let button = ui.add_enabled(action.is_enabled(state), egui::Button::new(label));
                if button.tip(tip).clicked() {
                    action.perform(state);
                }
            }
        })
        .response
    });
}
