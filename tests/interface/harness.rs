//! The whole app without a window, shared by the tests of interaction and views.

#![allow(dead_code, reason = "each test file uses its part")]

use bvhscope::app::state::Presented;
use bvhscope::camera::Camera;
use bvhscope::scene::{Instancing, LoadOptions, SceneSource};
use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, Vec2, vec2};
use egui_kittest::kittest::Queryable as _;

use crate::recorded_screen;
pub use crate::recorded_screen::Window;

/// The app on the built-in teapot; each frame waits until everything is fresh.
pub fn app() -> Window {
    app_of_size(vec2(1100.0, 760.0))
}

/// The same with a window size in points.
pub fn app_of_size(size: Vec2) -> Window {
    app_with(teapot(), size, true)
}

/// The same with one pixel per point, for tests about these.
pub fn app_in_pixels() -> Window {
    greeted(recorded_screen::open(teapot(), vec2(1100.0, 760.0), 1.0, true))
}

/// The app on any model. With `waits` each frame waits until everything is fresh.
pub fn app_with(source: SceneSource, size: Vec2, waits: bool) -> Window {
    greeted(recorded_screen::open(source, size, recorded_screen::COARSE, waits))
}

/// The app on a scene of copies in two levels.
pub fn app_of_copies() -> Window {
    app_in_two_levels("builtin:stack:60")
}

/// The app on the copies of a model in two levels.
pub fn app_in_two_levels(model: &str) -> Window {
    let source = SceneSource::parse(model.as_ref()).unwrap();
    let load = LoadOptions { instances: Instancing::TwoLevel, ..LoadOptions::default() };
    greeted(recorded_screen::open_with(source, load, vec2(1280.0, 860.0), recorded_screen::COARSE, true))
}

fn teapot() -> SceneSource {
    SceneSource::Builtin { name: "teapot".to_owned(), size: Some(2) }
}

/// The window once it shows the model.
fn greeted(mut harness: Window) -> Window {
    // The greeting would cover the viewport.
    harness.state_mut().state.preferences.greeted = true;
    harness.state_mut().state.preferences.toured = true;
    harness.state_mut().state.layout.tour = None;
    settle(&mut harness);
    harness
}

pub fn settle(harness: &mut Window) {
    harness.run_steps(3);
    assert!(harness.state_mut().run_until_idle());
    harness.run_steps(2);
}

pub fn viewport(harness: &Window) -> Rect {
    harness.get_by_label("Viewport").rect()
}

pub fn camera(harness: &Window) -> Camera {
    harness.state().state.wanted.camera
}

pub fn presented(harness: &Window) -> Presented {
    harness.state().state.model.presented.clone().unwrap()
}

/// The children of an interior node of a binary tree.
pub fn two(children: std::ops::Range<u32>) -> [u32; 2] {
    assert_eq!(children.len(), 2);
    [children.start, children.start + 1]
}

pub fn button(pos: Pos2, button: PointerButton, pressed: bool) -> Event {
    Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE }
}

/// Runs one frame with one event.
pub fn send(harness: &mut Window, event: Event) {
    harness.input_mut().events.push(event);
    harness.run_steps(1);
}

/// Presses a button, moves by each step, and releases it.
pub fn drag(harness: &mut Window, with: PointerButton, from: Pos2, steps: &[Vec2]) {
    send(harness, Event::PointerMoved(from));
    send(harness, button(from, with, true));
    let mut at = from;
    for step in steps {
        at += *step;
        send(harness, Event::PointerMoved(at));
    }
    send(harness, button(at, with, false));
    settle(harness);
}

/// Clicks the button of this name, and returns the text that it copies.
pub fn copied(harness: &mut Window, button: &str) -> String {
    harness.get_by_label(button).click();
    for _ in 0..4 {
        harness.run_steps(1);
        for command in &harness.output().platform_output.commands {
            if let egui::OutputCommand::CopyText(text) = command {
                return text.clone();
            }
        }
    }
    panic!("{button} copies nothing")
}

/// Clicks at a place of the window.
pub fn click(harness: &mut Window, at: Pos2) {
    harness.hover_at(at);
    harness.run_steps(1);
    for pressed in [true, false] {
        send(harness, button(at, PointerButton::Primary, pressed));
    }
    settle(harness);
}

/// Sends both clicks in one frame, because a frame of the harness takes longer than a double click may.
pub fn double_click(harness: &mut Window, at: Pos2) {
    harness.hover_at(at);
    harness.run_steps(1);
    for pressed in [true, false, true, false] {
        harness.input_mut().events.push(button(at, PointerButton::Primary, pressed));
    }
    settle(harness);
}

pub fn press(harness: &mut Window, modifiers: Modifiers, key: Key) {
    harness.key_press_modifiers(modifiers, key);
    settle(harness);
}

/// The pixel of the picture at a position in the window.
pub fn pixel(harness: &Window, at: Pos2) -> [u32; 2] {
    let inside = (at - viewport(harness).min) * harness.ctx.pixels_per_point();
    [inside.x as u32, inside.y as u32]
}
