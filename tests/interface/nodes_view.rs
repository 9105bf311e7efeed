//! The views of nodes in the dock: the list of worst nodes and the icicle.

use crate::harness::{Window, app, camera, double_click, presented, press, settle};
use bvhscope::app::views::icicle::IcicleView;
use bvhscope::app::views::nodes::NodesView;
use bvhscope::catalog::metrics;
use bvhscope::lab::icicle::IcicleWidth;
use bvhscope::overlay::ColorBy;
use egui::accesskit::Role;
use egui::{Key, Modifiers, pos2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};

fn open(view: &str) -> Window {
    let mut harness = app();
    harness.state_mut().state.preferences.dock.show(view);
    settle(&mut harness);
    harness
}

#[test]
fn containers_are_coloured_by_data_that_are_measured_for_that() {
    let mut harness = app();
    let accel = presented(&harness).accel;
    for (metric, title) in
        [(metrics::VISIT_RATIO, "visits over those predicted"), (metrics::GAIN, "gain from rebuilding")]
    {
        harness.state_mut().state.wanted.overlay.color_by = ColorBy::Metric(metric);
        settle(&mut harness);
        assert!(harness.query_by_label_contains(&format!("Legend. Containers: {title}")).is_some(), "{title}");
        let derived = &harness.state().state.model.derived;
        let known = [derived.known_visits(&accel).is_some(), accel.known_regrets().is_some()];
        assert_eq!(known, [true, metric == metrics::GAIN], "nothing is measured that nobody sees");
        let rays = harness.query_by_label("Measure this view").is_some();
        assert_eq!(rays, metric == metrics::VISIT_RATIO);
    }
}

fn ranked(harness: &Window) -> Vec<u32> {
    let accel = presented(harness).accel;
    harness.state().state.views.get::<NodesView>().ranking.of_tree(&accel).expect("ranked").to_vec()
}

fn selected(harness: &Window) -> Option<u32> {
    harness.state().state.selection.nodes.selected
}

fn hovered(harness: &Window) -> Option<u32> {
    harness.state().state.selection.nodes.hovered
}

/// The row of `node` in the list of worst nodes; the outline has rows of the same nodes, with fewer cells.
fn row<'a>(harness: &'a Window, node: u32) -> egui_kittest::Node<'a> {
    let kind = if presented(harness).table.is_leaf(node) { "leaf" } else { "node" };
    let name = format!("{kind} {}, ", bvhscope::text::count(u64::from(node)));
    harness
        .query_all_by_role(Role::ListItem)
        .filter(|row| row.accesskit_node().label().unwrap_or_default().starts_with(&name))
        .max_by(|a, b| a.rect().left().total_cmp(&b.rect().left()))
        .unwrap_or_else(|| panic!("no row of {name}"))
}

#[test]
fn the_worst_nodes_are_sorted_selected_and_stepped_through() {
    let mut harness = open("Nodes");
    let (table, accel) = (presented(&harness).table, presented(&harness).accel);
    let by_regret = ranked(&harness);
    let regrets = accel.known_regrets().expect("subtrees were rebuilt");
    assert!(by_regret.is_sorted_by(|&a, &b| regrets.regret(a) >= regrets.regret(b)));
    assert!(regrets.regret(by_regret[0]) > Some(0.0) && !by_regret[..5].contains(&1), "not the nodes of greatest cost");
    harness.get_by_label("Sort by SAH cost").click();
    settle(&mut harness);
    let by_cost = ranked(&harness);
    assert!(by_cost.is_sorted_by(|&a, &b| table.sah_share(a) >= table.sah_share(b)));

    harness.get_by_label("Sort by Overlap").click();
    settle(&mut harness);
    let by_overlap = ranked(&harness);
    assert!(by_overlap.is_sorted_by(|&a, &b| table.overlap(a) >= table.overlap(b)), "{by_overlap:?}");
    harness.get_by_label("Sort by Overlap").click();
    settle(&mut harness);
    assert!(ranked(&harness).is_sorted_by(|&a, &b| table.overlap(a) <= table.overlap(b)), "the other way round");
    harness.get_by_label("Sort by Visits ÷ predicted").click();
    settle(&mut harness);
    let by_visits = ranked(&harness);
    assert!(!by_visits.is_empty(), "visits were measured");

    row(&harness, by_visits[0]).click();
    settle(&mut harness);
    assert_eq!(selected(&harness), Some(by_visits[0]));
    let before = camera(&harness);
    press(&mut harness, Modifiers::ALT, Key::Period);
    assert_eq!(selected(&harness), Some(by_visits[1]), "the list stays, though the view has changed");
    assert_ne!(camera(&harness), before, "the next node is looked at");
    assert_eq!(ranked(&harness), by_visits);
    press(&mut harness, Modifiers::ALT, Key::Comma);
    assert_eq!(selected(&harness), Some(by_visits[0]));
    press(&mut harness, Modifiers::ALT, Key::Comma);
    assert_eq!(selected(&harness), Some(by_visits[0]), "there is none before the worst");

    let rays = |harness: &Window| harness.state().state.model.derived.rays(&presented(harness).accel.scene);
    let old = rays(&harness);
    harness.get_by_label("Measure this view").click();
    settle(&mut harness);
    assert_ne!(rays(&harness), old, "visits are those of the present view");
}

#[test]
fn a_node_under_the_pointer_lights_up_everywhere_and_no_longer() {
    let mut harness = open("Nodes");
    let node = ranked(&harness)[2];
    let at = row(&harness, node).rect().center();
    harness.hover_at(at);
    harness.run_steps(3);
    assert_eq!(hovered(&harness), Some(node));
    assert_eq!(harness.state().state.selection.pointed_before, Some(node), "views before it know of it too");
    harness.hover_at(pos2(3.0, 3.0));
    harness.run_steps(3);
    assert_eq!(hovered(&harness), None);
}

#[test]
fn the_icicle_lights_up_selects_zooms_and_is_walked_by_keys() {
    let mut harness = open("Icicle");
    let accel = presented(&harness).accel;
    let table = presented(&harness).table;
    let layout = harness.state().state.views.get::<IcicleView>().last_layout(&accel).expect("laid out").clone();
    let rect = harness.get_by_label_contains("Icicle of ").rect();
    let levels = layout.icicle.level_count() as f32;
    assert!(levels > 5.0, "all levels are shown");
    // The first column of the second level.
    let height = (rect.height() / levels).clamp(4.0, 18.0);
    let cell = *layout.icicle.at(1, 4).expect("a child of the root");
    let at = rect.min + egui::vec2(4.5, height * 1.5);
    harness.hover_at(at);
    harness.run_steps(3);
    assert_eq!((cell.node, hovered(&harness)), (1, Some(1)));
    double_click(&mut harness, at);
    let view = |harness: &Window| harness.state().state.views.get::<IcicleView>().top();
    assert_eq!((selected(&harness), view(&harness)), (Some(1), 1), "zoomed to the node");
    assert!(harness.query_by_label("Root").is_some(), "the way back is named");
    press(&mut harness, Modifiers::NONE, Key::ArrowDown);
    let below = selected(&harness).expect("a child");
    assert_eq!(table.parent(below), Some(1));
    press(&mut harness, Modifiers::NONE, Key::Enter);
    assert_eq!(view(&harness), below);
    press(&mut harness, Modifiers::NONE, Key::Backspace);
    assert_eq!(view(&harness), 1);
    harness.get_by_label("Root").click();
    settle(&mut harness);
    assert_eq!(view(&harness), 0);
}

#[test]
fn a_closed_view_derives_nothing_and_an_open_one_what_it_shows() {
    let mut harness = app();
    let accel = presented(&harness).accel;
    let known = |harness: &Window| {
        let state = &harness.state().state;
        [
            state.model.derived.visits.of_tree(&accel).is_some(),
            state.views.get::<NodesView>().ranking.of_tree(&accel).is_some(),
            state.views.get::<IcicleView>().sums.of_tree(&accel).is_some() || accel.known_regrets().is_some(),
        ]
    };
    assert_eq!(known(&harness), [false; 3]);
    harness.state_mut().state.preferences.dock.show("Icicle");
    settle(&mut harness);
    assert_eq!(known(&harness), [false, false, true], "shares of cost need no rays");
    assert!(accel.known_regrets().is_none());
    harness.state_mut().state.views.get_mut::<IcicleView>().width = IcicleWidth::Visits;
    harness.state_mut().state.views.get_mut::<IcicleView>().color = metrics::VISIT_RATIO;
    settle(&mut harness);
    assert_eq!(known(&harness), [true, false, true]);
    let visits = harness.state().state.model.derived.known_visits(&accel).expect("measured").0;
    let root = harness.state().state.views.get::<IcicleView>().sums.of_tree(&accel).expect("summed")[0];
    assert!(
        (f64::from(root) - visits.counts.iter().map(|&count| f64::from(count)).sum::<f64>()).abs()
            < 1.0 + f64::from(root) * 1e-5
    );
}

/// The row of a depth in the list in place of the outline.
fn depth_row<'a>(harness: &'a Window, depth: u32) -> egui_kittest::Node<'a> {
    harness
        .query_all_by_role(Role::ListItem)
        .filter(|row| row.rect().left() < 100.0)
        .find(|row| row.accesskit_node().label().unwrap_or_default().starts_with(&format!("{depth}, ")))
        .unwrap_or_else(|| panic!("no row of depth {depth}"))
}

#[test]
fn depths_are_listed_with_their_visits_and_drawn_by_a_click() {
    let mut harness = open("Nodes");
    harness.get_by_label("Depths").click();
    settle(&mut harness);
    let accel = presented(&harness).accel;
    let counts = accel.report.stats.nodes_per_depth.clone();
    for (depth, &nodes) in (0..).zip(&counts).take(5) {
        let label = depth_row(&harness, depth).accesskit_node().label().unwrap_or_default();
        assert!(label.starts_with(&format!("{depth}, {nodes}, ")), "{label}");
    }
    // Each ray that enters the root visits it once.
    let root = depth_row(&harness, 0).accesskit_node().label().unwrap_or_default();
    assert!(root.starts_with("0, 1, 1") && root.ends_with(", 1") || root.ends_with(", 1.00"), "{root}");
    let measured = harness.state().state.model.derived.measured(&accel).expect("visits are measured").1.clone();
    let [a, b] = [1, 2].map(|node| measured.visits.counts[node]);
    let visits = f64::from(a + b) / f64::from(measured.visits.root_hits());
    let second = depth_row(&harness, 1).accesskit_node().label().unwrap_or_default();
    assert!(second.ends_with(&format!(", {}", bvhscope::app::format::significant(visits))), "{second}, {visits}");

    depth_row(&harness, 3).click();
    settle(&mut harness);
    assert_eq!(harness.state().state.wanted.overlay.depth, Some([3, 3]));
    depth_row(&harness, 3).click();
    settle(&mut harness);
    assert_eq!(harness.state().state.wanted.overlay.depth, None, "a second click gives the range back");
    harness.get_by_label("Outline").click();
    settle(&mut harness);
    assert!(harness.query_by_label("Unfold node 1").is_some());
}
