//! A model that moves: its time strip, playing, keys, what is shared of its moment, two trees, and files that change.

use std::path::Path;
use std::sync::{Arc, Weak};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use bvhscope::accel::node_values::NodeValues;
use bvhscope::app::commands::{Action, CompareStep, command_line, shared_state};
use bvhscope::app::state::{AppState, CompareView, Presented, Request};
use bvhscope::app::views::motion::MotionView;
use bvhscope::catalog::metrics::GROWTH;
use bvhscope::overlay::ColorBy;
use bvhscope::scene::{Moment, Scene, SceneSource};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::tree::ContainerKind;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Vec2, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use serde_json::{Value, json};

use crate::harness::{Window, app, app_with, camera, click, drag, presented, press, send, settle, viewport};

const SIZE: Vec2 = vec2(1100.0, 760.0);

fn builtin(name: &str, size: u32) -> SceneSource {
    SceneSource::Builtin { name: name.to_owned(), size: Some(size) }
}

/// The cloth, whose clip lasts two seconds, in a window whose frames wait until everything is fresh.
fn cloth() -> Window {
    app_with(builtin("cloth", 200), SIZE, true)
}

fn state(harness: &mut Window) -> &mut AppState {
    &mut harness.state_mut().state
}

fn wanted(harness: &Window) -> Option<Moment> {
    harness.state().state.wanted.moment
}

fn shown(harness: &Window) -> Option<Moment> {
    presented(harness).accel.scene.moment
}

fn is_playing(harness: &Window) -> bool {
    harness.state().state.model.playback.playing
}

#[test]
fn in_a_small_window_the_view_scrolls_within_the_dock() {
    let mut harness = app_with(builtin("cloth", 50), vec2(640.0, 360.0), true);
    press(&mut harness, Modifiers::NONE, Key::T);
    let tab = harness.get_by_role_and_label(Role::Tab, "Motion").rect();
    let bar = harness.get_by_label("Depth range").rect();
    assert!(bar.bottom() < 360.0 && tab.bottom() < bar.top(), "{tab:?} {bar:?}");
    assert!(viewport(&harness).height() > 40.0 && viewport(&harness).bottom() <= tab.top() + 1.0);
    // What is painted of the view stays above the depth bar.
    let plot = harness.get_by_label_contains("Plot of").rect();
    assert!(plot.height() >= 59.0, "{plot:?}");
}

#[test]
fn a_model_that_moves_has_a_time_strip_and_plays() {
    assert!(app().query_by_label("Play clip").is_none(), "the teapot stands still");
    let mut harness = cloth();
    let (rest, from) = (presented(&harness), camera(&harness));
    assert_eq!((wanted(&harness), shown(&harness)), (None, None), "without a clip chosen, the pose of the file");
    harness.get_by_label("Play clip").click();
    harness.run_steps(2);
    let mut scenes: Vec<Weak<Scene>> = Vec::new();
    let mut last = -1.0;
    for _ in 0..5 {
        harness.run_steps(1);
        assert!(is_playing(&harness));
        let frame = presented(&harness);
        assert_eq!(frame.accel.scene.moment, wanted(&harness), "tree and picture follow");
        assert!(Arc::ptr_eq(frame.accel.scene.motion.as_ref().unwrap(), rest.accel.scene.motion.as_ref().unwrap()));
        assert_ne!(frame.accel.scene.triangles, rest.accel.scene.triangles);
        let seconds = wanted(&harness).unwrap().seconds;
        assert!(seconds != last);
        (last, scenes) = (seconds, [scenes, vec![Arc::downgrade(&frame.accel.scene)]].concat());
    }
    assert_eq!(camera(&harness), from, "the camera stays");
    harness.get_by_label("Pause clip").click();
    settle(&mut harness);
    assert!(!is_playing(&harness));
    assert!(presented(&harness).frame.coarseness == 1.0 && presented(&harness).tests_per_ray.is_some(), "refined");
    assert!(!harness.state().state.undo.can_undo(), "playing is no step to undo");
    // Memory is given back on a thread of its own.
    for _ in 0..500 {
        if scenes.iter().filter(|scene| scene.strong_count() > 0).count() <= 1 {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    panic!("frames are kept");
}

#[test]
fn keys_play_and_step() {
    let mut harness = cloth();
    let seconds = |harness: &Window| shown(harness).unwrap().seconds;
    press(&mut harness, Modifiers::SHIFT, Key::ArrowRight);
    assert_eq!(shown(&harness), Some(Moment { clip: 0, seconds: 0.0 }), "the first step chooses the first clip");
    press(&mut harness, Modifiers::SHIFT, Key::ArrowRight);
    press(&mut harness, Modifiers::SHIFT, Key::ArrowRight);
    assert!((seconds(&harness) - 0.08).abs() < 1e-6);
    press(&mut harness, Modifiers::SHIFT, Key::ArrowLeft);
    assert!((seconds(&harness) - 0.04).abs() < 1e-6);
    press(&mut harness, Modifiers::NONE, Key::L);
    assert!(!harness.state().state.model.playback.looped);
    press(&mut harness, Modifiers::NONE, Key::Space);
    for _ in 0..200 {
        harness.run_steps(1);
        if !is_playing(&harness) {
            break;
        }
    }
    assert_eq!((is_playing(&harness), seconds(&harness)), (false, 2.0), "it stops at the end");
    // Beside a model that stands still, the keys do nothing.
    let mut harness = app();
    press(&mut harness, Modifiers::NONE, Key::Space);
    assert!(!Action::PlayClip.is_enabled(&harness.state().state) && wanted(&harness).is_none());
}

#[test]
fn a_drag_along_the_strip_goes_to_any_moment() {
    let mut harness = cloth();
    let slider = harness.get_by_role_and_label(Role::Slider, "Time").rect();
    let from = slider.left_center() + vec2(10.0, 0.0);
    drag(&mut harness, PointerButton::Primary, from, &[vec2(slider.width() * 0.25, 0.0); 2]);
    let moment = shown(&harness).unwrap();
    assert!((0.9..1.15).contains(&moment.seconds), "{moment:?}");
    assert_eq!(wanted(&harness), Some(moment));
    let text = harness.query_all_by_label_contains("of 2.00 s").count();
    assert_eq!(text, 1, "the strip names the time");
}

#[test]
fn the_moment_is_shared_and_copied() {
    let mut first = cloth();
    state(&mut first).clock().unwrap().go_to(0.5);
    settle(&mut first);
    let line = shared_state(&first.state().state).line();
    let mut second = app();
    send(&mut second, Event::Paste(line.clone()));
    settle(&mut second);
    assert_eq!(shown(&second), Some(Moment { clip: 0, seconds: 0.5 }), "{line}");
    assert_eq!(presented(&second).accel.scene.triangles, presented(&first).accel.scene.triangles);
    let command = command_line(&first.state().state);
    assert!(command.contains(" --time 0.5 ") && !command.contains("--clip"), "{command}");
    // Another model begins in its own pose.
    state(&mut first).activity.requests.push(Request::Open(builtin("explosion", 100)));
    settle(&mut first);
    assert_eq!((wanted(&first), shown(&first)), (None, None));
    assert!(!command_line(&first.state().state).contains("--time"));
}

#[test]
fn both_trees_are_of_the_same_moment() {
    // No frame of this window waits.
    let mut harness = app_with(builtin("cloth", 2_000), SIZE, false);
    settle(&mut harness);
    press(&mut harness, Modifiers::COMMAND, Key::Num2);
    state(&mut harness).wanted.second.as_mut().unwrap().build.threshold = 20;
    Action::Compare(CompareStep::View(CompareView::Split)).perform(state(&mut harness));
    settle(&mut harness);
    state(&mut harness).clock().unwrap().toggle_play();
    let mut seen = std::collections::BTreeSet::new();
    for _ in 0..400 {
        harness.run_steps(1);
        let second = harness.state().state.model.second.clone().expect("the second tree stays");
        assert_eq!(second.accel.settings.threshold, 20);
        assert!(Arc::ptr_eq(&second.accel.scene, &presented(&harness).accel.scene));
        seen.extend(second.accel.scene.moment.map(|moment| moment.seconds.to_bits()));
        if seen.len() > 5 {
            break;
        }
    }
    assert!(seen.len() > 5, "both go on");
    press(&mut harness, Modifiers::NONE, Key::Space);
    assert_eq!(harness.state().state.shown_view(), CompareView::Split);
}

#[test]
fn slow_trees_drop_frames_and_never_fall_behind() {
    // No frame of this window waits.
    let mut harness = app_with(builtin("cloth", 20_000), SIZE, false);
    state(&mut harness).clock().unwrap().toggle_play();
    let mut seen: Vec<f32> = Vec::new();
    let mut wanted_at = Vec::new();
    for _ in 0..400 {
        harness.run_steps(1);
        wanted_at.extend(wanted(&harness).map(|moment| moment.seconds));
        if let Some(moment) = shown(&harness)
            && seen.last() != Some(&moment.seconds)
        {
            seen.push(moment.seconds);
        }
        if seen.len() > 12 {
            break;
        }
    }
    assert!(seen.len() > 2, "it plays: {seen:?}");
    // Each shown moment was wanted in some frame, and in the same order: no older frame comes after a newer one.
    let mut rest = wanted_at.iter();
    for moment in &seen {
        assert!(rest.any(|wanted| wanted == moment), "{moment} of {seen:?} in {wanted_at:?}");
    }
    state(&mut harness).clock().unwrap().toggle_play();
    settle(&mut harness);
    assert_eq!(shown(&harness), wanted(&harness), "the latest is shown at last");
}

/// A triangle that `clips` clips move, each by its number plus one, in a second.
fn write_clips(path: &Path, clips: usize) {
    let floats: Vec<f32> = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].into();
    let bytes: Vec<u8> = floats.iter().flat_map(|number| number.to_le_bytes()).collect();
    let view = |offset: usize, length: usize| json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    let accessor = |view: usize, count: usize, kind: &str| json!({"bufferView": view, "componentType": 5126, "count": count, "type": kind});
    let clip = |index: usize| {
        json!({"name": format!("move {index}"),
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            "samplers": [{"input": 1, "output": 2}]})
    };
    let mut positions = accessor(0, 3, "VEC3");
    (positions["min"], positions["max"]) = (json!([0, 0, 0]), json!([1, 1, 0]));
    let document: Value = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": bytes.len(), "uri": format!("data:application/octet-stream;base64,{}", STANDARD.encode(&bytes))}],
        "bufferViews": [view(0, 36), view(36, 8), view(44, 24)],
        "accessors": [positions, accessor(1, 2, "SCALAR"), accessor(2, 2, "VEC3")],
        "animations": (0..clips).map(clip).collect::<Vec<_>>(),
    });
    std::fs::write(path, document.to_string()).unwrap();
}

#[test]
fn ten_thousand_clips_are_listed_filtered_and_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("many.gltf");
    write_clips(&path, 10_000);
    let mut harness = app_with(SceneSource::File(path), SIZE, true);
    harness.get_by_role_and_label(Role::ComboBox, "Clip").click();
    settle(&mut harness);
    let rows = harness.query_all_by_label_contains("move ").count();
    assert!((4..40).contains(&rows), "{rows} rows: only those in view are laid out");
    harness.query_all_by_role(Role::TextInput).next().expect("a field that filters them").click();
    harness.run_steps(2);
    harness.query_all_by_role(Role::TextInput).next().unwrap().type_text("move 9876");
    settle(&mut harness);
    harness.get_by_label("move 9876").click();
    settle(&mut harness);
    assert_eq!(shown(&harness), Some(Moment { clip: 9876, seconds: 0.0 }));
    let command = command_line(&harness.state().state);
    assert!(command.contains(" --clip 'move 9876' --time 0 "), "{command}");
}

#[test]
fn a_model_that_is_replaced_while_it_plays_goes_on_or_says_why_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("changing.gltf");
    write_clips(&path, 2);
    let mut harness = app_with(SceneSource::File(path.clone()), SIZE, true);
    state(&mut harness).clock().unwrap().choose_clip(Some(1));
    state(&mut harness).clock().unwrap().toggle_play();
    harness.run_steps(2);
    let reload = |harness: &mut Window| {
        state(harness).activity.requests.push(Request::Reload);
        harness.run_steps(3);
    };
    let before = presented(&harness).accel.scene.motion.clone().unwrap();
    reload(&mut harness);
    assert!(!Arc::ptr_eq(&before, presented(&harness).accel.scene.motion.as_ref().unwrap()), "read again");
    assert_eq!((is_playing(&harness), wanted(&harness).map(|moment| moment.clip)), (true, Some(1)), "it goes on");
    write_clips(&path, 1);
    reload(&mut harness);
    assert_eq!((is_playing(&harness), wanted(&harness), shown(&harness)), (false, None, None));
    let messages = &harness.state().state.messages.history;
    assert!(messages.iter().any(|message| message.text.contains("no such clip")));
    state(&mut harness).clock().unwrap().toggle_play();
    harness.run_steps(1);
    write_clips(&path, 0);
    reload(&mut harness);
    assert!(!is_playing(&harness));
    assert!(harness.query_by_label("Play clip").is_none(), "it stands still now");
}

/// The view "Motion" over the walker, measured.
fn measured() -> Window {
    let mut harness = app_with(builtin("walker", 600), vec2(1100.0, 900.0), true);
    state(&mut harness).wanted.follow.frames = 10;
    press(&mut harness, Modifiers::NONE, Key::T);
    harness
}

#[test]
fn the_view_measures_each_policy_over_the_clip() {
    let mut harness = measured();
    let curves = harness.state().state.views.get::<MotionView>().curves().cloned().expect("measured");
    let curves = curves.as_ref().as_ref().unwrap();
    assert_eq!(curves.iter().map(|curve| curve.policy).collect::<Vec<_>>(), Policy::ALL);
    assert!(curves.iter().all(|curve| curve.rows.len() == 10));
    assert!(harness.query_by_label("Plot of SAH cost over the clip").is_some());
    assert_eq!(harness.state().state.views.get::<MotionView>().hidden, [Policy::Keep]);
    harness.get_by_role_and_label(Role::Button, "Refit").click();
    settle(&mut harness);
    assert_eq!(harness.state().state.views.get::<MotionView>().hidden, [Policy::Keep, Policy::Refit]);
    assert!(harness.query_by_label_contains("Cheapest with").is_some());
    // A step in time measures nothing anew; another container does, without what moves subtrees of boxes only.
    let before = harness.state().state.views.get::<MotionView>().curves().cloned().unwrap();
    press(&mut harness, Modifiers::SHIFT, Key::ArrowRight);
    assert!(Arc::ptr_eq(&before, harness.state().state.views.get::<MotionView>().curves().unwrap()));
    state(&mut harness).wanted.build.container = ContainerKind::Sphere;
    settle(&mut harness);
    let curves = harness.state().state.views.get::<MotionView>().curves().cloned().unwrap();
    assert_eq!(curves.as_ref().as_ref().unwrap().len(), Policy::ALL.len() - 1);
    // A model that stands still has nothing to measure.
    state(&mut harness).activity.requests.push(Request::Open(builtin("teapot", 2)));
    settle(&mut harness);
    assert!(harness.query_by_label_contains("This model stands still").is_some());
    assert!(harness.state().state.views.get::<MotionView>().curves().is_none());
}

#[test]
fn a_click_goes_to_the_frame_with_a_tree_by_the_policy() {
    let mut harness = measured();
    state(&mut harness).views.get_mut::<MotionView>().hidden =
        Policy::ALL.into_iter().filter(|policy| *policy != Policy::Rotate).collect();
    settle(&mut harness);
    let curves = harness.state().state.views.get::<MotionView>().curves().cloned().unwrap();
    let curve = curves.as_ref().as_ref().unwrap().iter().find(|curve| curve.policy == Policy::Rotate).unwrap();
    let plot = harness.get_by_label("Plot of SAH cost over the clip").rect();
    // Of a single curve, the pointer finds some point within reach on the way down.
    for share in 1..20 {
        click(&mut harness, plot.center_top() + vec2(0.0, plot.height() * share as f32 / 20.0));
        if wanted(&harness).is_some() {
            break;
        }
    }
    let moment = wanted(&harness).expect("a frame was clicked");
    let row = curve.rows.iter().find(|row| row.seconds == moment.seconds).expect("a frame of the clip");
    let accel = presented(&harness).accel;
    assert_eq!((accel.follow.policy, accel.scene.moment), (Policy::Rotate, Some(moment)));
    assert_eq!(accel.report.stats.sah_cost, row.stats.sah_cost, "the very tree that was measured");
}

#[test]
fn containers_show_how_much_they_have_grown() {
    let mut harness = app_with(builtin("explosion", 300), SIZE, true);
    state(&mut harness).wanted.overlay.color_by = ColorBy::Metric(GROWTH);
    state(&mut harness).wanted.follow.policy = Policy::Refit;
    settle(&mut harness);
    assert!(harness.query_by_label_contains("Legend. Containers: depth").is_some(), "nothing has grown yet");
    assert!(harness.query_by_label_contains("Known of trees that are kept or fitted").is_some());
    state(&mut harness).clock().unwrap().go_to(1.0);
    settle(&mut harness);
    let accel = presented(&harness).accel;
    let (built, values) = (accel.built_areas().unwrap(), NodeValues { accel: &accel, visits: None });
    assert!(values.get(GROWTH, 0).unwrap() > 2.0 && built.len() == accel.tree.node_count());
    assert!(harness.query_by_label_contains("Legend. Containers: area over that when built").is_some());
    state(&mut harness).wanted.follow.policy = Policy::Rebuild;
    settle(&mut harness);
    assert!(presented(&harness).accel.built_areas().is_none());
}

#[test]
fn two_trees_follow_by_policies_of_their_own() {
    let mut harness = cloth();
    press(&mut harness, Modifiers::COMMAND, Key::Num2);
    state(&mut harness).wanted.second.as_mut().unwrap().policy = Policy::Refit;
    state(&mut harness).clock().unwrap().go_to(0.7);
    settle(&mut harness);
    let second = harness.state().state.model.second.clone().unwrap();
    assert_eq!([presented(&harness).accel.follow.policy, second.accel.follow.policy], [Policy::Rebuild, Policy::Refit]);
    let hash = |shown: &Presented| shown.accel.hash(&CancelToken::new()).unwrap();
    assert_ne!(hash(&presented(&harness)), hash(&second));
    assert_eq!(presented(&harness).frame.primitive, second.frame.primitive, "the same hits");
    let names = [presented(&harness), second].map(|shown| shown.name());
    assert_eq!(names, ["AAC δ 6 ε 0.2, boxes", "AAC δ 6 ε 0.2, boxes, refit"]);
    assert!(harness.query_by_label_contains("B: AAC δ 6 ε 0.2, boxes, refit").is_some(), "the headline");
}

#[test]
fn open_views_follow_while_the_model_plays() {
    // No frame of this window waits, and a view takes longer than a frame.
    for (view, key, waiting) in [
        ("Merges", Key::F6, "Building the tree once more"),
        ("Icicle", Key::F7, "Measuring the subtrees"),
        ("Nodes", Key::F9, "Rebuilding subtrees"),
        ("Plots", Key::F10, "Counting the visits"),
    ] {
        let mut harness = app_with(builtin("walker", 3_000), SIZE, false);
        press(&mut harness, Modifiers::NONE, key);
        settle(&mut harness);
        assert!(harness.query_by_label_contains(waiting).is_none(), "{view}: all is known at rest");
        state(&mut harness).clock().unwrap().toggle_play();
        let (mut seen, mut behind) = (Vec::new(), 0);
        for _ in 0..3_000 {
            harness.run_steps(1);
            assert!(harness.query_by_label_contains(waiting).is_none(), "{view}: what was known stays");
            let model = &harness.state().state.model;
            let moment = model.in_views().and_then(|shown| shown.accel.scene.moment).map(|moment| moment.seconds);
            if seen.last() != Some(&moment) {
                seen.push(moment);
            }
            let visits =
                model.in_views().and_then(|shown| harness.state().state.model.derived.known_visits(&shown.accel));
            assert!(visits.is_some() || !["Nodes", "Plots"].contains(&view), "{view}: visits are those of its tree");
            if model.is_view_behind() {
                behind += 1;
                let text = format!("at {:.2} s", moment.unwrap_or_default());
                assert!(harness.query_by_label(&text).is_some() || moment.is_none(), "{view}: {text}");
            }
            if seen.len() > 4 && behind > 0 {
                break;
            }
        }
        assert!(seen.len() > 4 && behind > 0, "{view} follows: {seen:?}, {behind}");
        // Nodes of a tree that is not on the screen are not selected.
        let selected = harness.state().state.selection.nodes.selected;
        state(&mut harness).clock().unwrap().toggle_play();
        settle(&mut harness);
        let model = &harness.state().state.model;
        assert!(
            !model.is_view_behind() && Some(shown(&harness)) == model.in_views().map(|shown| shown.accel.scene.moment)
        );
        assert_eq!(harness.state().state.selection.nodes.selected, selected);
    }
}

#[test]
fn a_policy_ends_with_its_model_and_its_time_is_that_of_an_update() {
    let mut harness = cloth();
    state(&mut harness).clock().unwrap().go_to(0.5);
    state(&mut harness).wanted.follow.policy = Policy::Keep;
    settle(&mut harness);
    assert_eq!(presented(&harness).accel.follow.policy, Policy::Keep);
    let shows = |harness: &Window, start: &str| {
        harness.query_by(|node| node.value().is_some_and(|text| text.starts_with(start))).is_some()
    };
    assert!(shows(&harness, "Update time ") && !shows(&harness, "Build speed "));
    state(&mut harness).activity.requests.push(Request::Open(builtin("walker", 500)));
    settle(&mut harness);
    assert_eq!(harness.state().state.wanted.follow.policy, Policy::Rebuild);
    assert!(!shows(&harness, "Update time ") && shows(&harness, "Build speed "));
}

/// Writes a frame of a row: `count` triangles at `x`.
fn write_frame(folder: &Path, number: usize, x: usize, count: usize) {
    let triangles = (0..count).map(|y| format!("v {x} {y} 0\nv {} {y} 0\nv {x} {} 0\nf -3 -2 -1\n", x + 1, y + 1));
    std::fs::write(folder.join(format!("w_{number:02}.obj")), triangles.collect::<String>()).unwrap();
}

#[test]
fn a_row_of_files_plays_as_a_sequence() {
    let folder = tempfile::tempdir().unwrap();
    (1..=5).for_each(|number| write_frame(folder.path(), number, number, 6));
    let pattern = folder.path().join("w_##.obj");
    let mut harness = app_with(SceneSource::File(pattern.clone()), SIZE, true);
    state(&mut harness).wanted.follow.policy = Policy::Refit;
    // A frame of the row a step.
    for frame in 0..5 {
        press(&mut harness, Modifiers::SHIFT, Key::ArrowRight);
        assert!((shown(&harness).unwrap().seconds - frame as f32 / 24.0).abs() < 1e-5, "{frame}");
        let accel = presented(&harness).accel;
        assert_eq!((accel.scene.triangles[0].a.x, accel.follow.policy), ((frame + 1) as f32, Policy::Refit));
    }
    let command = command_line(&harness.state().state);
    let named = format!("bvhscope render '{}' ", pattern.display());
    assert!(command.starts_with(&named) && command.contains(" --policy refit --policy-frames 25 "), "{command}");
    // Frames of other triangles: no tree follows.
    write_frame(folder.path(), 3, 3, 9);
    state(&mut harness).activity.requests.push(Request::Reload);
    settle(&mut harness);
    assert_eq!(harness.state().state.wanted.follow.policy, Policy::Rebuild);
    assert!(shown(&harness).is_some(), "the moment stays");
    harness.get_by_role_and_label(Role::ComboBox, "Policy").click();
    settle(&mut harness);
    assert!(harness.get_by_role_and_label(Role::Button, "Refit").accesskit_node().is_disabled());
    assert!(!harness.get_by_role_and_label(Role::Button, "Rebuild").accesskit_node().is_disabled());
    press(&mut harness, Modifiers::NONE, Key::Escape);
    state(&mut harness).clock().unwrap().toggle_play();
    let mut counts = std::collections::BTreeSet::new();
    for _ in 0..40 {
        harness.run_steps(1);
        counts.insert(presented(&harness).accel.scene.triangles.len());
    }
    assert!(is_playing(&harness) && counts.into_iter().eq([6, 9]), "each frame has its own");
    // A policy that a pasted state brings is refused, and the present tree stays.
    state(&mut harness).clock().unwrap().go_to(0.0);
    settle(&mut harness);
    state(&mut harness).wanted.follow.policy = Policy::WholeClip;
    settle(&mut harness);
    let messages = &harness.state().state.messages.history;
    assert!(messages.iter().any(|message| message.text.contains("no tree can follow them by 'whole-clip'")));
    assert_eq!(presented(&harness).accel.follow.policy, Policy::Rebuild);
}
