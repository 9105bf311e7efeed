//! The second tree: what its actions do, and when they can be performed.

use std::path::Path;

use crate::app::state::action::CompareStep;
use crate::app::state::{AppState, SecondTree, TreeSide};

/// Performs a step.
pub(super) fn perform(state: &mut AppState, step: CompareStep) {
    let Some(second) = &mut state.wanted.second else {
        if matches!(step, CompareStep::Toggle | CompareStep::NextView) {
            state.wanted.second = Some(SecondTree::new(state.wanted.build));
            copy_file(state);
            // Both are equal until the settings of B change.
            state.layout.edited_tree = TreeSide::B;
        }
        return;
    };
    match step {
        CompareStep::Toggle => {
            state.wanted.second = None;
            state.wanted.tree_files[1] = None;
            state.layout.edited_tree = TreeSide::A;
        }
        CompareStep::EditOther => {
            let edited = &mut state.layout.edited_tree;
            *edited = if *edited == TreeSide::A { TreeSide::B } else { TreeSide::A };
        }
        CompareStep::Copy => {
            second.build = state.wanted.build;
            copy_file(state);
        }
        CompareStep::Swap => {
            std::mem::swap(&mut second.build, &mut state.wanted.build);
            state.wanted.tree_files.swap(0, 1);
        }
        CompareStep::View(view) => second.view = view,
        CompareStep::NextView => second.view = second.view.next(),
        CompareStep::OnlyCommon => second.only_common = !second.only_common,
    }
}

/// Lets the second tree come from where the first one does.
fn copy_file(state: &mut AppState) {
    let file = state.wanted.tree_file(TreeSide::A).map(Path::to_path_buf);
    state.wanted.set_tree_file(TreeSide::B, file);
}

/// The step can be performed now.
pub(super) fn is_enabled(state: &AppState, step: CompareStep) -> bool {
    match step {
        CompareStep::Toggle | CompareStep::NextView => state.model.presented.is_some(),
        CompareStep::Copy | CompareStep::Swap => {
            let [first, other] = &state.wanted.tree_files;
            state.wanted.second.is_some_and(|second| second.build != state.wanted.build) || first != other
        }
        CompareStep::EditOther | CompareStep::View(_) | CompareStep::OnlyCommon => state.wanted.second.is_some(),
    }
}

/// State of a switch or choice; `None` for other steps.
pub(super) fn is_on(state: &AppState, step: CompareStep) -> Option<bool> {
    let second = state.wanted.second;
    match step {
        CompareStep::Toggle => Some(second.is_some()),
        CompareStep::View(view) => Some(second.is_some_and(|second| second.view == view)),
        CompareStep::OnlyCommon => Some(second.is_some_and(|second| second.only_common)),
        CompareStep::EditOther | CompareStep::Copy | CompareStep::Swap | CompareStep::NextView => None,
    }
}
