//! Section "Tree": build settings.

use std::path::Path;

use bvhscope_engine::settings::{BuildSettings, Pass};
use bvhscope_engine::tree::ContainerKind;
use egui::{Button, Checkbox, Label, RadioButton, RichText, Role, Ui, WidgetInfo};

use crate::app::commands::{Action, CompareStep};
use crate::app::panels::side::control::control;
use crate::app::state::{AppState, TreeSide};
use crate::app::widgets::{
    DropDown, Header, SliderSpec, Tip as _, check, chip, explained, row, section, several, slider,
};
use crate::app::{format, theme};
use crate::catalog::settings::{CONTAINER, Choice, SETTINGS, Setting, Value, container_sentence};
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
    // In the place of the button, so that nothing below moves.
    row(ui, "Settings of", "The tree whose settings are below (4)", |ui| {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            for side in TreeSide::ALL {
                let name = format!("Tree {}", side.name());
                let tip = format!("Show and change the settings of tree {} (4)", side.name());
                if chip(ui, &name, state.edited_side() == side, &tip) {
                    state.layout.edited_tree = side;
                }
            }
            ui.menu_button("Both", |ui| both_trees(ui, state, second.only_common))
                .response
                .tip("Copy, exchange and remove the trees; draw what they have in common");
        })
        .response
    });
}

/// The menu of what concerns both trees.
fn both_trees(ui: &mut Ui, state: &mut AppState, mut only_common: bool) {
    for (step, label, tip) in [
        (CompareStep::Copy, "Copy A to B", "Give tree B the settings of tree A"),
        (CompareStep::Swap, "Swap", "Exchange the settings of the two trees"),
        (CompareStep::Toggle, "Remove B", "Remove tree B and free its memory (Ctrl+2)"),
    ] {
        let action = Action::Compare(step);
        if ui.add_enabled(action.is_enabled(state), Button::new(label)).tip(tip).clicked() {
            action.perform(state);
            ui.close();
        }
    }
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
        _ if setting == &CONTAINER => container(ui, state),
        Value::One { options, get, set } => list(ui, state, setting, &options(), *get, *set),
        Value::Any { .. } => passes(ui, state, setting),
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

/// The containers of the finished tree, where one click chooses. Oriented boxes are those of a pass over a tree of boxes.
fn container(ui: &mut Ui, state: &mut AppState) {
    let chosen = state.edited_build().tree_container();
    row(ui, CONTAINER.label, CONTAINER.tip, |ui| {
        ui.horizontal_wrapped(|ui| {
            // The names of three containers fit into the panel at its default width.
            (ui.spacing_mut().item_spacing.x, ui.spacing_mut().icon_spacing) = (4.0, 2.0);
            for kind in ContainerKind::WITH_ORIENTED {
                let of_kind = |build: &BuildSettings| {
                    let optimize = build.optimize.without(Pass::Orient);
                    BuildSettings { optimize, ..*build }.for_container(kind)
                };
                let refusal = refusal(state, |build| *build = of_kind(build));
                let response = ui.add_enabled(refusal.is_none(), RadioButton::new(chosen == kind, kind.label()));
                let response = response.tip(container_sentence(kind)).disabled_tip(refusal.unwrap_or_default());
                if response.clicked() {
                    *state.edited_build_mut() = of_kind(state.edited_build());
                }
            }
        })
        .response
    });
}

/// The passes in a list, each with what it does. That which makes oriented boxes is among the containers.
fn passes(ui: &mut Ui, state: &mut AppState, setting: &Setting) {
    let Value::Any { options, get, set, refusal, .. } = &setting.value else { return };
    let options = options();
    let listed = || options.iter().enumerate().filter(|(_, option)| option.name != Pass::Orient.name());
    let build = state.edited_build_mut();
    let on: Vec<&str> = listed().filter(|(index, _)| get(build, *index)).map(|(_, option)| option.label).collect();
    let chosen = if on.is_empty() { "none".to_owned() } else { on.join(", ") };
    row(ui, setting.label, setting.tip, |ui| {
        let checks = |ui: &mut Ui| {
            for (index, option) in listed() {
                let mut on = get(build, index);
                let refused = refusal(build, index);
                let text = explained(ui, option.label, &option.tip);
                let response = ui.add_enabled(refused.is_none(), Checkbox::new(&mut on, text));
                response.widget_info(|| WidgetInfo::selected(Role::CheckBox, refused.is_none(), on, option.label));
                if response.disabled_tip(refused.unwrap_or_default()).changed() {
                    set(build, index, on);
                }
            }
        };
        several(ui, setting.label, &chosen, checks)
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
