//! The view "Copies".

use bvhscope::app::commands::Action;
use bvhscope::lab::copy_advice::{MeshChange, copy_advice};
use bvhscope::lab::copy_costs::{CostInPart, copy_costs};
use bvhscope::lab::copy_forms::{copy_forms, flat_form};
use bvhscope::lab::population::Population;
use bvhscope::lab::report_table::number;
use bvhscope::scene::Instancing;
use bvhscope::text::count;
use bvhscope_engine::cancel::CancelToken;
use egui::accesskit::Role;
use egui::{Key, Modifiers, pos2};
use egui_kittest::kittest::Queryable as _;

use crate::harness::{Window, app, app_of_copies, camera, copied, double_click, presented, press, settle};

fn open() -> Window {
    let mut harness = app_of_copies();
    press(&mut harness, Modifiers::NONE, Key::O);
    settle(&mut harness);
    harness
}

/// The costs of all copies, measured by the rays of the view without it.
fn measured(harness: &Window) -> Vec<CostInPart> {
    let accel = presented(harness).accel;
    let rays = harness.state().state.model.derived.rays(&accel.scene).expect("the rays of the view");
    let mut rows = Vec::new();
    copy_costs(&accel, &[rays], 1_000, &CancelToken::new(), &mut |row| rows.push(row)).expect("two levels");
    rows
}

fn dearest(harness: &Window) -> Vec<u32> {
    measured(harness).iter().filter_map(|row| row.part.copy).collect()
}

/// The copied tables: lines of cells, of which each column of tests is compared.
fn check(harness: &mut Window) {
    let expected = measured(harness);
    let text = copied(harness, "Copy");
    let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split('\t').collect()).collect();
    let named = |name: &str| lines.iter().find(|cells| cells[0] == name).unwrap_or_else(|| panic!("{name}: {text}"));
    // Meshes that no ray enters are summed up.
    for row in expected.iter().filter(|row| row.part.mesh.is_none() || row.cost.entered_per_ray > 0.0) {
        let numbers = [row.cost.container_tests_per_ray, row.cost.primitive_tests_per_ray].map(number);
        let found = match (row.part.mesh, row.part.copy) {
            (_, Some(copy)) => &named(&copy.to_string())[7..9],
            (Some(mesh), None) => &named(&format!("mesh {mesh}"))[5..7],
            (None, None) if row.part.copies == 0 => &named("tree over the copies")[5..7],
            (None, None) => &named("whole scene")[5..7],
        };
        assert_eq!(found, numbers, "{:?}", row.part);
    }
}

fn selected(harness: &Window) -> (Option<u32>, Option<u32>) {
    let selection = &harness.state().state.selection;
    (selection.picked.as_ref().map(|picked| picked.primitive), selection.nodes.selected)
}

/// A copy and the leaf that holds it.
fn chosen(harness: &Window, copy: u32) -> (Option<u32>, Option<u32>) {
    (Some(copy), presented(harness).accel.path_to(copy).last().copied())
}

#[test]
fn costs_are_those_of_the_chosen_rays() {
    let mut harness = open();
    check(&mut harness);
    harness.state_mut().state.model.derived.population = Population::AmbientOcclusion;
    settle(&mut harness);
    check(&mut harness);
}

#[test]
fn the_dearest_copies_light_up_are_selected_and_stepped_through() {
    let mut harness = open();
    let listed = dearest(&harness);
    assert!(listed.len() > 5, "{listed:?}");
    let row_of = |harness: &Window, copy: u32| {
        let name = format!("copy {} of mesh", count(u64::from(copy)));
        harness
            .get_by(|node| node.role() == Role::ListItem && node.label().is_some_and(|label| label.starts_with(&name)))
            .rect()
    };
    harness.hover_at(row_of(&harness, listed[1]).center());
    harness.run_steps(3);
    let hovered = |harness: &Window| harness.state().state.selection.nodes.hovered;
    assert_eq!(hovered(&harness), chosen(&harness, listed[1]).1);
    harness.hover_at(pos2(3.0, 3.0));
    harness.run_steps(3);
    assert_eq!(hovered(&harness), None);

    let before = camera(&harness);
    let at = row_of(&harness, listed[1]).center();
    double_click(&mut harness, at);
    settle(&mut harness);
    assert_eq!(selected(&harness), chosen(&harness, listed[1]));
    let framed = camera(&harness);
    assert_ne!(framed, before, "it is looked at");

    press(&mut harness, Modifiers::ALT | Modifiers::SHIFT, Key::Comma);
    assert_eq!(selected(&harness), chosen(&harness, listed[0]), "the list stays, though the view has changed");
    assert_ne!(camera(&harness), framed);
    press(&mut harness, Modifiers::ALT | Modifiers::SHIFT, Key::Comma);
    assert_eq!(selected(&harness), chosen(&harness, listed[0]), "there is none before the dearest");
    press(&mut harness, Modifiers::ALT | Modifiers::SHIFT, Key::Period);
    assert_eq!(selected(&harness), chosen(&harness, listed[1]));
}

#[test]
fn forms_are_measured_once_they_are_shown() {
    let mut harness = open();
    harness.get_by_role_and_label(Role::Button, "Forms").click();
    settle(&mut harness);
    let accel = presented(&harness).accel;
    let rays = harness.state().state.model.derived.rays(&accel.scene).expect("the rays of the view");
    let (token, open, mut expected) = (CancelToken::new(), [1.0, 1.5, 2.0, 3.0, 4.0, 8.0], Vec::new());
    let flat = flat_form(&accel, &token).expect("room for it");
    copy_forms(&accel, Some(&flat), &open, &[rays], &token, &mut |row| expected.push(row)).expect("two levels");
    let text = copied(&mut harness, "Copy");
    let found: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split('\t').collect()).collect();
    assert_eq!(found.len(), 7, "{text}");
    for (found, expected) in found.iter().zip(&expected) {
        let numbers = [expected.cost.nodes_per_ray, expected.cost.blocks_per_ray].map(number);
        assert_eq!(
            (found[0], &found[5..7]),
            (expected.form.name().as_str(), &numbers.each_ref().map(String::as_str)[..])
        );
    }
    let fewest = expected.iter().skip(1).map(|row| row.cost.visits_per_ray()).fold(f64::INFINITY, f64::min);
    let said = format!("{} a ray", number(fewest));
    assert!(harness.query_by_label_contains(&said).is_some(), "{said}");
    let plots = |harness: &Window| {
        ["Nodes and blocks a ray", "Trees, MB"]
            .map(|up| harness.get_by_label_contains(&format!("Plot of {up} over Parts for each copy")).rect())
    };
    let before = plots(&harness);
    harness.run_steps(8);
    assert_eq!(plots(&harness), before, "they do not grow");
    harness.get_by_role_and_label(Role::Button, "Costs").click();
    settle(&mut harness);
    check(&mut harness);
}

#[test]
fn advice_is_measured_once_it_is_shown() {
    let mut harness = open();
    harness.get_by_role_and_label(Role::Button, "Advice").click();
    settle(&mut harness);
    let accel = presented(&harness).accel;
    let rays = harness.state().state.model.derived.rays(&accel.scene).expect("the rays of the view");
    let mut expected = Vec::new();
    copy_advice(&accel, &[rays], &CancelToken::new(), &mut |row| expected.push(row)).expect("two levels");
    expected.retain(|row| row.change != MeshChange::None);
    let text = copied(&mut harness, "Copy");
    let found: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split('\t').collect()).collect();
    assert!(expected.len() > 2, "{text}");
    assert_eq!(found.len(), expected.len(), "{text}");
    for (found, expected) in found.iter().zip(&expected) {
        let both = expected.differences.visits_change.expect("rays visit nodes") * 100.0;
        let said: f64 = found[4].parse().expect("a number");
        assert!((said - both).abs() < 0.051, "{found:?}: {both}");
    }
    assert!(harness.query_all_by_label_contains("for these rays").next().is_some());
    harness.get_by_role_and_label(Role::Button, "Costs").click();
    settle(&mut harness);
    check(&mut harness);
}

#[test]
fn what_has_no_two_levels_is_said() {
    let mut harness = app();
    press(&mut harness, Modifiers::NONE, Key::O);
    settle(&mut harness);
    assert!(harness.query_by_label_contains("no copies of meshes").is_some());

    let mut harness = app_of_copies();
    Action::ShowCopies(Instancing::Flat).perform(&mut harness.state_mut().state);
    settle(&mut harness);
    let step = Action::StepCopies(bvhscope::app::commands::RankingStep::Next);
    assert!(!step.is_enabled(&harness.state().state));
    press(&mut harness, Modifiers::NONE, Key::O);
    settle(&mut harness);
    assert!(harness.query_by_label_contains("Copies in two levels").is_some());
    Action::ShowCopies(Instancing::TwoLevel).perform(&mut harness.state_mut().state);
    settle(&mut harness);
    check(&mut harness);
}

#[test]
fn the_key_of_the_worst_copy_opens_the_list_first() {
    let mut harness = app_of_copies();
    press(&mut harness, Modifiers::ALT | Modifiers::SHIFT, Key::Period);
    settle(&mut harness);
    assert_eq!(selected(&harness), (None, None));
    press(&mut harness, Modifiers::ALT | Modifiers::SHIFT, Key::Period);
    assert_eq!(selected(&harness), chosen(&harness, dearest(&harness)[0]));
}
