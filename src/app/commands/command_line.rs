//! The command line that renders the present picture without a window.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use glam::DVec3;

use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use bvhscope_engine::tree::traverse::Traversal;

use crate::accel::Follow;
use crate::app::state::{AppState, CompareView, TreeSide, Wanted};
use crate::camera::{Camera, Projection};
use crate::catalog::settings::{Settings, Value, written};
use crate::overlay::{OverlaySettings, Selection};
use crate::render::Background;
use crate::scene::to_file;
use crate::text::quote;

/// The command that makes the present picture without a window: `bvhscope render`, or where two trees are in view, `bvhscope diff`,
/// which has no picture of both but the difference of their tests.
pub fn command_line(state: &AppState) -> String {
    match state.wanted.second {
        Some(second) if matches!(second.view, CompareView::Split | CompareView::Difference) => diff_line(state),
        Some(second) if second.view == CompareView::B => render_line(state, TreeSide::B),
        _ => render_line(state, TreeSide::A),
    }
}

/// A command line that grows by flags.
struct Line(String);

impl Line {
    /// Adds a flag where it has a value.
    fn flag(&mut self, name: &str, value: impl Into<Option<String>>) {
        if let Some(value) = value.into() {
            let _ = write!(self.0, " {name} {value}");
        }
    }

    /// Adds a flag without a value where it is on.
    fn switch(&mut self, name: &str, on: bool) {
        if on {
            let _ = write!(self.0, " {name}");
        }
    }

    /// The settings that a line names, by their flags.
    fn settings<T: Settings>(&mut self, settings: &T) {
        for (row, text) in written(settings) {
            let value = if let Value::Switch { .. } = row.value { String::new() } else { format!(" {text}") };
            let _ = write!(self.0, " --{}{value}", row.key);
        }
    }

    fn threads_and_size(&mut self, state: &AppState) {
        let threads = state.wanted.threads;
        self.flag("--threads", (threads > 0).then(|| threads.to_string()));
        let [width, height] = state.layout.viewport_px;
        self.flag("--size", (width > 0 && height > 0).then(|| format!("{width}x{height}")));
    }

    /// Place and direction of the camera.
    fn camera(&mut self, camera: &Camera, offset: DVec3) {
        let vector = |v: DVec3| format!("{},{},{}", v.x, v.y, v.z);
        self.flag("--eye", vector(to_file(camera.eye, offset)));
        self.flag("--target", vector(to_file(camera.target, offset)));
        self.flag("--up", vector(to_file(camera.up, DVec3::ZERO)));
        // Rounded, because the conversion between degrees and radians is not exact.
        self.flag("--fov", ((camera.fov_y.to_degrees() * 1e3).round() / 1e3).to_string());
    }

    fn traversal(&mut self, traversal: Traversal) {
        self.flag("--traversal", (traversal == Traversal::Paper).then(|| traversal.name().to_owned()));
    }

    /// The moment of a model that moves. A clip is named where its name means it, else it is numbered.
    fn moment(&mut self, state: &AppState) {
        let (Some((moment, clip)), Some(motion)) = (state.clip(), state.motion()) else { return };
        let is_name = !clip.name.starts_with(['-', ' ']) && motion.choose(Some(&clip.name)) == Ok(moment.clip);
        let name = if is_name { quote(&clip.name) } else { moment.clip.to_string() };
        self.flag("--clip", (motion.clips.len() > 1).then_some(name));
        self.flag("--time", moment.seconds.to_string());
    }

    /// How the tree of the moment is made, unless it is built there or read.
    fn follow(&mut self, state: &AppState, side: TreeSide) {
        let follow = follow_of(state, side);
        if follow != Follow::default() && state.wanted.tree_file(side).is_none() {
            self.flag("--policy", follow.policy.name().to_owned());
            self.flag("--policy-frames", follow.frames.to_string());
        }
    }

    /// The flags that both commands end with.
    fn end(mut self, state: &AppState) -> String {
        self.switch("--orthographic", state.wanted.camera.projection == Projection::Orthographic);
        for (key, value) in state.model.load_options.written() {
            let value = value.map_or_else(String::new, |value| format!(" {value}"));
            let _ = write!(self.0, " --{key}{value}");
        }
        self.0
    }
}

/// How the tree of a side follows the model at the wanted moment.
fn follow_of(state: &AppState, side: TreeSide) -> Follow {
    state.wanted.follow_at(side, state.clip().map(|(moment, _)| moment))
}

/// The `bvhscope diff` command that compares two trees in the present view.
fn diff_line(state: &AppState) -> String {
    let Wanted { source, camera, render, .. } = &state.wanted;
    let mut line = Line(format!("bvhscope diff {} -o difference.png", quote(&source.to_string())));
    for (name, side) in ["--a", "--b"].into_iter().zip(TreeSide::ALL) {
        let file = state.wanted.tree_file(side).map(|file| file.display().to_string());
        line.flag(name, quote(&file.unwrap_or_else(|| settings_text(state.wanted.build_of(side)))));
    }
    line.threads_and_size(state);
    line.moment(state);
    line.traversal(render.traversal);
    line.camera(camera, state.wanted.offset);
    let followed = TreeSide::ALL.into_iter().filter(|&side| follow_of(state, side) != Follow::default());
    let left_out: Vec<&str> = followed.map(TreeSide::name).collect();
    let mut text = line.end(state);
    if !left_out.is_empty() {
        // A comment of the shell: the command builds both trees at the moment.
        let _ = write!(text, " # without the policy of {}", left_out.join(" and "));
    }
    text
}

/// The settings of a tree as an argument of `bvhscope diff`. Without a tree there is nothing to compare: AAC takes its place.
fn settings_text(build: &BuildSettings) -> String {
    let builder = if build.builder == BuilderKind::None { BuilderKind::Aac } else { build.builder };
    let built = BuildSettings { builder, ..*build };
    let words = written(&built).map(|(row, value)| format!("{}={value}", row.key));
    words.collect::<Vec<_>>().join(" ")
}

/// The `bvhscope render` command that renders the present picture with one of the trees.
fn render_line(state: &AppState, side: TreeSide) -> String {
    let Wanted { source, camera, render, overlay, .. } = &state.wanted;
    let mut line = Line(format!("bvhscope render {} -o bvhscope.png", quote(&source.to_string())));
    match state.wanted.tree_file(side) {
        // The file of the model itself needs no flag.
        Some(file) if source.path() == Some(file) => {}
        Some(file) => line.flag("--tree", quote(&file.display().to_string())),
        None => line.settings(state.wanted.build_of(side)),
    }
    line.threads_and_size(state);
    line.moment(state);
    line.follow(state, side);
    line.camera(camera, state.wanted.offset);
    line.settings(render);
    let background = Some(render.background).filter(|background| *background != Background::default());
    line.flag("--background", background.map(|background| background.name().to_owned()));
    line.flag("--section", render.section.map(|plane| plane.in_file(state.wanted.offset)));
    let Selection { hidden, isolated, .. } = &state.selection.nodes;
    let hidden: BTreeSet<u32> = hidden.iter().copied().collect();
    let list = || hidden.iter().map(u32::to_string).collect::<Vec<_>>().join(",");
    line.flag("--hide", (!hidden.is_empty()).then(list));
    line.flag("--isolate", isolated.map(|node| node.to_string()));
    if uses_overlay(state) || state.counts_layouts() {
        // That of a second tree is not on show.
        let layout = state.model.layout_name().filter(|_| state.wanted.second.is_none());
        line.flag("--layout", layout.map(|name| quote(&name)));
    }
    if uses_overlay(state) {
        overlay_flags(state, &mut line);
    }
    line.switch("--keep-triangles", state.selection.nodes.hides_any() && !overlay.hide_triangles);
    line.end(state)
}

/// Whether the overlay draws anything or hides the picture, and its flags are needed.
fn uses_overlay(state: &AppState) -> bool {
    let overlay = &state.wanted.overlay;
    let any_drawn = !overlay.kinds(state.container_kind()).is_empty() || state.selection.nodes.selected.is_some();
    (any_drawn && state.shows_containers()) || !state.preferences.show_geometry
}

/// Appends the flags of the overlay, as it is drawn by pixels.
fn overlay_flags(state: &AppState, line: &mut Line) {
    let overlay = &state.wanted.overlay;
    if state.shows_containers() {
        let line_width = overlay.line_width * state.layout.pixels_per_point;
        line.settings(&OverlaySettings { line_width, ..overlay.spelt_out(state.container_kind()) });
        line.flag("--select", state.selection.nodes.selected.map(|node| node.to_string()));
    } else {
        line.flag("--overlay", "none".to_owned());
    }
    line.switch("--no-geometry", !state.preferences.show_geometry);
}
