//! Text for the clipboard: the whole state as one line, which can be pasted again, and all statistics.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use serde_json::Value;

use super::camera;
use crate::app::format;
use crate::app::state::{AppState, Presented, Request, Severity, SharedNodes, SharedState, Wanted};
use crate::catalog::numbers::{Digits, NUMBERS, Number, Section};
use crate::catalog::settings::used;
use crate::scene::{Instancing, Moment, SceneSource};
use crate::view::{CameraChoice, NamedView};
use bvhscope_engine::tree::ContainerKind;

/// Everything that another person needs to see what this window shows.
pub fn shared_state(state: &AppState) -> SharedState {
    let nodes = &state.selection.nodes;
    let mut wanted = state.wanted.clone();
    wanted.source = wanted.source.absolute();
    for file in wanted.tree_files.iter_mut().chain([&mut wanted.ray_file]).flatten() {
        *file = std::path::absolute(&*file).unwrap_or_else(|_| file.clone());
    }
    let tree = state.presented_tree();
    SharedState {
        wanted,
        copies: state.model.presented.as_ref().map_or_else(Instancing::default, |shown| shown.accel.scene.form()),
        show_geometry: state.preferences.show_geometry,
        show_containers: state.preferences.show_containers,
        dock: state.preferences.dock.open.clone(),
        nodes: SharedNodes {
            selected: nodes.selected,
            triangle: state.selection.picked.as_ref().map(|picked| picked.primitive),
            hidden: nodes.hidden.iter().copied().collect::<BTreeSet<_>>(),
            isolated: nodes.isolated,
            only: nodes.only.as_ref().map(|only| only.ranges()),
        },
        picture: state.model.shared_picture(),
        views: state.views.shared(tree.as_ref()),
        paper: state.preferences.paper.clone(),
    }
}

/// Shows the state of a line that was pasted. One that holds none is reported and changes nothing.
pub fn paste_state(state: &mut AppState, text: &str) {
    match SharedState::parse(text).and_then(|shared| with_model_here(state, shared)) {
        Ok((shared, note)) => {
            state.messages.notify(Severity::Info, note);
            show_state(state, shared);
        }
        Err(reason) => {
            state.messages.notify(Severity::Warning, format!("What was pasted is not shown: {reason}"));
        }
    }
}

/// The state with its model as it is found here, and what to say about it. A file that is elsewhere on this machine is taken to
/// be the open one where that has the same name.
fn with_model_here(state: &AppState, mut shared: SharedState) -> Result<(SharedState, String), String> {
    let source = &shared.wanted.source;
    let label = source.label();
    let missing = source.is_missing();
    if !missing {
        return Ok((shared, format!("The pasted state of {label} is shown; Ctrl+Z undoes its settings")));
    }
    if state.wanted.source.label() != label {
        return Err(format!("its model {source} is not here; open a copy of {label} first, then paste again"));
    }
    let note = format!("The pasted state is shown on the open {label}, because {source} is not here");
    shared.wanted.source = state.wanted.source.clone();
    Ok((shared, note))
}

/// Shows a state. What it selects is selected once its tree is there.
pub fn show_state(state: &mut AppState, shared: SharedState) {
    let own_view = shared.has_own_view();
    let SharedState { wanted, copies, show_geometry, show_containers, dock, nodes, picture, views, paper } = shared;
    let before = std::mem::replace(&mut state.wanted, wanted);
    let new = std::mem::replace(&mut state.wanted.source, before.source);
    let is_open = is_same(&new, &state.wanted.source);
    if own_view {
        state.wanted.camera = before.camera;
    }
    if is_open {
        // The coordinates of a line that was written by hand may be those of the file.
        let shift = state.move_to_offset(before.offset);
        if !own_view {
            state.wanted.camera = state.wanted.camera.shifted(shift);
        }
        state.wanted.moment = state.clip().map(|(moment, _)| moment);
        if copies != Instancing::Auto {
            state.model.load_options.instances = copies;
        }
    }
    match (is_open, own_view) {
        (true, true) => camera::reset(state, NamedView::Default),
        (true, false) => {}
        (false, own_view) => {
            let Wanted { camera, offset, .. } = state.wanted;
            let camera = (!own_view).then(|| CameraChoice::in_file(camera, offset));
            let tree_files = state.wanted.tree_files.clone();
            state.activity.requests.push(Request::OpenShared { source: new, copies, tree_files, camera });
        }
    }
    // A fixed range of the heat map belongs to what is shown with it.
    state.model.heat_basis = None;
    state.model.playback.playing = false;
    state.preferences.show_geometry = show_geometry;
    state.preferences.show_containers = show_containers;
    state.preferences.dock.open = dock;
    state.selection.pasted = Some(nodes);
    state.model.show_shared_picture(picture);
    if let Err(reason) = state.views.show_shared(views) {
        state.messages.notify(Severity::Warning, format!("Not all of the state is shown: {reason}"));
    }
    state.preferences.paper = paper;
}

fn is_same(a: &SceneSource, b: &SceneSource) -> bool {
    a.absolute() == b.absolute()
}

/// All statistics, one per line as name and value separated by a tab; `None` before the first picture.
pub fn statistics_text(state: &AppState) -> Option<String> {
    let shown = state.model.presented.as_ref()?;
    let (scene, report, settings) = (&shown.accel.scene, &shown.accel.report, &shown.accel.settings);
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name}\t{value}");
    };
    line("Model", scene.source.to_string());
    if let (Some(Moment { clip, seconds }), Some(motion)) = (scene.moment, &scene.motion) {
        line("Clip", motion.clips[clip].name.clone());
        line("Time", format!("{seconds} s"));
    }
    line("Triangles", format::count(scene.triangle_count()));
    for (name, value) in used(settings) {
        line(name, value);
    }
    line("Threads", report.threads.to_string());
    for stage in shown.accel.reused_stages() {
        line(&format!("Build: {stage}"), "reused".to_owned());
    }
    for (stage, time) in shown.accel.stages() {
        line(&format!("Build: {stage}"), format::duration(time));
        if let Some([before, after]) = report.stages.cost_change(stage) {
            let change = format!("{} to {}", format::significant(before), format::significant(after));
            line(&format!("SAH cost: {stage}"), change);
        }
    }
    let reading = shown.reading();
    for number in NUMBERS.iter().filter(|number| !number.label.is_empty()) {
        if let Some(value) = (number.get)(&reading).filter(|value| !value.is_object()) {
            line(&copied_name(number), copied(number, &value));
        }
    }
    if let Some(second) = &state.model.second {
        text.push_str(&second_text(second));
    }
    Some(text)
}

/// The numbers of the second tree, in the same form.
fn second_text(second: &Presented) -> String {
    let (settings, numbers) = (&second.accel.settings, second.numbers());
    let mut text = String::new();
    for (name, value) in used(settings) {
        let _ = writeln!(text, "B: {name}\t{value}");
    }
    for number in NUMBERS.iter().filter(|number| number.compared.is_some()) {
        if let Some(value) = numbers.value(number) {
            let _ = writeln!(text, "B: {}\t{}", copied_name(number), copied(number, &value.into()));
        }
    }
    text
}

/// Name of a number among all others.
fn copied_name(number: &Number) -> String {
    if number.panel == Some(Section::Memory) { format!("Memory: {}", number.label) } else { number.label.to_owned() }
}

/// A number with its unit.
fn copied(number: &Number, value: &Value) -> String {
    let text = format::of_number(number, value);
    if number.digits == Digits::Bytes { text } else { format!("{text} {}", number.unit).trim_end().to_owned() }
}

/// The numbers of the selected node, one per line as name and value separated by a tab; `None` where none is selected.
pub fn node_text(state: &AppState) -> Option<String> {
    let (shown, node) = state.selected()?;
    let table = &shown.table;
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name}\t{value}");
    };
    line("Model", shown.accel.scene.source.to_string());
    line("Node", node.to_string());
    line("Kind", if table.is_leaf(node) { "leaf" } else { "interior" }.to_owned());
    line("Depth", table.depth(node).to_string());
    let children = table.children(node).len();
    if children > 0 && children != 2 {
        line("Children", children.to_string());
    }
    if let Some(triangles) = table.known_primitives(node) {
        line("Triangles", triangles.to_string());
    }
    let vector = |v: glam::Vec3| shown.accel.scene.in_file(v).to_array().map(|number| number.to_string()).join(",");
    match table.container_kind() {
        ContainerKind::Aabb => {
            let bounds = table.node_box(node);
            line("Box from", vector(bounds.min));
            line("Box to", vector(bounds.max));
        }
        ContainerKind::Sphere => {
            let sphere = table.node_sphere(node);
            line("Centre", vector(sphere.center));
            line("Radius", sphere.radius.to_string());
        }
        ContainerKind::Oriented => {
            let container = table.node_oriented(node);
            line("Box from", vector(container.bounds.min));
            line("Box to", vector(container.bounds.max));
            line("Planes", container.kind().label().to_owned());
            line("Area over its box's", container.share_of_plain().to_string());
        }
        ContainerKind::Dop14 => {
            let dop = table.node_dop(node);
            line("Box from", vector(dop.bounds.min));
            line("Box to", vector(dop.bounds.max));
            line("Area over its box's", (dop.half_area() / dop.bounds.half_area()).to_string());
        }
    }
    line("Area over the root's", table.area_share(node).to_string());
    if let Some(overlap) = table.overlap(node) {
        line("Overlap of the children", overlap.to_string());
    }
    Some(text)
}
