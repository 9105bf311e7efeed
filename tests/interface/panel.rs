//! The panels on a small scene, shared by the tests of panels and shortcuts.

#![allow(dead_code, reason = "each test file uses its part")]

use std::path::PathBuf;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::app::panels;
use bvhscope::app::state::paper::{Experiment, PaperResult};
use bvhscope::app::state::{AppState, Preferences, Presented, Wanted};
use bvhscope::app::views;
use bvhscope::camera::Camera;
use bvhscope::lab::{Subject, TraceView};
use bvhscope::overlay::NodeTable;
use bvhscope::render::{RenderRequest, Shading, render};
use bvhscope::scene::{LoadOptions, Scene, SceneSource};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;
use egui::vec2;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use glam::Vec3;

/// A bumpy sheet of 2·n² triangles.
pub fn sheet(n: u32) -> Scene {
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
    let source = SceneSource::File(PathBuf::from("a_sheet_with_quite_a_long_name_for_a_panel.obj"));
    let mut scene = Scene::from_triangles(source, triangles);
    scene.mesh_count = 3;
    scene.warnings.add("triangles with NaN coordinates skipped", || bvhscope::scene::FileLocation::Line(12));
    scene
}

/// The state of a window that shows the sheet, with its tree and picture.
pub fn state(shading: Shading) -> AppState {
    let scene = Arc::new(sheet(24));
    let mut wanted = Wanted::new(scene.source.clone());
    wanted.camera = Camera::framing(&scene.bounds, Vec3::Y);
    wanted.render.shading = shading;
    wanted.render.samples = 1;
    let mut state = AppState::new(wanted, Preferences { greeted: true, toured: true, ..Preferences::default() });
    state.views = views::states();
    present(&mut state, &scene);
    state
}

/// Builds and traces with the wanted settings and presents the result.
pub fn present(state: &mut AppState, scene: &Arc<Scene>) {
    let token = CancelToken::new();
    let accel = Arc::new(Accel::build(scene, &state.wanted.build, &token).unwrap());
    let request = RenderRequest {
        count_tests: true,
        ..RenderRequest::new(&accel, state.wanted.camera, state.wanted.render, [96, 64])
    };
    let frame = Arc::new(render(&request, &token, &|_| {}).unwrap());
    let table = Arc::new(NodeTable::new(&accel));
    let frame_id = state.model.presented.as_ref().map_or(1, |shown| shown.frame_id + 1);
    let before = state.model.presented.as_ref().and_then(Presented::reference);
    state.model.presented =
        Some(Presented { before, ..Presented::new(accel, Arc::clone(&table), frame, false, frame_id, 0) });
    state.model.loaded = Some(Arc::clone(scene));
    state.layout.viewport_px = [800, 500];
    let shown = table.shown(&state.wanted.overlay, &state.selection.nodes, None);
    state.layout.graphics.shown = Some(Arc::new(shown));
    state.activity.mrays_per_s = 24.1;
}

pub fn draw(ui: &mut egui::Ui, state: &mut AppState) {
    panels::around(ui, state, |ui, _| {
        let rect = ui.max_rect();
        ui.painter().rect_filled(rect, 0.0, egui::Color32::from_gray(0x30));
        rect
    });
}

pub fn harness(state: AppState) -> Harness<'static, AppState> {
    sized(state, 1280.0, 720.0, 1.0)
}

pub fn sized(state: AppState, width: f32, height: f32, scale: f32) -> Harness<'static, AppState> {
    let mut harness = Harness::builder()
        .with_size(vec2(width, height))
        .with_pixels_per_point(scale)
        .with_max_steps(40)
        .build_ui_state(draw, state);
    harness.run_steps(4);
    harness
}

/// Clicks the only widget of this name.
pub fn press(harness: &mut Harness<'static, AppState>, name: &str) {
    harness.get_by_label(name).click();
    harness.run_steps(3);
}

/// Opens the view "Paper" with measured rows of the sheet.
pub fn with_rows(state: &mut AppState, experiment: Experiment) {
    let scene = state.model.loaded.clone().unwrap();
    let plan = &mut state.preferences.paper;
    plan.choose(experiment);
    (plan.thresholds, plan.repeat) = ([4, 8], 1);
    let (model, load) = (scene.source.to_string(), LoadOptions::default());
    let subject = Subject { model, scene: Arc::clone(&scene), trees: Vec::new(), forms: Vec::new(), rays: None, load };
    let view = TraceView { size: [16, 16], ..plan.view(&scene, &state.wanted) };
    let mut rows = Vec::new();
    let job = plan.job(&state.wanted);
    job.run(&subject, (0, 1), &view, &CancelToken::new(), &mut |row| rows.push(row)).unwrap();
    state.preferences.dock.show("Paper");
    state.activity.measured.insert(experiment, PaperResult::new(experiment, scene, rows, true));
}
