//! Entries of the menu "Tree".

use bvhscope_engine::settings::{BuilderKind, Passes, Preset};
use bvhscope_engine::tree::ContainerKind;
use egui::{Key, Modifiers};

use super::list::{ALT, CTRL, List, NONE};
use crate::app::commands::action::Action;
use crate::app::commands::descriptions::builder_description;
use crate::app::commands::entry::Category;

/// Adds the entries of the menu.
pub(super) fn add(list: &mut List) {
    let place = |group| (Category::Tree, group);
    for preset in Preset::ALL {
        let (threshold, epsilon) = preset.parameters();
        let label = format!("Preset: {}", preset.label());
        let passes = if preset.passes() == Passes::NONE { "" } else { ", every pass over the finished tree" };
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
    list.add(place(4), Action::SelectParent, "Select parent", "Walk up from the selected node", &[(ALT, Key::ArrowUp)]);
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
        Action::SelectSibling,
        "Select sibling",
        "Walk to the other child of the same parent",
        &[(ALT, Key::ArrowRight), (ALT, Key::ArrowLeft)],
    );
    hiding(list);
    list.add(place(5), Action::Undo, "Undo", "Undo the last change of settings", &[(CTRL, Key::Z)]);
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
