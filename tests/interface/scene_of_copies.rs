//! A scene of copies in two levels.

use std::sync::Arc;

use bvhscope::app::commands::Action;
use bvhscope::app::state::{Request, Severity};
use bvhscope::app::views;
use bvhscope::app::views::motion::{MotionQuantity, MotionView};
use bvhscope::app::views::plots::{PlotKind, PlotsView, TreeQuality};
use bvhscope::render::{Frame, Shading};
use bvhscope::scene::{Instancing, Moment, SceneSource};
use bvhscope_engine::Bvh;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::tree::ContainerKind;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;

use crate::harness::{Window, app_in_two_levels, app_of_copies, click, presented, press, settle, viewport};

fn errors(harness: &Window) -> Vec<String> {
    let open = harness.state().state.messages.open.iter();
    open.filter(|message| message.severity == Severity::Error).map(|message| message.text.clone()).collect()
}

#[test]
fn a_click_selects_a_copy_and_hiding_it_shows_what_is_behind() {
    let mut harness = app_of_copies();
    assert_eq!(presented(&harness).accel.scene.triangles.len(), 61, "crates and their ground");
    let at = viewport(&harness).center();
    click(&mut harness, at);
    settle(&mut harness);
    let picked = |harness: &Window| harness.state().state.selection.picked.as_ref().map(|picked| picked.primitive);
    let first = picked(&harness).expect("a copy is picked");
    assert!(first < 61, "{first}");
    assert!(harness.query_by_label_contains("Copies below").is_some(), "the selection speaks of copies");
    assert!(harness.query_by_label_contains("Triangles below").is_none());
    harness.state_mut().state.wanted.overlay.hide_triangles = true;
    Action::HideSelected.perform(&mut harness.state_mut().state);
    settle(&mut harness);
    click(&mut harness, at);
    settle(&mut harness);
    assert_ne!(picked(&harness), Some(first), "the hidden copy lets rays pass");
}

/// The tree goes on in the mesh of a copy: depths, nodes, triangles and hidden ones do, and the picture stays.
#[test]
fn an_unfolded_copy_goes_on_in_its_mesh() {
    let mut harness = app_of_copies();
    let before = presented(&harness).clone();
    let at = viewport(&harness).center();
    click(&mut harness, at);
    settle(&mut harness);
    let state = |harness: &Window| harness.state().state.selection.clone();
    let copy = state(&harness).picked.expect("a copy is picked").primitive;
    let leaf = state(&harness).nodes.selected.unwrap();
    Action::ToggleUnfolded.perform(&mut harness.state_mut().state);
    settle(&mut harness);
    let shown = presented(&harness).clone();
    assert_eq!(shown.accel.scene.unfolded.copies.iter().map(|one| one.copy).collect::<Vec<_>>(), [copy]);
    assert_eq!(shown.accel.tree.container_kind(), ContainerKind::Oriented);
    let selected = state(&harness).nodes.selected.unwrap();
    assert_eq!(state(&harness).picked, None, "no triangle of the copy was picked");
    assert_eq!(shown.table.depth(selected), before.table.depth(leaf), "its leaf is selected still");
    assert!(!shown.table.is_leaf(selected) && shown.table.max_depth() > before.table.max_depth());
    assert_eq!(shown.frame.rgba, before.frame.rgba, "the same rays");
    // A click goes on to the triangle, whose leaf has a place in the mesh.
    click(&mut harness, at);
    settle(&mut harness);
    let picked = state(&harness).picked.expect("a triangle is picked");
    let (of, triangle) = shown.accel.scene.copy_of(picked.primitive).unwrap();
    assert_eq!((of, triangle.is_some()), (copy, true));
    assert!(picked.path.contains(&selected) && picked.path.len() as u32 > shown.table.depth(selected) + 2);
    assert!(harness.query_by_label_contains(&format!("copy {copy} / node")).is_some());
    assert!(harness.query_by_label_contains("Triangles below").is_some());
    // A part of the mesh is hidden, is found again when another copy is unfolded too, and is shown when this one is folded.
    harness.state_mut().state.wanted.overlay.hide_triangles = true;
    Action::SelectParent.perform(&mut harness.state_mut().state);
    Action::HideSelected.perform(&mut harness.state_mut().state);
    settle(&mut harness);
    let hidden = |harness: &Window| harness.state().state.selection.nodes.hidden.len();
    let bare = presented(&harness).frame.rgba.clone();
    assert!(hidden(&harness) == 1 && bare != before.frame.rgba);
    Action::UnfoldAll.perform(&mut harness.state_mut().state);
    settle(&mut harness);
    assert_eq!((hidden(&harness), &presented(&harness).frame.rgba), (1, &bare));
    assert_eq!(presented(&harness).accel.scene.unfolded.copies.len(), 61);
    assert_eq!(errors(&harness), [""; 0]);
    Action::FoldAll.perform(&mut harness.state_mut().state);
    settle(&mut harness);
    assert_eq!((hidden(&harness), &presented(&harness).frame.rgba), (0, &before.frame.rgba));
    assert_eq!(presented(&harness).accel.tree.container_kind(), ContainerKind::Aabb);
    harness.state_mut().state.undo();
    settle(&mut harness);
    assert_eq!(presented(&harness).accel.scene.unfolded.copies.len(), 61);
}

#[test]
fn every_view_and_shading_answers() {
    every_view_answers(&[]);
}

#[test]
fn every_view_and_shading_answers_where_copies_are_unfolded() {
    every_view_answers(&[Action::UnfoldAll]);
}

fn every_view_answers(first: &[Action]) {
    let mut harness = app_of_copies();
    for action in first {
        action.perform(&mut harness.state_mut().state);
        settle(&mut harness);
    }
    for view in views::names() {
        harness.state_mut().state.preferences.dock.show(view);
        settle(&mut harness);
        assert_eq!(errors(&harness), [""; 0], "{view}");
    }
    for shading in Shading::ALL {
        harness.state_mut().state.wanted.render.shading = shading;
        settle(&mut harness);
        let presented = presented(&harness);
        assert_eq!(presented.frame.settings.shading, shading);
        let values = presented.frame.values.iter().filter(|value| **value > 0.0 && **value < Frame::NO_HIT);
        assert!(!shading.has_values() || values.count() > 100, "{shading:?}");
    }
    assert_eq!(errors(&harness), [""; 0]);
}

#[test]
fn numbers_that_copies_lack_are_not_waited_for() {
    const NONE: &str = "no end-point overlap";
    let mut harness = app_of_copies();
    press(&mut harness, Modifiers::NONE, Key::F10);
    settle(&mut harness);
    assert!(harness.query_by_label_contains("Leaf size").is_some(), "the panel lists numbers of the tree");
    assert!(harness.query_by_label_contains("EPO …").is_none(), "the panel waits for it");
    assert!(harness.query_by_label_contains("rays enter the root").is_some());
    assert!(
        harness.query_by_label_contains("tests each").is_none(),
        "those below the tree over the copies are not counted"
    );
    for (kind, quality, lacks) in [
        (PlotKind::Prediction, TreeQuality::Cost, true),
        (PlotKind::Speed, TreeQuality::Cost, false),
        (PlotKind::Speed, TreeQuality::SahCost, false),
        (PlotKind::Speed, TreeQuality::Epo, true),
    ] {
        let view = harness.state_mut().state.views.get_mut::<PlotsView>();
        (view.kind, view.quality) = (kind, quality);
        settle(&mut harness);
        assert_eq!(harness.query_by_label_contains(NONE).is_some(), lacks, "{kind:?} {quality:?}");
        assert_eq!(harness.query_by_label_contains("Plot of").is_some(), !lacks, "{kind:?} {quality:?}");
    }
}

#[test]
fn spheres_are_refused_and_the_tree_of_boxes_stays() {
    let mut harness = app_of_copies();
    let state = &mut harness.state_mut().state;
    state.wanted.build = state.wanted.build.for_container(ContainerKind::Sphere);
    settle(&mut harness);
    let said =
        |harness: &Window, what: &str| harness.state().state.messages.open.iter().any(|one| one.text.contains(what));
    assert!(said(&harness, "copies have boxes, not spheres") && said(&harness, "The present tree stays"));
    assert_eq!(presented(&harness).accel.tree.container_kind(), ContainerKind::Aabb);
}

#[test]
fn the_form_of_copies_is_chosen_in_the_window_and_is_of_that_model_alone() {
    let mut harness = app_of_copies();
    let is_on = |harness: &Window, form| Action::ShowCopies(form).is_on(&harness.state().state);
    let camera = harness.state().state.wanted.camera;
    assert_eq!([Instancing::Flat, Instancing::TwoLevel].map(|form| is_on(&harness, form)), [Some(false), Some(true)]);
    Action::ShowCopies(Instancing::Flat).perform(&mut harness.state_mut().state);
    settle(&mut harness);
    let scene = presented(&harness).accel.scene.clone();
    assert!(scene.copies.is_none() && scene.triangles.len() > 61 && scene.repeats_meshes);
    assert_eq!(harness.state().state.wanted.camera, camera, "it is the same model in the same view");
    assert_eq!([Instancing::Flat, Instancing::TwoLevel].map(|form| is_on(&harness, form)), [Some(true), Some(false)]);
    // The next model is loaded as the command line says.
    harness.state_mut().state.activity.requests.push(Request::Open(SceneSource::default_builtin()));
    settle(&mut harness);
    assert!(!Action::ShowCopies(Instancing::Flat).is_enabled(&harness.state().state), "a teapot has no copies");
    assert_eq!(harness.state().state.model.load_options.instances, Instancing::TwoLevel);
    assert_eq!(errors(&harness), [""; 0]);
}

/// The tree of the first vehicle's mesh.
fn tree_of_vehicle(harness: &Window) -> Arc<Bvh> {
    Arc::clone(&presented(harness).accel.levels().expect("two levels").wide().copies().meshes()[1])
}

#[test]
fn copies_that_move_play_while_the_trees_of_their_meshes_stay() {
    let mut harness = app_in_two_levels("builtin:traffic:40");
    let (rest, own) = (presented(&harness).accel.scene.clone(), tree_of_vehicle(&harness));
    harness.get_by_label("Play clip").click();
    harness.run_steps(2);
    for _ in 0..3 {
        harness.run_steps(1);
        let scene = presented(&harness).accel.scene.clone();
        assert_eq!(scene.moment, harness.state().state.wanted.moment, "tree and picture follow");
        assert!(scene.copies.is_some() && scene.triangles != rest.triangles && scene.is_same_model(&rest));
        assert!(Arc::ptr_eq(&own, &tree_of_vehicle(&harness)));
    }
    harness.get_by_label("Pause clip").click();
    settle(&mut harness);
    let go_to = |harness: &mut Window, seconds: f32| {
        harness.state_mut().state.wanted.moment = Some(Moment { clip: 0, seconds });
        settle(harness);
        assert_eq!(presented(harness).accel.scene.moment.map(|moment| moment.seconds), Some(seconds));
    };
    go_to(&mut harness, 3.0);
    assert!(Arc::ptr_eq(&own, &tree_of_vehicle(&harness)), "after a pause, too");
    let built = presented(&harness).frame.clone();
    harness.state_mut().state.wanted.follow.policy = Policy::Refit;
    settle(&mut harness);
    let fitted = presented(&harness).clone();
    assert!(fitted.accel.is_followed() && fitted.accel.built_areas().is_some());
    assert_eq!(fitted.frame.rgba, built.rgba, "the same hits by another tree");
    // A copy is picked and unfolded as at rest, and stays so in other moments.
    let at = viewport(&harness).center();
    click(&mut harness, at);
    settle(&mut harness);
    let copy = harness.state().state.selection.picked.as_ref().expect("the ground is picked").primitive;
    Action::ToggleUnfolded.perform(&mut harness.state_mut().state);
    settle(&mut harness);
    for seconds in [3.0, 1.5] {
        go_to(&mut harness, seconds);
        let accel = presented(&harness).accel.clone();
        assert_eq!(accel.scene.unfolded.copies.iter().map(|one| one.copy).collect::<Vec<_>>(), [copy]);
        assert_eq!(accel.tree.container_kind(), ContainerKind::Oriented);
    }
    assert_eq!(errors(&harness), [""; 0]);
}

#[test]
fn motion_measures_the_tree_over_the_copies_by_each_policy() {
    let mut harness = app_in_two_levels("builtin:traffic:40");
    harness.state_mut().state.wanted.follow.frames = 10;
    press(&mut harness, Modifiers::NONE, Key::T);
    settle(&mut harness);
    let curves = harness.state().state.views.get::<MotionView>().curves().cloned().expect("measured");
    let curves = curves.as_ref().as_ref().unwrap();
    assert_eq!(curves.iter().map(|curve| curve.policy).collect::<Vec<_>>(), Policy::ALL);
    for row in curves.iter().flat_map(|curve| &curve.rows) {
        assert!(row.epo.is_none() && row.tests_per_ray().is_some_and(|tests| tests > 1.0), "{row:?}");
        assert!(row.stats.nodes < 82, "41 copies: {row:?}");
    }
    assert!(harness.query_by_label_contains("Plot of").is_some());
    harness.state_mut().state.views.get_mut::<MotionView>().quantity = MotionQuantity::Epo;
    settle(&mut harness);
    assert!(harness.query_by_label_contains("no end-point overlap").is_some());
    assert_eq!(errors(&harness), [""; 0]);
}
