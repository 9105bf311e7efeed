//! The headline of the left panel and the selection's dock: what differs from the tree before, and that nothing moves.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::harness::{Window, app_of_size, presented, settle};
use crate::panel::{harness, present, sized, state};
use bvhscope::app::format;
use bvhscope::app::state::comparison::{Comparison, Counted, Verdict};
use bvhscope::app::state::{AppState, JobStatus, PickedTriangle};
use bvhscope::catalog::numbers::rows::{MRAYS_PER_S, SAH_COST, TESTS_PER_RAY};
use bvhscope::catalog::numbers::{Number, millions_per_second};
use bvhscope::lab::at_rest::measure_at_rest;
use bvhscope::render::{HeatKind, Shading};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::query::closed::Edges;
use bvhscope_engine::settings::{Pass, Preset};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::Traversal;
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};

/// Builds and presents the wanted tree again.
fn again(s: &mut AppState) {
    let scene = Arc::clone(s.model.loaded.as_ref().unwrap());
    present(s, &scene);
}

/// Takes the readings of the shown tree that the window takes at rest.
fn measure(s: &AppState) {
    measure_at_rest(&[&s.model.presented.as_ref().unwrap().accel], &CancelToken::new()).unwrap();
}

fn comparison(s: &AppState, quantity: &'static Number) -> Comparison {
    s.model.presented.as_ref().unwrap().compare(quantity)
}

/// The spoken name of a tile.
fn tile(h: &Harness<'static, AppState>, name: &str) -> String {
    let node = h.get_by(|node| node.value().is_some_and(|text| text.starts_with(name)));
    node.accesskit_node().value().unwrap_or_default()
}

#[test]
fn tests_per_ray_are_estimated_until_they_are_counted() {
    let mut harness = app_of_size(egui::vec2(1100.0, 760.0));
    let accel = presented(&harness).accel;
    assert!(accel.entering().is_none(), "nothing is counted at rest in tests of other things");
    let estimate = format::significant(accel.entering_estimate().unwrap().tests.into());
    let shown = |harness: &Window, text: &str| {
        harness.query_by(|node| node.value().is_some_and(|value| value.starts_with(text))).is_some()
    };
    assert!(shown(&harness, &format!("Tests per ray ≈ {estimate}")));
    measure_at_rest(&[&accel], &CancelToken::new()).unwrap();
    settle(&mut harness);
    let counted = format::significant(accel.entering().unwrap().tests.into());
    assert!(shown(&harness, &format!("Tests per ray {counted}")));
}

#[test]
fn the_scene_says_whether_it_is_closed() {
    let mut harness = app_of_size(egui::vec2(1100.0, 760.0));
    settle(&mut harness);
    let edges = Edges::of(&presented(&harness).accel.scene.triangles, &CancelToken::new()).unwrap();
    let value = |count: usize, otherwise: &str| {
        if count == 0 { format!("none: {otherwise}") } else { format::count(count as u64) }
    };
    for text in [
        format!("Open edges {}", value(edges.open, "closed")),
        format!("Shared edges {}", value(edges.shared_by_many, "manifold")),
        format!("Turned edges {}", value(edges.turned, "oriented")),
    ] {
        let found = harness.query_by(|node| node.value().as_deref() == Some(&*text)).is_some();
        assert!(found || harness.query_by_label(&text).is_some(), "{text}");
    }
}

#[test]
fn differences_to_the_tree_before_say_which_is_better() {
    let mut s = state(Shading::Lit);
    assert_eq!(comparison(&s, SAH_COST), Comparison::Unknown, "nothing came before");
    s.wanted.build.threshold = 2;
    again(&mut s);
    let container = s.wanted.build.container;
    s.wanted.build = bvhscope_engine::settings::BuildSettings::preset(Preset::Best, container);
    again(&mut s);
    for quantity in [SAH_COST, TESTS_PER_RAY] {
        let Comparison::Change { before, now, verdict, .. } = comparison(&s, quantity) else {
            panic!("{quantity:?} compares")
        };
        assert!(now < before && verdict == Verdict::Better, "{quantity:?}: {before} became {now}: {verdict:?}");
    }
    let h = harness(s);
    let text = tile(&h, "SAH cost ");
    assert!(text.contains('−') && text.ends_with("better"), "{text}");
}

#[test]
fn another_view_size_or_mode_does_not_compare() {
    let changes: [fn(&mut AppState); 3] = [
        |s| s.wanted.camera.eye *= 1.5,
        |s| s.wanted.render.shading = Shading::Heat(HeatKind::Both),
        |s| s.wanted.render.traversal = Traversal::Paper,
    ];
    for change in changes {
        let mut s = state(Shading::Lit);
        change(&mut s);
        s.wanted.build.threshold = 20;
        again(&mut s);
        assert_eq!(comparison(&s, TESTS_PER_RAY), Comparison::OtherView);
        assert_eq!(comparison(&s, MRAYS_PER_S), Comparison::Unknown, "not measured");
        assert!(matches!(comparison(&s, SAH_COST), Comparison::Change { .. }), "costs need no view");
    }
    let mut s = state(Shading::Lit);
    s.wanted.render.heat_range = Some([0.0, 9.0]);
    s.wanted.build.threshold = 20;
    again(&mut s);
    assert!(matches!(comparison(&s, TESTS_PER_RAY), Comparison::Change { .. }), "colours change no count");
}

#[test]
fn counts_with_hidden_triangles_do_not_compare() {
    let mut s = state(Shading::Lit);
    let shown = s.model.presented.as_mut().unwrap();
    Counted::observe(&mut shown.counted, &shown.frame, true);
    s.wanted.build.threshold = 20;
    again(&mut s);
    assert_eq!(comparison(&s, TESTS_PER_RAY), Comparison::OtherView);
    assert!(matches!(comparison(&s, SAH_COST), Comparison::Change { .. }));
}

#[test]
fn costs_of_boxes_and_spheres_do_not_compare() {
    let mut s = state(Shading::Lit);
    measure(&s);
    s.wanted.build.container = ContainerKind::Sphere;
    again(&mut s);
    measure(&s);
    assert_eq!(comparison(&s, SAH_COST), Comparison::OtherContainer);
    assert!(matches!(comparison(&s, TESTS_PER_RAY), Comparison::Change { verdict: Verdict::Worse, .. }));
    let h = harness(s);
    assert!(tile(&h, "SAH cost ").ends_with("not comparable"));
    assert!(tile(&h, "Tests per ray ").ends_with("worse"));
}

#[test]
fn numbers_are_marked_as_of_the_tree_before_while_a_rebuild_takes_long() {
    let mut s = state(Shading::Lit);
    let job = |age: u64| JobStatus {
        label: "Building".to_owned(),
        progress: 0.1,
        since: Instant::now().checked_sub(Duration::from_millis(age)).unwrap(),
        costs: Vec::new(),
    };
    s.activity.build = Some(job(0));
    let mut h = harness(s);
    h.state_mut().activity.build = Some(job(0));
    h.run_steps(1);
    assert!(h.query_by_label_contains("Of the tree before").is_none(), "a short rebuild marks nothing");
    h.state_mut().activity.build = Some(job(2_000));
    h.run_steps(2);
    assert!(h.query_by_label_contains("Of the tree before").is_some());
    // A model that has just been opened is shown before its tree is annealed.
    let wanted = &mut h.state_mut().wanted.build;
    wanted.optimize = wanted.optimize.with(Pass::Anneal);
    h.run_steps(2);
    assert!(h.query_by_label("AAC δ 6 ε 0.2, boxes, before it is annealed").is_some());
}

#[test]
fn selecting_a_node_moves_nothing_else() {
    let mut h = sized(state(Shading::Lit), 1280.0, 720.0, 1.0);
    let places = |h: &Harness<'static, AppState>| {
        ["Scene section", "Build section", "Hits 100 %", "Depth range"]
            .map(|name| h.query_by_label(name).map(|it| it.rect()))
    };
    let before = places(&h);
    assert!(before[0].is_some() && before[3].is_some());
    for node in [0, 5] {
        h.state_mut().selection.nodes.selected = Some(node);
        h.state_mut().selection.picked = Some(PickedTriangle { primitive: 17, path: vec![0, 1, 5] });
        h.run_steps(4);
        assert_eq!(places(&h), before);
        let row = h.get_by_label_contains("Area share").rect();
        assert!(h.ctx.content_rect().contains_rect(row), "the selection is in view");
    }
}

#[test]
fn sections_stay_folded_in_the_next_run() {
    let mut h = sized(state(Shading::Lit), 1280.0, 1400.0, 1.0);
    assert!(h.query_by_label_contains("Leaf triangles").is_none(), "memory is folded at first");
    h.get_by_label("Scene section").click();
    h.run_steps(40);
    h.get_by_label("Memory section").click();
    h.run_steps(40);
    let sections = h.state().preferences.sections.clone();
    assert_eq!((sections["Scene"], sections["Memory"], sections["Build"]), (false, true, true));
    let mut s = state(Shading::Lit);
    s.preferences.sections = sections;
    let h = sized(s, 1280.0, 1400.0, 1.0);
    assert!(h.query_by_label_contains("Materials").is_none());
    assert!(h.query_by_label_contains("Leaf triangles").is_some());
}

#[test]
fn a_scroll_bar_does_not_widen_the_right_panel() {
    let width = |height: f32| {
        let h = sized(state(Shading::Heat(HeatKind::Both)), 1280.0, height, 1.0);
        h.get_by_role_and_label(egui::accesskit::Role::Slider, "Threshold δ").rect().x_range()
    };
    assert_eq!(width(500.0), width(1200.0));
}

#[test]
fn the_headline_is_the_same_in_windows_of_three_sizes() {
    let shown = [[1100.0, 760.0], [1300.0, 900.0], [1600.0, 1000.0]].map(|size| {
        let mut window = app_of_size(size.into());
        let text = |window: &Window, name: &str| {
            let node = window.get_by(|node| node.value().is_some_and(|text| text.starts_with(name)));
            node.accesskit_node().value().unwrap_or_default()
        };
        let estimate = text(&window, "Tests per ray");
        assert!(estimate.contains(['…', '≈']), "not counted yet: {estimate}");
        assert_eq!(text(&window, "Speed "), "Speed … Mray/s", "not measured yet, whatever the picture took");
        window.state_mut().state.model.derived.at_rest.is_off = false;
        settle(&mut window);
        settle(&mut window);
        let accel = presented(&window).accel;
        let builds = accel.whole_builds().unwrap();
        let build = text(&window, "Build time");
        assert!(builds.times.spread.is_some() && build.contains(" to "), "the spread is shown: {build}");
        let (stage, time) = builds.stages[0];
        let shown = text(&window, &format!("Stage {stage}"));
        assert_eq!(shown, format!("Stage {stage} {}", format::duration(time)), "stages of the whole builds");
        let readings = accel.at_rest().unwrap();
        let speed = millions_per_second(readings.rays, readings.traces.ms);
        let shown = text(&window, "Speed ");
        assert!(shown.starts_with(&format!("Speed {} Mray/s", format::significant(speed))), "{shown}");
        (text(&window, "Tests per ray"), presented(&window).tests_per_ray.unwrap())
    });
    assert_eq!((&shown[0].0, &shown[1].0), (&shown[1].0, &shown[2].0));
    assert!(shown[0].1 != shown[2].1, "the mean of the picture is another");
}
