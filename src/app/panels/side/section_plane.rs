//! Section "Section plane": cuts model and containers open.

use egui::{self, Ui};

use crate::app::commands::{Action, SectionStep};
use crate::app::state::AppState;
use crate::app::widgets::{Header, SliderSpec, row, section, slider};

/// Shows the section.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
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
    if ui.selectable_label(off, "Off").on_hover_text("Show the whole model").clicked() {
        state.wanted.render.section = None;
    }
    for (step, label, tip) in [
        (SectionStep::X, "x", "Cut across the x axis"),
        (SectionStep::Y, "y", "Cut across the y axis"),
        (SectionStep::Z, "z", "Cut across the z axis"),
        (SectionStep::Facing, "Facing", "Cut parallel to the picture as it is now"),
    ] {
        let action = Action::Section(step);
        if ui.selectable_label(action.is_on(state) == Some(true), label).on_hover_text(tip).clicked() {
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
        label: "Position",
        tip: "Where the plane is, in percent of the model\u{2019}s size along its normal; the handle in the picture moves it too",
        range: 0.0..=100.0,
        default: 50.0,
        logarithmic: false,
        decimals: 1,
        zero: "",
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
                if button.on_hover_text(tip).clicked() {
                    action.perform(state);
                }
            }
        })
        .response
    });
}
