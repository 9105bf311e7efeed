//! The view "Layouts".

use bvhscope::lab::layouts::{LaidOut, LayoutPlan, layouts};
use bvhscope::lab::population::Population;
use bvhscope::lab::report_table::number;
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
