//! Actions of the menu "File".

use egui::Key;

use crate::app::commands::row::{CTRL, Item, NONE, Row, SHIFT, current, is_presented, item, many, one};
use crate::app::state::action::Action;
use crate::app::state::{AppState, Request};
use crate::scene::{BUILTIN_SCENES, Instancing, SceneSource, format_names};
use crate::text::file_name;

pub(in crate::app::commands) static ROWS: &[&[Row]] = &[
    &[
        many(
            || {
                let tip = format!("Open an {} file", format_names("or"));
                vec![Item { key: Some((CTRL, Key::O)), ..item(Action::Open, "Open…", tip) }]
            },
            |state, _| state.activity.requests.push(Request::OpenDialog),
        ),
        one(
            Action::OpenSequence,
            "Open sequence…",
            "Open a row of numbered files, such as walk_0001.obj and those after it, as the frames of a clip",
            &[],
            |state, _| state.activity.requests.push(Request::OpenSequenceDialog),
        ),
        one(Action::Reload, "Reload", "Read the model from its file again", &[(NONE, Key::F5)], |state, _| {
            state.activity.requests.push(Request::Reload);
        }),
        one(Action::StartPage, "Start page", "Show built-in scenes and recent files", &[(CTRL, Key::N)], |state, _| {
            state.layout.start_page_open = !state.layout.start_page_open;
            state.layout.path_field.wants_focus = state.layout.start_page_open;
            state.layout.path_field.selects_all = state.layout.start_page_open;
            state.layout.path_field.tree = None;
        }),
        many(builtin_scenes, open_builtin).within("Open built-in"),
        current(recent_files, |state, index| {
            let path = state.preferences.recent[index].clone();
            state.activity.requests.push(Request::Open(SceneSource::File(path)));
        })
        .within("Open recent"),
        current(scenes_of_file, |state, index| {
            state.model.load_options.scene = Some(index);
        })
        .switch(|state, index| Some(state.model.loaded.as_ref().is_some_and(|scene| scene.shown_scene == index)))
        .within("Scenes of the file"),
        current(forms_of_copies, |state, index| {
            state.model.load_options.instances = FORMS_OF_COPIES[index].0;
        })
        .switch(|state, index| {
            let is_two_level = FORMS_OF_COPIES[index].0 == Instancing::TwoLevel;
            Some(state.model.loaded.as_ref().is_some_and(|scene| scene.copies.is_some() == is_two_level))
        })
        .within("Copies of meshes"),
    ],
    &[
        one(
            Action::OpenTree,
            "Open tree…",
            "Read the tree of this model from a tree file of any builder (docs/tree-file.md)",
            &[(CTRL.plus(SHIFT), Key::O)],
            |state, _| state.activity.requests.push(Request::OpenTreeDialog(state.edited_side())),
        )
        .when(|state, _| state.model.loaded.is_some()),
        current(recent_trees, |state, index| {
            let path = state.preferences.recent_trees[index].clone();
            state.activity.requests.push(Request::OpenTree(state.edited_side(), path));
        })
        .within("Open recent tree")
        .when(|state, _| state.model.loaded.is_some()),
        one(
            Action::BuildTree,
            "Build tree instead",
            "Build the tree with the settings of the panel instead of reading it from its file",
            &[],
            |state, _| state.wanted.set_tree_file(state.edited_side(), None),
        )
        .when(|state, _| state.wanted.tree_file(state.edited_side()).is_some()),
        one(
            Action::SaveTree,
            "Save tree",
            "Save the tree as a tree file beside the model",
            &[(CTRL.plus(SHIFT), Key::S)],
            |state, _| state.activity.requests.push(Request::SaveTree),
        )
        .when(is_presented),
    ],
    &[one(
        Action::Screenshot,
        "Save screenshot",
        "Save the viewport as a PNG beside the model",
        &[(NONE, Key::F12)],
        |state, _| state.activity.requests.push(Request::Screenshot),
    )
    .when(is_presented)],
    &[one(Action::Quit, "Quit", "Close the program; settings are saved", &[(CTRL, Key::Q)], |state, _| {
        state.activity.requests.push(Request::Quit);
    })],
];

fn builtin_scenes() -> Vec<Item> {
    let scenes = BUILTIN_SCENES.iter().enumerate();
    scenes.map(|(i, scene)| item(Action::OpenBuiltin(i), format!("Open {}", scene.label), scene.description)).collect()
}

fn open_builtin(state: &mut AppState, index: usize) {
    let source = SceneSource::Builtin { name: BUILTIN_SCENES[index].name.to_owned(), size: None };
    state.activity.requests.push(Request::Open(source));
}

/// Forms of a scene of copies, with their labels and what they are.
const FORMS_OF_COPIES: [(Instancing, &str, &str); 2] = [
    (
        Instancing::Flat,
        "Copies flat",
        "Load the model with triangles of its own for each copy of a mesh: every view works on it",
    ),
    (Instancing::TwoLevel, "Copies in two levels", "Load the model with each mesh once, and a tree over its copies"),
];

/// The forms to choose from, where meshes have copies.
fn forms_of_copies(state: &AppState) -> Vec<Item> {
    let forms = FORMS_OF_COPIES.map(|(form, label, tip)| item(Action::ShowCopies(form), label, tip));
    if state.model.loaded.as_ref().is_some_and(|scene| scene.repeats_meshes) { forms.into() } else { Vec::new() }
}

/// The scenes to choose from, where there are several.
fn scenes_of_file(state: &AppState) -> Vec<Item> {
    let names = state.model.loaded.iter().flat_map(|scene| scene.scene_names.iter().enumerate());
    let scene = |(index, name): (usize, &String)| {
        let label = if name.is_empty() { format!("Scene {index}") } else { name.clone() };
        item(Action::ShowSceneOfFile(index), label, format!("Show scene {index} of the model's file"))
    };
    Some(names.map(scene).collect()).filter(|scenes: &Vec<Item>| scenes.len() > 1).unwrap_or_default()
}

fn recent_files(state: &AppState) -> Vec<Item> {
    let recent = state.preferences.recent.iter().enumerate();
    recent
        .map(|(i, path)| item(Action::OpenRecent(i), format!("Open {}", file_name(path)), path.display().to_string()))
        .collect()
}

fn recent_trees(state: &AppState) -> Vec<Item> {
    let recent = state.preferences.recent_trees.iter().enumerate();
    recent
        .map(|(i, path)| {
            item(Action::OpenRecentTree(i), format!("Open tree {}", file_name(path)), path.display().to_string())
        })
        .collect()
}
