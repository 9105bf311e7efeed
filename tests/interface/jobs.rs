//! Background jobs under pressure: sliders dragged faster than trees are built, models opened while others load, workers that
//! panic.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Duration;

use bvhscope::app::state::Request;
use bvhscope::render::Frame;
use bvhscope::scene::SceneSource;
use bvhscope::worker::{Outcome, Worker};
use bvhscope_engine::cancel::CancelToken;
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use rayon::prelude::*;

use crate::harness::{Window, app_with};
use crate::recorded_screen;

fn builtin(name: &str, size: u32) -> SceneSource {
    SceneSource::Builtin { name: name.to_owned(), size: Some(size) }
}

/// The app as in a real window, where frames never wait for the workers.
fn app(source: SceneSource, width: f32, height: f32, scale: f32) -> Window {
    recorded_screen::open(source, egui::vec2(width, height), scale, false)
}

/// Runs frames until the picture has all its samples, a moment after the last change.
fn settle(harness: &mut Window) {
    for _ in 0..3_000 {
        harness.run_steps(3);
        assert!(harness.state_mut().run_until_idle());
        let state = &harness.state().state;
        let frame = state.model.presented.as_ref().map(|presented| &presented.frame);
        let complete = |frame: &Arc<Frame>| [frame.width_px, frame.height_px] == state.layout.viewport_px;
        if state.layout.viewport_px.contains(&0) || !harness.state().is_busy() && frame.is_some_and(complete) {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("the picture is never complete");
}

#[test]
fn two_hundred_slider_changes_end_on_the_last_value() {
    let mut harness = app(builtin("terrain", 60_000), 700.0, 500.0, 1.0);
    settle(&mut harness);
    for step in 0..200 {
        harness.state_mut().state.wanted.build.threshold = 2 + step % 60;
        harness.step();
    }
    settle(&mut harness);
    let presented = harness.state().state.model.presented.clone().unwrap();
    assert_eq!(presented.accel.settings.threshold, 2 + 199 % 60);
    assert_eq!(presented.frame.coarseness, 1.0, "and its picture is complete");
}

#[test]
fn trees_are_shown_while_the_slider_moves() {
    let mut harness = app(builtin("terrain", 60_000), 700.0, 500.0, 1.0);
    settle(&mut harness);
    let mut shown = vec![harness.state().state.model.presented.as_ref().unwrap().accel.settings.threshold];
    let mut wanted = 2;
    while shown.len() < 5 {
        wanted = 2 + (wanted + 7) % 60;
        harness.state_mut().state.wanted.build.threshold = wanted;
        harness.step();
        let presented = harness.state().state.model.presented.as_ref().unwrap();
        let frame = &presented.frame;
        assert_eq!(
            [frame.width_px, frame.height_px],
            [0, 1].map(|axis| {
                (harness.state().state.layout.viewport_px[axis] as f32 / frame.coarseness).ceil() as u32
            })
        );
        if shown.last() != Some(&presented.accel.settings.threshold) {
            shown.push(presented.accel.settings.threshold);
        }
    }
    settle(&mut harness);
    let presented = harness.state().state.model.presented.clone().unwrap();
    assert_eq!(presented.accel.settings.threshold, wanted);
    assert_eq!(presented.frame.coarseness, 1.0, "and its picture is complete");
}

#[test]
fn the_newest_of_several_models_is_shown_whole() {
    let mut harness = app(builtin("teapot", 3), 700.0, 500.0, 1.0);
    settle(&mut harness);
    let newest = SceneSource::Builtin { name: "cornell".to_owned(), size: None };
    for source in [builtin("terrain", 900_000), builtin("slivers", 300_000), newest.clone()] {
        harness.state_mut().state.activity.requests.push(Request::Open(source));
        harness.run_steps(2);
    }
    settle(&mut harness);
    let presented = harness.state().state.model.presented.clone().unwrap();
    assert_eq!(presented.accel.scene.source, newest);
    let triangles = presented.accel.scene.triangles.len() as u32;
    assert!(presented.frame.primitive.iter().all(|&primitive| primitive == u32::MAX || primitive < triangles));
}

#[test]
fn the_status_bar_follows_a_study_without_input() {
    let mut harness = app_with(builtin("walker", 20_000), egui::vec2(1100.0, 760.0), false);
    // The view "Motion".
    harness.key_press_modifiers(Modifiers::NONE, Key::T);
    let mut seen: Vec<f32> = Vec::new();
    for _ in 0..3_000 {
        harness.run_steps(1);
        if harness.query_by_role_and_label(Role::ProgressIndicator, "Following the clip").is_some() {
            let delay = harness.output().viewport_output[&egui::ViewportId::ROOT].repaint_delay;
            assert!(delay <= Duration::from_millis(100), "the next frame would come after {delay:?}");
            seen.extend(harness.state().state.activity.study.as_ref().map(|job| job.progress));
        }
        if seen.len() >= 10 && seen.last() > seen.first() {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("the bar does not move: {seen:?}");
}

#[test]
fn windows_of_every_size_and_scale_are_drawn() {
    for (width, height, scale) in [(1.0, 1.0, 1.0), (2.0, 900.0, 1.0), (640.0, 400.0, 2.0), (640.0, 400.0, 0.5)] {
        let mut harness = app(builtin("teapot", 2), width, height, scale);
        settle(&mut harness);
        harness.set_size(egui::vec2(300.0, 200.0));
        harness.set_pixels_per_point(scale * 1.5);
        settle(&mut harness);
        harness.set_size(egui::vec2(0.0, 0.0));
        harness.run_steps(3);
        harness.set_size(egui::vec2(700.0, 450.0));
        settle(&mut harness);
        let state = &harness.state().state;
        let frame = &state.model.presented.as_ref().unwrap().frame;
        assert_eq!([frame.width_px, frame.height_px], state.layout.viewport_px);
    }
}

#[test]
fn a_panic_among_threads_fails_one_job_and_not_the_next() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let worker = Worker::new(
        "test",
        || {},
        move |fails: bool, _: &CancelToken, _: &(dyn Fn(u32) + Sync)| {
            let sum = |i: u32| {
                assert!(!fails || i != 700, "on purpose");
                i
            };
            Some(pool.install(|| (0..1000_u32).into_par_iter().map(sum).sum()))
        },
    )
    .unwrap();
    let wait = || loop {
        if let Some(outcome) = worker.take() {
            return outcome;
        }
        std::thread::yield_now();
    };
    for _ in 0..3 {
        worker.request(true);
        assert!(matches!(wait(), Outcome::Panicked(text) if text.contains("on purpose")));
        worker.request(false);
        assert!(matches!(wait(), Outcome::Done(499_500)));
    }
}

#[test]
fn at_most_one_job_runs_and_one_waits() {
    let (running, most) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
    let (started, is_started) = mpsc::channel();
    let (all_requested, go_on) = mpsc::channel::<()>();
    let (ours, peak) = (Arc::clone(&running), Arc::clone(&most));
    let worker = Worker::new(
        "test",
        || {},
        move |request: usize, token: &CancelToken, _: &(dyn Fn(usize) + Sync)| {
            peak.fetch_max(ours.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            started.send(request).unwrap();
            if request == 0 {
                // Runs while all others are requested, although it is cancelled.
                go_on.recv().unwrap();
            }
            ours.fetch_sub(1, Ordering::SeqCst);
            (!token.is_cancelled()).then_some(request)
        },
    )
    .unwrap();
    worker.request(0);
    assert_eq!(is_started.recv().unwrap(), 0);
    for request in 1..=200 {
        worker.request(request);
    }
    assert!(worker.is_busy());
    all_requested.send(()).unwrap();
    let result = loop {
        if let Some(outcome) = worker.take() {
            break outcome;
        }
        std::thread::yield_now();
    };
    assert!(matches!(result, Outcome::Done(200)));
    drop(worker);
    assert_eq!(most.load(Ordering::SeqCst), 1, "at most one job runs");
    assert_eq!(is_started.iter().collect::<Vec<_>>(), [200], "of those that waited only the newest started");
}
