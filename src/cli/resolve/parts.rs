//! Parts of several commands: threads, loading, passes, camera, picture and overlay.

use crate::accel::Follow;
use crate::catalog::settings::{Given, OPTIMIZE};
use crate::cli::args::{
    AroundArgs, CameraArgs, CameraParts, CamerasArgs, FollowArgs, LoadArgs, MomentArgs, SettingFlags,
};
use crate::cli::values::ViewArg;
use crate::headless::{MomentChoice, Times};
use crate::overlay::OverlaySettings;
use crate::overlay::rows::CONTAINERS;
use crate::render::RenderSettings;
use crate::scene::LoadOptions;
use crate::view::{CameraChoice, NamedView};
use bvhscope_engine::follow::Policy;
use bvhscope_engine::settings::{Pass, Passes};
use bvhscope_engine::tree::ContainerKind;

/// The number of threads to work with: those asked for or all, never more than can run at once.
pub fn threads(requested: Option<usize>) -> usize {
    crate::threads::count(requested.unwrap_or(0))
}

pub fn load(args: &LoadArgs) -> LoadOptions {
    let instances = args.instances.unwrap_or_default();
    LoadOptions { allow_outside: args.allow_outside, scene: args.scene, fps: args.fps, instances }
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

/// A single moment.
pub(super) fn moment(args: MomentArgs) -> MomentChoice {
    MomentChoice { times: args.time.map(Times::At), clip: args.clip }
}

/// How the tree of a moment follows the model.
pub(super) fn follow(args: &FollowArgs) -> Follow {
    let frames = args.policy_frames.unwrap_or(Follow::default().frames);
    Follow { policy: args.policy.unwrap_or(Policy::Rebuild), frames }.normal()
}

/// The camera of a command that takes one.
pub fn camera(args: &CameraArgs) -> CameraChoice {
    camera_of(args.camera, &args.parts)
}

/// The cameras of a command that takes several; the default one where none is named.
pub(super) fn cameras(args: &CamerasArgs) -> Vec<CameraChoice> {
    let named = args.cameras.iter().map(|&view| camera_of(Some(view), &args.parts));
    let none_named = args.cameras.is_empty().then(|| camera_of(None, &args.parts));
    named.chain(none_named).collect()
}

fn camera_of(view: Option<ViewArg>, parts: &CameraParts) -> CameraChoice {
    let (view, of_file) = match view {
        Some(ViewArg::Named(view)) => (view, None),
        Some(ViewArg::OfFile(index)) => (NamedView::Default, Some(index)),
        None => (NamedView::Default, None),
    };
    let &CameraParts { eye, target, up, fov: fov_y, orthographic } = parts;
    CameraChoice { view, of_file, of_scene: None, eye, target, up, fov_y, orthographic }
}

/// The picture's settings.
pub(super) fn picture(flags: &SettingFlags<RenderSettings>, around: &AroundArgs) -> RenderSettings {
    RenderSettings { background: around.background.unwrap_or_default(), ..flags.0.settings() }
}

/// The overlay's settings; `None` without `--overlay`.
pub(super) fn overlay(flags: &SettingFlags<OverlaySettings>) -> Option<OverlaySettings> {
    flags.0.get(&CONTAINERS).map(|_| flags.0.settings())
}
