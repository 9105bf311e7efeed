//! The window without a window: the whole app in a headless harness, each frame waiting until everything is fresh.

#![cfg(feature = "gui")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use bvhscope::app::App;
use bvhscope::app::state::{Request, Severity, Wanted};
use bvhscope::scene::SceneSource;
use eframe::egui;
use egui_kittest::Harness;

/// The app on the built-in teapot, small and with one sample a pixel, so that a test takes little time.
fn app() -> Harness<'static, App> {
    let mut wanted = Wanted::new(SceneSource::Builtin { name: "teapot".to_owned(), size: Some(4) });
    wanted.render.samples = 1;
    let mut harness = Harness::builder()
        .with_size(egui::vec2(1000.0, 640.0))
        .with_max_steps(40)
        .wgpu()
        .build_eframe(|context| App::new_for_test(context, wanted, true).unwrap());
    settle(&mut harness);
    harness
}

/// A few frames: what one frame changes, the next ones show.
fn settle(harness: &mut Harness<'static, App>) {
    harness.run_steps(4);
    assert!(harness.state_mut().run_until_idle());
    harness.run_steps(2);
}

#[test]
fn starts_with_a_picture_of_the_wanted_model() {
    let harness = app();
    let state = &harness.state().state;
    let presented = state.presented.as_ref().unwrap();
    assert_eq!(presented.accel.scene.source, state.wanted.source);
    assert_eq!([presented.frame.width_px, presented.frame.height_px], state.viewport_px);
    assert_eq!(presented.frame.coarseness, 1);
    assert!(presented.frame.stats.hits > 0, "the teapot is seen");
    assert!(state.overlay_counts.0 > 0, "containers lie over it");
    assert!(!harness.state().is_busy());
}

#[test]
fn a_new_threshold_gives_a_new_tree_and_its_picture() {
    let mut harness = app();
    let before = harness.state().state.presented.clone().unwrap();
    harness.state_mut().state.wanted.build.threshold = 24;
    settle(&mut harness);
    let after = harness.state().state.presented.clone().unwrap();
    assert_eq!(after.accel.settings.threshold, 24);
    assert_ne!(after.table.id, before.table.id);
    assert!(after.frame_id > before.frame_id);
    assert_ne!(after.accel.report.stats.sah_cost, before.accel.report.stats.sah_cost);
    assert_eq!(after.frame.primitive, before.frame.primitive, "another tree shows the same model");
}

#[test]
fn the_depth_changes_what_is_shown_but_not_the_picture() {
    let mut harness = app();
    harness.state_mut().state.wanted.overlay.depth = [0, 0];
    settle(&mut harness);
    let frame = harness.state().state.presented.as_ref().unwrap().frame_id;
    assert_eq!(harness.state().state.overlay_counts, (1, 1));
    harness.state_mut().state.wanted.overlay.depth = [1, 2];
    settle(&mut harness);
    let state = &harness.state().state;
    assert_eq!(state.overlay_counts, (6, 6));
    assert_eq!(state.presented.as_ref().unwrap().frame_id, frame);
}

#[test]
fn an_unusable_file_is_told_and_nothing_is_lost() {
    let mut harness = app();
    let before = harness.state().state.presented.as_ref().unwrap().frame_id;
    let source = harness.state().state.wanted.source.clone();
    let missing = SceneSource::File("does-not-exist.obj".into());
    harness.state_mut().state.requests.push(Request::Open(missing));
    settle(&mut harness);
    let state = &harness.state().state;
    assert_eq!(state.presented.as_ref().unwrap().frame_id, before);
    assert_eq!(state.wanted.source, source);
    let told: Vec<_> = state.messages.iter().filter(|message| message.severity == Severity::Error).collect();
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].text.contains("does-not-exist.obj"), "{}", told[0].text);
}

#[test]
fn refused_settings_leave_the_tree_alone() {
    let mut harness = app();
    let before = harness.state().state.presented.as_ref().unwrap().table.id;
    let build = &mut harness.state_mut().state.wanted.build;
    build.builder = bvhscope::bvh::BuilderKind::BinnedSah;
    build.container = bvhscope::bvh::ContainerKind::Sphere;
    settle(&mut harness);
    let state = &harness.state().state;
    assert_eq!(state.presented.as_ref().unwrap().table.id, before);
    assert_eq!(state.wanted.build, state.presented.as_ref().unwrap().accel.settings);
    assert!(state.messages.iter().any(|message| message.severity == Severity::Warning));
}

#[test]
fn a_picked_triangle_selects_the_path_to_its_leaf() {
    let mut harness = app();
    let state = &mut harness.state_mut().state;
    bvhscope::app::picking::pick(state, Some(5));
    let (primitive, path) = state.picked.clone().unwrap();
    assert_eq!((primitive, path[0]), (5, 0));
    assert_eq!(state.selection.selected, path.last().copied());
    bvhscope::app::picking::select_parent(state);
    assert_eq!(state.selection.selected, Some(path[path.len() - 2]));
    bvhscope::app::picking::select_child(state);
    assert_eq!(state.selection.selected, path.last().copied());
    state.wanted.build.threshold = 12;
    settle(&mut harness);
    let state = &harness.state().state;
    assert_eq!(state.picked.as_ref().map(|(primitive, _)| *primitive), Some(5), "it stays selected in a new tree");
}
