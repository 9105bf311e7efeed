//! Trees of other builders: the whole app reads them from files, follows these, shows what is wrong with them, and builds instead.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::harness::{Window, app, app_of_copies, camera, presented, press, settle};
use bvhscope::accel::Accel;
use bvhscope::app::commands::{Action, CompareStep};
use bvhscope::app::state::paper::{Experiment, PaperPlan};
use bvhscope::app::state::{AppState, Request, Severity, TreeSide};
use bvhscope::app::views::plots::{PlotKind, PlotsView};
use bvhscope::overlay::{OverlaySettings, Selection};
use bvhscope::scene::SceneSource;
use bvhscope_engine::AnyTree;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree_file::{Header, TwoLevelTrees, write_tree, write_two_levels};
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use tempfile::TempDir;

fn state(harness: &mut Window) -> &mut AppState {
    &mut harness.state_mut().state
}

/// A tree of the presented scene by another builder.
fn lbvh(harness: &Window) -> Accel {
    let settings = BuildSettings { builder: BuilderKind::Lbvh, ..BuildSettings::default() };
    Accel::build(&presented(harness).accel.scene, &settings, &CancelToken::new()).unwrap()
}

fn write(path: &Path, tree: &AnyTree, triangles: usize, corners: Option<&[Triangle]>) {
    let header = Header { builder: Some("handmade".to_owned()), build_ms: Some(12.5), ..Header::new(triangles) };
    let mut bytes = Vec::new();
    write_tree(tree, &header, corners, &mut bytes, &CancelToken::new()).unwrap();
    // As a builder does that must not be read halfway.
    let whole = path.with_extension("tmp");
    std::fs::write(&whole, bytes).unwrap();
    std::fs::rename(whole, path).unwrap();
}

/// The same in a file of a folder, which goes when it is dropped.
fn lbvh_file(harness: &Window) -> (TempDir, PathBuf, Accel) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.bvh");
    let other = lbvh(harness);
    write(&path, &other.tree, other.scene.triangles.len(), None);
    (folder, path, other)
}

/// The app with the LBVH of a file in place of its own tree.
fn with_tree_file() -> (Window, TempDir, PathBuf) {
    let mut harness = app();
    let (folder, path, other) = lbvh_file(&harness);
    state(&mut harness).activity.requests.push(Request::OpenTree(TreeSide::A, path.clone()));
    settle(&mut harness);
    assert_eq!(presented(&harness).accel.tree, other.tree);
    (harness, folder, path)
}

/// Number of trees in the list of those of the session.
fn listed(harness: &Window) -> usize {
    harness.state().state.views.get::<PlotsView>().session.plotted(None).len()
}

/// The names of files saved in `folder`.
fn saved(folder: &Path) -> Vec<String> {
    let names =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.filter(|name| name.ends_with(".bvh")).collect();
    names.sort();
    names
}

#[test]
fn copies_have_the_ids_of_their_file() {
    let mut harness = app_of_copies();
    let accel = presented(&harness).accel;
    let ids: Vec<u32> = (0..accel.scene.triangles.len() as u32).map(|copy| 70_000 + 3 * copy).collect();
    let trees = accel.file_trees(false, &CancelToken::new()).unwrap();
    let levels = TwoLevelTrees { ids: Some(&ids), ..trees.levels().expect("two levels") };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.bvh");
    let mut bytes = Vec::new();
    write_two_levels(&levels, &trees.header(), false, &mut bytes, &CancelToken::new()).unwrap();
    std::fs::write(&path, bytes).unwrap();
    let is_shown = |harness: &Window| harness.query_all_by_label_contains("(id 7").next().is_some();
    press(&mut harness, Modifiers::NONE, Key::O);
    settle(&mut harness);
    assert!(!is_shown(&harness), "the program's own tree has none");
    state(&mut harness).activity.requests.push(Request::OpenTree(TreeSide::A, path));
    settle(&mut harness);
    press(&mut harness, Modifiers::ALT | Modifiers::SHIFT, Key::Period);
    settle(&mut harness);
    press(&mut harness, Modifiers::ALT | Modifiers::SHIFT, Key::Period);
    settle(&mut harness);
    let copy = harness.state().state.selection.picked.as_ref().expect("a dear copy").primitive;
    assert_ne!(copy, 0, "its id is that of another");
    let id = 70_000 + 3 * copy;
    assert!(is_shown(&harness));
    assert!(
        harness.query_all_by_label_contains(&format!("copy {copy} (id {id}) of mesh")).next().is_some(),
        "in the list"
    );
    assert!(harness.query_all_by_label_contains("Id of the copy").next().is_some(), "in the panel");
}

#[test]
fn a_saved_tree_is_named_after_its_letter_and_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("corner.obj");
    std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\n").unwrap();
    let mut harness = app();
    state(&mut harness).activity.requests.push(Request::Open(SceneSource::File(model)));
    settle(&mut harness);
    let save = |harness: &mut Window, count: usize| {
        Action::SaveTree.perform(state(harness));
        for _ in 0..500 {
            harness.run_steps(1);
            if saved(folder.path()).len() == count {
                return;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("no tree was saved");
    };
    save(&mut harness, 1);
    Action::Compare(CompareStep::Toggle).perform(state(&mut harness));
    let second = state(&mut harness).wanted.second.as_mut().unwrap();
    second.build = BuildSettings { builder: BuilderKind::Lbvh, container: ContainerKind::Sphere, ..second.build };
    settle(&mut harness);
    save(&mut harness, 2);
    assert_eq!(saved(folder.path()), ["corner-B-lbvh-sphere-001.bvh", "corner-fast-001.bvh"]);
}

/// Begins a lesson and leaves it.
fn read_a_lesson(harness: &mut Window) {
    let own = Arc::clone(&presented(harness).accel.scene);
    Action::Lesson(0).perform(state(harness));
    settle(harness);
    settle(harness);
    assert!(!presented(harness).accel.scene.is_same_model(&own), "the lesson has its own model");
    Action::LeaveLesson.perform(state(harness));
    settle(harness);
    settle(harness);
}

/// A lesson gives the model back by its absolute path.
#[cfg(unix)]
#[test]
fn a_lesson_gives_back_the_trees_of_a_model_with_a_relative_path() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("corner.obj");
    std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\n").unwrap();
    let up: PathBuf = std::env::current_dir().unwrap().components().skip(1).map(|_| "..").collect();
    let mut harness = app();
    let source = SceneSource::File(up.join(model.strip_prefix("/").unwrap()));
    state(&mut harness).activity.requests.push(Request::Open(source));
    settle(&mut harness);
    settle(&mut harness);
    press(&mut harness, Modifiers::NONE, Key::CloseBracket);
    assert_eq!(listed(&harness), 2);
    read_a_lesson(&mut harness);
    assert_eq!(listed(&harness), 2);
}

/// A tree of a file belongs to the model that is read with it, not to the one before.
#[test]
fn a_lesson_gives_back_trees_of_files_and_the_list_of_trees() {
    let (mut harness, _folder, path) = with_tree_file();
    state(&mut harness).activity.requests.push(Request::OpenTree(TreeSide::B, path));
    settle(&mut harness);
    let own = state(&mut harness).wanted.clone();
    assert!(own.tree_files.iter().all(Option::is_some));
    let (tree, trees) = (presented(&harness).accel, listed(&harness));
    assert_eq!(trees, 2, "the built one and that of the file");
    read_a_lesson(&mut harness);
    assert_eq!(state(&mut harness).wanted, own);
    let second = state(&mut harness).model.second.as_ref().expect("tree B").accel.clone();
    assert_eq!((&presented(&harness).accel.tree, &second.tree), (&tree.tree, &tree.tree));
    assert_eq!(listed(&harness), trees);
    let messages = &state(&mut harness).messages.history;
    assert!(messages.iter().all(|message| message.severity != Severity::Error), "{messages:?}");
}

#[test]
fn a_tree_file_takes_the_place_of_the_build_until_a_setting_changes() {
    let (mut harness, _folder, path) = with_tree_file();
    assert!(harness.query_by_label_contains("mine.bvh (handmade), boxes").is_some());
    assert!(harness.query_by_label("Build instead").is_some());
    assert_eq!(harness.state().state.preferences.recent_trees, std::slice::from_ref(&path));
    assert_eq!(presented(&harness).accel.build_ms(), Some(12.5));
    press(&mut harness, Modifiers::NONE, Key::CloseBracket);
    let built = presented(&harness).accel;
    assert!(built.file.is_none() && built.settings.threshold == BuildSettings::default().threshold + 1);
    press(&mut harness, Modifiers::COMMAND, Key::Z);
    let file = presented(&harness).accel.file.clone();
    assert_eq!(file.map(|file| file.path), Some(path), "undone");
    harness.get_by_label("Build instead").click();
    settle(&mut harness);
    assert!(presented(&harness).accel.file.is_none());
    assert!(harness.query_by_label("Build instead").is_none());
}

#[test]
fn what_sticks_out_is_told_and_drawn() {
    let mut harness = app();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrong.bvh");
    let mut other = lbvh(&harness);
    let triangles = other.scene.triangles.len();
    let AnyTree::Aabb(tree) = &mut other.tree else { panic!("boxes are the default") };
    // Half the root: a child of it sticks out.
    let Aabb { min, max } = tree.nodes[0].container;
    tree.nodes[0].container = Aabb { min, max: (min + max) * 0.5 };
    write(&path, &other.tree, triangles, None);
    state(&mut harness).activity.requests.push(Request::OpenTree(TreeSide::A, path));
    settle(&mut harness);
    let shown = presented(&harness);
    assert!(shown.table.faulty().count() > 0);
    let fault = shown.accel.faults()[0].to_string();
    assert!(harness.query_by_label(&fault).is_some(), "{fault}: in the left panel");
    assert!(harness.query_by_label_contains("sticks out").is_some(), "in the legend");
}

#[test]
fn a_file_with_its_triangles_is_model_and_tree() {
    let mut harness = app();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("crash.bvh");
    let other = lbvh(&harness);
    let triangles = &other.scene.triangles;
    write(&path, &other.tree, triangles.len(), Some(triangles));
    state(&mut harness).activity.requests.push(Request::Open(SceneSource::File(path.clone())));
    settle(&mut harness);
    let shown = presented(&harness).accel;
    assert_eq!((shown.scene.source.path(), &shown.tree), (Some(path.as_path()), &other.tree));
    Action::BuildTree.perform(state(&mut harness));
    settle(&mut harness);
    let built = presented(&harness).accel;
    assert!(built.file.is_none() && built.scene.source.path() == Some(path.as_path()));
}

#[test]
fn a_tree_alone_that_is_opened_is_one_of_the_model_on_the_screen() {
    let mut harness = app();
    let (_folder, path, _other) = lbvh_file(&harness);
    let source = harness.state().state.wanted.source.clone();
    state(&mut harness).activity.requests.push(Request::Open(SceneSource::File(path.clone())));
    settle(&mut harness);
    settle(&mut harness);
    let shown = presented(&harness).accel;
    assert_eq!((&shown.scene.source, shown.file.as_ref().map(|file| &file.path)), (&source, Some(&path)));
    let state = &harness.state().state;
    assert!(!state.messages.open.iter().any(|message| message.severity == Severity::Error));
    assert_eq!(state.wanted.source, source);
}

#[test]
fn the_second_tree_may_be_that_of_a_file() {
    let mut harness = app();
    let (_folder, path, other) = lbvh_file(&harness);
    let first = presented(&harness).accel;
    state(&mut harness).activity.requests.push(Request::OpenTree(TreeSide::B, path.clone()));
    settle(&mut harness);
    let second = harness.state().state.model.second.clone().unwrap().accel;
    assert_eq!((&presented(&harness).accel.tree, &second.tree), (&first.tree, &other.tree));
    Action::Compare(CompareStep::Swap).perform(state(&mut harness));
    settle(&mut harness);
    assert_eq!(presented(&harness).accel.file.as_ref().map(|file| &file.path), Some(&path));
    Action::Compare(CompareStep::Toggle).perform(state(&mut harness));
    settle(&mut harness);
    assert_eq!(harness.state().state.wanted.tree_files, [Some(path), None]);
}

#[test]
fn a_tree_file_that_is_written_anew_is_read_again() {
    let (mut harness, _folder, path) = with_tree_file();
    let before = camera(&harness);
    let scene = Arc::clone(&presented(&harness).accel.scene);
    let settings = BuildSettings { builder: BuilderKind::BinnedSah, ..BuildSettings::default() };
    let other = Accel::build(&scene, &settings, &CancelToken::new()).unwrap();
    assert_ne!(presented(&harness).accel.tree, other.tree);
    write(&path, &other.tree, scene.triangles.len(), None);
    follow(&mut harness, |state| state.model.presented.as_ref().unwrap().accel.tree == other.tree);
    assert_eq!(camera(&harness), before);

    std::fs::write(path.with_extension("tmp"), "not a tree").unwrap();
    std::fs::rename(path.with_extension("tmp"), &path).unwrap();
    let errors = |state: &AppState| {
        let open = state.messages.open.iter();
        open.filter(|message| message.severity == Severity::Error && message.text.contains("mine.bvh")).count()
    };
    follow(&mut harness, |state| errors(state) > 0);
    settle(&mut harness);
    assert_eq!(errors(&harness.state().state), 1);
    assert_eq!(presented(&harness).accel.tree, other.tree, "what was shown stays");

    write(&path, &lbvh(&harness).tree, scene.triangles.len(), None);
    follow(&mut harness, |state| state.model.presented.as_ref().unwrap().accel.tree != other.tree);
}

/// Runs frames until `done`, for as long as a loaded machine may need to notice that a file has changed and to read it.
fn follow(harness: &mut Window, done: impl Fn(&AppState) -> bool) {
    let start = Instant::now();
    while !done(&harness.state().state) {
        assert!(start.elapsed() < Duration::from_mins(2), "the file is not followed");
        std::thread::sleep(Duration::from_millis(50));
        harness.run_steps(1);
    }
}

#[test]
fn the_papers_curves_and_the_plots_show_it_beside_ours() {
    let (mut harness, _folder, path) = with_tree_file();
    let plan = &mut state(&mut harness).preferences.paper;
    plan.side_px = PaperPlan::SIDES_PX[0];
    plan.repeat = 1;
    plan.thresholds = [4, 5];
    plan.containers = vec![ContainerKind::Aabb];
    Action::Measure(Experiment::Thresholds).perform(state(&mut harness));
    settle(&mut harness);
    settle(&mut harness);
    let rows = harness.state().state.activity.measured[&Experiment::Thresholds].rows.clone();
    let file = Some(path.display().to_string());
    assert_eq!(rows.iter().map(|row| row.tree.clone()).collect::<Vec<_>>(), [None, None, file]);

    harness.get_by_label("Build instead").click();
    settle(&mut harness);
    let is_end = |button: &egui_kittest::Node<'_>| {
        let name = button.accesskit_node().label().unwrap_or_default();
        name.starts_with("SAH cost") && name.ends_with("mine.bvh (handmade)")
    };
    let ends: Vec<_> = harness.query_all_by_role(Role::Button).filter(is_end).collect();
    assert_eq!(ends.len(), 2, "a line from one end of the plot to the other");
    assert!((ends[0].rect().center().y - ends[1].rect().center().y).abs() < 0.5);
    // The plots with units lie below the relative one.
    ends[0].scroll_to_me();
    settle(&mut harness);
    harness.query_all_by_role(Role::Button).find(is_end).unwrap().click();
    settle(&mut harness);
    assert_eq!(presented(&harness).accel.file.as_ref().map(|file| &file.path), Some(&path));

    press(&mut harness, Modifiers::NONE, Key::F10);
    state(&mut harness).views.get_mut::<PlotsView>().kind = PlotKind::Speed;
    settle(&mut harness);
    harness.get_by_label("Build instead").click();
    settle(&mut harness);
    assert!(presented(&harness).accel.file.is_none());
    harness.get_by_label_contains("mine.bvh (handmade), boxes: built in 12.5 ms").click();
    settle(&mut harness);
    assert_eq!(presented(&harness).accel.file.as_ref().map(|file| &file.path), Some(&path));
}

#[test]
fn measuring_all_trees_of_the_session_reads_files_again() {
    let (mut harness, _folder, path) = with_tree_file();
    harness.get_by_label("Build instead").click();
    settle(&mut harness);
    assert!(presented(&harness).accel.file.is_none());
    state(&mut harness).views.get_mut::<PlotsView>().kind = PlotKind::List;
    press(&mut harness, Modifiers::NONE, Key::F10);
    harness.get_by_label_contains("Measure all ").click();
    settle(&mut harness);
    let state = &harness.state().state;
    let rays = state.model.derived.rays(&presented(&harness).accel.scene);
    let trees = state.views.get::<PlotsView>().session.plotted(rays);
    let of_file = trees.iter().find(|tree| tree.file.as_ref().is_some_and(|(file, _)| *file == path)).expect("listed");
    assert!(of_file.tests.is_some() && of_file.epo.is_some() && of_file.cost.is_some(), "{of_file:?}");
    assert!(harness.query_by_label("Measure all").is_some(), "all are measured");
}

#[test]
fn a_wide_node_has_all_its_children_in_every_view() {
    let mut harness = app();
    let accel = presented(&harness).accel;
    let token = CancelToken::new();
    let wide = accel.widen(&token).unwrap().tree.to_tree(&accel.tree, &token).unwrap().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wide.bvh");
    write(&path, &wide, accel.scene.triangles.len(), None);
    state(&mut harness).activity.requests.push(Request::OpenTree(TreeSide::A, path));
    press(&mut harness, Modifiers::NONE, Key::F9);
    let table = presented(&harness).table;
    let children: Vec<u32> = table.children(0).collect();
    assert!(children.len() > 2, "{children:?}");
    let overlay = OverlaySettings { depth: Some([1, 1]), ..harness.state().state.wanted.overlay };
    let containers = table.shown(&overlay, &Selection::default(), None).nodes;
    assert_eq!(containers, children, "all are drawn");

    // The outline shows them all below the root.
    let rows: Vec<String> = {
        let rows = harness.query_all_by_role(Role::ListItem).filter(|row| row.rect().left() < 100.0);
        rows.map(|row| row.accesskit_node().label().unwrap_or_default()).collect()
    };
    for child in &children {
        let start = format!("{} {child}, ", if table.is_leaf(*child) { "leaf" } else { "node" });
        assert!(rows.iter().any(|row| row.starts_with(&start)), "{start}: {rows:?}");
    }
    // Walking goes round them.
    state(&mut harness).select_node(0);
    Action::SelectChild.perform(state(&mut harness));
    let mut seen = Vec::new();
    for _ in &children {
        seen.push(harness.state().state.selection.nodes.selected.unwrap());
        Action::SelectNextSibling.perform(state(&mut harness));
    }
    assert_eq!(seen, children);
    assert_eq!(harness.state().state.selection.nodes.selected, Some(children[0]));
    // One ray enters the root and tests each of its children.
    let viewport_px = harness.state().state.layout.viewport_px;
    state(&mut harness).take_ray(viewport_px.map(|side| side / 2));
    press(&mut harness, Modifiers::NONE, Key::F8);
    let accel = presented(&harness).accel;
    let record = harness.state().state.model.ray.record.of_tree(&accel).expect("recorded").clone();
    let steps = &(*record).as_ref().unwrap().steps;
    for child in &children {
        assert!(steps.iter().any(|step| step.tree_node == *child), "child {child} is not tested");
    }
}
