//! Parts of several commands: threads, loading, passes, camera, picture and overlay.

use crate::catalog::settings::{Given, OPTIMIZE};
use crate::cli::args::{CameraArgs, LoadArgs, OverlayArgs, PictureArgs};
use crate::cli::values::ViewArg;
use crate::overlay::OverlaySettings;
use crate::render::RenderSettings;
use crate::scene::LoadOptions;
use crate::view::{CameraChoice, NamedView};
use bvhscope_engine::settings::{Pass, Passes};
use bvhscope_engine::tree::ContainerKind;

/// The number of threads to work with: those asked for or all, never more than can run at once.
pub fn threads(requested: Option<usize>) -> usize {
    crate::threads::count(requested.unwrap_or(0))
}

pub fn load(args: &LoadArgs) -> LoadOptions {
    LoadOptions { allow_outside: args.allow_outside, scene: args.scene, fps: args.fps }
}

/// The error message for passes over the tree of a file that would move its nodes, if there are any.
pub fn invalid_passes_of_file(given: &Given) -> Option<String> {
    let passes = given.get(&OPTIMIZE).map(|_| given.settings().optimize)?;
    let moving = passes.without(Pass::Orient);
    (moving != Passes::NONE).then(|| {
        format!(
            "--optimize {moving} with --tree: the tree of a file keeps its nodes; of the passes only '{}' runs over it",
            Pass::Orient.name()
        )
    })
}

/// The error message for passes that do not support one of the containers, if there are any.
pub fn invalid_passes(given: &Given, containers: &[ContainerKind]) -> Option<String> {
    let only_boxes = given.pass_for_boxes()?;
    let has_boxes = |kind: &ContainerKind| matches!(kind, ContainerKind::Aabb | ContainerKind::Oriented);
    let other = containers.iter().find(|container| !has_boxes(container))?;
    Some(format!(
        "the pass '{}' works on boxes only: choose '--container box', or '--optimize {}' for {}",
        only_boxes.name(),
        Pass::Collapse.name(),
        other.plural()
    ))
}

/// The camera; `view` where none is named.
pub fn camera(args: &CameraArgs, view: NamedView) -> CameraChoice {
    let (view, of_file) = match args.camera {
        Some(ViewArg::Named(view)) => (view, None),
        Some(ViewArg::OfFile(index)) => (view, Some(index)),
        None => (view, None),
    };
    CameraChoice {
        view,
        of_file,
        of_scene: None,
        eye: args.eye,
        target: args.target,
        up: args.up,
        fov_y: args.fov,
        orthographic: args.orthographic,
    }
}

pub(super) fn picture(args: &PictureArgs) -> RenderSettings {
    let base = RenderSettings::default();
    RenderSettings {
        shading: args.shading.unwrap_or(base.shading),
        light: args.light.unwrap_or(base.light),
        exposure: args.exposure.unwrap_or(base.exposure),
        normals: args.normals.unwrap_or(base.normals),
        crease_degrees: args.crease.unwrap_or(base.crease_degrees),
        cluster_depth: args.cluster_depth.unwrap_or(base.cluster_depth),
        traversal: args.traversal.unwrap_or(base.traversal),
        heat_range: args.heat_range.or(base.heat_range),
        color_map: args.color_map.unwrap_or(base.color_map),
        background: base.background,
        mesh_edges: args.mesh_edges,
        section: base.section,
        ground: args.ground,
        simd: args.simd.unwrap_or(base.simd),
        samples: args.samples.unwrap_or(base.samples),
    }
}

/// The overlay settings; `None` without `--overlay`.
pub(super) fn overlay(args: &OverlayArgs) -> Option<OverlaySettings> {
    let kinds = args.overlay?;
    let base = OverlaySettings::default();
    let shown = OverlaySettings {
        depth: args.depth.or(base.depth),
        leaves_only: args.leaves,
        parents: args.parents,
        color_by: args.color_by.unwrap_or(base.color_by),
        hidden_alpha: args.hidden_lines.unwrap_or(base.hidden_alpha),
        line_width: args.line_width.unwrap_or(base.line_width),
        hide_triangles: true,
        faces: args.faces,
        overlap: args.overlap,
        budget: args.at_most.or(base.budget),
        ..base
    };
    Some(shown.with_kinds(kinds))
}
