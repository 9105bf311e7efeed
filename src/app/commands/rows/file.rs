//! Actions of the menu "File".

use egui::Key;

use super::{CTRL, NONE, SHIFT, copy, is_presented};
use crate::app::commands::action::Action;
use crate::app::commands::command_line::command_line;
use crate::app::commands::row::{Item, Row, current, item, many, one};
use crate::app::commands::share::shared_state;
use crate::app::commands::statistics_text::statistics_text;
use crate::app::state::{AppState, Request};
use crate::scene::{BUILTIN_SCENES, SceneSource, format_names};
use crate::text::file_name;

pub(in crate::app::commands) static ROWS: &[&[Row]] = &[
    &[
        many(
            || {
                let tip = format!("Open an {} file", format_names("or"));
                vec![Item { key: Some((CTRL, Key::O)), ..item(Action::Open, "Open…", tip) }]
            },
            |state, _| state.requests.push(Request::OpenDialog),
        ),
        one(Action::Reload, "Reload", "Read the model from its file again", &[(NONE, Key::F5)], |state, _| {
            state.requests.push(Request::Reload);
        }),
        one(Action::StartPage, "Start page", "Show built-in scenes and recent files", &[(CTRL, Key::N)], |state, _| {
            state.layout.start_page_open = !state.layout.start_page_open;
        }),
    ],
    &[
        many(builtin_scenes, open_builtin),
        current(recent_files, |state, index| {
            let path = state.preferences.recent[index].clone();
            state.requests.push(Request::Open(SceneSource::File(path)));
        }),
    ],
    &[
        one(
            Action::OpenTree,
            "Open tree…",
            "Read the tree of this model from a tree file of any builder (docs/tree-file.md)",
            &[(CTRL.plus(SHIFT), Key::O)],
            |state, _| state.requests.push(Request::OpenTreeDialog(state.edited_side())),
        )
        .when(|state, _| state.model.loaded.is_some()),
        current(recent_trees, |state, index| {
            let path = state.preferences.recent_trees[index].clone();
            state.requests.push(Request::OpenTree(state.edited_side(), path));
        })
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
            "Save the tree as a tree file in the current folder",
            &[(CTRL.plus(SHIFT), Key::S)],
            |state, _| state.requests.push(Request::SaveTree),
        )
        .when(is_presented),
    ],
    &[
        one(
            Action::Screenshot,
            "Save screenshot",
            "Save the viewport as a PNG in the current folder",
            &[(NONE, Key::F12)],
            |state, _| state.requests.push(Request::Screenshot),
        )
        .when(is_presented),
        one(
            Action::CopyCommandLine,
            "Copy render command",
            "Copy the command that renders this picture without a window",
            &[(CTRL.plus(SHIFT), Key::L)],
            |state, _| copy(state, Some(command_line(state)), "The render command"),
        ),
        one(
            Action::CopyState,
            "Copy state",
            "Copy everything that this window shows as one line: Ctrl+V over another window, or a terminal, shows the same",
            &[(CTRL, Key::L)],
            |state, _| copy(state, Some(shared_state(state).line()), "The state"),
        ),
        one(
            Action::CopyStatistics,
            "Copy statistics",
            "Copy all numbers of scene, build, tree and trace as text",
            &[(CTRL, Key::I)],
            |state, _| copy(state, statistics_text(state), "All numbers"),
        )
        .when(is_presented),
    ],
    &[one(Action::Quit, "Quit", "Close the program; settings are saved", &[(CTRL, Key::Q)], |state, _| {
        state.requests.push(Request::Quit);
    })],
];

fn builtin_scenes() -> Vec<Item> {
    let scenes = BUILTIN_SCENES.iter().enumerate();
    scenes.map(|(i, scene)| item(Action::OpenBuiltin(i), format!("Open {}", scene.label), scene.description)).collect()
}

fn open_builtin(state: &mut AppState, index: usize) {
    let source = SceneSource::Builtin { name: BUILTIN_SCENES[index].name.to_owned(), size: None };
    state.requests.push(Request::Open(source));
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
