//! Mouse and keyboard in the whole app: over the viewport and on the sliders.

use crate::harness::{
    Window, app, app_in_pixels, camera, double_click, drag, pixel, presented, press, settle, two, viewport,
};
use bvhscope::app::commands::{Action, command_line};
use bvhscope::app::format;
use bvhscope::app::state::{PickedTriangle, Severity};
use bvhscope::app::viewport::picking;
use bvhscope::catalog::layouts::LayoutChoice;
use bvhscope::overlay::OverlaySettings;
use bvhscope::render::{HeatKind, Shading};
use bvhscope::scene::SceneSource;
use bvhscope_engine::settings::BuilderKind;
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::Traversal;
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};

/// The statistic whose name is `name`, as it is displayed, without the difference from the tree before.
fn displayed(harness: &Window, name: &str) -> String {
    let start = format!("{name} ");
    // The accessible value of a label is its text.
    let node = harness.get_by(|node| node.value().is_some_and(|text| text.starts_with(&start)));
    let text = node.accesskit_node().value().unwrap();
    text[start.len()..].split(", ").next().unwrap_or_default().to_owned()
}

#[test]
fn a_dragged_threshold_rebuilds_the_tree_and_the_numbers_follow() {
    let mut harness = app();
    let before = displayed(&harness, "SAH cost");
    let rail = harness.get_by_role_and_label(Role::Slider, "Threshold δ").rect();
    let grip = Pos2::new(rail.left() + rail.width() * 0.4, rail.center().y);
    drag(&mut harness, PointerButton::Primary, grip, &[vec2(rail.width() * 0.1, 0.0); 4]);
    let threshold = harness.state().state.wanted.build.threshold;
    assert!(threshold > 12, "the handle is at {threshold}");
    let shown = presented(&harness);
    assert_eq!(shown.accel.settings.threshold, threshold);
    let stats = &shown.accel.report.stats;
    assert_eq!(displayed(&harness, "SAH cost"), format::significant(f64::from(stats.sah_cost)));
    assert_ne!(displayed(&harness, "SAH cost"), before);
    assert_eq!(displayed(&harness, "Nodes"), format::count(stats.nodes as u64));
    assert_eq!(displayed(&harness, "Depth"), stats.max_depth.to_string());
    let tests: f32 = shown.tests_per_ray.unwrap().iter().sum();
    assert_eq!(displayed(&harness, "Tests per pixel"), format::significant(f64::from(tests)));
}

/// Press, one movement and release in the events of one UI frame, as where a frame takes long.
fn drag_at_once(harness: &mut Window, from: Pos2, by: egui::Vec2) {
    let button = |pos: Pos2, pressed| crate::harness::button(pos, PointerButton::Primary, pressed);
    let events =
        [Event::PointerMoved(from), button(from, true), Event::PointerMoved(from + by), button(from + by, false)];
    harness.input_mut().events.extend(events);
    harness.run_steps(4);
    settle(harness);
}

#[test]
fn a_drag_within_one_frame_counts_in_the_picture_and_on_a_slider() {
    let mut harness = app();
    let (before, at) = (camera(&harness), viewport(&harness).center());
    drag_at_once(&mut harness, at, vec2(160.0, 0.0));
    assert_ne!(camera(&harness).eye, before.eye, "the view turns");
    let rail = harness.get_by_role_and_label(Role::Slider, "Threshold δ").rect();
    let threshold = harness.state().state.wanted.build.threshold;
    let grip = Pos2::new(rail.left() + rail.width() * 0.4, rail.center().y);
    drag_at_once(&mut harness, grip, vec2(rail.width() * 0.4, 60.0));
    assert!(harness.state().state.wanted.build.threshold > threshold, "though the pointer has left the slider");
}

#[test]
fn settings_are_undone_and_redone_by_keys() {
    let mut harness = app();
    let threshold = |harness: &Window| presented(harness).accel.settings.threshold;
    let start = threshold(&harness);
    press(&mut harness, Modifiers::NONE, Key::CloseBracket);
    assert_eq!(threshold(&harness), start + 1);
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!(threshold(&harness), start);
    press(&mut harness, Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);
    assert_eq!(threshold(&harness), start + 1);
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    press(&mut harness, Modifiers::COMMAND, Key::Y);
    assert_eq!(threshold(&harness), start + 1);
}

#[test]
fn a_click_picks_a_triangle_and_keys_walk_hide_and_show() {
    let mut harness = app();
    let middle = viewport(&harness).center();
    let [x, y] = pixel(&harness, middle);
    let shown = presented(&harness);
    let seen = picking::primitive_at(&shown.frame, x, y).expect("the teapot is in the middle");
    let middle = viewport(&harness).center();
    drag(&mut harness, PointerButton::Primary, middle, &[]);
    let PickedTriangle { primitive: triangle, path } =
        harness.state().state.selection.picked.clone().expect("the click picked nothing");
    assert_eq!((triangle, &path), (seen, &shown.accel.path_to(seen)));
    let selected = |harness: &Window| harness.state().state.selection.nodes.selected;
    let [.., parent, leaf] = path[..] else { panic!("the leaf is the root") };
    assert_eq!(selected(&harness), Some(leaf));
    assert!(harness.query_by_label(&format!("Triangle {}", format::count(u64::from(seen)))).is_some());

    press(&mut harness, Modifiers::ALT, Key::ArrowUp);
    assert_eq!(selected(&harness), Some(parent));
    let [first, second] = two(shown.table.children(parent));
    press(&mut harness, Modifiers::ALT, Key::ArrowDown);
    assert_eq!(selected(&harness), Some(leaf), "back down the way it came");
    press(&mut harness, Modifiers::ALT, Key::ArrowRight);
    assert_eq!(selected(&harness), Some(if leaf == first { second } else { first }));
    press(&mut harness, Modifiers::ALT, Key::ArrowUp);
    press(&mut harness, Modifiers::ALT.plus(Modifiers::SHIFT), Key::ArrowDown);
    assert_eq!(selected(&harness), Some(second));

    harness.state_mut().state.wanted.overlay.depth = Some([0, 0]);
    harness.state_mut().state.selection.nodes.selected = Some(0);
    settle(&mut harness);
    assert_eq!(harness.state().state.layout.graphics.overlay_counts(), (1, 1));
    press(&mut harness, Modifiers::NONE, Key::H);
    assert!(harness.state().state.selection.nodes.hidden.contains(&0));
    assert_eq!(harness.state().state.layout.graphics.overlay_counts().0, 0, "a hidden container is not drawn");
    press(&mut harness, Modifiers::ALT, Key::H);
    assert_eq!(harness.state().state.layout.graphics.overlay_counts(), (1, 1));
    press(&mut harness, Modifiers::NONE, Key::Escape);
    assert_eq!((selected(&harness), harness.state().state.selection.picked.is_none()), (None, true));
}

#[test]
fn esc_closes_an_open_list_before_it_clears_the_selection() {
    let mut harness = app();
    harness.state_mut().state.selection.nodes.selected = Some(0);
    let listed = |harness: &Window| harness.query_by_label(BuilderKind::Exact.label()).is_some();
    harness.get_by_role_and_label(Role::ComboBox, "Builder").click();
    harness.run_steps(3);
    assert!(listed(&harness), "the list is open");
    press(&mut harness, Modifiers::NONE, Key::Escape);
    assert!(!listed(&harness), "the list is closed");
    assert_eq!(harness.state().state.selection.nodes.selected, Some(0));
    press(&mut harness, Modifiers::NONE, Key::Escape);
    assert_eq!(harness.state().state.selection.nodes.selected, None);
}

#[test]
fn a_click_on_the_background_selects_nothing() {
    let mut harness = app();
    let middle = viewport(&harness).center();
    drag(&mut harness, PointerButton::Primary, middle, &[]);
    assert!(harness.state().state.selection.picked.is_some());
    let corner = viewport(&harness).right_top() + vec2(-20.0, 20.0);
    let [x, y] = pixel(&harness, corner);
    assert_eq!(picking::primitive_at(&presented(&harness).frame, x, y), None);
    drag(&mut harness, PointerButton::Primary, corner, &[]);
    assert!(
        harness.state().state.selection.picked.is_none() && harness.state().state.selection.nodes.selected.is_none()
    );
}

#[test]
fn a_drag_orbits_past_the_poles_without_sticking() {
    let mut harness = app();
    let (start, quarter) = (camera(&harness), viewport(&harness).height() * 0.25);
    let from = viewport(&harness).center();
    // Twelve drags of an eighth of a turn: over the pole, upside down along the back, and round again.
    let chord = 2.0 * start.distance() * (std::f32::consts::PI / 8.0).sin();
    for step in 1..=12 {
        let before = camera(&harness).eye;
        drag(&mut harness, PointerButton::Primary, from, &[vec2(0.0, quarter)]);
        let moved = camera(&harness).eye.distance(before);
        assert!((moved - chord).abs() < 0.02 * chord, "step {step} moved {moved} instead of {chord}");
    }
    assert!((camera(&harness).distance() - start.distance()).abs() < 1e-3 * start.distance());
    assert!(camera(&harness).eye.distance(start.eye) > start.distance(), "half a turn is left");
    // On by keys, 36 steps of 5 degrees, until the second turn is complete.
    for step in 0..36 {
        let before = camera(&harness).eye;
        harness.key_press(Key::ArrowUp);
        harness.run_steps(1);
        assert!(camera(&harness).eye.distance(before) > 0.05 * start.distance(), "it sticks at step {step}");
    }
    assert!(camera(&harness).eye.distance(start.eye) < 1e-2 * start.distance(), "a full turn leads back");
}

#[test]
fn the_wheel_zooms_to_the_point_under_the_pointer() {
    let mut harness = app();
    let at = viewport(&harness).center() + vec2(60.0, 20.0);
    let [x, y] = pixel(&harness, at);
    let point = |harness: &Window| picking::surface_point(&presented(harness).frame, x, y).unwrap();
    let (before, distance) = (point(&harness), camera(&harness).distance());
    harness.hover_at(at);
    harness.event(Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: vec2(0.0, 3.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Wheel,
        modifiers: Modifiers::NONE,
    });
    harness.run_steps(10);
    settle(&mut harness);
    assert!(camera(&harness).distance() < 0.9 * distance, "{} became {}", distance, camera(&harness).distance());
    let after = point(&harness);
    assert!(after.distance(before) < 0.01 * distance, "{before} became {after}");
    harness.key_press(Key::Plus);
    settle(&mut harness);
    assert!(point(&harness).distance(before) < 0.01 * distance, "the key zooms to the pointer too");
}

#[test]
fn other_buttons_pan() {
    for with in [PointerButton::Secondary, PointerButton::Middle] {
        let mut harness = app();
        let before = camera(&harness);
        let middle = viewport(&harness).center();
        drag(&mut harness, with, middle, &[vec2(30.0, 10.0), vec2(30.0, 10.0)]);
        let after = camera(&harness);
        let (eye, target) = (after.eye - before.eye, after.target - before.target);
        assert!(
            target.length() > 1e-2 * before.distance() && eye.distance(target) < 1e-5,
            "{with:?}: {eye} and {target}"
        );
        assert!(eye.dot(before.forward()).abs() < 1e-4, "{with:?} moves within the picture");
    }
}

#[test]
fn a_double_click_focuses_and_on_the_background_resets() {
    let mut harness = app();
    let corner = viewport(&harness).right_top() + vec2(-20.0, 20.0);
    // Fits the model to the viewport, of which nothing was known when it was loaded.
    double_click(&mut harness, corner);
    let start = camera(&harness);
    let at = viewport(&harness).center() + vec2(50.0, 30.0);
    let [x, y] = pixel(&harness, at);
    let point = picking::surface_point(&presented(&harness).frame, x, y).unwrap();
    double_click(&mut harness, at);
    assert!(camera(&harness).target.distance(point) < 1e-4, "{} instead of {point}", camera(&harness).target);
    double_click(&mut harness, corner);
    assert!(camera(&harness).target.distance(start.target) < 1e-4);
    assert!((camera(&harness).distance() - start.distance()).abs() < 1e-3 * start.distance());
}

/// The software driver of the tests draws the same picture with and without a window.
#[test]
fn the_copied_command_line_makes_the_picture_of_the_window() {
    let mut harness = app_in_pixels();
    let state = &mut harness.state_mut().state;
    state.wanted.overlay = OverlaySettings {
        depth: Some([2, 4]),
        follows_tree: false,
        containers: ContainerKind::OF_PAPER.into_iter().collect(),
        hidden_alpha: 0.6,
        line_width: 2.0,
        budget: Some(9),
        ..state.wanted.overlay
    };
    state.wanted.render.samples = 3;
    state.wanted.render.mesh_edges = true;
    state.wanted.camera.eye.y += 0.7;
    state.selection.nodes.selected = Some(1);
    state.selection.nodes.hidden.insert(5);
    settle(&mut harness);
    compare_with_command_line(&mut harness);
    // Lines alone, then the heat map of the paper's traversal without lines.
    harness.state_mut().state.preferences.show_geometry = false;
    compare_with_command_line(&mut harness);
    let state = &mut harness.state_mut().state;
    state.preferences.show_geometry = true;
    state.preferences.show_containers = false;
    state.wanted.render.shading = Shading::Heat(HeatKind::Both);
    state.wanted.render.traversal = Traversal::Paper;
    settle(&mut harness);
    compare_with_command_line(&mut harness);
    // The same of a layout, and then its nodes.
    harness.state_mut().state.model.layout.chosen = LayoutChoice::parse("4 optimal, 8, leaves 4").ok();
    compare_with_command_line(&mut harness);
    let state = &mut harness.state_mut().state;
    state.preferences.show_containers = true;
    state.wanted.render.shading = Shading::Lit;
    compare_with_command_line(&mut harness);
}

/// Runs the copied command line and compares its picture with that in the window.
fn compare_with_command_line(harness: &mut Window) {
    settle(harness);
    let window = harness.render().unwrap();
    let line = command_line(&harness.state().state);
    let folder = tempfile::tempdir().unwrap();
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_bvhscope"));
    let path = std::env::join_paths([program.parent().unwrap()]).unwrap();
    let output = std::process::Command::new("/bin/sh")
        .args(["-c", &line])
        .current_dir(folder.path())
        .env("PATH", path)
        .output()
        .unwrap();
    assert!(output.status.success(), "{line}\n{}", String::from_utf8_lossy(&output.stderr));
    let rendered = image::open(folder.path().join("bvhscope.png")).unwrap().to_rgba8();
    let [width, height] = harness.state().state.layout.viewport_px;
    // A legend lies below the picture where containers are drawn.
    assert!(rendered.width() == width && rendered.height() >= height, "{:?}", rendered.dimensions());
    let corner = viewport(harness).min;
    let (mut compared, mut different, mut colors) = (0, 0, std::collections::HashSet::new());
    // Without the lower quarter, where legend and gizmo are.
    for (y, x) in (0..height * 3 / 4).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let ours = window.get_pixel(corner.x as u32 + x, corner.y as u32 + y).0;
        let theirs = rendered.get_pixel(x, y).0;
        compared += 1;
        different += usize::from((0..3).any(|channel| ours[channel].abs_diff(theirs[channel]) > 3));
        colors.insert(theirs);
    }
    assert!(colors.len() > 50, "{line}\nonly {} colours", colors.len());
    assert!(different * 1000 < compared, "{line}\n{different} of {compared} pixels differ");
}

#[test]
fn a_camera_is_kept_found_again_and_removed() {
    let mut harness = app();
    let orbit = |harness: &mut Window, key: Key| {
        harness.get_by_label("Viewport").focus();
        settle(harness);
        press(harness, Modifiers::NONE, key);
        camera(harness)
    };
    let mut kept = Vec::new();
    for key in [Key::ArrowLeft, Key::ArrowUp] {
        kept.push(orbit(&mut harness, key));
        press(&mut harness, Modifiers::COMMAND, Key::D);
    }
    // Where one is already, no second one is kept.
    press(&mut harness, Modifiers::COMMAND, Key::D);
    assert_eq!(harness.state().state.preferences.bookmarks.len(), 2);
    assert_eq!(harness.state().state.messages.history.back().unwrap().text, "This camera is kept already as View 2");
    let elsewhere = orbit(&mut harness, Key::ArrowRight);
    assert!(kept[0] != kept[1] && !kept.contains(&elsewhere));
    for expected in [kept[0], kept[1], kept[0]] {
        press(&mut harness, Modifiers::NONE, Key::J);
        assert_eq!(camera(&harness), expected);
        assert_eq!(presented(&harness).frame.camera, expected);
    }
    // By the palette, from another model: a message appears, and nothing is lost.
    harness.state_mut().state.preferences.bookmarks[1].source = SceneSource::File("/elsewhere/hall.obj".into());
    Action::GoToBookmark(1).perform(&mut harness.state_mut().state);
    settle(&mut harness);
    assert_eq!(camera(&harness), kept[1]);
    let warned = harness.state().state.messages.history.back().unwrap().clone();
    assert!(warned.severity == Severity::Warning && warned.text.contains("was kept for hall.obj"), "{}", warned.text);
    assert!(!Action::RemoveBookmark.is_enabled(&harness.state().state), "this model's bookmark is elsewhere");
    press(&mut harness, Modifiers::NONE, Key::J);
    Action::RemoveBookmark.perform(&mut harness.state_mut().state);
    settle(&mut harness);
    assert_eq!(harness.state().state.preferences.bookmarks.len(), 1);
    assert!(!Action::NextBookmark.is_enabled(&harness.state().state));
}
