//! Section "Tree": build settings.

use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Preset};
use bvhscope_engine::tree::ContainerKind;
use egui::{Checkbox, Grid, RadioButton, Ui};

use crate::app::commands::{Action, builder_description, is_preset};
use crate::app::panels::widgets::{Header, SliderSpec, chip, combo, row, section, slider};
use crate::app::state::AppState;

/// Shows the section.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let tip = "Reset builder, container, threshold, ε, curve, passes and threads";
    let header = Header { name: "Tree settings", reset: Some(tip), ..Header::default() };
    let reset = section(ui, "TREE", header, |ui| {
        let triangles = state.model.loaded.as_ref().map_or(0, |scene| scene.triangles.len());
        builder(ui, state, triangles);
        container(ui, state, triangles);
        let aac = state.wanted.build.builder == BuilderKind::Aac;
        ui.add_enabled_ui(aac, |ui| {
            threshold(ui, state);
            presets(ui, state);
            epsilon(ui, state);
        });
        let sorts = matches!(state.wanted.build.builder, BuilderKind::Aac | BuilderKind::Lbvh);
        ui.add_enabled_ui(sorts, |ui| curve(ui, state));
        passes(ui, state);
        threads(ui, state);
    });
    if reset {
        state.wanted.build = BuildSettings::default();
        state.wanted.threads = 0;
    }
}

fn builder(ui: &mut Ui, state: &mut AppState, triangles: usize) {
    let build = state.wanted.build;
    let tip = "The algorithm that builds the tree. Compare SAH cost and tests per ray after a change";
    let choices = BuilderKind::ALL.map(|kind| (kind, kind.label(), builder_description(kind)));
    combo(ui, "Builder", tip, &mut state.wanted.build.builder, &choices, |builder| {
        BuildSettings { builder, ..build }.refusal(triangles)
    });
}

fn container(ui: &mut Ui, state: &mut AppState, triangles: usize) {
    let build = state.wanted.build;
    let tip = "Bounding volume of each node. Boxes are tighter: faster to build and fewer tests per ray";
    row(ui, "Container", tip, |ui| {
        ui.horizontal(|ui| {
            for kind in ContainerKind::ALL {
                let refusal = BuildSettings { container: kind, ..build }.refusal(triangles);
                let radio = RadioButton::new(build.container == kind, kind.label());
                let response = ui.add_enabled(refusal.is_none(), radio);
                let response = match refusal {
                    Some(reason) => response.on_disabled_hover_text(reason),
                    None => response,
                };
                if response.clicked() {
                    state.wanted.build.container = kind;
                }
            }
        })
        .response
    });
}

fn threshold(ui: &mut Ui, state: &mut AppState) {
    let mut value = f64::from(state.wanted.build.threshold);
    let spec = SliderSpec {
        label: "Threshold",
        tip: "Groups of fewer triangles are clustered rather than split (δ). Higher: slower build, fewer tests per ray. 6 fast, 12 good ([ and ])",
        range: f64::from(BuildSettings::MIN_THRESHOLD)..=f64::from(BuildSettings::MAX_THRESHOLD),
        default: f64::from(BuildSettings::default().threshold),
        logarithmic: true,
        decimals: 0,
        zero: "",
    };
    if slider(ui, &mut value, &spec) {
        state.wanted.build.threshold = value as u32;
    }
}

fn presets(ui: &mut Ui, state: &mut AppState) {
    ui.horizontal_wrapped(|ui| {
        // Spacing at which all five fit into one row of the narrowest panel.
        ui.spacing_mut().item_spacing.x = 3.0;
        ui.spacing_mut().button_padding.x = 5.0;
        for preset in Preset::ALL {
            let (threshold, epsilon) = preset.parameters();
            let source = match preset {
                Preset::Fast | Preset::Hq => "Mahmuda, Yuniarti, Nurul K.",
                Preset::AacFast | Preset::AacHq => "Gu et al. 2013",
                Preset::Best => "and every pass below but the split",
            };
            let tip = format!("Threshold {threshold}, ε {epsilon} ({source})");
            if chip(ui, preset.label(), is_preset(state, preset), &tip) {
                Action::Preset(preset).perform(state);
            }
        }
    });
}

fn epsilon(ui: &mut Ui, state: &mut AppState) {
    let mut value = f64::from(state.wanted.build.epsilon);
    let spec = SliderSpec {
        label: "Reduction ε",
        tip: "How strongly clusters are reduced on the way up. Smaller: more clusters kept, slower build, better tree",
        range: 0.0..=f64::from(BuildSettings::MAX_EPSILON),
        default: f64::from(BuildSettings::default().epsilon),
        logarithmic: false,
        decimals: 2,
        zero: "",
    };
    if slider(ui, &mut value, &spec) {
        state.wanted.build.epsilon = value as f32;
    }
}

fn curve(ui: &mut Ui, state: &mut AppState) {
    let tip = "Space-filling curve along which triangles are sorted before they are clustered";
    let choices = Curve::ALL.map(|curve| {
        let meaning = match curve {
            Curve::Morton => "The bits of x, y and z in turn: the paper's, and the fastest",
            Curve::Hilbert => "Neighbours on it always touch. Helps spheres most",
            Curve::Extended => "With the triangles' size as a fourth axis (Vinkler et al. 2017)",
        };
        (curve, curve.label(), meaning)
    });
    combo(ui, "Curve", tip, &mut state.wanted.build.curve, &choices, |_| None);
}

fn passes(ui: &mut Ui, state: &mut AppState) {
    let tip = "Passes before and after the builder that improve the tree. Each takes time";
    row(ui, "Optimize", tip, |ui| {
        Grid::new("passes")
            .num_columns(2)
            .show(ui, |ui| {
                for (index, pass) in Pass::ALL.into_iter().enumerate() {
                    let build = &mut state.wanted.build;
                    let mut on = build.optimize.contains(pass);
                    let usable = build.container == ContainerKind::Aabb || !pass.boxes_only();
                    let tip = match pass {
                        Pass::Split => {
                            "Puts large triangles into several boxes before the tree is built (Karras and Aila 2013). \
                         Helps walls and beams that are not axis-aligned, takes more memory"
                        }
                        Pass::Restructure => {
                            "Builds treelets again from the top by SAH and keeps what is cheaper. Helps scans most"
                        }
                        Pass::Reinsert => "Moves subtrees to where they cost less (Meister and Bittner 2018)",
                        Pass::Collapse => "Makes leaves of several triangles where that is cheaper: fewer nodes",
                    };
                    let response = ui.add_enabled(usable, Checkbox::new(&mut on, pass.label()));
                    let response =
                        response.on_hover_text(tip).on_disabled_hover_text("For boxes only: choose the box container");
                    if response.changed() {
                        build.optimize = if on { build.optimize.with(pass) } else { build.optimize.without(pass) };
                    }
                    if index % 2 == 1 {
                        ui.end_row();
                    }
                }
            })
            .response
    });
}

fn threads(ui: &mut Ui, state: &mut AppState) {
    let most = std::thread::available_parallelism().map_or(1, std::num::NonZero::get).max(2);
    let mut value = state.wanted.threads as f64;
    let spec = SliderSpec {
        label: "Threads",
        tip: "Threads that build and trace; 0 takes all. The tree is the same for any number",
        range: 0.0..=most as f64,
        default: 0.0,
        logarithmic: false,
        decimals: 0,
        zero: "all",
    };
    if slider(ui, &mut value, &spec) {
        state.wanted.threads = value as usize;
    }
}
