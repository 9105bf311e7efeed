//! Actions of the menu "Tree", and what those of the second tree do.

use std::path::Path;

use egui::Key;

use crate::app::commands::row::{CTRL, Item, NONE, Row, flip, item, many, one};
use crate::app::format;
use crate::app::state::action::{Action, CompareStep};
use crate::app::state::{AppState, CompareView, SecondTree, TreeSide};
use crate::catalog::settings::{self, BUILDER, CONTAINER, Choice, OPTIMIZE, PRESET, Setting, THRESHOLD, Value};
use crate::overlay::ColorBy;
use bvhscope_engine::settings::{BuilderKind, Pass, Preset};
use bvhscope_engine::tree::ContainerKind;

pub(in crate::app::commands) static ROWS: &[&[Row]] = &[
    &[
        many(presets, |state, index| set_value(state, &PRESET, index))
            .switch(|state, index| Some(is_value(state, &PRESET, index)))
            .within("Preset"),
        many(builders, |state, index| set_value(state, &BUILDER, index))
            .when(|state, index| can_set(state, &BUILDER, index))
            .switch(|state, index| Some(is_value(state, &BUILDER, index)))
            .within("Builder"),
        many(containers, |state, index| set_value(state, &CONTAINER, index))
            .when(|state, index| can_set(state, &CONTAINER, index))
            .switch(|state, index| Some(is_value(state, &CONTAINER, index)))
            .within("Container"),
        many(passes, set_pass)
            .when(|state, index| refused_pass(state, index).is_none())
            .switch(|state, index| Some(state.edited_build().optimize.contains(Pass::ALL[index])))
            .within("Passes"),
        one(
            Action::RaiseThreshold,
            "Raise threshold",
            "AAC: a slower build and a better tree",
            &[(NONE, Key::CloseBracket)],
            |state, _| step_threshold(state, 1),
        )
        .when(has_threshold)
        .because("This builder has no threshold")
        .repeated(),
        one(
            Action::LowerThreshold,
            "Lower threshold",
            "AAC: a faster build and a worse tree",
            &[(NONE, Key::OpenBracket)],
            |state, _| step_threshold(state, -1),
        )
        .when(has_threshold)
        .because("This builder has no threshold")
        .repeated(),
    ],
    &[many(comparisons, |state, index| compare(state, COMPARISONS[index]))
        .when(|state, index| can_compare(state, COMPARISONS[index]))
        .switch(|state, index| is_compared(state, COMPARISONS[index]))
        .within("Two trees")],
    DRAWN,
];

const DRAWN: &[Row] = &[
    many(kinds, |state, index| {
        let (kind, kinds) = (ContainerKind::WITH_ORIENTED[index], state.wanted.overlay.kinds(state.container_kind()));
        let flipped = if kinds.contains(kind) { kinds.without(kind) } else { kinds.with(kind) };
        state.wanted.overlay = state.wanted.overlay.with_kinds(flipped);
    })
    .switch(|state, index| {
        Some(state.wanted.overlay.kinds(state.container_kind()).contains(ContainerKind::WITH_ORIENTED[index]))
    })
    .within("Show"),
    many(colors, |state, index| state.wanted.overlay.color_by = ColorBy::ALL[index])
        .switch(|state, index| Some(state.wanted.overlay.color_by == ColorBy::ALL[index]))
        .within("Colour by"),
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
        "Show the levels that together hold 100 to 200 containers, in every tree; of leaves alone, the largest in view",
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
        |state, _| flip(&mut state.model.curve.shown),
    )
    .switch(|state, _| Some(state.model.curve.shown)),
];

fn presets() -> Vec<Item> {
    values(&PRESET, &Preset::ALL.map(Action::Preset))
}

fn builders() -> Vec<Item> {
    values(&BUILDER, &BuilderKind::ALL.map(Action::Builder))
}

fn containers() -> Vec<Item> {
    values(&CONTAINER, &ContainerKind::ALL.map(Action::Container))
}

fn passes() -> Vec<Item> {
    let Value::Any { options, .. } = &OPTIMIZE.value else { return Vec::new() };
    let pass = |(pass, option): (Pass, Choice)| item(Action::Pass(pass), format!("Pass: {}", option.label), option.tip);
    Pass::ALL.into_iter().zip(options()).map(pass).collect()
}

fn set_pass(state: &mut AppState, index: usize) {
    if let Value::Any { get, set, .. } = &OPTIMIZE.value {
        let build = state.edited_build_mut();
        set(build, index, !get(build, index));
    }
}

/// Why a pass would have no effect.
fn refused_pass(state: &AppState, index: usize) -> Option<&'static str> {
    let Value::Any { refusal, .. } = &OPTIMIZE.value else { return None };
    refusal(state.edited_build(), index)
}

fn kinds() -> Vec<Item> {
    let kind = |kind: ContainerKind| {
        let tip = format!("Draw the {} around nodes, whatever the tree is built of", kind.plural());
        item(Action::ShowKind(kind), format!("Show {}", kind.plural()), tip)
    };
    ContainerKind::WITH_ORIENTED.map(kind).into()
}

fn colors() -> Vec<Item> {
    let color = |by: ColorBy| {
        let label = format!("Colour by {}", format::lower(by.label()));
        item(Action::ColorBy(by), label, "Choose what the colour of a container means; the legend has the numbers")
    };
    ColorBy::ALL.map(color).into()
}

/// One action for each named value of a setting.
fn values(setting: &Setting, actions: &[Action]) -> Vec<Item> {
    let Value::One { options, .. } = &setting.value else { return Vec::new() };
    let value =
        |(&action, option): (&Action, Choice)| item(action, format!("{}: {}", setting.label, option.label), option.tip);
    actions.iter().zip(options()).map(value).collect()
}

fn set_value(state: &mut AppState, setting: &Setting, index: usize) {
    if let Value::One { set, .. } = &setting.value {
        set(state.edited_build_mut(), index);
    }
}

/// A tree of the model can be built with this value.
fn can_set(state: &AppState, setting: &Setting, index: usize) -> bool {
    let Value::One { set, .. } = &setting.value else { return false };
    let mut build = *state.edited_build();
    set(&mut build, index);
    build.refusal(state.model.loaded.as_ref().map_or(0, |scene| scene.triangles.len())).is_none()
}

/// The tree is built, not read from a file, with this value.
fn is_value(state: &AppState, setting: &Setting, index: usize) -> bool {
    let Value::One { get, .. } = &setting.value else { return false };
    state.wanted.tree_file(state.edited_side()).is_none() && get(state.edited_build()) == Some(index)
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

/// Only AAC has a threshold.
fn has_threshold(state: &AppState, _: usize) -> bool {
    (THRESHOLD.applies)(state.edited_build())
}

/// Changes the threshold by `step` within its limits.
fn step_threshold(state: &mut AppState, step: i32) {
    let build = state.edited_build_mut();
    build.threshold = build.threshold.saturating_add_signed(step);
    settings::limit(build);
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

/// Performs a step.
pub(super) fn compare(state: &mut AppState, step: CompareStep) {
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
pub(super) fn can_compare(state: &AppState, step: CompareStep) -> bool {
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
pub(super) fn is_compared(state: &AppState, step: CompareStep) -> Option<bool> {
    let second = state.wanted.second;
    match step {
        CompareStep::Toggle => Some(second.is_some()),
        CompareStep::View(view) => Some(second.is_some_and(|second| second.view == view)),
        CompareStep::OnlyCommon => Some(second.is_some_and(|second| second.only_common)),
        CompareStep::EditOther | CompareStep::Copy | CompareStep::Swap | CompareStep::NextView => None,
    }
}
