//! Section "Tree": build settings.

use std::path::Path;

use bvhscope_engine::settings::BuildSettings;
use egui::{Button, Checkbox, Grid, Label, RadioButton, RichText, Ui};

use crate::app::commands::{Action, CompareStep};
use crate::app::panels::side::control::control;
use crate::app::state::{AppState, TreeSide};
use crate::app::widgets::{DropDown, Header, SliderSpec, Tip as _, check, chip, row, section, slider};
use crate::app::{format, theme};
use crate::catalog::settings::{Choice, SETTINGS, Setting, Value};
use crate::text::file_name;

/// Index of the present value of a setting.
type Get = fn(&BuildSettings) -> Option<usize>;
/// Sets the value with an index.
type Set = fn(&mut BuildSettings, usize);

/// Shows the section.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let tip = "Reset everything below to its default";
    let header = Header { name: "Tree settings", reset: Some(tip), ..Header::default() };
    let reset = section(ui, "TREE", header, |ui| {
        second_tree(ui, state);
        tree_file(ui, state);
        for row in SETTINGS {
            setting(ui, state, row);
        }
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
            if action.is_enabled(state) && ui.button(label).tip(tip).clicked() {
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
            let name = format::elide_middle(&file_name(&path), (ui.available_width() / 7.5) as usize);
            ui.add(Label::new(RichText::new(name).strong()).truncate()).tip(path.display().to_string());
        })
        .response
    });
    // On a line of its own, so that names of files are not cut.
    if ui.button("Build instead").tip("Build the tree with the settings below instead").clicked() {
        Action::BuildTree.perform(state);
    }
    let dim = theme::palette(ui).dim;
    ui.add(Label::new(RichText::new("A change below builds the tree here instead").small().color(dim)).wrap());
}

/// The control of a setting; nothing where the builder does not use it.
fn setting(ui: &mut Ui, state: &mut AppState, setting: &Setting) {
    if !(setting.applies)(state.edited_build()) {
        return;
    }
    match &setting.value {
        Value::One { options, get, set } if fit_a_row(&options()) => radio(ui, state, setting, &options(), *get, *set),
        Value::One { options, get, set } => list(ui, state, setting, &options(), *get, *set),
        Value::Any { .. } => checks(ui, state, setting),
        _ => control(ui, setting, state.edited_build_mut()),
    }
}

/// Why no tree of the model can be built with the value that `set` sets.
fn refusal(state: &AppState, set: impl Fn(&mut BuildSettings)) -> Option<String> {
    let mut build = *state.edited_build();
    set(&mut build);
    build.refusal(state.model.loaded.as_ref().map_or(0, |scene| scene.triangles.len()))
}

fn list(ui: &mut Ui, state: &mut AppState, setting: &Setting, options: &[Choice], get: Get, set: Set) {
    let mut index = get(state.edited_build());
    let unnamed = index.is_none().then_some((None, "Custom", "Values that have no name"));
    let named = options.iter().enumerate().map(|(index, option)| (Some(index), option.label, option.tip.as_str()));
    let choices: Vec<_> = unnamed.into_iter().chain(named).collect();
    let refused = |index: Option<usize>| index.and_then(|index| refusal(state, |build| set(build, index)));
    if DropDown::new(setting.label, &choices).explained().refusing(&refused).row(ui, setting.tip, &mut index)
        && let Some(index) = index
    {
        set(state.edited_build_mut(), index);
    }
}

/// The names of all `options` fit side by side, where one click chooses.
fn fit_a_row(options: &[Choice]) -> bool {
    const LETTERS: usize = 16;
    options.iter().map(|option| option.label.len()).sum::<usize>() <= LETTERS
}

fn radio(ui: &mut Ui, state: &mut AppState, setting: &Setting, options: &[Choice], get: Get, set: Set) {
    row(ui, setting.label, setting.tip, |ui| {
        ui.horizontal(|ui| {
            // The names of three containers fit into the panel at its default width.
            (ui.spacing_mut().item_spacing.x, ui.spacing_mut().icon_spacing) = (4.0, 2.0);
            for (index, option) in options.iter().enumerate() {
                let refusal = refusal(state, |build| set(build, index));
                let button = RadioButton::new(get(state.edited_build()) == Some(index), option.label);
                let response = ui.add_enabled(refusal.is_none(), button);
                let response = response.disabled_tip(refusal.unwrap_or_default());
                if response.clicked() {
                    set(state.edited_build_mut(), index);
                }
            }
        })
        .response
    });
}

fn checks(ui: &mut Ui, state: &mut AppState, setting: &Setting) {
    let Value::Any { options, get, set, refusal, .. } = &setting.value else { return };
    row(ui, setting.label, setting.tip, |ui| {
        let checks = |ui: &mut Ui| {
            for (index, option) in options().iter().enumerate() {
                let build = state.edited_build_mut();
                let mut on = get(build, index);
                let refused = refusal(build, index);
                let response = ui.add_enabled(refused.is_none(), Checkbox::new(&mut on, option.label));
                let response = response.tip(&option.tip).disabled_tip(refused.unwrap_or_default());
                if response.changed() {
                    set(build, index, on);
                }
                if index % 2 == 1 {
                    ui.end_row();
                }
            }
        };
        Grid::new(setting.key).num_columns(2).show(ui, checks).response
    });
}

fn threads(ui: &mut Ui, state: &mut AppState) {
    let most = std::thread::available_parallelism().map_or(1, std::num::NonZero::get).max(2);
    let mut value = state.wanted.threads as f64;
    let spec = SliderSpec {
        zero: "all",
        ..SliderSpec::new(
            "Threads",
            "Threads that build and trace; 0 takes all. The tree is the same for any number",
            0.0..=most as f64,
            0.0,
        )
    };
    if slider(ui, &mut value, &spec) {
        state.wanted.threads = value as usize;
    }
}
