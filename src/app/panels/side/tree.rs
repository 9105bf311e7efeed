//! Section "Tree": build settings.

use std::path::Path;

use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Pass, Preset};
use bvhscope_engine::tree::ContainerKind;
use egui::{Align, Button, Checkbox, Grid, Label, Layout, RadioButton, RichText, Ui};

use crate::app::commands::{Action, CompareStep, builder_description, is_preset};
use crate::app::state::{AppState, TreeSide};
use crate::app::widgets::{Header, SliderSpec, Tip as _, check, chip, combo, row, section, slider};
use crate::app::{format, theme};
use crate::text::file_name;

/// Shows the section.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let tip = "Reset builder, container, threshold, ε, curve, passes and threads";
    let header = Header { name: "Tree settings", reset: Some(tip), ..Header::default() };
    let reset = section(ui, "TREE", header, |ui| {
        second_tree(ui, state);
        tree_file(ui, state);
        let triangles = state.model.loaded.as_ref().map_or(0, |scene| scene.triangles.len());
        builder(ui, state, triangles);
        container(ui, state, triangles);
        let aac = state.edited_build().builder == BuilderKind::Aac;
        ui.add_enabled_ui(aac, |ui| {
            threshold(ui, state);
            presets(ui, state);
            epsilon(ui, state);
        });
        let sorts = matches!(state.edited_build().builder, BuilderKind::Aac | BuilderKind::Lbvh);
        ui.add_enabled_ui(sorts, |ui| curve(ui, state));
        passes(ui, state);
        rounds(ui, state);
        threads(ui, state);
    });
    if reset {
        *state.edited_build_mut() = BuildSettings::default();
        Action::BuildTree.perform(state);
        state.wanted.threads = 0;
    }
}

/// Which of two trees the settings below are of; a button for a second tree where there is one only.
fn second_tree(ui: &mut Ui, state: &mut AppState) {
    let Some(second) = state.wanted.second else {
        let tip = "Build a second tree B of this model and see both at the same camera (Ctrl+2)";
        if ui.add(Button::new("Compare with a second tree")).tip(tip).clicked() {
            Action::Compare(CompareStep::Toggle).perform(state);
        }
        return;
    };
    row(ui, "Settings of", "The tree whose settings are below (4)", |ui| {
        ui.horizontal(|ui| {
            for side in TreeSide::ALL {
                let name = format!("Tree {}", side.name());
                let tip = format!("Show and change the settings of tree {} (4)", side.name());
                if chip(ui, &name, state.edited_side() == side, &tip) {
                    state.layout.edited_tree = side;
                }
            }
        })
        .response
    });
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().button_padding.x = 5.0;
        for (step, label, tip) in [
            (CompareStep::Copy, "Copy A to B", "Give tree B the settings of tree A"),
            (CompareStep::Swap, "Swap", "Exchange the settings of the two trees"),
            (CompareStep::Toggle, "Remove B", "Remove tree B and free its memory (Ctrl+2)"),
        ] {
            let action = Action::Compare(step);
            let button = ui.add_enabled(action.is_enabled(state), Button::new(label)).tip(tip);
            if button.disabled_tip("Both trees have the same settings").clicked() {
                action.perform(state);
            }
        }
    });
    let mut only_common = second.only_common;
    let tip = "Draw only the containers that both trees have: those with the same triangles below";
    if check(ui, &mut only_common, "Only common containers", tip) {
        Action::Compare(CompareStep::OnlyCommon).perform(state);
    }
}

/// The file that the tree is read from, if there is one.
fn tree_file(ui: &mut Ui, state: &mut AppState) {
    let Some(path) = state.wanted.tree_file(state.edited_side()).map(Path::to_path_buf) else { return };
    row(ui, "From file", "The tree is read from this file, and again whenever it is written", |ui| {
        ui.horizontal(|ui| {
            let tip = "Build the tree with the settings below instead";
            let remove = ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let response = ui.button("Build instead").tip(tip);
                let name = file_name(&path);
                let name = format::elide_middle(&name, (ui.available_width() / 7.5) as usize);
                ui.add(Label::new(RichText::new(name).strong()).truncate()).tip(path.display().to_string());
                response
            });
            if remove.inner.clicked() {
                Action::BuildTree.perform(state);
            }
        })
        .response
    });
    let dim = theme::palette(ui).dim;
    ui.add(Label::new(RichText::new("A change below builds the tree here instead").small().color(dim)).wrap());
}

fn builder(ui: &mut Ui, state: &mut AppState, triangles: usize) {
    let build = *state.edited_build();
    let tip = "The algorithm that builds the tree. Compare SAH cost and tests per ray after a change";
    let choices = BuilderKind::ALL.map(|kind| (kind, kind.label(), builder_description(kind)));
    combo(ui, "Builder", tip, &mut state.edited_build_mut().builder, &choices, |builder| {
        BuildSettings { builder, ..build }.refusal(triangles)
    });
}

fn container(ui: &mut Ui, state: &mut AppState, triangles: usize) {
    let build = *state.edited_build();
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
                    state.edited_build_mut().container = kind;
                }
            }
        })
        .response
    });
}

fn threshold(ui: &mut Ui, state: &mut AppState) {
    let mut value = f64::from(state.edited_build().threshold);
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
        state.edited_build_mut().threshold = value as u32;
    }
}

fn presets(ui: &mut Ui, state: &mut AppState) {
    ui.horizontal_wrapped(|ui| {
        // Spacing at which all six fit into one row of the narrowest panel.
        ui.spacing_mut().item_spacing.x = 2.0;
        ui.spacing_mut().button_padding.x = 3.0;
        for preset in Preset::ALL {
            let (threshold, epsilon) = preset.parameters();
            let source = match preset {
                Preset::Fast | Preset::Hq => "Mahmuda, Yuniarti, Nurul K.",
                Preset::AacFast | Preset::AacHq => "Gu et al. 2013",
                Preset::Best => "then collapse, restructure and reinsert",
                Preset::Finest => "and every pass below: takes minutes",
            };
            let tip = format!("Threshold {threshold}, ε {epsilon} ({source})");
            if chip(ui, preset.label(), is_preset(state, preset), &tip) {
                Action::Preset(preset).perform(state);
            }
        }
    });
}

fn epsilon(ui: &mut Ui, state: &mut AppState) {
    let mut value = f64::from(state.edited_build().epsilon);
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
        state.edited_build_mut().epsilon = value as f32;
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
    combo(ui, "Curve", tip, &mut state.edited_build_mut().curve, &choices, |_| None);
}

fn passes(ui: &mut Ui, state: &mut AppState) {
    let tip = "Passes before and after the builder that improve the tree. Each takes time";
    row(ui, "Optimize", tip, |ui| {
        Grid::new("passes")
            .num_columns(2)
            .show(ui, |ui| {
                for (index, pass) in Pass::ALL.into_iter().enumerate() {
                    let build = state.edited_build_mut();
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
                        Pass::Anneal => {
                            "Moves every subtree again and again, at first even where that costs more: hundreds of times \
                         as slow as all others, and the best tree there is"
                        }
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

fn rounds(ui: &mut Ui, state: &mut AppState) {
    if state.edited_build().annealing_rounds().is_none() {
        return;
    }
    let mut value = f64::from(state.edited_build().rounds);
    let spec = SliderSpec {
        label: "Rounds",
        tip: "Rounds of annealing. More give a better tree in proportionally more time",
        range: 1.0..=f64::from(BuildSettings::MAX_ROUNDS),
        default: f64::from(BuildSettings::DEFAULT_ROUNDS),
        logarithmic: true,
        decimals: 0,
        zero: "",
    };
    if slider(ui, &mut value, &spec) {
        state.edited_build_mut().rounds = value as u32;
    }
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
