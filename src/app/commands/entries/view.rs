//! Entries of the menu "View".

use egui::{Key, Modifiers};

use super::list::{ALT, CTRL, List, NONE, SHIFT};
use crate::app::commands::action::{Action, OrbitStep, SectionStep, ViewDirection};
use crate::app::commands::descriptions::shading_description;
use crate::app::commands::entry::Category;
use crate::app::state::Theme;
use crate::render::Shading;

/// Adds the entries of the menu.
pub(super) fn add(list: &mut List) {
    use ViewDirection::{Back, Bottom, Front, Left, Right, Top};
    let place = |group| (Category::View, group);
    for (direction, label, key) in [
        (Front, "Front", (NONE, Key::Num1)),
        (Back, "Back", (CTRL, Key::Num1)),
        (Right, "Right", (NONE, Key::Num3)),
        (Left, "Left", (CTRL, Key::Num3)),
        (Top, "Top", (NONE, Key::Num7)),
        (Bottom, "Bottom", (CTRL, Key::Num7)),
    ] {
        let label = format!("{label} view");
        let description = format!("Look at the model from the {}", label.trim_end_matches(" view").to_lowercase());
        list.add(place(0), Action::View(direction), &label, &description, &[key]);
    }
    list.add(
        place(1),
        Action::ToggleOrthographic,
        "Orthographic",
        "Parallel rays instead of perspective",
        &[(NONE, Key::Num5)],
    );
    list.add(place(1), Action::ToggleUpAxis, "Switch up axis", "Let y or z point up", &[(NONE, Key::U)]);
    list.add(
        place(1),
        Action::ToggleFly,
        "Fly mode",
        "Move with W, A, S, D, Q and E instead of orbiting; Shift is faster",
        &[(NONE, Key::V)],
    );
    list.add(
        place(1),
        Action::ResetView,
        "Reset view",
        "Go back to the default view: inside a model that encloses its centre, as a room does, otherwise outside",
        &[(NONE, Key::R)],
    );
    list.add(
        place(1),
        Action::ViewOutside,
        "View from outside",
        "Look at the whole model from outside, also at a room",
        &[(SHIFT, Key::R)],
    );
    list.add(
        place(1),
        Action::FrameSelection,
        "Frame selection",
        "Fill the view with the selected node, or with the whole model",
        &[(NONE, Key::F)],
    );
    list.add(place(1), Action::AddBookmark, "Add bookmark", "Keep this camera, to come back to it", &[(CTRL, Key::D)]);
    list.add(
        place(1),
        Action::NextBookmark,
        "Next bookmark",
        "Go to the next camera that was kept for this model",
        &[(NONE, Key::J)],
    );
    list.add(place(1), Action::RemoveBookmark, "Remove bookmark", "Forget the bookmark that the camera is at", &[]);
    for (step, label, key) in [
        (OrbitStep::Left, "left", Key::ArrowLeft),
        (OrbitStep::Right, "right", Key::ArrowRight),
        (OrbitStep::Up, "up", Key::ArrowUp),
        (OrbitStep::Down, "down", Key::ArrowDown),
    ] {
        let description = "Orbit by 5 degrees; the key works while the picture has the focus";
        list.add(place(1), Action::Orbit(step), &format!("Orbit {label}"), description, &[(NONE, key)]);
    }
    list.add(
        place(1),
        Action::ZoomIn,
        "Zoom in",
        "Move closer to the point under the pointer",
        &[(NONE, Key::Plus), (NONE, Key::Equals)],
    );
    list.add(
        place(1),
        Action::ZoomOut,
        "Zoom out",
        "Move away from the point under the pointer",
        &[(NONE, Key::Minus)],
    );
    list.add(place(2), Action::ToggleContainers, "Containers", "Draw containers over the picture", &[(NONE, Key::B)]);
    list.add(place(2), Action::ToggleGeometry, "Geometry", "Show the traced picture", &[(NONE, Key::N)]);
    list.add(
        place(2),
        Action::ToggleMeshEdges,
        "Mesh edges",
        "Draw the edges of the triangles over the picture",
        &[(NONE, Key::M)],
    );
    list.add(
        place(2),
        Action::ToggleGround,
        "Ground shadow",
        "Let the model's shadow fall on a ground below it, so that it does not float",
        &[],
    );
    list.add(
        place(2),
        Action::LockExposure,
        "Lock exposure",
        "Keep the brightness of this view while the camera moves; again to meter it anew",
        &[(NONE, Key::K)],
    );
    list.add(
        place(2),
        Action::FitHeatRange,
        "Fit heat range",
        "Spread the colours of the heat map over the counts of this picture; the range then stays",
        &[(NONE, Key::C)],
    );
    section(list);
    let digits = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];
    for (index, shading) in Shading::ALL.into_iter().enumerate() {
        let label = format!("Shading: {}", shading.label());
        // Modes beyond the ninth have no key.
        let shortcut = digits.get(index).map(|&key| (ALT, key));
        list.add(place(3), Action::Shade(shading), &label, shading_description(shading), shortcut.as_slice());
    }
    list.add(place(4), Action::ToggleLeftPanel, "Left panel", "Show scene and statistics", &[(NONE, Key::F3)]);
    list.add(place(4), Action::ToggleRightPanel, "Right panel", "Show the settings", &[(NONE, Key::F4)]);
    for (theme, name, description) in [
        (Theme::Dark, "dark", "Light text on dark grey"),
        (Theme::Light, "light", "Dark text on light grey"),
        (Theme::System, "system", "Follow the desktop"),
    ] {
        list.add(place(5), Action::Theme(theme), &format!("Theme: {name}"), description, &[]);
    }
}

/// The section plane.
fn section(list: &mut List) {
    use SectionStep::{Facing, Flip, Snap, Toggle, X, Y, Z};
    for (step, label, description, keys) in [
        (Toggle, "Section", "Cut model and containers open by a plane, or close them", &[(NONE, Key::X)][..]),
        (X, "Section: across x", "Cut across the x axis; drag the handle to move the plane", &[]),
        (Y, "Section: across y", "Cut across the y axis; drag the handle to move the plane", &[]),
        (Z, "Section: across z", "Cut across the z axis; drag the handle to move the plane", &[]),
        (Facing, "Section: facing", "Cut parallel to the picture, through the middle of the model", &[]),
        (Snap, "Section: snap to axis", "Turn the section plane to the nearest axis", &[]),
        (Flip, "Section: flip", "Keep the other half", &[(Modifiers::SHIFT, Key::X)]),
    ] {
        list.add((Category::View, 2), Action::Section(step), label, description, keys);
    }
}
