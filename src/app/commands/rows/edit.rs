//! Actions of the menu "Edit".

use bvhscope_engine::settings::BuildSettings;
use egui::Key;

use crate::app::commands::clipboard::{node_text, shared_state, statistics_text};
use crate::app::commands::command_line::command_line;
use crate::app::commands::nodes;
use crate::app::commands::row::{ALT, CTRL, NONE, Row, SHIFT, copy, flip, is_presented, one};
use crate::app::state::action::Action;
use crate::app::state::{AppState, Request};
use crate::overlay::OverlaySettings;
use crate::render::RenderSettings;
use crate::scene::CopyRanges;

pub(in crate::app::commands) static ROWS: &[&[Row]] = &[
    &[
        one(Action::Undo, "Undo", "Undo the last change of settings or hidden nodes", &[(CTRL, Key::Z)], |state, _| {
            state.undo();
        })
        .when(|state, _| state.undo.can_undo())
        .repeated(),
        one(
            Action::Redo,
            "Redo",
            "Redo the change that was undone last",
            &[(CTRL.plus(SHIFT), Key::Z), (CTRL, Key::Y)],
            |state, _| {
                state.redo();
            },
        )
        .when(|state, _| state.undo.can_redo())
        .repeated(),
        one(
            Action::ResetSettings,
            "Reset all settings",
            "Reset tree, containers and picture to their defaults",
            &[],
            |state, _| reset(state),
        ),
    ],
    WALKING,
    HIDING,
    UNFOLDING,
    &[
        one(
            Action::CopyCommandLine,
            "Copy render command",
            "Copy the command that renders this picture without a window",
            &[(CTRL.plus(SHIFT), Key::L)],
            |state, _| copy(state, Some(command_line(state)), "the render command"),
        ),
        one(
            Action::CopyState,
            "Copy state",
            "Copy everything that this window shows as one line: Ctrl+V over another window, or a terminal, shows the same",
            &[(CTRL, Key::L)],
            |state, _| copy(state, Some(shared_state(state).line()), "the state"),
        ),
        one(
            Action::CopyStatistics,
            "Copy statistics",
            "Copy all numbers of scene, build, tree and trace as text",
            &[(CTRL, Key::I)],
            |state, _| copy(state, statistics_text(state), "all numbers"),
        )
        .when(is_presented),
        one(Action::CopyNode, "Copy node", "Copy the numbers of the selected node as text", &[], |state, _| {
            copy(state, node_text(state), "the node");
        })
        .when(|state, _| state.selected().is_some()),
    ],
    &[one(
        Action::Cancel,
        "Cancel",
        "Cancel the running job, or clear the selection if none runs",
        &[(NONE, Key::Escape)],
        |state, _| cancel(state),
    )
    .when(|state, _| {
        state.activity.has_jobs()
            || state.selection.is_some()
            || state.selection.nodes.isolated.is_some()
            || state.selection.nodes.only.is_some()
    })],
];

const WALKING: &[Row] = &[
    one(
        Action::GoTo,
        "Go to node or triangle",
        "Select and frame the node or triangle of a number that you type",
        &[(CTRL, Key::G)],
        |state, _| state.layout.toggle_go_to(),
    )
    .when(is_presented),
    one(Action::SelectParent, "Select parent", "Walk up from the selected node", &[(ALT, Key::ArrowUp)], |state, _| {
        nodes::select(state, nodes::parent);
    })
    .when(|state, _| nodes::parent(state).is_some())
    .repeated()
    .within("Select"),
    one(
        Action::SelectChild,
        "Select child",
        "Walk down to the first child, or select the root where nothing is selected",
        &[(ALT, Key::ArrowDown)],
        |state, _| nodes::select(state, nodes::first_child),
    )
    .when(|state, _| nodes::first_child(state).is_some())
    .repeated()
    .within("Select"),
    one(
        Action::SelectSecondChild,
        "Select second child",
        "Walk down to the second child",
        &[(ALT.plus(SHIFT), Key::ArrowDown)],
        |state, _| nodes::select(state, nodes::second_child),
    )
    .when(|state, _| nodes::second_child(state).is_some())
    .repeated()
    .within("Select"),
    one(
        Action::SelectNextSibling,
        "Select next sibling",
        "Walk to the next child of the same parent, from the last to the first",
        &[(ALT, Key::ArrowRight)],
        |state, _| nodes::select(state, |state| nodes::sibling(state, 1)),
    )
    .when(|state, _| nodes::sibling(state, 1).is_some())
    .repeated()
    .within("Select"),
    one(
        Action::SelectPreviousSibling,
        "Select previous sibling",
        "Walk to the previous child of the same parent, from the first to the last",
        &[(ALT, Key::ArrowLeft)],
        |state, _| nodes::select(state, |state| nodes::sibling(state, -1)),
    )
    .when(|state, _| nodes::sibling(state, -1).is_some())
    .repeated()
    .within("Select"),
];

const HIDING: &[Row] = &[
    one(
        Action::HideSelected,
        "Hide selected",
        "Leave out the selected node, everything below it and its triangles",
        &[(NONE, Key::H)],
        |state, _| nodes::hide_selected(state),
    )
    .when(is_selected),
    one(
        Action::IsolateSelected,
        "Isolate selected",
        "Leave out everything but the selected node and what is below it",
        &[(NONE, Key::I), (SHIFT, Key::H)],
        |state, _| nodes::isolate_selected(state),
    )
    .when(is_selected),
    one(Action::ShowAll, "Show all", "Show all hidden nodes again", &[(ALT, Key::H)], |state, _| {
        state.selection.show_all();
    })
    .when(|state, _| state.selection.nodes.hides_any() || !state.selection.hidden.is_empty()),
    one(
        Action::ToggleHideTriangles,
        "Hide with triangles",
        "Hiding a node also leaves its triangles out of the picture",
        &[],
        |state, _| flip(&mut state.wanted.overlay.hide_triangles),
    )
    .switch(|state, _| Some(state.wanted.overlay.hide_triangles)),
];

const UNFOLDING: &[Row] = &[
    one(
        Action::ToggleUnfolded,
        "Unfold or fold copies",
        "Let the tree go on in the meshes of the copies below the selected node, or end at these copies",
        &[(ALT, Key::U)],
        |state, _| nodes::toggle_unfolded(state),
    )
    .when(|state, _| state.selected().is_some_and(|(shown, _)| shown.accel.scene.copies.is_some())),
    one(
        Action::UnfoldAll,
        "Unfold all copies",
        "Let the tree go on in the meshes of all copies, where memory suffices",
        &[],
        |state, _| nodes::unfold_all(state),
    )
    .when(|state, _| state.model.presented.as_ref().is_some_and(|shown| shown.accel.scene.copies.is_some())),
    one(
        Action::FoldAll,
        "Fold all copies",
        "Let the tree end at the copies",
        &[(ALT.plus(SHIFT), Key::U)],
        |state, _| {
            nodes::unfold(state, CopyRanges::default());
        },
    )
    .when(|state, _| !state.wanted.unfolded.is_empty()),
];

fn is_selected(state: &AppState, _: usize) -> bool {
    state.selection.nodes.selected.is_some()
}

/// Resets all that undo restores, apart from hidden nodes.
fn reset(state: &mut AppState) {
    let wanted = &mut state.wanted;
    wanted.build = BuildSettings::default();
    wanted.threads = 0;
    wanted.render = RenderSettings::default();
    wanted.overlay = OverlaySettings::default();
    wanted.second = None;
    wanted.tree_files = [None, None];
    wanted.ray_file = None;
}

/// Closes open dialogs, else cancels running jobs, else clears the selection. Refinement of the picture is cancelled last, because
/// it runs after every change.
fn cancel(state: &mut AppState) {
    if state.layout.palette.take().is_some() || state.layout.node_menu.take().is_some() {
        return;
    }
    if state.layout.has_dialog() {
        state.layout.close_dialogs();
    } else if state.layout.tour.is_some() {
        state.end_tour();
    } else if state.activity.load.is_some() || state.activity.build.is_some() {
        state.activity.requests.push(Request::CancelJobs);
    } else if state.activity.measure.is_some() {
        state.activity.requests.push(Request::CancelMeasuring);
    } else if state.activity.study.is_some() {
        state.activity.stop_study = true;
    } else if state.selection.is_some() {
        state.selection.clear();
    } else if state.selection.nodes.isolated.is_some() || state.selection.nodes.only.is_some() {
        state.selection.nodes.isolated = None;
        state.selection.nodes.only = None;
    } else if state.activity.render.is_some() {
        state.activity.requests.push(Request::CancelJobs);
    }
}
