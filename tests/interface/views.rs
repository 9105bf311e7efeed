//! Navigation (gizmo, view keys, fly mode) and the layout of panels in a small window.

use crate::harness::{Window, app, app_of_size, camera, drag, presented, press, send, settle, viewport};
use bvhscope::app::state::Navigation;
use bvhscope::app::viewport::picking;
use bvhscope::camera::Projection;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Vec2, vec2};
use egui_kittest::kittest::Queryable as _;
use glam::Vec3;

/// Direction from the target to the eye.
fn side(harness: &Window) -> Vec3 {
    -camera(harness).forward()
}

#[test]
fn keys_and_the_gizmo_look_along_the_axes() {
    let mut harness = app();
    for (modifiers, key, knob, axis) in [
        (Modifiers::NONE, Key::Num1, "View from +z", Vec3::Z),
        (Modifiers::COMMAND, Key::Num1, "View from -z", Vec3::NEG_Z),
        (Modifiers::NONE, Key::Num3, "View from +x", Vec3::X),
        (Modifiers::COMMAND, Key::Num3, "View from -x", Vec3::NEG_X),
        (Modifiers::NONE, Key::Num7, "View from +y", Vec3::Y),
        (Modifiers::COMMAND, Key::Num7, "View from -y", Vec3::NEG_Y),
    ] {
        press(&mut harness, modifiers, key);
        assert!(side(&harness).distance(axis) < 1e-2, "{key:?}: {}", side(&harness));
        let seen = camera(&harness);
        press(&mut harness, Modifiers::NONE, Key::R);
        assert!(side(&harness).distance(axis) > 0.2, "{key:?}: R goes back");
        harness.get_by_label(knob).click();
        settle(&mut harness);
        assert!(side(&harness).distance(axis) < 1e-2, "{knob}: {}", side(&harness));
        assert!(camera(&harness).up.distance(seen.up) < 1e-4, "{knob}: both agree on what is up");
        // The presented picture is from the same camera.
        assert_eq!(presented(&harness).frame.camera, camera(&harness));
    }
}

#[test]
fn orthographic_projection_keeps_the_size_of_the_target() {
    let mut harness = app();
    let hits = |harness: &Window| presented(harness).frame.stats.hits as f64;
    let before = hits(&harness);
    press(&mut harness, Modifiers::NONE, Key::Num5);
    assert_eq!(camera(&harness).projection, Projection::Orthographic);
    let parallel = hits(&harness);
    assert!((parallel / before - 1.0).abs() < 0.2, "{before} pixels became {parallel}");
    press(&mut harness, Modifiers::NONE, Key::Num5);
    assert_eq!(hits(&harness), before);
}

#[test]
fn another_up_axis_turns_the_view_and_what_is_front() {
    let mut harness = app();
    let hits = presented(&harness).frame.stats.hits;
    press(&mut harness, Modifiers::NONE, Key::U);
    assert!(camera(&harness).up.distance(Vec3::Z) < 1e-4);
    assert_ne!(presented(&harness).frame.stats.hits, hits, "the picture shows the model from elsewhere");
    press(&mut harness, Modifiers::NONE, Key::Num7);
    assert!(side(&harness).distance(Vec3::Z) < 1e-2, "the top is where up is");
    press(&mut harness, Modifiers::NONE, Key::U);
    assert!(camera(&harness).up.y.abs() > 0.5 || side(&harness).distance(Vec3::Y) < 1e-2);
}

#[test]
fn fly_keys_move_whatever_has_the_focus_and_the_mouse_looks_around() {
    let mut harness = app();
    press(&mut harness, Modifiers::NONE, Key::V);
    assert_eq!(harness.state().state.preferences.navigation, Navigation::Fly);
    // A slider has the focus.
    harness.get_by_label("More of containers").click();
    harness.run_steps(4);
    harness.get_by_role_and_label(Role::Slider, "Hidden lines").focus();
    harness.run_steps(2);
    let hold = |harness: &mut Window, key: Key, modifiers: Modifiers| {
        let before = camera(harness);
        let event = |pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
        send(harness, Event::ModifiersChanged(modifiers));
        send(harness, event(true));
        harness.run_steps(3);
        send(harness, event(false));
        send(harness, Event::ModifiersChanged(Modifiers::NONE));
        settle(harness);
        let moved = camera(harness).eye - before.eye;
        assert!((camera(harness).target - before.target).distance(moved) < 1e-4, "{key:?} does not turn");
        moved
    };
    let forward = camera(&harness).forward();
    let ahead = hold(&mut harness, Key::W, Modifiers::NONE);
    assert!(ahead.normalize().distance(forward) < 1e-3, "{ahead}");
    assert!(hold(&mut harness, Key::S, Modifiers::NONE).dot(forward) < 0.0);
    let right = forward.cross(Vec3::Y).normalize();
    assert!(hold(&mut harness, Key::D, Modifiers::NONE).normalize().distance(right) < 1e-3);
    assert!(hold(&mut harness, Key::A, Modifiers::NONE).dot(right) < 0.0);
    assert!(hold(&mut harness, Key::E, Modifiers::NONE).y > 0.0 && hold(&mut harness, Key::Q, Modifiers::NONE).y < 0.0);
    let faster = hold(&mut harness, Key::W, Modifiers::SHIFT);
    assert!(faster.length() > 2.0 * ahead.length(), "{} is not faster than {}", faster.length(), ahead.length());

    let (before, middle) = (camera(&harness), viewport(&harness).center());
    drag(&mut harness, PointerButton::Primary, middle, &[vec2(30.0, 0.0), vec2(30.0, 0.0)]);
    assert!(camera(&harness).eye.distance(before.eye) < 1e-5, "looking around stays in place");
    assert!(camera(&harness).forward().distance(before.forward()) > 0.02);
    press(&mut harness, Modifiers::NONE, Key::V);
    let resting = camera(&harness);
    harness.key_press(Key::W);
    settle(&mut harness);
    assert_eq!(camera(&harness), resting, "the letters mean nothing any more");
}

/// A window of 1280×720 pixels at 200 % has 640×360 points.
#[test]
fn in_a_narrow_window_one_panel_gives_way_to_the_other() {
    let mut harness = app_of_size(Vec2::new(640.0, 360.0));
    let seen = |harness: &Window| {
        ["Scene section", "Tree settings section"].map(|name| harness.query_by_label_contains(name).is_some())
    };
    assert_eq!(seen(&harness), [false, true], "the settings are in front");
    assert!(viewport(&harness).width() > 300.0, "{}", viewport(&harness).width());
    for (key, expected) in [
        (Key::F3, [true, false]),
        (Key::F4, [false, true]),
        (Key::F4, [false, false]),
        (Key::F3, [true, false]),
        (Key::F3, [false, false]),
    ] {
        press(&mut harness, Modifiers::NONE, key);
        harness.run_steps(20);
        assert_eq!(seen(&harness), expected, "{key:?}");
        assert!(viewport(&harness).width() > 300.0, "{key:?}: {}", viewport(&harness).width());
    }
    harness.get_by_label_contains("Show the settings").click();
    harness.run_steps(20);
    assert_eq!(seen(&harness), [false, true]);
    harness.set_size(Vec2::new(1100.0, 760.0));
    press(&mut harness, Modifiers::NONE, Key::F3);
    harness.run_steps(20);
    assert_eq!(seen(&harness), [true, true], "a wide one has room for both");
}

#[test]
fn the_selection_scrolls_into_view() {
    let mut harness = app_of_size(Vec2::new(1000.0, 560.0));
    let inside = |harness: &Window| {
        harness
            .query_by_label_contains("Area share ")
            .is_some_and(|row| harness.ctx.content_rect().contains_rect(row.rect()))
    };
    assert!(!inside(&harness));
    picking::pick(&mut harness.state_mut().state, Some(5));
    harness.run_steps(30);
    assert!(inside(&harness), "the details of the selected node lie below the window");
}
