//! Actions of the menu "Tree".

use bvhscope_engine::settings::{BuildSettings, BuilderKind, Preset};
use bvhscope_engine::tree::ContainerKind;
use egui::Key;

use super::{ALT, CTRL, NONE, SHIFT, copy, flip};
use crate::app::commands::action::{Action, CompareStep};
use crate::app::commands::row::{Item, Row, item, many, one};
use crate::app::commands::statistics_text::node_text;
use crate::app::commands::{compare, nodes};
use crate::app::state::{AppState, CompareView, Request};
use crate::overlay::OverlaySettings;
use crate::render::RenderSettings;

pub(in crate::app::commands) static ROWS: &[&[Row]] = &[
    &[many(presets, |state, index| {
        let build = state.edited_build_mut();
        *build = BuildSettings::preset(Preset::ALL[index], build.container);
    })
    .switch(|state, index| Some(is_preset(state, Preset::ALL[index])))],
    &[many(builders, |state, index| state.edited_build_mut().builder = BuilderKind::ALL[index])
        .when(|state, index| {
            let build = BuildSettings { builder: BuilderKind::ALL[index], ..*state.edited_build() };
            build.refusal(state.model.loaded.as_ref().map_or(0, |scene| scene.triangles.len())).is_none()
        })
        .switch(|state, index| Some(is_built(state) && state.edited_build().builder == BuilderKind::ALL[index]))],
    &[
        many(containers, |state, index| state.edited_build_mut().container = ContainerKind::ALL[index])
            .when(|state, index| {
                BuildSettings { container: ContainerKind::ALL[index], ..*state.edited_build() }.refusal(0).is_none()
            })
            .switch(|state, index| {
                Some(is_built(state) && state.edited_build().container == ContainerKind::ALL[index])
            }),
        one(
            Action::RaiseThreshold,
            "Raise threshold",
            "AAC: a slower build and a better tree",
            &[(NONE, Key::CloseBracket)],
            |state, _| step_threshold(state, 1),
        )
        .when(has_threshold)
        .repeated(),
        one(
            Action::LowerThreshold,
            "Lower threshold",
            "AAC: a faster build and a worse tree",
            &[(NONE, Key::OpenBracket)],
            |state, _| step_threshold(state, -1),
        )
        .when(has_threshold)
        .repeated(),
    ],
    &[many(comparisons, |state, index| compare::perform(state, COMPARISONS[index]))
        .when(|state, index| compare::is_enabled(state, COMPARISONS[index]))
        .switch(|state, index| compare::is_on(state, COMPARISONS[index]))],
    DRAWN,
    WALKING,
    HIDING,
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
    &[one(
        Action::Cancel,
        "Cancel",
        "Cancel the running job, or clear the selection if none runs",
        &[(NONE, Key::Escape)],
        |state, _| cancel(state),
    )
    .when(|state, _| {
        state.activity.has_jobs()
            || state.lab.job().is_some()
            || state.selection.is_some()
            || state.selection.nodes.isolated.is_some()
            || state.selection.nodes.only.is_some()
    })],
];

const DRAWN: &[Row] = &[
    one(Action::Deeper, "Deeper", "Show containers one level further down", &[(NONE, Key::Period)], |state, _| {
        step_depth(state, 1);
    })
    .repeated(),
    one(Action::Shallower, "Shallower", "Show containers one level further up", &[(NONE, Key::Comma)], |state, _| {
        step_depth(state, -1);
    })
    .repeated(),
    one(
        Action::AutomaticDepths,
        "Automatic depth range",
        "Show the levels that together hold 100 to 200 containers, in every tree",
        &[(CTRL, Key::Period)],
        |state, _| state.wanted.overlay.depth = None,
    )
    .switch(|state, _| Some(state.wanted.overlay.depth.is_none())),
    one(Action::ToggleLeavesOnly, "Leaves only", "Draw only the leaves within the chosen depths", &[], |state, _| {
        flip(&mut state.wanted.overlay.leaves_only);
    })
    .switch(|state, _| Some(state.wanted.overlay.leaves_only)),
    one(Action::ToggleParents, "Parents", "Also draw all levels above the chosen depths", &[], |state, _| {
        flip(&mut state.wanted.overlay.parents);
    })
    .switch(|state, _| Some(state.wanted.overlay.parents)),
    one(Action::ToggleFaces, "Faces", "Fill the sides of containers that face the viewer, faintly", &[], |state, _| {
        flip(&mut state.wanted.overlay.faces);
    })
    .switch(|state, _| Some(state.wanted.overlay.faces)),
    one(
        Action::ToggleOverlap,
        "Overlap of the children",
        "Fill what the children of the selected node have in common, seen through the surface",
        &[],
        |state, _| flip(&mut state.wanted.overlay.overlap),
    )
    .switch(|state, _| Some(state.wanted.overlay.overlap)),
    one(
        Action::ToggleCurve,
        "Space-filling curve",
        "Draw the curve along which the triangles are sorted, and the cells at which they are split",
        &[],
        |state, _| flip(&mut state.lab.curve.shown),
    )
    .switch(|state, _| Some(state.lab.curve.shown)),
];

const WALKING: &[Row] = &[
    one(Action::SelectParent, "Select parent", "Walk up from the selected node", &[(ALT, Key::ArrowUp)], |state, _| {
        nodes::select(state, nodes::parent);
    })
    .when(|state, _| nodes::parent(state).is_some())
    .repeated(),
    one(
        Action::SelectChild,
        "Select child",
        "Walk down to the first child, or select the root where nothing is selected",
        &[(ALT, Key::ArrowDown)],
        |state, _| nodes::select(state, nodes::first_child),
    )
    .when(|state, _| nodes::first_child(state).is_some())
    .repeated(),
    one(
        Action::SelectSecondChild,
        "Select second child",
        "Walk down to the second child",
        &[(ALT.plus(SHIFT), Key::ArrowDown)],
        |state, _| nodes::select(state, nodes::second_child),
    )
    .when(|state, _| nodes::second_child(state).is_some())
    .repeated(),
    one(
        Action::SelectNextSibling,
        "Select next sibling",
        "Walk to the next child of the same parent, from the last to the first",
        &[(ALT, Key::ArrowRight)],
        |state, _| nodes::select(state, |state| nodes::sibling(state, 1)),
    )
    .when(|state, _| nodes::sibling(state, 1).is_some())
    .repeated(),
    one(
        Action::SelectPreviousSibling,
        "Select previous sibling",
        "Walk to the previous child of the same parent, from the first to the last",
        &[(ALT, Key::ArrowLeft)],
        |state, _| nodes::select(state, |state| nodes::sibling(state, -1)),
    )
    .when(|state, _| nodes::sibling(state, -1).is_some())
    .repeated(),
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
    one(Action::CopyNode, "Copy node", "Copy the numbers of the selected node as text", &[], |state, _| {
        copy(state, node_text(state), "The node");
    })
    .when(|state, _| state.selected().is_some()),
];

fn presets() -> Vec<Item> {
    let preset = |preset: Preset| {
        let (threshold, epsilon) = preset.parameters();
        let passes = match preset {
            Preset::Fast | Preset::Hq | Preset::AacFast | Preset::AacHq => "",
            Preset::Best => ", then collapse, restructure and reinsert",
            Preset::Finest => ", and every pass: takes minutes",
        };
        let tip = format!("Threshold {threshold}, ε {epsilon}{passes}");
        item(Action::Preset(preset), format!("Preset: {}", preset.label()), tip)
    };
    Preset::ALL.map(preset).into()
}

fn builders() -> Vec<Item> {
    let builder = |kind: BuilderKind| {
        item(Action::Builder(kind), format!("Builder: {}", kind.label()), builder_description(kind))
    };
    BuilderKind::ALL.map(builder).into()
}

/// Description of a builder.
pub(in crate::app) fn builder_description(builder: BuilderKind) -> &'static str {
    match builder {
        BuilderKind::Aac => "Approximate agglomerative clustering (Gu et al. 2013)",
        BuilderKind::Lbvh => "Median split by Morton code (Lauterbach et al. 2009): fastest build, worst tree",
        BuilderKind::BinnedSah => "Top-down splits by the surface area heuristic (Wald 2007), boxes only",
        BuilderKind::Exact => "Always merges the closest pair (Walter et al. 2008); small scenes only",
        BuilderKind::None => "No tree: every ray tests every triangle",
    }
}

fn containers() -> Vec<Item> {
    let container = |kind: ContainerKind| {
        let tip = match kind {
            ContainerKind::Aabb => "Build and trace the tree with axis-aligned boxes",
            ContainerKind::Sphere => "Build and trace the tree with spheres",
        };
        item(Action::Container(kind), format!("Container: {}", kind.label()), tip)
    };
    ContainerKind::ALL.map(container).into()
}

/// Actions on the second tree, in the order of the menu.
const COMPARISONS: [CompareStep; 10] = [
    CompareStep::Toggle,
    CompareStep::NextView,
    CompareStep::View(CompareView::A),
    CompareStep::View(CompareView::B),
    CompareStep::View(CompareView::Split),
    CompareStep::View(CompareView::Difference),
    CompareStep::EditOther,
    CompareStep::Copy,
    CompareStep::Swap,
    CompareStep::OnlyCommon,
];

fn comparisons() -> Vec<Item> {
    let step = |step| {
        let (label, tip, key) = match step {
            CompareStep::Toggle => (
                "Second tree",
                "Compare this tree with a second one, B, at the same camera, or remove that one again",
                Some((CTRL, Key::Num2)),
            ),
            CompareStep::NextView => (
                "Next view of two trees",
                "Go from A to B, both side by side, and the difference of their tests",
                Some((NONE, Key::Num2)),
            ),
            CompareStep::View(view) => {
                let label = format!("Show: {}", view.label());
                return item(Action::Compare(step), label, compare_description(view));
            }
            CompareStep::EditOther => (
                "Edit the other tree",
                "Let the panel and the keys change the settings of the other of the two trees",
                Some((NONE, Key::Num4)),
            ),
            CompareStep::Copy => ("Copy A to B", "Give tree B the settings of tree A", None),
            CompareStep::Swap => ("Swap A and B", "Exchange the settings of the two trees", None),
            CompareStep::OnlyCommon => (
                "Only common containers",
                "Draw only the containers that both trees have: those with the same triangles",
                None,
            ),
        };
        Item { key, ..item(Action::Compare(step), label, tip) }
    };
    COMPARISONS.map(step).into()
}

/// One sentence about a view of two trees.
pub(in crate::app) const fn compare_description(view: CompareView) -> &'static str {
    match view {
        CompareView::A => "The picture and the containers of tree A",
        CompareView::B => "The picture and the containers of tree B",
        CompareView::Split => "Tree A left of the seam, tree B right of it: drag the seam",
        CompareView::Difference => {
            "Tests of B minus tests of A in each pixel: blue where B takes fewer, orange where it takes more"
        }
    }
}

/// Whether the tree whose settings are shown is built, not read from a file.
fn is_built(state: &AppState) -> bool {
    state.wanted.tree_file(state.edited_side()).is_none()
}

/// Whether builder, threshold, ε, curve, passes and rounds are those of `preset`.
pub(in crate::app) fn is_preset(state: &AppState, preset: Preset) -> bool {
    let build = state.edited_build();
    let mut named = BuildSettings::preset(preset, build.container);
    if !preset.is_slow() {
        named.rounds = build.rounds;
    }
    is_built(state) && *build == named
}

/// Only AAC has a threshold.
fn has_threshold(state: &AppState, _: usize) -> bool {
    state.edited_build().builder == BuilderKind::Aac
}

/// Changes the threshold by `step` within its limits.
fn step_threshold(state: &mut AppState, step: i32) {
    let build = state.edited_build_mut();
    build.threshold =
        build.threshold.saturating_add_signed(step).clamp(BuildSettings::MIN_THRESHOLD, BuildSettings::MAX_THRESHOLD);
}

/// Moves the range of drawn depths by `step` within the tree, keeping its length.
fn step_depth(state: &mut AppState, step: i32) {
    let max_depth = state.model.presented.as_ref().map_or(64, |shown| shown.accel.tree.max_depth());
    let [from, to] = state.drawn_depths();
    let fits = if step > 0 { to < max_depth } else { from > 0 };
    if fits {
        state.wanted.overlay.depth = Some([from.saturating_add_signed(step), to.saturating_add_signed(step)]);
    }
}

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
}

/// Closes open dialogs, else cancels running jobs, else clears the selection. Refinement of the picture is cancelled last, because
/// it runs after every change.
fn cancel(state: &mut AppState) {
    if state.layout.palette.take().is_some() || state.layout.node_menu.take().is_some() {
        return;
    }
    if state.layout.has_dialog() {
        state.layout.close_dialogs();
    } else if state.layout.tour.take().is_some() {
        // Shown once more from the menu only.
    } else if state.activity.load.is_some() || state.activity.build.is_some() {
        state.requests.push(Request::CancelJobs);
    } else if state.activity.measure.is_some() {
        state.requests.push(Request::CancelMeasuring);
    } else if state.lab.job().is_some() {
        state.lab.stop();
    } else if state.selection.is_some() {
        state.selection.clear();
    } else if state.selection.nodes.isolated.is_some() || state.selection.nodes.only.is_some() {
        state.selection.nodes.isolated = None;
        state.selection.nodes.only = None;
    } else if state.activity.render.is_some() {
        state.requests.push(Request::CancelJobs);
    }
}
