//! The present state as text: the command line that repeats it, and all numbers.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::app::format;
use crate::app::state::{AppState, Wanted};
use crate::camera::Projection;
use crate::overlay::OverlayKinds;
use crate::render::{Light, Shading};
use bvhscope_engine::WideBvh;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{Curve, Passes};
use bvhscope_engine::tree::levels::Levels;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};
use bvhscope_engine::tree::traverse::Traversal;

/// The command that makes the picture on the screen without a window.
pub fn command_line(state: &AppState) -> String {
    let Wanted { source, build, threads, camera, render, overlay: _ } = &state.wanted;
    let vector = |v: glam::Vec3| format!("{},{},{}", v.x, v.y, v.z);
    let mut line = format!("bvhscope render {} -o bvhscope.png", quote(&source.to_string()));
    let mut flag = |name: &str, value: String| {
        let _ = write!(line, " {name} {value}");
    };
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
    if *threads > 0 {
        flag("--threads", threads.to_string());
    }
    let [width, height] = state.layout.viewport_px;
    if width > 0 && height > 0 {
        flag("--size", format!("{width}x{height}"));
    }
    flag("--eye", vector(camera.eye));
    flag("--target", vector(camera.target));
    flag("--up", vector(camera.up));
    // Turning degrees into radians and back leaves dust behind the comma.
    flag("--fov", ((camera.fov_y.to_degrees() * 1e3).round() / 1e3).to_string());
    flag("--shading", render.shading.name().to_owned());
    flag("--samples", render.samples.to_string());
    flag("--color-map", render.color_map.name().to_owned());
    if render.shading == Shading::Clusters {
        flag("--cluster-depth", render.cluster_depth.to_string());
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
    if shows_containers(state) {
        containers(state, &mut line);
    }
    let orthographic = camera.projection == Projection::Orthographic;
    let switches = [
        (render.mesh_edges, " --mesh-edges"),
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

/// Whether the overlay changes anything about the picture.
fn shows_containers(state: &AppState) -> bool {
    let overlay = &state.wanted.overlay;
    let any = overlay.show_boxes || overlay.show_spheres || state.selection.nodes.selected.is_some();
    (any && state.preferences.show_containers) || !state.preferences.show_geometry
}

/// The flags of the overlay.
fn containers(state: &AppState, line: &mut String) {
    let overlay = &state.wanted.overlay;
    let mut flag = |name: &str, value: String| {
        let _ = write!(line, " {name} {value}");
    };
    let drawn = state.preferences.show_containers;
    let kind = OverlayKinds::ALL.into_iter().find(|kind| kind.shown() == [overlay.show_boxes, overlay.show_spheres]);
    flag("--overlay", kind.filter(|_| drawn).unwrap_or(OverlayKinds::None).name().to_owned());
    if drawn {
        flag("--depth", format!("{}..{}", overlay.depth[0], overlay.depth[1]));
        flag("--color-by", overlay.color_by.name().to_owned());
        flag("--hidden-lines", overlay.hidden_alpha.to_string());
        flag("--line-width", (overlay.line_width * state.layout.pixels_per_point).to_string());
        flag("--at-most", overlay.budget.to_string());
        if let Some(node) = state.selection.nodes.selected {
            flag("--select", node.to_string());
        }
        if !state.selection.nodes.hidden.is_empty() {
            let hidden: BTreeSet<u32> = state.selection.nodes.hidden.iter().copied().collect();
            flag("--hide", hidden.iter().map(u32::to_string).collect::<Vec<_>>().join(","));
        }
    }
    let switches = [
        (overlay.leaves_only && drawn, " --leaves"),
        (overlay.parents && drawn, " --parents"),
        (!state.preferences.show_geometry, " --no-geometry"),
    ];
    for (on, name) in switches {
        if on {
            line.push_str(name);
        }
    }
}

/// A shell word.
fn quote(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-:+".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

/// Every number on the screen, one a line; `None` before the first picture.
pub fn statistics_text(state: &AppState) -> Option<String> {
    let shown = state.model.presented.as_ref()?;
    let (scene, report, frame) = (&shown.accel.scene, &shown.accel.report, &shown.frame);
    let (stats, settings) = (&report.stats, &shown.accel.settings);
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name}\t{value}");
    };
    let number = |value: f32| format::significant(f64::from(value));
    line("Model", scene.source.to_string());
    line("Triangles", format::count(scene.triangles.len() as u64));
    line("Builder", settings.builder.label().to_owned());
    line("Container", settings.container.label().to_owned());
    line("Threshold", settings.threshold.to_string());
    line("Reduction ε", settings.epsilon.to_string());
    line("Optimize", settings.passes().to_string());
    line("Threads", report.threads.to_string());
    line("Build time", format::duration(report.build_time));
    for (stage, time) in &report.stages.stages {
        line(&format!("Build: {stage}"), format::duration(*time));
        if let Some([before, after]) = report.stages.cost_change(stage) {
            let change = format!("{} to {}", format::significant(before), format::significant(after));
            line(&format!("SAH cost: {stage}"), change);
        }
    }
    line("Mtri/s", format::significant(report.mtriangles_per_s()));
    line("SAH cost", format!("{} (container {TRAVERSAL_COST}, triangle {INTERSECTION_COST})", number(stats.sah_cost)));
    if let Some(epo) = shown.accel.known_epo() {
        line("End-point overlap", number(epo));
    }
    line("Nodes", format::count(stats.nodes as u64));
    line("Leaves", format::count(stats.leaves as u64));
    line("Depth", stats.max_depth.to_string());
    line(
        "Leaf size",
        format!("{} to {}, mean {}", stats.min_leaf_size, stats.max_leaf_size, number(stats.mean_leaf_size)),
    );
    line("Tree memory", format::bytes(report.tree_bytes));
    line("Triangle memory", format::bytes(report.triangle_bytes));
    let wide = shown.accel.known_wide();
    if let Some(wide) = wide {
        line("Wide tree memory", format::bytes(wide.tree.node_bytes()));
        line("Wide triangle memory", format::bytes(wide.tree.triangle_bytes()));
    }
    line("Overlay memory", format::bytes(Levels::bytes(stats.nodes)));
    let bytes = report.bytes_per_triangle() + wide.map_or(0.0, WideBvh::bytes_per_triangle);
    line("Bytes per triangle", format::significant(bytes));
    line("Trace time", format::duration(frame.stats.trace_time));
    line("Primary rays", format::count(frame.stats.primary_rays));
    line("Hits", format::count(frame.stats.hits));
    line("Mray/s", format::significant(state.activity.mrays_per_s));
    if let Some([containers, primitives]) = shown.tests_per_ray {
        line("Tests per ray", number(containers + primitives));
        line("Container tests per ray", number(containers));
        line("Primitive tests per ray", number(primitives));
    }
    Some(text)
}
