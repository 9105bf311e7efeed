//! Sections "Picture": render settings; and "Section plane": cuts model and containers open.

use egui::{self, Ui};

use crate::app::commands::{Action, SectionStep, shading_description};
use crate::app::panels::side::histogram;
use crate::app::state::AppState;
use crate::app::widgets::{DropDown, Header, SliderSpec, Tip as _, row, section, slider};
use crate::render::{ColorMap, Exposure, Light, NormalSource, RenderSettings, Shading};
use bvhscope_engine::tree::traverse::Traversal;

/// Shows the section.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let header = Header { reset: Some("Reset the picture's settings"), ..Header::default() };
    let reset = section(ui, "PICTURE", header, |ui| {
        let render = &mut state.wanted.render;
        let shadings = Shading::ALL.map(|shading| (shading, shading.label(), shading_description(shading)));
        let tip = format!("What the colour of a pixel means (Alt+1 to Alt+{})", shadings.len());
        DropDown::new("Shading", &shadings).row(ui, &tip, &mut render.shading);
        let heat = matches!(render.shading, Shading::Heat(_));
        if render.shading == Shading::Lit {
            light(ui, state);
        }
        if state.wanted.render.shading == Shading::Clusters {
            if state.cluster_cut(state.model.presented.as_ref().map(|shown| &shown.accel)).is_some() {
                let tip = "Surfaces have the colours of the clusters that the view Merges shows; close it (F6) to choose a depth";
                row(ui, "Clusters", tip, |ui| ui.label("those of Merges"));
            } else {
                cluster_depth(ui, state);
            }
        }
        if heat || state.wanted.render.shading == Shading::Depth {
            scale(ui, &mut state.wanted.render, heat);
        }
        if heat {
            histogram::show(ui, state);
        }
        normals(ui, state);
        let tip = "Draw the edges of triangles that are at least 2 pixels high: how fine the mesh is, and where triangles are long and thin (M)";
        row(ui, "Mesh", tip, |ui| ui.checkbox(&mut state.wanted.render.mesh_edges, "Edges"));
        samples(ui, state);
    });
    if reset {
        state.wanted.render = RenderSettings::default();
    }
}

/// Light, exposure and ground.
fn light(ui: &mut Ui, state: &mut AppState) {
    let has_own = state.model.presented.as_ref().is_some_and(|shown| !shown.accel.scene.lights.is_empty());
    let wanted = state.wanted.render.light;
    let mut lights = Light::ALL.map(|light| match light {
        Light::Headlight => (light, "Headlight", "From the camera, without shadows: faster"),
        Light::Sun => (light, "Sun", "From high above, with shadows"),
        Light::File => (light, "File", "The lights of the model's file, with shadows; the sun where it has none"),
    });
    lights.reverse();
    let offered = if has_own || wanted == Light::File { &lights[..] } else { &lights[1..] };
    let tip = "Where the light comes from";
    DropDown::new("Light", offered).row(ui, tip, &mut state.wanted.render.light);
    exposure(ui, state);
    let tip = "Let the model's shadow fall on a ground below it, so that it does not float. The tree and all counts \
               stay as they are";
    row(ui, "Ground", tip, |ui| ui.checkbox(&mut state.wanted.render.ground, "Shadow"));
}

/// The colours of numbers, and how rays visit nodes while tests are counted.
fn scale(ui: &mut Ui, render: &mut RenderSettings, heat: bool) {
    if heat {
        let orders = Traversal::ALL.map(|traversal| match traversal {
            Traversal::Ordered => (traversal, "Ordered", "Near child first, culled by distance"),
            Traversal::Paper => (traversal, "Paper", "Unordered and not culled, as printed: many more tests"),
        });
        let tip = "How rays visit nodes while tests are counted";
        DropDown::new("Traversal", &orders).row(ui, tip, &mut render.traversal);
    }
    let maps = ColorMap::ALL.map(|map| {
        let meaning = match map {
            ColorMap::Viridis => "Violet over green to yellow: even steps, also for the colour-blind",
            ColorMap::Inferno => "Black over red to pale yellow: even steps, darkest start",
            ColorMap::Turbo => "Blue over green to red: the most distinguishable colours",
        };
        (map, map.label(), meaning)
    });
    DropDown::new("Colour map", &maps).row(ui, "Colours from the smallest to the largest value", &mut render.color_map);
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
    let mut stops = f64::from(match *setting {
        Exposure::Auto => metered,
        Exposure::Fixed(stops) => stops,
    });
    // No "-0.0".
    if stops.abs() < 0.05 {
        stops = 0.0;
    }
    let spec = SliderSpec {
        decimals: 1,
        ..SliderSpec::new(
            "Stops",
            "Exposure in stops (EV): each doubles the light, 0 shows it as it is. Moving it switches the meter off",
            -4.0..=4.0,
            0.0,
        )
    };
    if slider(ui, &mut stops, &spec) {
        *setting = Exposure::Fixed(stops as f32);
    }
}

/// Where normals come from, with the crease angle.
fn normals(ui: &mut Ui, state: &mut AppState) {
    let render = &mut state.wanted.render;
    let uses_normals =
        matches!(render.shading, Shading::Lit | Shading::Normals | Shading::AmbientOcclusion | Shading::Clusters);
    if !uses_normals {
        return;
    }
    let sources = NormalSource::ALL.map(|source| {
        let meaning = match source {
            NormalSource::File => "The file's, or by crease angle where it has none",
            NormalSource::Crease => "Triangles that meet at less than the crease angle look like one curved surface",
            NormalSource::Flat => "Every triangle is flat, as rays meet it",
        };
        (source, source.label(), meaning)
    });
    DropDown::new("Normals", &sources).row(
        ui,
        "What makes surfaces look smooth; the triangles stay as they are",
        &mut render.normals,
    );
    if render.normals != NormalSource::Crease {
        return;
    }
    let spec = SliderSpec::new(
        "Crease angle",
        "Degrees between triangles up to which their edge is smooth. Higher: rounder; lower: more sharp edges",
        0.0..=180.0,
        f64::from(RenderSettings::default().crease_degrees),
    );
    slider(ui, &mut render.crease_degrees, &spec);
}

/// Hundredths of a stop.
fn round(stops: f32) -> f32 {
    (stops * 100.0).round() / 100.0
}

fn cluster_depth(ui: &mut Ui, state: &mut AppState) {
    let max_depth = state.model.presented.as_ref().map_or(32, |shown| shown.accel.tree.max_depth()).max(1);
    let mut value = f64::from(state.wanted.render.cluster_depth.min(max_depth));
    let spec = SliderSpec::new(
        "Cluster depth",
        "The depth of the containers whose colours surfaces take. Deeper: smaller patches",
        0.0..=f64::from(max_depth),
        f64::from(RenderSettings::default().cluster_depth.min(max_depth)),
    );
    if slider(ui, &mut value, &spec) {
        state.wanted.render.cluster_depth = value as u32;
    }
}

fn samples(ui: &mut Ui, state: &mut AppState) {
    let spec = SliderSpec {
        logarithmic: true,
        ..SliderSpec::new(
            "Samples",
            "Samples per pixel once the picture is at rest. More: smoother edges and shadows, later",
            1.0..=256.0,
            f64::from(RenderSettings::default().samples),
        )
    };
    slider(ui, &mut state.wanted.render.samples, &spec);
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
