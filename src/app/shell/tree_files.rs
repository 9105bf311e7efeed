//! Opening and saving trees as files.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::Sender;

use crate::accel::Accel;
use crate::app::state::{AppState, SecondTree, Severity, TreeSide, preferences};
use crate::app::viewport::screenshot::Outcome;
use crate::budget::Budget;
use crate::export::{cannot_be_written, first_writable, write_new_with};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::tree_file::write_tree;

/// Wants a tree of the present model to be read from `path`; a second tree is added where that one is to be read.
pub(crate) fn open_tree(side: TreeSide, path: PathBuf, state: &mut AppState) {
    let path = std::path::absolute(&path).unwrap_or(path);
    if state.model.loaded.is_none() {
        let text = "Open the model first, then its tree";
        state.messages.notify(Severity::Warning, text);
        return;
    }
    preferences::remember_file(&mut state.preferences.recent_trees, path.clone());
    if side == TreeSide::B && state.wanted.second.is_none() {
        state.wanted.second = Some(SecondTree::new(state.wanted.build));
    }
    state.layout.start_page_open = false;
    state.wanted.set_tree_file(side, Some(path));
}

/// Saves the presented tree beside the model, on a thread of its own.
pub(crate) fn save_tree(saved: Sender<Outcome>, wake: Arc<dyn Fn() + Send + Sync>, state: &mut AppState) {
    let Some(shown) = state.shown_tree(state.edited_side()) else {
        state.messages.notify(Severity::Warning, "There is no tree to save yet");
        return;
    };
    let accel = Arc::clone(&shown.accel);
    let folders = state.wanted.save_folders();
    let thread = std::thread::Builder::new().name("save tree".to_owned()).spawn(move || {
        let outcome = write(&accel, &first_writable(&folders))
            .map(|path| (path, None))
            .map_err(|error| format!("The tree was not saved: {error}"));
        // Sending fails where the window has been closed.
        let _ = saved.send(outcome);
        wake();
    });
    if let Err(error) = thread {
        state.messages.notify(Severity::Error, format!("The tree could not be saved: {error}"));
    }
}

fn write(accel: &Accel, folder: &Path) -> Result<PathBuf, String> {
    // Arrays are made whole before they are written.
    Budget::of_process().check("the file", accel.tree.bytes() as u64).map_err(|error| error.to_string())?;
    let label = accel.scene.source.label();
    let name =
        std::path::Path::new(&label).file_stem().map_or_else(|| label.clone(), |stem| stem.to_string_lossy().into());
    let stem = format!("{name}-{}", accel.builder_name());
    let token = CancelToken::new();
    let write = |mut writer: &mut dyn std::io::Write| {
        write_tree(&accel.tree, &accel.file_header(false), None, &mut writer, &token)
            .map_err(|error| cannot_be_written(&error))
    };
    write_new_with(folder, &stem, "bvh", write).map_err(|error| error.to_string())
}
