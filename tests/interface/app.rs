//! The whole app in a headless harness. Each frame waits until all background work is done, except where a test is about it.

use bvhscope::app::App;
use bvhscope::app::commands::Action;
use bvhscope::app::state::paper::{Experiment, RowFormat};
use bvhscope::app::state::{PickedTriangle, Request, Severity};
use bvhscope::catalog::numbers::rows::{HITS, SAH_COST, TESTS_PER_RAY};
use bvhscope::lab::Subject;
use bvhscope::lab::report_table::number;
use bvhscope::overlay::ContainerSet;
use bvhscope::render::{RenderSettings, Shading};
use bvhscope::scene::{LoadOptions, SceneSource};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuilderKind;
use bvhscope_engine::tree::ContainerKind;
use egui::accesskit::Role;
use egui_kittest::kittest::Queryable as _;

use crate::harness::Window;
use crate::recorded_screen;

/// The app on a small built-in teapot with one sample per pixel.
fn app() -> Window {
    let mut harness = app_that_waits(true);
    settle(&mut harness);
    harness
}

/// The same. With `wait` false, work goes on between the frames as in a real window.
fn app_that_waits(waits: bool) -> Window {
    app_on(SceneSource::Builtin { name: "teapot".to_owned(), size: Some(4) }, waits)
}

fn app_on(source: SceneSource, waits: bool) -> Window {
    app_of_size(egui::vec2(1000.0, 640.0), source, waits)
}

fn app_of_size(size: egui::Vec2, source: SceneSource, waits: bool) -> Window {
    recorded_screen::open(source, size, recorded_screen::COARSE, waits)
}

/// Runs a few frames, as the changes of one are shown in the next.
fn settle(harness: &mut Window) {
    harness.run_steps(4);
    assert!(harness.state_mut().run_until_idle());
    harness.run_steps(2);
}

/// Runs frames of an app that does not wait until `what` holds.
fn wait_for(harness: &mut Window, what: &dyn Fn(&App) -> bool) {
    let start = std::time::Instant::now();
    while !what(harness.state()) {
        assert!(start.elapsed().as_secs() < 120, "the expected state never came");
        harness.step();
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
}

#[test]
fn starts_with_a_picture_of_the_wanted_model() {
    let harness = app();
    let state = &harness.state().state;
    let presented = state.model.presented.as_ref().unwrap();
    assert_eq!(presented.accel.scene.source, state.wanted.source);
    assert_eq!([presented.frame.width_px, presented.frame.height_px], state.layout.viewport_px);
    assert_eq!(presented.frame.coarseness, 1.0);
    assert!(presented.frame.stats.hits > 0, "the teapot is seen");
    assert!(state.layout.graphics.overlay_counts().0 > 0, "containers lie over it");
    assert!(!harness.state().is_busy());
}

#[test]
fn containers_are_missing_only_once_they_were_chosen() {
    let mut harness = app_that_waits(false);
    let missing = "No containers at this depth";
    wait_for(&mut harness, &|app| app.state.model.presented.is_some());
    for _ in 0..5 {
        assert!(harness.query_by_label(missing).is_none());
        harness.step();
    }
    assert!(harness.state().state.layout.graphics.overlay_counts().0 > 0);
    harness.state_mut().state.selection.nodes.hidden.insert(0);
    harness.run_steps(2);
    assert!(harness.query_by_label(missing).is_some(), "the root is hidden");
}

#[test]
fn a_new_threshold_gives_a_new_tree_and_its_picture() {
    let mut harness = app();
    let before = harness.state().state.model.presented.clone().unwrap();
    harness.state_mut().state.wanted.build.threshold = 24;
    settle(&mut harness);
    let after = harness.state().state.model.presented.clone().unwrap();
    assert_eq!(after.accel.settings.threshold, 24);
    assert_ne!(after.table.id, before.table.id);
    assert!(after.frame_id > before.frame_id);
    assert_ne!(after.accel.report.stats.sah_cost, before.accel.report.stats.sah_cost);
    assert_eq!(after.frame.primitive, before.frame.primitive, "another tree shows the same model");
}

#[test]
fn tests_per_ray_are_counted_in_every_mode() {
    let mut harness = app();
    let mut all = Vec::new();
    for shading in Shading::ALL {
        // With one sample per pixel no second pass could add the counts.
        harness.state_mut().state.wanted.render = RenderSettings { shading, samples: 1, ..RenderSettings::default() };
        settle(&mut harness);
        let shown = harness.state().state.model.presented.clone().unwrap();
        assert_eq!(shown.frame.settings.shading, shading);
        all.push(shown.tests_per_ray.unwrap_or_else(|| panic!("{} has no counts", shading.label())));
    }
    for [containers, primitives] in &all {
        assert!(*containers > 1.0 && *primitives > 0.1);
        assert!((containers - all[0][0]).abs() < 1e-3 && (primitives - all[0][1]).abs() < 1e-3, "{all:?}");
    }
}

#[test]
fn the_last_counts_stay_while_the_model_is_turned() {
    // A small picture is traced at full resolution even in motion, a large one is coarse.
    for size in [egui::vec2(640.0, 360.0), egui::vec2(1000.0, 640.0)] {
        let source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(4) };
        counts_stay_while_turned(app_of_size(size, source, false));
    }
}

fn counts_stay_while_turned(mut harness: Window) {
    wait_for(&mut harness, &|app| app.state.model.presented.is_some() && !app.is_busy());
    let before = harness.state().state.model.presented.clone().unwrap();
    let moving = |app: &App| {
        let shown = app.state.model.presented.as_ref().unwrap();
        shown.frame_id > before.frame_id && shown.frame.stats.tests_per_ray().is_none()
    };
    let start = std::time::Instant::now();
    while !moving(harness.state()) {
        assert!(start.elapsed().as_secs() < 120, "no picture of a moving model came");
        harness.state_mut().state.wanted.camera.eye.x += 0.01;
        harness.step();
    }
    let shown = harness.state().state.model.presented.clone().unwrap();
    assert!(before.tests_per_ray.is_some());
    assert_eq!(shown.tests_per_ray, before.tests_per_ray);
    // At rest they are counted again.
    wait_for(&mut harness, &|app| {
        app.state.model.presented.as_ref().is_some_and(|shown| shown.frame.stats.tests_per_ray().is_some())
    });
    let counted = harness.state().state.model.presented.clone().unwrap();
    assert_eq!(counted.tests_per_ray, counted.frame.stats.tests_per_ray());
}

#[test]
fn the_depth_changes_what_is_shown_but_not_the_picture() {
    let mut harness = app();
    harness.state_mut().state.wanted.overlay.depth = Some([0, 0]);
    settle(&mut harness);
    let frame = harness.state().state.model.presented.as_ref().unwrap().frame_id;
    assert_eq!(harness.state().state.layout.graphics.overlay_counts(), (1, 1));
    harness.state_mut().state.wanted.overlay.depth = Some([1, 2]);
    settle(&mut harness);
    let state = &harness.state().state;
    assert_eq!(state.layout.graphics.overlay_counts(), (6, 6));
    assert_eq!(state.model.presented.as_ref().unwrap().frame_id, frame);
}

#[test]
fn the_wanted_depths_survive_a_smaller_model() {
    let mut harness = app();
    let open = |harness: &mut Window, name: &str| {
        let source = SceneSource::Builtin { name: name.to_owned(), size: None };
        harness.state_mut().state.activity.requests.push(Request::Open(source));
        settle(harness);
    };
    harness.state_mut().state.wanted.overlay.depth = Some([5, 90]);
    open(&mut harness, "cornell");
    let max_depth = harness.state().state.model.presented.as_ref().unwrap().table.max_depth();
    assert_eq!(harness.state().state.drawn_depths(), [5.min(max_depth), max_depth], "clamped for display");
    assert_eq!(harness.state().state.wanted.overlay.depth, Some([5, 90]));
    Action::AutomaticDepths.perform(&mut harness.state_mut().state);
    settle(&mut harness);
    let (drawn, wanted) = harness.state().state.layout.graphics.overlay_counts();
    assert!(drawn == wanted && drawn <= 200);
    assert!(harness.query_by_label("Automatic depth range").is_some());
}

#[test]
fn the_drawn_containers_follow_the_tree_until_chosen() {
    let mut harness = app();
    Action::Container(ContainerKind::Sphere).perform(&mut harness.state_mut().state);
    settle(&mut harness);
    assert_eq!(harness.state().state.drawn_kinds(), ContainerSet::of(ContainerKind::Sphere));
    harness.get_by_label("More of containers").click();
    harness.run_steps(4);
    harness.get_by_role_and_label(Role::CheckBox, "Boxes").click();
    harness.run_steps(2);
    Action::Container(ContainerKind::Aabb).perform(&mut harness.state_mut().state);
    settle(&mut harness);
    assert_eq!(harness.state().state.drawn_kinds(), ContainerKind::OF_PAPER.into_iter().collect(), "as chosen by hand");
    for (choice, kinds) in
        [("14-DOPs", ContainerSet::of(ContainerKind::Dop14)), ("As the tree", ContainerSet::of(ContainerKind::Aabb))]
    {
        harness.get_by_role_and_label(Role::ComboBox, "Show").click();
        harness.run_steps(4);
        harness.get_by_role_and_label(Role::Button, choice).click();
        harness.run_steps(4);
        assert_eq!(harness.state().state.drawn_kinds(), kinds, "{choice}");
    }
    assert!(harness.state().state.wanted.overlay.follows_tree);
}

#[test]
fn an_unusable_file_is_reported_and_nothing_is_lost() {
    let mut harness = app();
    let before = harness.state().state.model.presented.as_ref().unwrap().frame_id;
    let source = harness.state().state.wanted.source.clone();
    let missing = SceneSource::File("does-not-exist.obj".into());
    harness.state_mut().state.activity.requests.push(Request::Open(missing));
    settle(&mut harness);
    let state = &harness.state().state;
    assert_eq!(state.model.presented.as_ref().unwrap().frame_id, before);
    assert_eq!(state.wanted.source, source);
    let errors: Vec<_> = state.messages.history.iter().filter(|message| message.severity == Severity::Error).collect();
    assert_eq!(errors.len(), 1, "{errors:?}");
    assert!(errors[0].text.contains("does-not-exist.obj"), "{}", errors[0].text);
}

#[test]
fn an_empty_window_says_what_to_do() {
    let mut harness = app_on(SceneSource::Builtin { name: "terrain".to_owned(), size: Some(3_000_000) }, false);
    wait_for(&mut harness, &|app| app.state.activity.load.is_some());
    harness.run_steps(2);
    harness.get_by_label("Cancel").click();
    wait_for(&mut harness, &|app| !app.is_busy());
    harness.run_steps(3);
    assert!(harness.state().state.model.presented.is_none(), "the very first model was given up");
    assert!(harness.query_by_label_contains("Nothing to show. F5 tries again").is_some());
    // And so it does.
    harness.state_mut().state.wanted.source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(2) };
    Action::Reload.perform(&mut harness.state_mut().state);
    wait_for(&mut harness, &|app| app.state.model.presented.is_some());
    harness.run_steps(2);
    assert!(harness.query_by_label_contains("Nothing to show").is_none());
}

#[test]
fn a_long_load_is_cancelled_by_its_button_and_the_scene_stays() {
    let mut harness = app_that_waits(false);
    wait_for(&mut harness, &|app| app.state.model.presented.is_some() && !app.is_busy());
    let before = harness.state().state.model.presented.clone().unwrap();
    let large = SceneSource::Builtin { name: "terrain".to_owned(), size: Some(10_000_000) };
    harness.state_mut().state.activity.requests.push(Request::Open(large));
    wait_for(&mut harness, &|app| app.state.activity.load.is_some());
    harness.run_steps(2);
    assert!(harness.query_by_label("Loading terrain 10000000").is_some(), "what runs has a bar");
    harness.get_by_label("Cancel").click();
    wait_for(&mut harness, &|app| !app.is_busy());
    let state = &harness.state().state;
    assert!(
        state.messages.history.iter().any(|message| message.text == "Loading cancelled"),
        "{:?}",
        state.messages.history
    );
    assert_eq!(state.wanted.source, before.accel.scene.source);
    assert!(std::sync::Arc::ptr_eq(&state.model.presented.as_ref().unwrap().accel, &before.accel));
}

#[test]
fn f5_reads_the_file_again() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("model.obj");
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    std::fs::write(&model, format!("{corners}f 1 2 3\n")).unwrap();
    let mut harness = app_on(SceneSource::File(model.clone()), true);
    settle(&mut harness);
    let triangles =
        |harness: &Window| harness.state().state.model.presented.as_ref().unwrap().accel.scene.triangles.len();
    assert_eq!(triangles(&harness), 1);
    assert_eq!(harness.state().state.preferences.recent.first(), Some(&model));
    std::fs::write(&model, format!("{corners}f 1 2 3\nf 1 2 4\n")).unwrap();
    harness.key_press(egui::Key::F5);
    settle(&mut harness);
    assert_eq!(triangles(&harness), 2);
    // Open another scene, then return by the list of recent files.
    Action::OpenBuiltin(0).perform(&mut harness.state_mut().state);
    settle(&mut harness);
    assert!(triangles(&harness) > 100);
    harness.state_mut().state.layout.start_page_open = true;
    harness.run_steps(3);
    press(&mut harness, "model.obj");
    assert_eq!(triangles(&harness), 2);
}

#[test]
fn every_builder_of_the_list_builds() {
    let mut harness = app();
    harness.state_mut().state.preferences.greeted = true;
    for builder in BuilderKind::ALL {
        harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "Builder").click();
        harness.run_steps(4);
        harness.get_by_role_and_label(egui::accesskit::Role::Button, builder.label()).click();
        settle(&mut harness);
        let state = &harness.state().state;
        let shown = state.model.presented.as_ref().unwrap();
        assert_eq!((shown.accel.settings.builder, state.wanted.build.builder), (builder, builder));
        assert!(shown.frame.stats.hits > 0, "{}", builder.label());
        assert!(state.messages.history.is_empty(), "{:?}", state.messages.history);
    }
}

#[test]
fn refused_settings_leave_the_tree_alone() {
    let mut harness = app();
    let before = harness.state().state.model.presented.as_ref().unwrap().table.id;
    let build = &mut harness.state_mut().state.wanted.build;
    build.builder = bvhscope_engine::settings::BuilderKind::BinnedSah;
    build.container = bvhscope_engine::tree::ContainerKind::Sphere;
    settle(&mut harness);
    let state = &harness.state().state;
    assert_eq!(state.model.presented.as_ref().unwrap().table.id, before);
    assert_eq!(state.wanted.build, state.model.presented.as_ref().unwrap().accel.settings);
    assert!(state.messages.history.iter().any(|message| message.severity == Severity::Warning));
}

#[test]
fn a_picked_triangle_selects_the_path_to_its_leaf() {
    let mut harness = app();
    let state = &mut harness.state_mut().state;
    bvhscope::app::viewport::picking::pick(state, Some(5));
    let PickedTriangle { primitive, path } = state.selection.picked.clone().unwrap();
    assert_eq!((primitive, path[0]), (5, 0));
    assert_eq!(state.selection.nodes.selected, path.last().copied());
    Action::SelectParent.perform(state);
    assert_eq!(state.selection.nodes.selected, Some(path[path.len() - 2]));
    Action::SelectChild.perform(state);
    assert_eq!(state.selection.nodes.selected, path.last().copied());
    state.wanted.build.threshold = 12;
    settle(&mut harness);
    let state = &harness.state().state;
    assert_eq!(
        state.selection.picked.as_ref().map(|picked| picked.primitive),
        Some(5),
        "it stays selected in a new tree"
    );
}

#[test]
fn the_selection_survives_a_rebuild() {
    let mut harness = app();
    let rebuilt = |harness: &mut Window, threshold| {
        harness.state_mut().state.wanted.build.threshold = threshold;
        settle(harness);
        let shown = harness.state().state.model.presented.clone().unwrap();
        assert_eq!(shown.accel.settings.threshold, threshold);
        (shown, harness.state().state.selection.nodes.selected)
    };
    // The root, selected without a triangle.
    Action::SelectChild.perform(&mut harness.state_mut().state);
    assert_eq!(harness.state().state.selection.nodes.selected, Some(0));
    assert_eq!(rebuilt(&mut harness, 9).1, Some(0), "the root stays selected");

    // An interior node on the path to a picked triangle.
    let state = &mut harness.state_mut().state;
    bvhscope::app::viewport::picking::pick(state, Some(5));
    let path = state.selection.picked.clone().unwrap().path;
    state.selection.nodes.selected = Some(path[2]);
    let (shown, selected) = rebuilt(&mut harness, 14);
    assert_eq!(selected, Some(shown.accel.path_to(5)[2]), "the depth stays");

    // A node off that path.
    let sibling = shown.table.sibling(selected.unwrap(), 1).unwrap();
    harness.state_mut().state.selection.nodes.selected = Some(sibling);
    let triangle = shown.accel.tree.first_primitive_below(sibling).unwrap();
    let (shown, selected) = rebuilt(&mut harness, 20);
    let path = shown.accel.path_to(triangle);
    assert_eq!(selected, Some(path[2.min(path.len() - 1)]));

    // The leaf of the picked triangle.
    let state = &mut harness.state_mut().state;
    bvhscope::app::viewport::picking::pick(state, Some(5));
    let (shown, selected) = rebuilt(&mut harness, 6);
    assert_eq!(selected, shown.accel.path_to(5).last().copied());
}

/// Clicks the only widget of this name and waits for the work that it starts.
fn press(harness: &mut Window, name: &str) {
    harness.get_by_label(name).click();
    settle(harness);
}

/// A small measurement.
fn plan_little(harness: &mut Window) {
    let plan = &mut harness.state_mut().state.preferences.paper;
    plan.side_px = 256;
    plan.repeat = 1;
    plan.thresholds = [4, 8];
}

#[test]
fn the_paper_panel_shows_the_numbers_of_the_command_line() {
    let mut harness = app();
    plan_little(&mut harness);
    harness.key_press(egui::Key::F11);
    settle(&mut harness);
    assert_eq!(harness.state().state.preferences.dock.open.as_deref(), Some("Paper"));
    press(&mut harness, "Measure");
    let state = &harness.state().state;
    let shown = state.activity.measured[&Experiment::Tables].clone();
    assert!(shown.finished && shown.rows.len() == 2, "{} rows", shown.rows.len());
    let scene = state.model.loaded.clone().unwrap();
    let plan = &state.preferences.paper;
    let (model, load) = (scene.source.to_string(), LoadOptions::default());
    let subject = Subject { model, scene: scene.clone(), trees: Vec::new(), forms: Vec::new(), rays: None, load };
    let view = plan.view(&scene, &state.wanted);
    let mut rows = Vec::new();
    let job = plan.job(&state.wanted);
    job.run(&subject, (0, 1), &view, &CancelToken::new(), &mut |row| rows.push(row)).unwrap();
    for (shown, row) in shown.rows.iter().zip(&rows) {
        assert_eq!((&shown.model, shown.container), (&row.model, row.container));
        for count in [HITS, TESTS_PER_RAY, SAH_COST] {
            assert_eq!(shown.number(count), row.number(count), "{}", count.key);
        }
    }
    for (name, row) in ["box", "sphere"].iter().zip(&rows) {
        let cell = format!("all {name} {} tests/ray", number(row.number(TESTS_PER_RAY)));
        assert!(harness.query_by_label_contains(&cell).is_some(), "'{cell}' is not in the table");
    }
    for format in RowFormat::ALL {
        assert!(Action::SaveRows(format).is_enabled(&harness.state().state));
        assert!(!shown.file(format).unwrap().is_empty());
    }
    let json = String::from_utf8(shown.file(RowFormat::Json).unwrap()).unwrap();
    assert_eq!(json.lines().count(), 2);
    assert_eq!(shown.stem(), "teapot 4-bench");
}

#[test]
fn a_click_on_a_point_of_a_curve_sets_its_threshold() {
    let mut harness = app();
    plan_little(&mut harness);
    harness.state_mut().state.preferences.paper.containers = vec![ContainerKind::Aabb];
    Action::Measure(Experiment::Thresholds).perform(&mut harness.state_mut().state);
    settle(&mut harness);
    settle(&mut harness);
    assert_eq!(harness.state().state.activity.measured[&Experiment::Thresholds].rows.len(), 5);
    assert_eq!(harness.state().state.wanted.build.threshold, 6);
    let named = |name: &'static str| {
        move |node: &egui_kittest::kittest::AccessKitNode<'_>| {
            node.label().is_some_and(|label| label.starts_with(name) && label.contains("at threshold 8,"))
        }
    };
    harness.get_by(named("Build time"));
    // Where this one lies does not depend on how fast the machine is, but it is below the fold of the dock.
    harness.get_by(named("SAH cost")).scroll_to_me();
    settle(&mut harness);
    harness.get_by(named("SAH cost")).click();
    settle(&mut harness);
    let state = &harness.state().state;
    assert_eq!(state.wanted.build.threshold, 8);
    assert_eq!(state.model.presented.as_ref().unwrap().accel.settings.threshold, 8);
}

#[test]
fn each_experiment_keeps_its_own_rows() {
    let mut harness = app();
    plan_little(&mut harness);
    for experiment in [Experiment::Thresholds, Experiment::Tables] {
        Action::Measure(experiment).perform(&mut harness.state_mut().state);
        settle(&mut harness);
        settle(&mut harness);
    }
    let measured = &harness.state().state.activity.measured;
    assert_eq!(measured[&Experiment::Thresholds].rows.len(), 10);
    assert_eq!(measured[&Experiment::Tables].rows.len(), 2);
    press(&mut harness, Experiment::Thresholds.label());
    assert!(harness.query_by_label("Plot of Tests per entering ray").is_some());
    press(&mut harness, Experiment::Tables.label());
    assert!(harness.query_by_label_contains("mean of the ratios").is_none(), "there is one scene");
    press(&mut harness, Experiment::Threads.label());
    assert!(!Action::SaveRows(RowFormat::Csv).is_enabled(&harness.state().state), "nothing was measured there");
}

#[test]
fn measuring_is_cancelled_and_keeps_its_rows() {
    let mut harness = app_that_waits(false);
    wait_for(&mut harness, &|app| app.state.model.presented.is_some() && !app.is_busy());
    plan_little(&mut harness);
    // Thousands of trees, so that it cannot end before it is cancelled.
    let plan = &mut harness.state_mut().state.preferences.paper;
    plan.thresholds = [2, 64];
    plan.epsilons = vec![0.0, 0.1, 0.2, 0.3, 0.4];
    plan.repeat = 20;
    Action::Measure(Experiment::Thresholds).perform(&mut harness.state_mut().state);
    wait_for(&mut harness, &|app| app.state.activity.measured.contains_key(&Experiment::Thresholds));
    assert!(harness.state().state.activity.measure.as_ref().is_some_and(|job| job.progress > 0.0));
    harness.run_steps(2);
    harness.get_by_label("Cancel measuring").click();
    harness.run_steps(3);
    wait_for(&mut harness, &|app| !app.is_busy());
    let state = &harness.state().state;
    let result = &state.activity.measured[&Experiment::Thresholds];
    assert!(!result.finished && !result.rows.is_empty() && result.rows.len() < 630);
    assert!(state.activity.measure.is_none());
    assert!(state.messages.history.iter().any(|message| message.text.starts_with("Measuring cancelled")));
}
