//! Entries of the menu "File".

use egui::Key;

use super::list::{CTRL, List, NONE, SHIFT};
use crate::app::commands::action::Action;
use crate::app::commands::entry::Category;
use crate::scene::{BUILTIN_SCENES, format_names};

/// Adds the entries of the menu.
pub(super) fn add(list: &mut List) {
    let place = |group| (Category::File, group);
    let description = format!("Open an {} file", format_names("or"));
    list.add(place(0), Action::Open, "Open…", &description, &[(CTRL, Key::O)]);
    list.add(place(0), Action::Reload, "Reload", "Read the model from its file again", &[(NONE, Key::F5)]);
    list.add(place(0), Action::StartPage, "Start page", "Show built-in scenes and recent files", &[(CTRL, Key::N)]);
    for (index, scene) in BUILTIN_SCENES.iter().enumerate() {
        list.add(place(1), Action::OpenBuiltin(index), &format!("Open {}", scene.label), scene.description, &[]);
    }
    list.add(
        place(3),
        Action::OpenTree,
        "Open tree…",
        "Read the tree of this model from a tree file of any builder (docs/tree-file.md)",
        &[(CTRL | SHIFT, Key::O)],
    );
    list.add(
        place(3),
        Action::BuildTree,
        "Build tree instead",
        "Build the tree with the settings of the panel instead of reading it from its file",
        &[],
    );
    list.add(
        place(3),
        Action::SaveTree,
        "Save tree",
        "Save the tree as a tree file in the current folder",
        &[(CTRL | SHIFT, Key::S)],
    );
    list.add(
        place(4),
        Action::Screenshot,
        "Save screenshot",
        "Save the viewport as a PNG in the current folder",
        &[(NONE, Key::F12)],
    );
    list.add(
        place(4),
        Action::CopyCommandLine,
        "Copy render command",
        "Copy the command that renders this picture without a window",
        &[(CTRL | SHIFT, Key::L)],
    );
    list.add(
        place(4),
        Action::CopyState,
        "Copy state",
        "Copy everything that this window shows as one line: Ctrl+V over another window, or a terminal, shows the same",
        &[(CTRL, Key::L)],
    );
    list.add(
        place(4),
        Action::CopyStatistics,
        "Copy statistics",
        "Copy all numbers of scene, build, tree and trace as text",
        &[(CTRL, Key::I)],
    );
    list.add(place(5), Action::Quit, "Quit", "Close the program; settings are saved", &[(CTRL, Key::Q)]);
}
