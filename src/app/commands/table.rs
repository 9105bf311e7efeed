//! The list of actions.

use std::sync::LazyLock;

use egui::{Key, KeyboardShortcut, Modifiers};

use crate::app::commands::{Action, Category, Entry, OrbitStep, ViewDirection};
use crate::app::state::paper::{Experiment, RowFormat};
use crate::app::state::{AppState, Theme};
use crate::render::Shading;
use crate::scene::BUILTIN_SCENES;
use bvhscope_engine::settings::{BuilderKind, Passes, Preset};
use bvhscope_engine::tree::ContainerKind;

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const ALT: Modifiers = Modifiers::ALT;

type Keys<'a> = &'a [(Modifiers, Key)];

/// Every action but the recent files, in the order of menus.
pub fn entries() -> &'static [Entry] {
    static ENTRIES: LazyLock<Vec<Entry>> = LazyLock::new(|| {
        let mut list = List(Vec::new());
        file(&mut list);
        view(&mut list);
        tree(&mut list);
        lab(&mut list);
        help(&mut list);
        list.0
    });
    &ENTRIES
}

/// [`entries`] and the recent files of `state`.
pub fn entries_for(state: &AppState) -> Vec<Entry> {
    let recent = state.preferences.recent.iter().enumerate().map(|(index, path)| Entry {
        action: Action::OpenRecent(index),
        label: format!("Open {}", path.file_name().unwrap_or(path.as_os_str()).to_string_lossy()),
        description: path.display().to_string(),
        category: Category::File,
        shortcuts: Vec::new(),
        group: 2,
        in_viewport: false,
    });
    entries().iter().cloned().chain(recent).collect()
}

struct List(Vec<Entry>);

impl List {
    fn add(&mut self, place: (Category, u8), action: Action, label: &str, description: &str, keys: Keys<'_>) {
        self.0.push(Entry {
            action,
            label: label.to_owned(),
            description: description.to_owned(),
            category: place.0,
            shortcuts: keys.iter().map(|&(modifiers, key)| KeyboardShortcut::new(modifiers, key)).collect(),
            group: place.1,
            in_viewport: matches!(action, Action::Orbit(_)),
        });
    }
}

fn file(list: &mut List) {
    let place = |group| (Category::File, group);
    list.add(place(0), Action::Open, "Open…", "Open an OBJ, glTF, GLB, PLY or STL file", &[(CTRL, Key::O)]);
    list.add(place(0), Action::Reload, "Reload", "Read the model from its file again", &[(NONE, Key::F5)]);
    list.add(place(0), Action::StartPage, "Start page", "Show built-in scenes and recent files", &[(CTRL, Key::N)]);
    for (index, scene) in BUILTIN_SCENES.iter().enumerate() {
        list.add(place(1), Action::OpenBuiltin(index), &format!("Open {}", scene.label), scene.description, &[]);
    }
    list.add(
        place(3),
        Action::Screenshot,
        "Save screenshot",
        "Save the viewport as a PNG in the current folder",
        &[(NONE, Key::F12)],
    );
    list.add(
        place(3),
        Action::CopyCommandLine,
        "Copy command line",
        "Copy the command that makes this very picture without a window",
        &[(CTRL, Key::L)],
    );
    list.add(
        place(3),
        Action::CopyStatistics,
        "Copy statistics",
        "Copy all numbers of scene, build, tree and trace as text",
        &[(CTRL, Key::I)],
    );
    list.add(place(4), Action::Quit, "Quit", "Close the program; settings are kept", &[(CTRL, Key::Q)]);
}

fn view(list: &mut List) {
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
    list.add(place(1), Action::ResetView, "Reset view", "Go back to the default view of the model", &[(NONE, Key::R)]);
    list.add(
        place(1),
        Action::FrameSelection,
        "Frame selection",
        "Fill the view with the selected node, or with the whole model",
        &[(NONE, Key::F)],
    );
    for (step, label, key) in [
        (OrbitStep::Left, "left", Key::ArrowLeft),
        (OrbitStep::Right, "right", Key::ArrowRight),
        (OrbitStep::Up, "up", Key::ArrowUp),
        (OrbitStep::Down, "down", Key::ArrowDown),
    ] {
        let description = "Turn around the model by 5 degrees; the key works while the picture has the focus";
        list.add(place(1), Action::Orbit(step), &format!("Orbit {label}"), description, &[(NONE, key)]);
    }
    list.add(
        place(1),
        Action::ZoomIn,
        "Zoom in",
        "Bring the point under the pointer nearer",
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
        Action::FitHeatRange,
        "Fit heat range",
        "Spread the colours of the heat map over the counts of this picture; the range then stays",
        &[(NONE, Key::C)],
    );
    let digits = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];
    for (shading, key) in Shading::ALL.into_iter().zip(digits) {
        let label = format!("Shading: {}", shading.label());
        list.add(place(3), Action::Shade(shading), &label, shading_description(shading), &[(ALT, key)]);
    }
    list.add(place(4), Action::ToggleLeftPanel, "Left panel", "Show scene and statistics", &[(NONE, Key::F3)]);
    list.add(place(4), Action::ToggleRightPanel, "Right panel", "Show the settings", &[(NONE, Key::F4)]);
    for (theme, name, description) in [
        (Theme::Dark, "dark", "Light text on dark grey"),
        (Theme::Light, "light", "Dark text on light grey"),
        (Theme::System, "system", "As the desktop has it"),
    ] {
        list.add(place(5), Action::Theme(theme), &format!("Theme: {name}"), description, &[]);
    }
}

fn tree(list: &mut List) {
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
    list.add(place(3), Action::ToggleLeavesOnly, "Leaves only", "Of the chosen depths draw leaves alone", &[]);
    list.add(place(3), Action::ToggleParents, "Parents", "Draw all levels above the chosen depths too", &[]);
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
    list.add(place(4), Action::HideSelected, "Hide selected", "Do not draw the selected node", &[(NONE, Key::H)]);
    list.add(place(4), Action::ShowAll, "Show all", "Draw all hidden nodes again", &[(NONE, Key::J)]);
    list.add(place(5), Action::Undo, "Undo", "Take back the last change of settings", &[(CTRL, Key::Z)]);
    list.add(
        place(5),
        Action::Redo,
        "Redo",
        "Bring back what was undone",
        &[(CTRL.plus(Modifiers::SHIFT), Key::Z), (CTRL, Key::Y)],
    );
    list.add(
        place(5),
        Action::ResetSettings,
        "Reset all settings",
        "Bring tree, containers and picture back to their defaults",
        &[],
    );
    list.add(
        place(6),
        Action::Cancel,
        "Cancel",
        "Stop the running job; where none runs, clear the selection",
        &[(NONE, Key::Escape)],
    );
}

fn lab(list: &mut List) {
    let place = |group| (Category::Lab, group);
    list.add(
        place(0),
        Action::TogglePaper,
        "Paper panel",
        "Measure the paper's tables and figures on the open model",
        &[(NONE, Key::F6)],
    );
    for experiment in Experiment::ALL {
        let label = format!("Measure {}", experiment.label().to_lowercase());
        list.add(place(1), Action::Measure(experiment), &label, experiment.description(), &[]);
    }
    for format in RowFormat::ALL {
        let what = match format {
            RowFormat::Csv | RowFormat::Json => "rows",
            RowFormat::Png | RowFormat::Svg => "plot",
        };
        let label = format!("Save measured {what} as {}", format.label());
        list.add(place(2), Action::SaveRows(format), &label, "Save a file in the current folder", &[]);
    }
}

fn help(list: &mut List) {
    let place = (Category::Help, 0);
    list.add(place, Action::Palette, "Commands…", "Find and run any command by typing", &[(CTRL, Key::P)]);
    list.add(
        place,
        Action::Shortcuts,
        "Keys and mouse",
        "List every key and mouse gesture",
        &[(NONE, Key::F1), (NONE, Key::Questionmark)],
    );
    list.add(
        place,
        Action::Messages,
        "Messages",
        "List again what was said since the program started",
        &[(NONE, Key::F2)],
    );
}

/// What a shading mode shows, in one sentence.
pub(crate) fn shading_description(shading: Shading) -> &'static str {
    use crate::render::HeatKind;
    match shading {
        Shading::Lit => "Light, materials and textures",
        Shading::Normals => "The direction of the surface as a colour",
        Shading::Depth => "Distance along the view direction",
        Shading::AmbientOcclusion => "How open the surface is to its surroundings",
        Shading::Clusters => "Each surface in the colour of the container, at the cluster depth, that holds it",
        Shading::Heat(HeatKind::Both) => "Container and triangle tests that each pixel cost",
        Shading::Heat(HeatKind::Containers) => "Container tests that each pixel cost",
        Shading::Heat(HeatKind::Primitives) => "Triangle tests that each pixel cost",
        Shading::Heat(HeatKind::Steps) => {
            "Nodes and blocks of the eight-wide tree, which makes the pictures, that each pixel cost"
        }
    }
}

/// What a builder does, in one sentence.
pub(crate) fn builder_description(builder: BuilderKind) -> &'static str {
    match builder {
        BuilderKind::Aac => "Approximate agglomerative clustering (Gu et al. 2013)",
        BuilderKind::Lbvh => "Median split by Morton code (Lauterbach et al. 2009): fastest build, worst tree",
        BuilderKind::BinnedSah => "Top-down splits by the surface area heuristic (Wald 2007), boxes only",
        BuilderKind::Exact => "Always merges the closest pair (Walter et al. 2008); small scenes only",
        BuilderKind::None => "No tree: every ray tests every triangle",
    }
}
