//! The view "Layouts".

use bvhscope::app::commands::command_line;
use bvhscope::app::state::SecondTree;
use bvhscope::app::views::icicle::IcicleView;
use bvhscope::catalog::layouts::LayoutChoice;
use bvhscope::lab::layouts::{LaidOut, LayoutPlan, kept_nodes, layouts};
use bvhscope::lab::population::Population;
use bvhscope::lab::report_table::number;
use bvhscope::render::{HeatKind, Shading};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::layouts::Collapse;
use bvhscope_engine::tree::ContainerKind;
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;

use crate::harness::{Window, app, app_of_copies, copied, presented, press, settle};

fn open() -> Window {
    let mut harness = app();
    press(&mut harness, Modifiers::NONE, Key::Y);
    settle(&mut harness);
    harness
}

/// The copied table without its head: name, front, nodes, boxes, triangles, tests and so on of each layout.
fn rows(harness: &mut Window) -> Vec<Vec<String>> {
    let text = copied(harness, "Copy");
    text.lines().skip(1).map(|line| line.split('\t').map(str::to_owned).collect()).collect()
}

/// The same layouts, measured by the rays of the view without it.
fn measured(harness: &Window, plan: &LayoutPlan) -> Vec<LaidOut> {
    let accel = presented(harness).accel;
    let rays = harness.state().state.model.derived.rays(&accel.scene).expect("the rays of the view");
    let mut rows = Vec::new();
    layouts(&accel, plan, &[rays], &CancelToken::new(), &mut |row| rows.push(row)).expect("a tree of boxes");
    rows
}

fn check(harness: &mut Window, plan: &LayoutPlan) {
    let expected = measured(harness, plan);
    let found = rows(harness);
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        let numbers = [expected.rays.tests_per_ray, expected.rays.bytes_per_ray].map(number);
        assert_eq!([&found[0], &found[5], &found[8]], [&expected.layout.name(), &numbers[0], &numbers[1]]);
    }
    assert!(found.iter().any(|row| row[1] == "*"), "some are on the front");
}

#[test]
fn layouts_are_measured_by_the_chosen_rays_and_chosen_by_their_axes() {
    let mut harness = open();
    let mut plan = LayoutPlan::default();
    check(&mut harness, &plan);
    let plot = harness.get_by_label_contains("Plot of Tests a ray over Bytes a ray").rect();
    harness.run_steps(8);
    assert_eq!(harness.get_by_label_contains("Plot of Tests a ray over Bytes a ray").rect(), plot, "it does not grow");

    harness.state_mut().state.model.derived.population = Population::Random;
    settle(&mut harness);
    check(&mut harness, &plan);

    harness.get_by_role_and_label(Role::Button, "Greedy").click();
    settle(&mut harness);
    plan.collapses = vec![Collapse::Greedy, Collapse::Optimal];
    check(&mut harness, &plan);
    // At least one stays of each axis.
    for name in ["Optimal", "Greedy"] {
        harness.get_by_role_and_label(Role::Button, name).click();
        settle(&mut harness);
    }
    plan.collapses = vec![Collapse::Greedy];
    check(&mut harness, &plan);
}

/// The numbers of the wide tree that the window shows: its containers at all depths.
fn shown_nodes(harness: &mut Window) -> Vec<u32> {
    let last = harness.state().state.model.table().expect("a tree").max_depth();
    harness.state_mut().state.wanted.overlay.depth = Some([0, last]);
    harness.state_mut().state.wanted.overlay.budget = Some(100_000);
    settle(harness);
    let mut nodes = harness.state().state.layout.graphics.shown.clone().expect("containers are drawn").nodes.clone();
    nodes.sort_unstable();
    nodes
}

#[test]
fn a_layout_on_show_is_drawn_and_is_the_icicle() {
    let mut harness = open();
    let binary = shown_nodes(&mut harness);
    let accel = presented(&harness).accel;
    assert_eq!(binary.len(), accel.tree.node_count());
    let plan = LayoutPlan::default();
    let row = measured(&harness, &plan).into_iter().nth(4).expect("a row");
    harness.get_by_role_and_label(Role::ComboBox, "Layout on show").click();
    harness.run_steps(2);
    harness.get_by_role_and_label(Role::Button, &row.layout.name()).click();
    settle(&mut harness);

    let kept = kept_nodes(&accel, row.layout.choice, None, &CancelToken::new()).expect("a tree of boxes");
    let mut expected = kept.nodes().to_vec();
    expected.sort_unstable();
    assert_eq!(shown_nodes(&mut harness), expected, "inner boxes have vanished");
    assert!(expected.len() < binary.len());
    assert_eq!(expected.len(), row.numbers.layout_nodes + row.numbers.layout_leaves);
    let table = harness.state().state.model.table().cloned().expect("a table");
    assert_eq!(table.max_depth() as usize + 1, kept.levels().ranges.len(), "depths are those of the wide tree");
    let marked = expected.iter().find(|&&node| kept.children(node).len() > 2).expect("a node with more than two");
    assert!(table.below(*marked).eq(kept.children(*marked).iter().copied()));

    // In the icicle, and ended there.
    press(&mut harness, Modifiers::NONE, Key::F7);
    settle(&mut harness);
    let label = format!("Layout {}", row.layout.name());
    let icicles = harness.get_all_by_label_contains("Icicle of").count();
    assert!(icicles > 0 && harness.query_all_by_label(&label).count() == 2, "in the icicle and beside the depths");
    let state = &harness.state().state;
    let last = state.views.get::<IcicleView>().last_layout(&accel).cloned().expect("an icicle");
    assert!(last.icicle.cells.iter().all(|cell| kept.depth(cell.node) == Some(cell.level)));
    harness.get_all_by_label(&label).next().expect("a way out").click();
    settle(&mut harness);
    assert_eq!(harness.state().state.model.layout.chosen, None);
    assert_eq!(shown_nodes(&mut harness), binary);
}

#[test]
fn a_heat_map_counts_the_layout_on_show_and_its_legend_names_it() {
    let mut harness = open();
    let row = measured(&harness, &LayoutPlan::default()).into_iter().nth(4).expect("a row");
    let state = &mut harness.state_mut().state;
    state.wanted.render.shading = Shading::Heat(HeatKind::Lines);
    state.wanted.render.heat_range = Some([0.0, 40.0]);
    settle(&mut harness);
    let legend = |harness: &Window, text: &str| {
        harness.query_all_by_label_contains("Legend. Picture: cache lines per pixel").count() == 1
            && harness.query_by_label_contains(&format!("cache lines per pixel{text}")).is_some()
    };
    let in_layout = format!(" in {}", row.layout.name());
    assert!(legend(&harness, "") && !legend(&harness, &in_layout));
    let of_tree = presented(&harness).frame;

    harness.state_mut().state.model.layout.toggle(row.layout.choice);
    settle(&mut harness);
    assert!(legend(&harness, &in_layout), "the legend names the layout");
    assert_eq!(harness.state().state.wanted.render.heat_range, None, "the range was that of other counts");
    let frame = presented(&harness).frame;
    assert_eq!((frame.layout, &frame.primitive), (Some(row.layout.choice), &of_tree.primitive));
    assert_ne!(frame.values, of_tree.values);
    assert_eq!(frame.stats.tests_per_ray(), of_tree.stats.tests_per_ray(), "numbers of the tree stay its own");
    let flag = format!("--layout '{}'", row.layout.name());
    assert!(command_line(&harness.state().state).contains(&flag), "{}", command_line(&harness.state().state));

    // A fixed range compares one layout with another.
    harness.state_mut().state.wanted.render.heat_range = Some([0.0, 30.0]);
    settle(&mut harness);
    harness.state_mut().state.model.layout.toggle(LayoutChoice::Engine);
    settle(&mut harness);
    assert_eq!(harness.state().state.wanted.render.heat_range, Some([0.0, 30.0]));
    assert_eq!(presented(&harness).frame.values, of_tree.values, "of the tree that is traced, as a layout");

    // Other shadings keep their picture, and two trees are compared by their own counts.
    harness.state_mut().state.wanted.render.shading = Shading::Heat(HeatKind::AllHits);
    settle(&mut harness);
    assert_eq!(presented(&harness).frame.layout, None);
    let state = &mut harness.state_mut().state;
    state.wanted.render.shading = Shading::Heat(HeatKind::Lines);
    state.wanted.second = Some(SecondTree::new(state.wanted.build));
    settle(&mut harness);
    assert_eq!(presented(&harness).frame.layout, None);
    assert!(!command_line(&harness.state().state).contains("--layout"));
}

#[test]
fn what_has_no_layouts_is_said() {
    let mut harness = open();
    harness.state_mut().state.wanted.build.container = ContainerKind::Sphere;
    settle(&mut harness);
    assert!(harness.query_by_label_contains("Layouts are those of trees of boxes").is_some());

    let mut harness = app_of_copies();
    press(&mut harness, Modifiers::NONE, Key::Y);
    settle(&mut harness);
    assert!(harness.query_by_label_contains("Copies flat").is_some());
}
