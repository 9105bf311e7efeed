//! The command line that renders the present picture without a window.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Passes};
use bvhscope_engine::tree::traverse::Traversal;

use crate::app::state::{AppState, CompareView, TreeSide, Wanted};
use crate::camera::{Camera, Projection};
use crate::overlay::{OverlayKinds, Selection};
use crate::render::{Background, Exposure, Light, NormalSource, RenderSettings, Shading};
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

/// The `bvhscope diff` command that compares two trees in the present view.
fn diff_line(state: &AppState) -> String {
    let Wanted { source, threads, camera, render, .. } = &state.wanted;
    let mut line = format!("bvhscope diff {} -o difference.png", quote(&source.to_string()));
    let mut flag = |name: &str, value: String| {
        let _ = write!(line, " {name} {value}");
    };
    for (name, side) in ["--a", "--b"].into_iter().zip(TreeSide::ALL) {
        let file = state.wanted.tree_file(side).map(|file| file.display().to_string());
        flag(name, quote(&file.unwrap_or_else(|| settings_text(state.wanted.build_of(side)))));
    }
    if *threads > 0 {
        flag("--threads", threads.to_string());
    }
    let [width, height] = state.layout.viewport_px;
    if width > 0 && height > 0 {
        flag("--size", format!("{width}x{height}"));
    }
    if render.traversal == Traversal::Paper {
        flag("--traversal", render.traversal.name().to_owned());
    }
    camera_flags(camera, &mut flag);
    if camera.projection == Projection::Orthographic {
        line.push_str(" --orthographic");
    }
    if state.model.allow_outside {
        line.push_str(" --allow-outside");
    }
    line
}

/// The settings of a tree as an argument of `bvhscope diff`. Without a tree there is nothing to compare: AAC takes its place.
fn settings_text(build: &BuildSettings) -> String {
    let builder = if build.builder == BuilderKind::None { BuilderKind::Aac } else { build.builder };
    let mut text = format!("builder={} container={}", builder.name(), build.container.name());
    let _ = write!(text, " threshold={} epsilon={}", build.threshold, build.epsilon);
    if build.curve != Curve::Morton {
        let _ = write!(text, " curve={}", build.curve.name());
    }
    if build.passes() != Passes::NONE {
        let _ = write!(text, " optimize={}", build.passes());
    }
    if let Some(rounds) = build.annealing_rounds() {
        let _ = write!(text, " rounds={rounds}");
    }
    text
}

/// Where the camera is and looks.
fn camera_flags(camera: &Camera, flag: &mut impl FnMut(&str, String)) {
    let vector = |v: glam::Vec3| format!("{},{},{}", v.x, v.y, v.z);
    flag("--eye", vector(camera.eye));
    flag("--target", vector(camera.target));
    flag("--up", vector(camera.up));
    // Rounded, because the conversion between degrees and radians is not exact.
    flag("--fov", ((camera.fov_y.to_degrees() * 1e3).round() / 1e3).to_string());
}

/// The `bvhscope render` command that renders the present picture with one of the trees.
fn render_line(state: &AppState, side: TreeSide) -> String {
    let Wanted { source, threads, camera, render, .. } = &state.wanted;
    let build = state.wanted.build_of(side);
    let mut line = format!("bvhscope render {} -o bvhscope.png", quote(&source.to_string()));
    let mut flag = |name: &str, value: String| {
        let _ = write!(line, " {name} {value}");
    };
    match state.wanted.tree_file(side) {
        // The file of the model itself needs no flag.
        Some(file) if source.path() == Some(file) => {}
        Some(file) => flag("--tree", quote(&file.display().to_string())),
        None => {
            flag("--builder", build.builder.name().to_owned());
            flag("--container", build.container.name().to_owned());
            flag("--threshold", build.threshold.to_string());
            flag("--epsilon", build.epsilon.to_string());
            if build.curve != Curve::Morton {
                flag("--curve", build.curve.name().to_owned());
            }
            if build.passes() != Passes::NONE {
                flag("--optimize", build.passes().to_string());
            }
            if let Some(rounds) = build.annealing_rounds() {
                flag("--rounds", rounds.to_string());
            }
        }
    }
    if *threads > 0 {
        flag("--threads", threads.to_string());
    }
    let [width, height] = state.layout.viewport_px;
    if width > 0 && height > 0 {
        flag("--size", format!("{width}x{height}"));
    }
    camera_flags(camera, &mut flag);
    flag("--shading", render.shading.name().to_owned());
    flag("--samples", render.samples.to_string());
    flag("--color-map", render.color_map.name().to_owned());
    if render.shading == Shading::Clusters {
        flag("--cluster-depth", render.cluster_depth.to_string());
    }
    if let Some(plane) = render.section {
        flag("--section", plane.to_string());
    }
    if let Some([low, high]) = render.heat_range {
        flag("--heat-range", format!("{low}..{high}"));
    }
    if render.traversal == Traversal::Paper {
        flag("--traversal", render.traversal.name().to_owned());
    }
    if render.simd != SimdLevel::best() {
        flag("--simd", render.simd.name().to_owned());
    }
    if render.light == Light::Headlight {
        flag("--light", render.light.name().to_owned());
    }
    if render.background == Background::Light {
        flag("--background", render.background.name().to_owned());
    }
    if let Exposure::Fixed(stops) = render.exposure {
        flag("--exposure", stops.to_string());
    }
    if render.normals != NormalSource::File {
        flag("--normals", render.normals.name().to_owned());
    }
    if render.crease_degrees != RenderSettings::default().crease_degrees {
        flag("--crease", render.crease_degrees.to_string());
    }
    let Selection { hidden, isolated, .. } = &state.selection.nodes;
    if !hidden.is_empty() {
        let hidden: BTreeSet<u32> = hidden.iter().copied().collect();
        flag("--hide", hidden.iter().map(u32::to_string).collect::<Vec<_>>().join(","));
    }
    if let Some(node) = isolated {
        flag("--isolate", node.to_string());
    }
    if uses_overlay(state) {
        overlay_flags(state, &mut line);
    }
    let orthographic = camera.projection == Projection::Orthographic;
    let switches = [
        (state.selection.nodes.hides_any() && !state.wanted.overlay.hide_triangles, " --keep-triangles"),
        (render.mesh_edges, " --mesh-edges"),
        (render.ground, " --ground"),
        (orthographic, " --orthographic"),
        (state.model.allow_outside, " --allow-outside"),
    ];
    for (on, name) in switches {
        if on {
            line.push_str(name);
        }
    }
    line
}

/// Whether the overlay draws anything or hides the picture, so that its flags are needed.
fn uses_overlay(state: &AppState) -> bool {
    let overlay = &state.wanted.overlay;
    let any_drawn = overlay.kinds(state.container_kind()) != [false; 2] || state.selection.nodes.selected.is_some();
    (any_drawn && state.preferences.show_containers) || !state.preferences.show_geometry
}

/// Appends the flags of the overlay.
fn overlay_flags(state: &AppState, line: &mut String) {
    let overlay = &state.wanted.overlay;
    let mut flag = |name: &str, value: String| {
        let _ = write!(line, " {name} {value}");
    };
    let drawn = state.preferences.show_containers;
    let kinds = overlay.kinds(state.container_kind());
    let kind = OverlayKinds::ALL.into_iter().find(|kind| kind.shown() == kinds);
    flag("--overlay", kind.filter(|_| drawn).unwrap_or(OverlayKinds::None).name().to_owned());
    if drawn {
        if let Some([first, last]) = overlay.depth {
            flag("--depth", format!("{first}..{last}"));
        }
        flag("--color-by", overlay.color_by.name().to_owned());
        flag("--hidden-lines", overlay.hidden_alpha.to_string());
        flag("--line-width", (overlay.line_width * state.layout.pixels_per_point).to_string());
        if let Some(budget) = overlay.budget {
            flag("--at-most", budget.to_string());
        }
        if let Some(node) = state.selection.nodes.selected {
            flag("--select", node.to_string());
        }
    }

    let switches = [
        (overlay.leaves_only && drawn, " --leaves"),
        (overlay.parents && drawn, " --parents"),
        (overlay.faces && drawn, " --faces"),
        (overlay.overlap && state.selection.nodes.selected.is_some(), " --overlap"),
        (!state.preferences.show_geometry, " --no-geometry"),
    ];
    for (on, name) in switches {
        if on {
            line.push_str(name);
        }
    }
}
