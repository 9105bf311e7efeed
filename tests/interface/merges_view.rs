//! The view "Merges": scrubbing, playing, cuts, and why clusters were merged.

use std::collections::HashSet;
use std::sync::Arc;

use bvhscope::app::commands::Action;
use bvhscope::app::format;
use bvhscope::app::state::Standing;
use bvhscope::app::state::picture_cut::{CutKind, MergePage, MergeStudy};
use bvhscope::render::Shading;
use bvhscope_engine::Preset;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::construction::MergeOrder;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass, Passes};
use bvhscope_engine::tree::ContainerKind;
use egui::{Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::Queryable as _;

use crate::harness::{Window, app, copied, drag, presented, press, settle, two};

/// The app with the view open.
fn open() -> Window {
    let mut harness = app();
    press(&mut harness, Modifiers::NONE, Key::F6);
    assert_eq!(harness.state().state.preferences.dock.open.as_deref(), Some("Merges"));
    harness
}

fn study(harness: &Window) -> Arc<Result<MergeStudy, String>> {
    harness.state().state.model.cut.known(&presented(harness).accel).expect("the merges are recorded")
}

fn step(harness: &Window) -> Option<u32> {
    let study = study(harness);
    harness.state().state.model.cut.step(&study.as_ref().as_ref().unwrap().merges)
}

fn standing(harness: &Window) -> Arc<Standing> {
    harness.state().state.layout.graphics.standing.clone().expect("clusters are drawn")
}

fn steps(harness: &Window) -> u32 {
    study(harness).as_ref().as_ref().unwrap().merges.timeline.steps()
}

#[test]
fn keys_walk_through_the_merges_and_the_overlay_follows() {
    let mut harness = open();
    let leaves = presented(&harness).accel.report.stats.leaves as u32;
    assert_eq!(steps(&harness) + 1, leaves);
    assert!(harness.state().state.layout.graphics.standing.is_none(), "depths are drawn until a step is chosen");
    harness.get_by_label("Merge").focus();
    settle(&mut harness);
    press(&mut harness, Modifiers::NONE, Key::ArrowRight);
    assert_eq!(step(&harness), Some(1));
    let clusters = standing(&harness);
    assert_eq!(clusters.all as u32, leaves - 1, "one merge makes one of two");
    let made = clusters.made.expect("something was merged");
    let [first, second] = two(presented(&harness).table.children(made));
    assert!(clusters.stands(made) && !clusters.stands(first) && !clusters.stands(second));
    assert_eq!(harness.state().state.layout.graphics.overlay_counts().1, clusters.all);
    assert!(harness.query_by_label_contains("Merge 1 of").is_some(), "the line below says it");

    press(&mut harness, Modifiers::NONE, Key::End);
    assert_eq!((standing(&harness).nodes.clone(), standing(&harness).made), (vec![0], Some(0)));
    press(&mut harness, Modifiers::COMMAND, Key::ArrowLeft);
    assert_eq!(standing(&harness).all, 10, "the key frame before the end");
    press(&mut harness, Modifiers::NONE, Key::Home);
    assert_eq!(standing(&harness).all as u32, leaves);

    harness.get_by_label("Clear").click();
    settle(&mut harness);
    assert!(harness.state().state.layout.graphics.standing.is_none(), "the depths are drawn again");
    Action::ToggleDock("Merges").perform(&mut harness.state_mut().state);
    settle(&mut harness);
    assert!(harness.query_by_label("Merge").is_none());
}

#[test]
fn playing_stops_at_the_end() {
    let mut harness = open();
    harness.state_mut().state.model.cut.speed = 1e6;
    harness.get_by_label("Play").click();
    settle(&mut harness);
    assert_eq!(step(&harness), Some(steps(&harness)));
    assert!(harness.query_by_label("Pause").is_none(), "it has stopped");
}

#[test]
fn dragging_scrubs() {
    let mut harness = open();
    let plot = harness.get_by_label("Merge").rect();
    drag(&mut harness, PointerButton::Primary, plot.center(), &[vec2(10.0, 0.0), vec2(20.0, 5.0)]);
    let half = step(&harness).expect("a step");
    assert!((half as f32 / steps(&harness) as f32 - 0.55).abs() < 0.12, "{half}");
    drag(&mut harness, PointerButton::Primary, plot.center(), &[vec2(-2000.0, 0.0)]);
    assert_eq!(step(&harness), Some(0));
}

#[test]
fn every_order_ends_with_the_root_and_a_new_tree_keeps_the_number_left() {
    let mut harness = open();
    for order in [MergeOrder::Distance, MergeOrder::Level, MergeOrder::Built] {
        harness.get_by_label(order.label()).click();
        settle(&mut harness);
        let known = study(&harness);
        let merges = &known.as_ref().as_ref().unwrap().merges;
        assert_eq!((merges.order(), merges.made_at(merges.timeline.steps())), (order, Some(0)));
    }
    harness.state_mut().state.model.cut.left = Some(7);
    harness.state_mut().state.wanted.build.threshold = 17;
    settle(&mut harness);
    let clusters = standing(&harness);
    assert_eq!((clusters.all, clusters.nodes.len()), (7, 7));
    assert!(clusters.nodes.iter().all(|&node| (node as usize) < presented(&harness).table.len()));
}

#[test]
fn selecting_a_node_shows_its_merge_and_why() {
    let mut harness = open();
    let first = presented(&harness).table.children(0).start;
    harness.state_mut().state.select_node(first);
    settle(&mut harness);
    assert_eq!(standing(&harness).made, Some(first));
    assert!(harness.query_by_label_contains("Winner: nodes").is_some());
    assert!(harness.query_by_label_contains("Distances between").is_some());
    let matrix = copied(&mut harness, "Copy matrix");
    let size = matrix.lines().count() - 1;
    assert!(size >= 2 && matrix.lines().all(|line| line.split('\t').count() == size + 2), "{matrix}");
    let least =
        matrix.lines().skip(1).flat_map(|row| row.split('\t').skip(2)).filter_map(|cell| cell.parse::<f32>().ok());
    assert_eq!(least.fold(f32::INFINITY, f32::min), 1.0, "the winner has the least area: {matrix}");
}

#[test]
fn cuts_need_no_step() {
    let mut harness = open();
    let merges = &mut harness.state_mut().state.model.cut;
    (merges.cut_kind, merges.cut_triangles) = (CutKind::Triangles, 50);
    settle(&mut harness);
    let clusters = standing(&harness);
    let shown = presented(&harness);
    assert!(clusters.all > 1 && clusters.made.is_none());
    let triangles: u32 = clusters.nodes.iter().map(|&node| shown.table.primitives(node)).sum();
    assert_eq!(triangles as usize, shown.accel.scene.triangles.len(), "each triangle is in one cluster");
    assert!(clusters.nodes.iter().all(|&node| shown.table.primitives(node) <= 50));
}

#[test]
fn cluster_colours_show_the_clusters_that_are_drawn() {
    let mut harness = open();
    harness.state_mut().state.wanted.render.shading = Shading::Clusters;
    settle(&mut harness);
    let by_depth = presented(&harness).frame;
    assert!(by_depth.clusters.is_none());
    for (kind, left, passes) in [
        (CutKind::Step, 20, false),
        (CutKind::Area, 20, false),
        (CutKind::Triangles, 20, false),
        (CutKind::Triangles, 20, true),
        (CutKind::Step, 20, true),
    ] {
        let preset = if passes { Preset::Best } else { Preset::Fast };
        harness.state_mut().state.wanted.build = BuildSettings::preset(preset, ContainerKind::Aabb);
        let merges = &mut harness.state_mut().state.model.cut;
        (merges.left, merges.cut_kind) = (Some(left), kind);
        (merges.cut_area, merges.cut_triangles) = (0.02, 50);
        settle(&mut harness);
        let (shown, clusters) = (presented(&harness), standing(&harness));
        let cut = shown.frame.clusters.clone().expect("the picture is of the cut");
        let of = cut.of_primitives(&shown.accel.tree, &CancelToken::new()).unwrap();
        let seen: HashSet<u32> =
            shown.frame.primitive.iter().filter(|&&hit| hit != u32::MAX).map(|&hit| of[hit as usize]).collect();
        assert!(seen.len() > 4, "{kind:?} shows {} clusters", seen.len());
        assert!(seen.iter().all(|&node| clusters.stands(node)), "{kind:?} with passes: {passes}");
        let text = match kind {
            CutKind::Step => "active clusters",
            CutKind::Area => "nodes of at most 2.00 % of the area",
            CutKind::Triangles => "nodes of at most 50 triangles",
        };
        assert!(harness.query_by_label_contains(&format!("Legend. Picture: {text}")).is_some(), "{text}");
        assert!(harness.query_by_label("those of Merges").is_some(), "the depth is not what counts");
        assert_ne!(shown.frame.rgba, by_depth.rgba);
    }
    harness.state_mut().state.wanted.build = BuildSettings::default();
    harness.state_mut().state.model.cut.clear();
    settle(&mut harness);
    assert_eq!(presented(&harness).frame.rgba, by_depth.rgba, "the depth again");
    harness.state_mut().state.model.cut.cut_kind = CutKind::Area;
    press(&mut harness, Modifiers::NONE, Key::F6);
    assert!(presented(&harness).frame.clusters.is_none(), "a closed view changes nothing");
}

#[test]
fn trees_with_passes_and_trees_of_other_builders_say_what_is_shown() {
    let mut harness = open();
    harness.state_mut().state.wanted.build = BuildSettings::preset(Preset::Best, ContainerKind::Aabb);
    harness.state_mut().state.model.cut.left = Some(20);
    settle(&mut harness);
    assert!(harness.query_by_label_contains("before its passes").is_some());
    let clusters = standing(&harness);
    let table = clusters.table().expect("a tree of its own");
    assert!(table.len() > presented(&harness).table.len(), "the passes collapse leaves");
    assert_eq!((clusters.all, clusters.nodes.len()), (20, 20));

    harness.state_mut().state.wanted.build = BuildSettings::preset(Preset::Swift, ContainerKind::Aabb);
    settle(&mut harness);
    assert!(harness.query_by_label_contains("merges blocks of triangles").is_some());
    assert!(harness.query_by_label("As built").is_none(), "there is no such order");
    assert_eq!(standing(&harness).all, 20, "but there are the last twenty by area");
}

#[test]
fn trees_from_the_top_are_watched_split_by_split() {
    let mut harness = open();
    harness.state_mut().state.wanted.build.builder = BuilderKind::Sbvh;
    settle(&mut harness);
    harness.get_by_label("Merge").focus();
    settle(&mut harness);
    press(&mut harness, Modifiers::NONE, Key::Home);
    assert_eq!((standing(&harness).nodes.clone(), standing(&harness).made), (vec![0], None));
    assert!(harness.query_by_label_contains("Nothing split yet").is_some());
    press(&mut harness, Modifiers::NONE, Key::ArrowRight);
    let (clusters, shown) = (standing(&harness), presented(&harness));
    let [left, right] = two(shown.table.children(0));
    assert_eq!((clusters.all, clusters.made), (2, Some(0)));
    assert!(clusters.stands(left) && clusters.stands(right) && !clusters.stands(0));
    let [all, first, second] = [0, left, right].map(|node| format::count(u64::from(shown.table.primitives(node))));
    let sides = format!("Split 1: node 0 of {all} triangles into {first} and {second}");
    assert!(harness.query_by_label_contains(&sides).is_some(), "{sides}");
    assert!(harness.query_by_label_contains("Split 1 of").is_some(), "the line below says it");
    press(&mut harness, Modifiers::NONE, Key::End);
    assert_eq!(standing(&harness).all, shown.accel.report.stats.leaves);

    harness.get_by_label("Largest first").click();
    settle(&mut harness);
    harness.state_mut().state.model.cut.left = Some(40);
    settle(&mut harness);
    let area = |node: u32| shown.table.area_share(node);
    let (clusters, nodes) = (standing(&harness), 0..shown.table.len() as u32);
    let made = clusters.made.expect("a split");
    let whole = nodes.filter(|&node| clusters.stands(node) && !shown.table.is_leaf(node));
    assert_eq!(clusters.all, 40);
    assert!(whole.into_iter().all(|node| area(node) <= area(made)), "no larger node is still whole");

    // A selected node shows its split.
    harness.state_mut().state.select_node(left);
    settle(&mut harness);
    assert_eq!(standing(&harness).made, Some(left));
}

#[test]
fn merges_of_ploc_and_h_ploc_are_recorded() {
    for (builder, group) in [(BuilderKind::Ploc, " · round 1 · "), (BuilderKind::Hploc, " · level ")] {
        let mut harness = open();
        harness.state_mut().state.wanted.build.builder = builder;
        settle(&mut harness);
        harness.get_by_label("Merge").focus();
        settle(&mut harness);
        press(&mut harness, Modifiers::NONE, Key::Home);
        press(&mut harness, Modifiers::NONE, Key::ArrowRight);
        assert_eq!(standing(&harness).all, presented(&harness).accel.report.stats.leaves - 1);
        assert!(
            harness.query_by_label_contains(&format!("Merge 1 of {}", format::count(steps(&harness).into()))).is_some()
        );
        assert!(harness.query_by_label_contains(group).is_some(), "{group}");
        assert!(harness.query_by_label_contains("each other's nearest").is_some());
        assert!(harness.query_by_label("By level").is_some());
    }
}

#[test]
fn the_curve_is_dragged_and_the_price_is_compared() {
    let mut harness = open();
    harness.state_mut().state.model.cut.page = MergePage::Reduction;
    settle(&mut harness);
    let before = harness.state().state.wanted.build;
    let at = harness.get_by_label("Threshold on the curve").rect().center();
    drag(&mut harness, PointerButton::Primary, at, &[vec2(8.0, 0.0), vec2(20.0, 0.0)]);
    let build = harness.state().state.wanted.build;
    assert!(build.threshold > before.threshold, "{} from {}", build.threshold, before.threshold);
    assert_eq!(presented(&harness).accel.settings.threshold, build.threshold, "the tree was built again");
    harness.get_by_label("Reduction on the curve").focus();
    settle(&mut harness);
    press(&mut harness, Modifiers::NONE, Key::ArrowUp);
    assert!(harness.state().state.wanted.build.epsilon < build.epsilon, "more clusters");

    let curve = copied(&mut harness, "Copy curve");
    assert!(curve.lines().count() > 3 && curve.lines().all(|line| line.split('\t').count() == 9), "{curve}");

    let first = presented(&harness).table.children(0).start;
    harness.state_mut().state.select_node(first);
    harness.state_mut().state.model.cut.page = MergePage::Price;
    settle(&mut harness);
    harness.get_by_label_contains("Compare node").click();
    settle(&mut harness);
    assert!(harness.query_by_label_contains("The approximation").is_some());
    assert!(harness.query_by_label_contains("First merge that differs").is_some());
    let comparison = copied(&mut harness, "Copy comparison");
    assert!(comparison.lines().nth(1).is_some_and(|row| row.starts_with(&format!("{first}\t"))), "{comparison}");

    harness.state_mut().state.wanted.build.optimize = Passes::NONE.with(Pass::Collapse);
    settle(&mut harness);
    assert!(harness.query_by_label_contains("The subtree, after its passes (Collapse), costs").is_some());
}
