//! The panels without a window: found by their names, moved, and looked at for what they change.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
#![cfg(feature = "gui")]

use std::collections::{BTreeSet, HashSet};
use std::path::PathBuf;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::app::commands::{self, Action, shortcut_text};
use bvhscope::app::panels::palette;
use bvhscope::app::paper::{Experiment, PaperResult};
use bvhscope::app::state::{AppState, Hover, Preferences, Presented, Request, Severity, Theme, Wanted};
use bvhscope::app::{panels, theme};
use bvhscope::bvh::{BuildSettings, BuilderKind, ContainerKind, Pass, Passes, Preset};
use bvhscope::camera::Camera;
use bvhscope::cancel::CancelToken;
use bvhscope::geometry::{Aabb, Triangle};
use bvhscope::lab::{Subject, TraceView};
use bvhscope::overlay::NodeTable;
use bvhscope::render::{HeatKind, RenderRequest, Shading, render};
use bvhscope::scene::{Material, Scene, SceneSource, Warnings};
use eframe::egui::accesskit::Role;
use eframe::egui::{self, Key, Modifiers, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use glam::Vec3;

/// A bumpy sheet of 2·n² triangles.
fn sheet(n: u32) -> Scene {
    let height = |x: u32, y: u32| ((x * x + 3 * y) % 7) as f32 * 0.05;
    let point = |x: u32, y: u32| Vec3::new(x as f32 / n as f32 - 0.5, height(x, y), y as f32 / n as f32 - 0.5);
    let mut triangles = Vec::new();
    for y in 0..n {
        for x in 0..n {
            let [a, b, c, d] = [point(x, y), point(x + 1, y), point(x, y + 1), point(x + 1, y + 1)];
            triangles.push(Triangle { a, b, c });
            triangles.push(Triangle { a: b, b: d, c });
        }
    }
    let bounds = triangles.iter().fold(Aabb::EMPTY, |bounds, triangle| bounds.union(&triangle.bounds()));
    let mut warnings = Warnings::default();
    warnings.add("triangles with NaN coordinates skipped", || bvhscope::scene::Place::Line(12));
    Scene {
        source: SceneSource::File(PathBuf::from("a_sheet_with_quite_a_long_name_for_a_panel.obj")),
        triangles,
        bounds,
        up: Vec3::Y,
        attributes: None,
        material_indices: Vec::new(),
        materials: vec![Material::clay()],
        textures: Vec::new(),
        mesh_count: 3,
        warnings,
    }
}

/// A window that shows the sheet, with a real tree and a real picture.
fn state(shading: Shading) -> AppState {
    let scene = Arc::new(sheet(24));
    let mut wanted = Wanted::new(scene.source.clone());
    wanted.camera = Camera::framing(&scene.bounds, Vec3::Y);
    wanted.render.shading = shading;
    wanted.render.samples = 1;
    let mut state = AppState::new(wanted, Preferences { greeted: true, ..Preferences::default() });
    present(&mut state, &scene);
    state
}

/// Builds and traces what is wanted and shows it.
fn present(state: &mut AppState, scene: &Arc<Scene>) {
    let token = CancelToken::new();
    let accel = Arc::new(Accel::build(scene, &state.wanted.build, &token).unwrap());
    let request = RenderRequest {
        accel: Arc::clone(&accel),
        camera: state.wanted.camera,
        settings: state.wanted.render,
        width_px: 96,
        height_px: 64,
        coarseness: 1,
        count_tests: true,
    };
    let frame = Arc::new(render(&request, &token, &|_| {}).unwrap());
    let table = Arc::new(NodeTable::new(&accel));
    let tests_per_ray = frame.stats.tests_per_ray();
    let frame_id = state.presented.as_ref().map_or(1, |shown| shown.frame_id + 1);
    state.presented = Some(Presented { accel, table, frame, frame_id, tests_per_ray, threads: 0 });
    state.scene = Some(Arc::clone(scene));
    state.viewport_px = [800, 500];
    state.mrays_per_s = 24.1;
}

fn draw(ui: &mut egui::Ui, state: &mut AppState) {
    let ctx = ui.ctx().clone();
    theme::apply(&ctx, &state.preferences);
    commands::handle_shortcuts(&ctx, state);
    panels::top(ui, state);
    panels::bottom(ui, state);
    panels::left(ui, state);
    panels::right(ui, state);
    egui::CentralPanel::no_frame().show(ui, |ui| {
        let rect = ui.max_rect();
        ui.painter().rect_filled(rect, 0.0, egui::Color32::from_gray(0x30));
        panels::over_viewport(ui, rect, state);
    });
    panels::windows(&ctx, state);
}

fn harness(state: AppState) -> Harness<'static, AppState> {
    sized(state, 1280.0, 720.0, 1.0)
}

fn sized(state: AppState, width: f32, height: f32, scale: f32) -> Harness<'static, AppState> {
    let mut harness = Harness::builder()
        .with_size(vec2(width, height))
        .with_pixels_per_point(scale)
        .with_max_steps(40)
        .build_ui_state(draw, state);
    harness.run_steps(4);
    harness
}

/// Clicks the one widget of this name.
fn press(harness: &mut Harness<'static, AppState>, name: &str) {
    harness.get_by_label(name).click();
    harness.run_steps(3);
}

/// Opens the paper panel with rows of the sheet.
fn with_rows(state: &mut AppState, experiment: Experiment) {
    let scene = state.scene.clone().unwrap();
    let plan = &mut state.preferences.paper;
    plan.choose(experiment);
    (plan.thresholds, plan.repeat) = ([4, 8], 1);
    let subject = Subject { model: scene.source.to_string(), scene: Arc::clone(&scene) };
    let view = TraceView { size: [16, 16], ..plan.view(&scene, &state.wanted) };
    let mut rows = Vec::new();
    let job = plan.job(&state.wanted);
    job.run(&subject, (0, 1), &view, &CancelToken::new(), &mut |row| rows.push(row)).unwrap();
    state.preferences.paper_open = true;
    state.paper = Some(PaperResult::new(experiment, scene, rows, true));
}

#[test]
fn the_paper_panel_names_its_widgets_and_fits_the_smallest_screen() {
    for experiment in Experiment::ALL {
        let mut s = state(Shading::Lit);
        with_rows(&mut s, experiment);
        let h = sized(s, 1024.0, 640.0, 2.0);
        let screen = h.ctx.content_rect();
        for label in ["Measure", "Save SVG", "Close paper panel", "Measured repeat", "Depth range"] {
            assert!(screen.contains_rect(h.get_by_label(label).rect()), "{label} lies outside");
        }
        let nameless = h.root().children_recursive().find(|node| {
            let node = node.accesskit_node();
            let acts = [Role::Button, Role::CheckBox, Role::SpinButton, Role::ComboBox].contains(&node.role());
            acts && node.label().or_else(|| node.value()).unwrap_or_default().trim().is_empty()
        });
        assert!(nameless.is_none(), "{}: {:?}", experiment.label(), nameless.map(|node| node.rect()));
    }
}

#[test]
fn the_paper_panel_switches_between_tables_and_plots() {
    let mut s = state(Shading::Lit);
    with_rows(&mut s, Experiment::Thresholds);
    let mut h = harness(s);
    assert!(h.query_by_label("Plot of Tests per ray").is_some());
    press(&mut h, "Tables");
    assert!(h.query_by_label("Plot of Tests per ray").is_none());
    assert_eq!(h.query_all_by_label_contains("δ 8").count(), 2, "a row for the box and one for the sphere");
    press(&mut h, "Close paper panel");
    assert!(!h.state().preferences.paper_open);
}

#[test]
fn presets_set_threshold_and_epsilon() {
    let mut h = harness(state(Shading::Lit));
    for preset in Preset::ALL.into_iter().rev() {
        press(&mut h, preset.label());
        let build = h.state().wanted.build;
        assert_eq!((build.threshold, build.epsilon), preset.parameters(), "{}", preset.label());
    }
}

#[test]
fn passes_are_checked_one_by_one_and_greyed_where_they_need_boxes() {
    let mut h = harness(state(Shading::Lit));
    press(&mut h, Preset::Best.label());
    assert_eq!(h.state().wanted.build.optimize, Passes::ALL);
    for pass in Pass::ALL {
        h.get_by_role_and_label(Role::CheckBox, pass.label()).click();
        h.run_steps(3);
        assert_eq!(h.state().wanted.build.optimize, Passes::ALL.without(pass));
        h.get_by_role_and_label(Role::CheckBox, pass.label()).click();
        h.run_steps(3);
        assert_eq!(h.state().wanted.build.optimize, Passes::ALL);
    }
    h.get_by_role_and_label(Role::RadioButton, ContainerKind::Sphere.label()).click();
    h.run_steps(3);
    for pass in Pass::ALL {
        let disabled = h.get_by_role_and_label(Role::CheckBox, pass.label()).accesskit_node().is_disabled();
        assert_eq!(disabled, pass.boxes_only(), "{}", pass.label());
    }
    assert_eq!(h.state().wanted.build.passes(), Passes::NONE.with(Pass::Collapse));
    press(&mut h, Preset::Fast.label());
    assert_eq!(h.state().wanted.build.optimize, Passes::NONE, "the paper's tree stays as it is");
}

#[test]
fn an_arrow_key_moves_the_focused_threshold() {
    let mut h = harness(state(Shading::Lit));
    let before = h.state().wanted.build.threshold;
    h.get_by_role_and_label(Role::Slider, "Threshold").focus();
    h.run_steps(2);
    h.key_press(Key::ArrowRight);
    h.run_steps(3);
    let after = h.state().wanted.build.threshold;
    assert!(after > before, "{before} became {after}");
    h.key_press(Key::ArrowLeft);
    h.run_steps(3);
    assert_eq!(h.state().wanted.build.threshold, before);
}

#[test]
fn reset_brings_the_tree_settings_back() {
    let mut s = state(Shading::Lit);
    s.wanted.build.threshold = 40;
    s.wanted.build.container = ContainerKind::Sphere;
    s.wanted.threads = 1;
    let mut h = harness(s);
    press(&mut h, "Reset tree settings");
    assert_eq!(h.state().wanted.build, BuildSettings::default());
    assert_eq!(h.state().wanted.threads, 0);
}

#[test]
fn the_radio_chooses_the_container() {
    let mut h = harness(state(Shading::Lit));
    for kind in [ContainerKind::Sphere, ContainerKind::Aabb] {
        h.get_by_role_and_label(Role::RadioButton, kind.label()).click();
        h.run_steps(3);
        assert_eq!(h.state().wanted.build.container, kind);
    }
}

#[test]
fn what_cannot_be_built_is_greyed() {
    let mut s = state(Shading::Lit);
    s.wanted.build.container = ContainerKind::Sphere;
    let refused = BuildSettings { builder: BuilderKind::BinnedSah, ..s.wanted.build };
    assert!(refused.refusal(100).is_some());
    let mut h = harness(s);
    h.get_by_role_and_label(Role::ComboBox, "Builder").click();
    h.run_steps(4);
    assert!(h.get_by_label(BuilderKind::BinnedSah.label()).accesskit_node().is_disabled());
    assert!(!h.get_by_label(BuilderKind::Lbvh.label()).accesskit_node().is_disabled());
    press(&mut h, BuilderKind::Lbvh.label());
    assert_eq!(h.state().wanted.build.builder, BuilderKind::Lbvh);
}

#[test]
fn the_list_of_shadings_chooses_one() {
    let mut h = harness(state(Shading::Lit));
    h.get_by_role_and_label(Role::ComboBox, "Shading").click();
    h.run_steps(4);
    press(&mut h, Shading::Clusters.label());
    assert_eq!(h.state().wanted.render.shading, Shading::Clusters);
    assert!(h.query_by_role_and_label(Role::Slider, "Cluster depth").is_some());
}

#[test]
fn the_job_strip_counts_the_passes_that_a_mode_takes() {
    for (shading, text) in [(Shading::Heat(HeatKind::Both), "pass 1 of 1 "), (Shading::Lit, "pass 16 of 16 ")] {
        let mut s = state(shading);
        s.wanted.render.samples = 16;
        let scene = s.scene.clone().unwrap();
        present(&mut s, &scene);
        let h = harness(s);
        assert!(h.query_by_label_contains(text).is_some(), "{}: no '{text}'", shading.label());
    }
}

#[test]
fn arrow_keys_move_the_depth_range() {
    let mut h = harness(state(Shading::Lit));
    let before = h.state().wanted.overlay.depth;
    h.get_by_label("Depth range").focus();
    h.run_steps(2);
    h.key_press(Key::ArrowRight);
    h.run_steps(3);
    assert_ne!(h.state().wanted.overlay.depth, before);
    let [from, to] = h.state().wanted.overlay.depth;
    assert!(from <= to);
}

#[test]
fn a_key_switches_containers() {
    let mut h = harness(state(Shading::Lit));
    assert!(h.state().preferences.show_containers);
    h.key_press(Key::B);
    h.run_steps(2);
    assert!(!h.state().preferences.show_containers);
}

#[test]
fn the_palette_finds_and_performs() {
    let mut h = harness(state(Shading::Lit));
    h.key_press_modifiers(Modifiers::COMMAND, Key::P);
    h.run_steps(4);
    assert_eq!(h.state().palette.as_deref(), Some(""));
    h.get_by_label("Command").type_text("leaves");
    h.run_steps(4);
    assert_eq!(h.state().palette.as_deref(), Some("leaves"));
    h.key_press(Key::Enter);
    h.run_steps(4);
    assert_eq!(h.state().palette, None);
    assert!(h.state().wanted.overlay.leaves_only);
}

#[test]
fn the_palette_ranks_beginnings_of_words_first() {
    let found = palette::filter(commands::entries().to_vec(), "orth");
    assert_eq!(found[0].action, Action::ToggleOrthographic);
    assert!(palette::filter(commands::entries().to_vec(), "zzzzqq").is_empty());
}

#[test]
fn every_action_is_named_and_no_key_means_two() {
    let mut keys = HashSet::new();
    let mut labels = HashSet::new();
    for entry in commands::entries() {
        assert!(!entry.label.is_empty() && !entry.description.is_empty(), "{:?}", entry.action);
        assert!(labels.insert(&entry.label), "{} stands for two actions", entry.label);
        for key in &entry.shortcuts {
            assert!(keys.insert(shortcut_text(key)), "{} means two actions", shortcut_text(key));
        }
    }
    assert!(keys.len() > 20);
}

#[test]
fn the_readme_lists_the_very_keys_of_the_actions() {
    let readme = include_str!("../README.md");
    let rows =
        readme.split_once("| keys and mouse |").unwrap().1.lines().skip(1).take_while(|line| line.starts_with('|'));
    let keys = rows.skip(1).filter_map(|row| row.split('|').nth(1));
    let told: BTreeSet<&str> = keys.flat_map(|cell| cell.split('`').skip(1).step_by(2)).collect();
    let actions = commands::entries().iter().flat_map(|entry| entry.shortcuts.iter().map(shortcut_text));
    let actions: BTreeSet<String> = actions.collect();
    assert_eq!(told, actions.iter().map(String::as_str).collect());
}

#[test]
fn arrows_turn_the_camera_only_while_the_viewport_has_the_focus() {
    let mut h = harness(state(Shading::Lit));
    let eye = |h: &Harness<'static, AppState>| h.state().wanted.camera.eye;
    let before = eye(&h);
    h.key_press(Key::ArrowRight);
    h.run_steps(2);
    assert_eq!(eye(&h), before);
    h.state_mut().viewport_focused = true;
    h.key_press(Key::ArrowRight);
    h.run_steps(2);
    assert_ne!(eye(&h), before);
    h.key_press(Key::ArrowLeft);
    h.run_steps(2);
    assert!(eye(&h).distance(before) < 1e-4);
}

#[test]
fn a_key_zooms_to_the_hovered_point() {
    let mut h = harness(state(Shading::Lit));
    let target = h.state().wanted.camera.target;
    h.key_press(Key::Plus);
    h.run_steps(2);
    assert_eq!(h.state().wanted.camera.target, target, "without a pointer it zooms to the target");
    let hover = Hover { x_px: 200, y_px: 400, primitive: None, distance: f32::INFINITY, value: None };
    h.state_mut().hover = Some(hover);
    let distance = h.state().wanted.camera.distance();
    h.key_press(Key::Plus);
    h.run_steps(2);
    let camera = h.state().wanted.camera;
    assert!(camera.distance() < distance && camera.target.distance(target) > 1e-3);
    h.key_press(Key::Minus);
    h.run_steps(2);
    assert!(h.state().wanted.camera.target.distance(target) < 1e-3, "the other key goes back");
}

#[test]
fn threshold_keys_leave_other_builders_alone() {
    let mut s = state(Shading::Lit);
    s.wanted.build.builder = BuilderKind::Lbvh;
    let build = s.wanted.build;
    let mut h = harness(s);
    h.key_press(Key::CloseBracket);
    h.run_steps(2);
    assert_eq!(h.state().wanted.build, build);
    assert!(!Action::LowerThreshold.is_enabled(h.state()));
    h.state_mut().wanted.build.builder = BuilderKind::Aac;
    h.key_press(Key::CloseBracket);
    h.run_steps(2);
    assert_eq!(h.state().wanted.build.threshold, build.threshold + 1);
}

#[test]
fn looking_at_a_number_does_not_change_it() {
    let mut s = state(Shading::Lit);
    // Finer than the slider's last digit, and beyond the ends of the sliders.
    s.wanted.build.epsilon = 0.125;
    s.wanted.render.samples = 1000;
    s.wanted.threads = 700;
    let wanted = s.wanted.clone();
    let mut h = harness(s);
    assert_eq!(h.state().wanted, wanted);
    let shown = |h: &Harness<'static, AppState>, name: &str| h.get_by_label(name).accesskit_node().value();
    assert_eq!(shown(&h, "Reduction ε value").as_deref(), Some("0.125"));
    assert_eq!(shown(&h, "Threads value").as_deref(), Some("700"));
    h.get_by_role_and_label(Role::Slider, "Reduction ε").focus();
    h.run_steps(2);
    h.key_press(Key::ArrowRight);
    h.run_steps(3);
    let epsilon = h.state().wanted.build.epsilon;
    assert!((epsilon * 100.0 - (epsilon * 100.0).round()).abs() < 1e-3 && epsilon > 0.125, "{epsilon}");
    assert_eq!(h.state().wanted.render, wanted.render);
}

#[test]
fn the_panels_keep_their_width() {
    let mut s = state(Shading::Heat(HeatKind::Both));
    s.wanted.build.epsilon = 0.125;
    s.wanted.render.samples = 1000;
    s.wanted.threads = 1000;
    let mut h = harness(s);
    let before = h.get_by_role_and_label(Role::Slider, "Threshold").rect();
    h.run_steps(10);
    assert_eq!(h.get_by_role_and_label(Role::Slider, "Threshold").rect(), before);
}

#[test]
fn a_double_click_resets_a_slider() {
    let mut s = state(Shading::Lit);
    s.wanted.build.threshold = 40;
    let mut h = harness(s);
    let pos = h.get_by_role_and_label(Role::Slider, "Threshold").rect().center();
    h.hover_at(pos);
    h.run_steps(2);
    // In one frame: a frame of the harness lasts longer than a double click may.
    for pressed in [true, false, true, false] {
        let button = egui::PointerButton::Primary;
        let event = egui::Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE };
        h.input_mut().events.push(event);
    }
    h.run_steps(3);
    assert_eq!(h.state().wanted.build.threshold, BuildSettings::default().threshold);
}

#[test]
fn the_mouse_drags_a_range_of_depths() {
    let mut s = state(Shading::Lit);
    s.wanted.overlay.depth = [0, 0];
    let max_depth = s.presented.as_ref().unwrap().accel.tree.max_depth();
    let mut h = harness(s);
    let bar = h.get_by_label("Depth range").rect();
    let at = |share: f32| egui::pos2(bar.left() + bar.width() * share, bar.center().y);
    h.drag_at(at(0.4));
    h.run_steps(2);
    h.hover_at(at(0.6));
    h.run_steps(2);
    h.drop_at(at(0.6));
    h.run_steps(2);
    let [from, to] = h.state().wanted.overlay.depth;
    assert!(from > 0 && from < to && to < max_depth, "{from} to {to} of {max_depth}");
    assert!((from as f32 / max_depth as f32 - 0.4).abs() < 0.15 && (to as f32 / max_depth as f32 - 0.6).abs() < 0.15);
}

#[test]
fn fit_fixes_the_heat_range_and_auto_frees_it() {
    let mut h = harness(state(Shading::Heat(HeatKind::Both)));
    assert_eq!(h.state().wanted.render.heat_range, None);
    press(&mut h, "Fit");
    let fitted = h.state().presented.as_ref().unwrap().frame.fitted_range();
    assert_eq!(h.state().wanted.render.heat_range, Some(fitted));
    press(&mut h, "Auto");
    assert_eq!(h.state().wanted.render.heat_range, None);
}

#[test]
fn the_mouse_drags_the_ends_of_the_heat_range() {
    let mut h = sized(state(Shading::Heat(HeatKind::Both)), 1280.0, 900.0, 1.0);
    let rect = h.get_by_label_contains("Histogram of tests").rect();
    let drag = |h: &mut Harness<'static, AppState>, from: f32, to: f32| {
        let at = |share: f32| egui::pos2(rect.left() + rect.width() * share, rect.center().y);
        h.drag_at(at(from));
        h.run_steps(2);
        h.hover_at(at(to));
        h.run_steps(2);
        h.drop_at(at(to));
        h.run_steps(2);
        h.state().wanted.render.heat_range.expect("a dragged range is fixed")
    };
    let [low, high] = drag(&mut h, 0.9, 0.5);
    let [same, lower] = drag(&mut h, 0.5, 0.4);
    assert!(lower < high && same == low, "{low} to {high} became {same} to {lower}");
    let [higher, same] = drag(&mut h, 0.02, 0.2);
    assert!(higher > low && same == lower, "{low} to {lower} became {higher} to {same}");
}

#[test]
fn every_shading_but_the_lit_one_has_a_legend() {
    for shading in Shading::ALL {
        let mut s = state(shading);
        s.selection.selected = Some(0);
        let h = harness(s);
        let picture = h.query_by_label_contains("Legend. Picture: ");
        assert_eq!(picture.is_some(), shading != Shading::Lit, "{}", shading.label());
        assert!(h.query_by_label_contains("selected, children, hovered").is_some());
    }
}

#[test]
fn messages_can_be_read_again() {
    let mut s = state(Shading::Lit);
    s.tell(Severity::Error, "broken.obj:12: not a face");
    let mut h = harness(s);
    press(&mut h, "Close message");
    assert!(h.query_by_label("broken.obj:12: not a face").is_none());
    h.key_press(Key::F2);
    h.run_steps(3);
    assert!(h.query_by_label("broken.obj:12: not a face").is_some());
    press(&mut h, "Copy all");
    assert_eq!(h.state().requests, [Request::Copy("Error: broken.obj:12: not a face".to_owned())]);
    h.key_press(Key::Escape);
    h.run_steps(3);
    assert!(!h.state().messages_open);
}

#[test]
fn the_greeting_leads_to_the_start_page() {
    let mut s = state(Shading::Lit);
    s.preferences.greeted = false;
    let mut h = harness(s);
    press(&mut h, "Open a model…");
    assert!(h.state().start_page_open && !h.state().preferences.greeted);
    assert!(h.query_by_label("Open a file…").is_some());
}

#[test]
fn messages_are_copied_and_closed_by_name() {
    let mut s = state(Shading::Lit);
    s.tell(Severity::Error, "broken.obj:12: not a face");
    let mut h = harness(s);
    press(&mut h, "Copy message");
    assert_eq!(h.state().requests, [Request::Copy("broken.obj:12: not a face".to_owned())]);
    press(&mut h, "Close message");
    assert!(h.state().messages.is_empty());
}

#[test]
fn every_widget_has_a_name() {
    let mut s = state(Shading::Heat(HeatKind::Both));
    s.selection.selected = Some(5);
    s.picked = Some((17, vec![0, 1, 5]));
    s.preferences.greeted = false;
    s.tell(Severity::Error, "broken.obj:12: not a face");
    let h = harness(s);
    let mut seen = 0;
    for node in h.root().children_recursive() {
        let node = node.accesskit_node();
        let acts = [
            Role::Button,
            Role::CheckBox,
            Role::RadioButton,
            Role::Slider,
            Role::SpinButton,
            Role::ComboBox,
            Role::TextInput,
        ];
        if acts.contains(&node.role()) {
            seen += 1;
            let name = node.label().or_else(|| node.value()).unwrap_or_default();
            assert!(!name.trim().is_empty(), "{:?} at {:?} has no name", node.role(), node.bounding_box());
        }
    }
    assert!(seen > 30, "{seen} widgets");
}

#[test]
fn zero_threads_read_as_all() {
    let h = harness(state(Shading::Lit));
    let number = h.get_by_label("Threads value");
    assert_eq!(number.accesskit_node().value().as_deref(), Some("all"));
}

/// Signs that no font holds end the harness, so every text of these windows has its glyphs.
#[test]
fn every_window_fits_the_smallest_screen() {
    let mut s = state(Shading::Heat(HeatKind::Both));
    s.preferences.theme = Theme::Light;
    s.preferences.recent = vec![PathBuf::from("models/conference.obj")];
    s.start_page_open = true;
    let mut h = sized(s, 1024.0, 640.0, 2.0);
    let screen = h.ctx.content_rect();
    for label in ["Open a file…", "conference.obj", "Depth range", "Reset tree settings", "File"] {
        assert!(screen.contains_rect(h.get_by_label(label).rect()), "{label} lies outside");
    }
    h.state_mut().start_page_open = false;
    h.state_mut().shortcuts_open = true;
    h.run_steps(3);
    assert!(screen.contains_rect(h.get_by_label("Zoom to the point under the pointer").rect()));
    h.state_mut().shortcuts_open = false;
    h.state_mut().palette = Some("pre".to_owned());
    h.run_steps(3);
    assert!(screen.contains_rect(h.get_by_label("Command").rect()));
}
