//! The view "Ray" in the whole app: a ray is picked or typed, stepped through, and survives what happens to the tree.

use bvhscope::lab::ray::{RayMethod, RayRecord, Step};
use bvhscope::render::{RayKind, RayStart};
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::tree::traverse::{RayEvent, TestCounts, Traversal};
use egui::accesskit::Role;
use egui::{Key, Modifiers, PointerButton};
use egui_kittest::kittest::Queryable as _;
use glam::{DMat3, DVec3};

use crate::harness::{Window, app, drag, presented, press, settle, viewport};

/// The app with the view open and the ray of the pixel in the middle taken.
fn app_with_ray() -> Window {
    let mut harness = app();
    press(&mut harness, Modifiers::NONE, Key::F8);
    assert_eq!(harness.state().state.preferences.dock.open.as_deref(), Some("Ray"));
    let middle = viewport(&harness).center();
    drag(&mut harness, PointerButton::Primary, middle, &[]);
    harness
}

fn record(harness: &Window) -> RayRecord {
    let shown = harness.state().state.model.ray.shown().expect("a ray was recorded");
    (**shown).clone().expect("there is such a ray")
}

fn cursor(harness: &Window) -> usize {
    harness.state().state.model.ray.cursor
}

fn click(harness: &mut Window, label: &str) {
    harness.get_by_label(label).click();
    settle(harness);
}

#[test]
fn a_click_on_the_picture_takes_the_ray_of_its_pixel() {
    let mut harness = app();
    press(&mut harness, Modifiers::NONE, Key::F8);
    assert!(harness.query_by_label_contains("Click the picture").is_some(), "the empty view says what to do");
    let at = viewport(&harness).center();
    drag(&mut harness, PointerButton::Primary, at, &[]);
    let record = record(&harness);
    let shown = presented(&harness);
    let mut counts = TestCounts::default();
    let hit = shown.accel.closest_hit_with(&record.ray, Traversal::Ordered, &mut counts).unwrap();
    assert_eq!((record.counts, record.hit), (counts, Some((hit.t, hit.primitive_index))));
    let pixel = crate::harness::pixel(&harness, at);
    assert_eq!(harness.state().state.model.ray.source.map(|source| source.start), Some(RayStart::Pixel(pixel)));
    assert_eq!(harness.state().state.selection.nodes.selected, None, "the click selects nothing meanwhile");
    let totals = format!("In all {} container tests, {} triangle test", counts.containers, counts.primitives);
    assert!(harness.query_by_label_contains(&totals).is_some(), "{totals}");
    // Once rays are not picked, a click selects again.
    click(&mut harness, "Pick in the picture");
    drag(&mut harness, PointerButton::Primary, at, &[]);
    assert!(harness.state().state.selection.nodes.selected.is_some());
}

#[test]
fn the_strip_zooms_to_the_hit_and_back() {
    let mut harness = app_with_ray();
    let record = record(&harness);
    let (hit, _) = record.hit.expect("the middle is hit");
    let [first, last] = record.reach();
    click(&mut harness, "Zoom to hit");
    let [from, to] = harness.state().state.model.ray.zoom.expect("zoomed");
    assert!(from < hit && hit < to && to - from < 0.5 * (last - first), "{from} {hit} {to} of {first} {last}");
    click(&mut harness, "Whole ray");
    assert_eq!(harness.state().state.model.ray.zoom, None);
}

#[test]
fn the_same_ray_is_shown_in_both_trees() {
    let mut harness = app_with_ray();
    let strip = |harness: &Window| harness.get_by_label("Containers along the ray").rect();
    let alone = strip(&harness);
    press(&mut harness, Modifiers::COMMAND, Key::Num2);
    harness.state_mut().state.edited_build_mut().threshold = 40;
    settle(&mut harness);
    let second = harness.state().state.model.second.clone().expect("a second tree");
    let mut counts = TestCounts::default();
    second.accel.closest_hit_with(&record(&harness).ray, Traversal::Ordered, &mut counts);
    let name = format!("Containers along the ray in B: {} container tests", counts.containers);
    let below = harness.get_by_label_contains(&name).rect();
    for (letter, strip) in [("A: ", strip(&harness)), ("B: ", below)] {
        let mut named = harness.query_all_by_label_contains(letter);
        let is_above = |rect: egui::Rect| rect.bottom() <= strip.top() + 0.5 && rect.bottom() > strip.top() - 40.0;
        assert!(named.any(|node| is_above(node.rect())), "{letter} above its strip");
    }
    assert!(strip(&harness).height() < 0.6 * alone.height() && below.top() > strip(&harness).bottom());
}

#[test]
fn all_hits_are_listed_with_the_thickness_between_them() {
    let mut harness = app_with_ray();
    // Wait for the edges, which say whether parity counts.
    settle(&mut harness);
    let record = record(&harness);
    let scene = &presented(&harness).accel.scene;
    let [origin, direction] = [record.ray.origin, record.ray.direction].map(|vector| vector.as_dvec3());
    // By Cramer's rule, one triangle after another.
    let distance = |triangle: &Triangle| {
        let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(|corner| corner.as_dvec3());
        let of = |x: DVec3, y: DVec3, z: DVec3| DMat3::from_cols(x, y, z).determinant();
        let all = of(b - a, c - a, -direction);
        let [u, v, t] =
            [of(origin - a, c - a, -direction), of(b - a, origin - a, -direction), of(b - a, c - a, origin - a)]
                .map(|part| part / all);
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
    };
    let mut expected: Vec<f64> = scene.triangles.iter().filter_map(distance).collect();
    expected.sort_by(f64::total_cmp);
    let found: Vec<f32> = record.crossings.hits.iter().map(|hit| hit.t).collect();
    assert!(found.len() > 1 && found.len() == expected.len(), "{found:?} {expected:?}");
    assert!(found.iter().zip(&expected).all(|(a, b)| (f64::from(*a) - b).abs() < 1e-4 * b), "{found:?} {expected:?}");
    assert!(harness.query_by_label(&format!("All hits: {}", found.len())).is_some());
    assert!(harness.query_by_label_contains("passes through").is_some());
    let (index, second) = record.crossings.hits.iter().enumerate().find(|(_, hit)| hit.thickness.is_some()).unwrap();
    assert_eq!(second.thickness, Some(second.t - record.crossings.hits[index - 1].t));
    let row = harness.get_all_by_role(Role::ListItem).find(|row| {
        use egui_kittest::kittest::NodeT as _;
        row.accesskit_node().label().is_some_and(|label| label.starts_with("2 back"))
    });
    row.expect("the second surface is listed").click();
    settle(&mut harness);
    let selected = harness.state().state.selection.nodes.selected;
    assert_eq!(selected, presented(&harness).accel.path_to(second.triangle).last().copied());
}

#[test]
fn steps_are_walked_by_buttons_and_keys_and_lit_in_the_picture() {
    let mut harness = app_with_ray();
    let record = record(&harness);
    assert_eq!(cursor(&harness), 0);
    click(&mut harness, "Step");
    click(&mut harness, "Step");
    assert_eq!(cursor(&harness), 2);
    assert_eq!(harness.state().state.selection.nodes.traced, Some(record.steps[2].tree_node));
    click(&mut harness, "Back");
    assert_eq!(cursor(&harness), 1);
    click(&mut harness, "Next hit");
    let hit = record.next_hit(1).unwrap();
    assert_eq!(cursor(&harness), hit);
    assert!(matches!(record.steps[hit].what, Step::Event(RayEvent::Nearer { .. })));
    let waiting: Vec<u32> = record.stack_after(hit).iter().map(|&span| record.spans[span as usize].tree_node).collect();
    assert_eq!(harness.state().state.selection.nodes.waiting, waiting);
    click(&mut harness, "First");
    assert_eq!(cursor(&harness), 0);
    harness.get_by_label("Containers along the ray").focus();
    harness.run_steps(2);
    for key in [Key::ArrowRight, Key::ArrowRight, Key::ArrowRight, Key::ArrowLeft] {
        harness.key_press(key);
        harness.run_steps(2);
    }
    assert_eq!(cursor(&harness), 2);
    harness.key_press(Key::End);
    harness.run_steps(2);
    assert_eq!(cursor(&harness), record.steps.len() - 1);
    harness.key_press(Key::Home);
    harness.run_steps(2);
    assert_eq!(cursor(&harness), 0);
    harness.key_press(Key::Space);
    harness.run_steps(1);
    assert!(harness.state().state.model.ray.playing);
    harness.state_mut().state.model.ray.speed = 60.0;
    harness.run_steps(30);
    assert!(cursor(&harness) > 3, "{}", cursor(&harness));
    // Closed, the view marks nothing and costs nothing.
    press(&mut harness, Modifiers::NONE, Key::F8);
    let nodes = &harness.state().state.selection.nodes;
    assert_eq!((nodes.traced, nodes.waiting.len()), (None, 0));
    harness.state_mut().state.wanted.build.threshold += 9;
    settle(&mut harness);
    let accel = presented(&harness).accel;
    assert!(harness.state().state.model.ray.record.of_tree(&accel).is_none(), "nothing is recorded for a closed view");
}

#[test]
fn a_row_of_the_list_goes_to_its_step_and_selects_its_node() {
    let mut harness = app_with_ray();
    let record = record(&harness);
    let index = 3;
    let row = harness.get_all_by_role(Role::ListItem).find(|row| {
        use egui_kittest::kittest::NodeT as _;
        row.accesskit_node().label().is_some_and(|label| label.starts_with(&format!("{}  ", index + 1)))
    });
    row.expect("the fourth step is listed").click();
    settle(&mut harness);
    assert_eq!(cursor(&harness), index);
    assert_eq!(harness.state().state.selection.nodes.selected, Some(record.steps[index].tree_node));
}

#[test]
fn every_traversal_and_kind_of_ray_has_a_button() {
    let mut harness = app_with_ray();
    for method in RayMethod::ALL {
        click(&mut harness, &format!("Trace: {}", method.label()));
        let counts = record(&harness).counts;
        let ray = record(&harness).ray;
        let shown = presented(&harness);
        let mut expected = TestCounts::default();
        match method {
            RayMethod::Binary(traversal) => {
                shown.accel.closest_hit_with(&ray, traversal, &mut expected);
            }
            RayMethod::Wide => {
                let level = bvhscope_engine::kernel::SimdLevel::best().level();
                shown.accel.wide().tree.closest_hit_with(level, &ray, &mut expected);
            }
        }
        assert_eq!(counts, expected, "{method:?}");
    }
    let primary = record(&harness).ray;
    for kind in [RayKind::AmbientOcclusion, RayKind::Bounce] {
        click(&mut harness, kind.label());
        assert_ne!(record(&harness).ray, primary, "{kind:?}");
    }
    // A ray of the background leaves no surface: the view shows a message, and keeps running.
    let corner = viewport(&harness).left_top() + egui::vec2(40.0, 40.0);
    drag(&mut harness, PointerButton::Primary, corner, &[]);
    assert!(harness.query_by_label_contains("There is no such ray").is_some());
    click(&mut harness, RayKind::Primary.label());
    assert_eq!(record(&harness).hit, None);
}

#[test]
fn a_ray_is_typed_and_one_that_points_nowhere_keeps_the_one_before() {
    let mut harness = app_with_ray();
    let before = harness.state().state.model.ray.source;
    harness.state_mut().state.model.ray.typed = ["0, 5, 0", "0, 0, 0"].map(str::to_owned);
    click(&mut harness, "Trace");
    assert!(harness.query_by_label_contains("points nowhere").is_some());
    assert_eq!(harness.state().state.model.ray.source, before);
    assert!(!record(&harness).steps.is_empty(), "the ray before stays");
    harness.state_mut().state.model.ray.typed = ["0, 50, 0", "0, -2, 0"].map(str::to_owned);
    click(&mut harness, "Trace");
    assert!(harness.query_by_label_contains("points nowhere").is_none());
    let ray = record(&harness).ray;
    assert_eq!((ray.origin.y, ray.direction.y), (50.0, -1.0));
}

#[test]
fn the_ray_and_the_step_survive_another_tree() {
    let mut harness = app_with_ray();
    for _ in 0..5 {
        click(&mut harness, "Step");
    }
    let (before, old) = (record(&harness), presented(&harness).accel);
    harness.state_mut().state.wanted.build.container = bvhscope_engine::tree::ContainerKind::Sphere;
    settle(&mut harness);
    settle(&mut harness);
    assert!(!std::sync::Arc::ptr_eq(&old, &presented(&harness).accel));
    let after = record(&harness);
    assert_eq!((after.ray, cursor(&harness)), (before.ray, 5));
    assert_ne!(after.counts, before.counts, "spheres are tested otherwise");
    assert!(harness.query_by_label_contains("The tree has changed").is_some());
}
