//! Entries of the menu "Tree".

use bvhscope_engine::settings::{BuilderKind, Preset};
use bvhscope_engine::tree::ContainerKind;
use egui::{Key, Modifiers};

use super::list::{ALT, CTRL, List, NONE};
use crate::app::commands::action::{Action, CompareStep};
use crate::app::commands::descriptions::{builder_description, compare_description};
use crate::app::commands::entry::Category;
use crate::app::state::CompareView;

/// Adds the entries of the menu.
pub(super) fn add(list: &mut List) {
    let place = |group| (Category::Tree, group);
    for preset in Preset::ALL {
        let (threshold, epsilon) = preset.parameters();
        let label = format!("Preset: {}", preset.label());
        let passes = match preset {
            Preset::Fast | Preset::Hq | Preset::AacFast | Preset::AacHq => "",
            Preset::Best => ", then collapse, restructure and reinsert",
            Preset::Finest => ", and every pass: takes minutes",
        };
        let description = format!("Threshold {threshold}, ε {epsilon}{passes}");
        list.add(place(0), Action::Preset(preset), &label, &description, &[]);
    }
    for builder in BuilderKind::ALL {
        let label = format!("Builder: {}", builder.label());
        list.add(place(1), Action::Builder(builder), &label, builder_description(builder), &[]);
    }
    for container in ContainerKind::ALL {
        let label = format!("Container: {}", container.label());
        let description = match container {
            ContainerKind::Aabb => "Build and trace the tree with axis-aligned boxes",
            ContainerKind::Sphere => "Build and trace the tree with spheres",
        };
        list.add(place(2), Action::Container(container), &label, description, &[]);
    }
    list.add(
        place(2),
        Action::RaiseThreshold,
        "Raise threshold",
        "AAC: a slower build and a better tree",
        &[(NONE, Key::CloseBracket)],
    );
    list.add(
        place(2),
        Action::LowerThreshold,
        "Lower threshold",
        "AAC: a faster build and a worse tree",
        &[(NONE, Key::OpenBracket)],
    );
    comparing(list);
    list.add(place(3), Action::Deeper, "Deeper", "Show containers one level further down", &[(NONE, Key::Period)]);
    list.add(place(3), Action::Shallower, "Shallower", "Show containers one level further up", &[(NONE, Key::Comma)]);
    list.add(
        place(3),
        Action::AutomaticDepths,
        "Automatic depth range",
        "Show the levels that together hold 100 to 200 containers, in every tree",
        &[(CTRL, Key::Period)],
    );
    list.add(place(3), Action::ToggleLeavesOnly, "Leaves only", "Draw only the leaves within the chosen depths", &[]);
    list.add(place(3), Action::ToggleParents, "Parents", "Also draw all levels above the chosen depths", &[]);
    list.add(place(3), Action::ToggleFaces, "Faces", "Fill the sides of containers that face the viewer, faintly", &[]);
    list.add(
        place(3),
        Action::ToggleOverlap,
        "Overlap of the children",
        "Fill what the children of the selected node have in common, seen through the surface",
        &[],
    );
    list.add(place(4), Action::SelectParent, "Select parent", "Walk up from the selected node", &[(ALT, Key::ArrowUp)]);
    list.add(
        place(3),
        Action::ToggleCurve,
        "Space-filling curve",
        "Draw the curve along which the triangles are sorted, and the cells at which they are split",
        &[],
    );
    list.add(
        place(4),
        Action::SelectChild,
        "Select child",
        "Walk down to the first child, or select the root where nothing is selected",
        &[(ALT, Key::ArrowDown)],
    );
    list.add(
        place(4),
        Action::SelectSecondChild,
        "Select second child",
        "Walk down to the second child",
        &[(ALT.plus(Modifiers::SHIFT), Key::ArrowDown)],
    );
    list.add(
        place(4),
        Action::SelectNextSibling,
        "Select next sibling",
        "Walk to the next child of the same parent, from the last to the first",
        &[(ALT, Key::ArrowRight)],
    );
    list.add(
        place(4),
        Action::SelectPreviousSibling,
        "Select previous sibling",
        "Walk to the previous child of the same parent, from the first to the last",
        &[(ALT, Key::ArrowLeft)],
    );
    hiding(list);
    list.add(place(5), Action::Undo, "Undo", "Undo the last change of settings or hidden nodes", &[(CTRL, Key::Z)]);
    list.add(
        place(5),
        Action::Redo,
        "Redo",
        "Redo the change that was undone last",
        &[(CTRL.plus(Modifiers::SHIFT), Key::Z), (CTRL, Key::Y)],
    );
    list.add(
        place(5),
        Action::ResetSettings,
        "Reset all settings",
        "Reset tree, containers and picture to their defaults",
        &[],
    );
    list.add(
        place(6),
        Action::Cancel,
        "Cancel",
        "Cancel the running job, or clear the selection if none runs",
        &[(NONE, Key::Escape)],
    );
}

/// The second tree.
fn comparing(list: &mut List) {
    let mut add = |step, label: &str, description: &str, keys: &[_]| {
        list.add((Category::Tree, 7), Action::Compare(step), label, description, keys);
    };
    add(
        CompareStep::Toggle,
        "Second tree",
        "Compare this tree with a second one, B, at the same camera, or remove that one again",
        &[(CTRL, Key::Num2)],
    );
    add(
        CompareStep::NextView,
        "Next view of two trees",
        "Go from A to B, both side by side, and the difference of their tests",
        &[(NONE, Key::Num2)],
    );
    for view in CompareView::ALL {
        let label = format!("Show: {}", view.label());
        add(CompareStep::View(view), &label, compare_description(view), &[]);
    }
    add(
        CompareStep::EditOther,
        "Edit the other tree",
        "Let the panel and the keys change the settings of the other of the two trees",
        &[(NONE, Key::Num4)],
    );
    add(CompareStep::Copy, "Copy A to B", "Give tree B the settings of tree A", &[]);
    add(CompareStep::Swap, "Swap A and B", "Exchange the settings of the two trees", &[]);
    add(
        CompareStep::OnlyCommon,
        "Only common containers",
        "Draw only the containers that both trees have: those with the same triangles",
        &[],
    );
}

/// Hiding, isolating and showing nodes.
fn hiding(list: &mut List) {
    let place = (Category::Tree, 4);
    list.add(
        place,
        Action::HideSelected,
        "Hide selected",
        "Leave out the selected node, everything below it and its triangles",
        &[(NONE, Key::H)],
    );
    list.add(
        place,
        Action::IsolateSelected,
        "Isolate selected",
        "Leave out everything but the selected node and what is below it",
        &[(NONE, Key::I), (Modifiers::SHIFT, Key::H)],
    );
    list.add(place, Action::ShowAll, "Show all", "Show all hidden nodes again", &[(ALT, Key::H)]);
    list.add(
        place,
        Action::ToggleHideTriangles,
        "Hide with triangles",
        "Hiding a node also leaves its triangles out of the picture",
        &[],
    );
    list.add(place, Action::CopyNode, "Copy node", "Copy the numbers of the selected node as text", &[]);
}
