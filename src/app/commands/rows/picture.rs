//! Actions of the menu "View" on the picture: what is shown of the model, and how it is shaded.

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::tree::traverse::Traversal;
use egui::Key;

use crate::app::commands::camera;
use crate::app::commands::row::{ALT, Item, NONE, Row, SHIFT, flip, item, many, one};
use crate::app::state::AppState;
use crate::app::state::action::{Action, SectionStep};
use crate::render::rows::shading_sentence;
use crate::render::{Exposure, Shading};

pub(super) const ROWS: &[Row] = &[
    one(Action::ToggleContainers, "Containers", "Draw containers over the picture", &[(NONE, Key::B)], |state, _| {
        state.toggle_containers();
    })
    .switch(|state, _| Some(state.shows_containers())),
    one(Action::ToggleGeometry, "Geometry", "Show the traced picture", &[(NONE, Key::N)], |state, _| {
        flip(&mut state.preferences.show_geometry);
    })
    .switch(|state, _| Some(state.preferences.show_geometry)),
    one(
        Action::ToggleMeshEdges,
        "Mesh edges",
        "Draw the edges of the triangles over the picture",
        &[(NONE, Key::M)],
        |state, _| {
            flip(&mut state.wanted.render.mesh_edges);
            // Edges are drawn into the picture, so it must be shown.
            state.preferences.show_geometry |= state.wanted.render.mesh_edges;
        },
    )
    .switch(|state, _| Some(state.wanted.render.mesh_edges)),
    one(
        Action::ToggleGround,
        "Ground shadow",
        "Let the model's shadow fall on a ground below it, so that it does not float",
        &[],
        |state, _| flip(&mut state.wanted.render.ground),
    )
    .when(is_lit)
    .switch(|state, _| Some(state.wanted.render.ground)),
    one(
        Action::LockExposure,
        "Lock exposure",
        "Keep the brightness of this view while the camera moves; again to meter it anew",
        &[(NONE, Key::K)],
        |state, _| lock_exposure(state),
    )
    .when(is_lit)
    .switch(|state, _| Some(state.wanted.render.exposure != Exposure::Auto)),
    one(
        Action::FitHeatRange,
        "Fit heat range",
        "Spread the colours of the heat map over the counts of this picture; the range then stays",
        &[(NONE, Key::C)],
        |state, _| fit_heat_range(state),
    )
    .when(|state, _| state.model.presented.as_ref().is_some_and(|shown| !shown.frame.values.is_empty())),
    many(sections, |state, index| camera::step_section(state, SectionStep::ALL[index]))
        .when(|state, index| camera::can_step_section(state, SectionStep::ALL[index]))
        .switch(|state, index| camera::is_section_on(state, SectionStep::ALL[index]))
        .within("Section"),
    many(shadings, |state, index| state.wanted.render.shading = Shading::ALL[index])
        .switch(|state, index| Some(state.wanted.render.shading == Shading::ALL[index]))
        .within("Shading"),
    many(samples, |state, index| state.wanted.render.samples = SAMPLES[index])
        .switch(|state, index| Some(state.wanted.render.samples == SAMPLES[index]))
        .within("Samples"),
    many(traversals, |state, index| state.wanted.render.traversal = Traversal::ALL[index])
        .switch(|state, index| Some(state.wanted.render.traversal == Traversal::ALL[index]))
        .within("Traversal"),
];

fn sections() -> Vec<Item> {
    let step = |step| {
        let (label, tip, key) = match step {
            SectionStep::Toggle => {
                ("Section", "Cut model and containers open by a plane, or close them", Some((NONE, Key::X)))
            }
            SectionStep::X => ("Section: across x", "Cut across the x axis; drag the handle to move the plane", None),
            SectionStep::Y => ("Section: across y", "Cut across the y axis; drag the handle to move the plane", None),
            SectionStep::Z => ("Section: across z", "Cut across the z axis; drag the handle to move the plane", None),
            SectionStep::Facing => {
                ("Section: facing", "Cut parallel to the picture, through the middle of the model", None)
            }
            SectionStep::Snap => ("Section: snap to axis", "Turn the section plane to the nearest axis", None),
            SectionStep::Flip => ("Section: flip", "Keep the other half", Some((SHIFT, Key::X))),
        };
        Item { key, ..item(Action::Section(step), label, tip) }
    };
    SectionStep::ALL.map(step).into()
}

fn shadings() -> Vec<Item> {
    let digits = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];
    let shadings = Shading::ALL.into_iter().enumerate();
    shadings
        .map(|(index, shading)| {
            let label = format!("Shading: {}", shading.label());
            // Modes beyond the ninth have no key.
            let key = digits.get(index).map(|&key| (ALT, key));
            Item { key, ..item(Action::Shade(shading), label, shading_sentence(shading)) }
        })
        .collect()
}

/// Numbers of samples per pixel in the menu.
const SAMPLES: [u32; 5] = [1, 4, 16, 64, 256];

fn samples() -> Vec<Item> {
    let of = |count: u32| {
        let tip = "Antialiasing samples per pixel of a picture at rest";
        item(Action::Samples(count), format!("Samples: {count}"), tip)
    };
    SAMPLES.map(of).into()
}

fn traversals() -> Vec<Item> {
    let of = |traversal: Traversal| {
        let tip = "How rays visit nodes while tests are counted";
        item(Action::Traversal(traversal), format!("Traversal: {}", traversal.name()), tip)
    };
    Traversal::ALL.map(of).into()
}

fn is_lit(state: &AppState, _: usize) -> bool {
    state.wanted.render.shading == Shading::Lit
}

/// Sets the heat map's range to the one that fits the presented picture.
fn fit_heat_range(state: &mut AppState) {
    let Some(shown) = &state.model.presented else { return };
    if matches!(state.wanted.render.shading, Shading::Heat(_)) && !shown.frame.values.is_empty() {
        state.wanted.render.heat_range = shown.frame.fitted_range(&CancelToken::new()).ok();
    }
}

/// Fixes the exposure at that of the presented picture, or lets it be metered again.
fn lock_exposure(state: &mut AppState) {
    let shown = state.model.presented.as_ref().map_or(0.0, |shown| shown.frame.exposure_stops);
    let exposure = &mut state.wanted.render.exposure;
    *exposure = match exposure {
        // Rounded, as the slider and the command line show it.
        Exposure::Auto => Exposure::Fixed((shown * 100.0).round() / 100.0),
        Exposure::Fixed(_) => Exposure::Auto,
    };
}
