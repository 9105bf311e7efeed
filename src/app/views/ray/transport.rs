//! Stepping through a record: first, back, play, step, next hit, the slider over all steps, the speed, and the keys
//! while the strip or a row of a list has the focus. Looking at it from the side, and copying it. The present step in
//! words, and the totals of the ray beside those of the picture.

use egui::{self, Button, EventFilter, Key, Label, Modifiers, Response, RichText, Slider, TextStyle, Ui, WidgetInfo};

use super::events::step_text;
use super::hits;
use crate::app::state::{AppState, PictureRay, Presented, RaySource, SPEEDS};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::lab::ray::{RayMethod, RayRecord, ray_table};
use crate::render::{HeatKind, RayKind, RayStart, Shading};
use bvhscope_engine::tree::traverse::TestCounts;

/// Width of the slider over the steps in points.
const SLIDER_WIDTH: f32 = 220.0;
/// Width of the slider of the speed in points.
const SPEED_WIDTH: f32 = 80.0;

/// Shows it.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, shown: &Presented, record: &RayRecord) {
    let steps = record.steps.len();
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let ray = &mut state.model.ray;
        let (first, last) = (ray.cursor == 0, ray.cursor + 1 >= steps);
        if button(ui, "First", !first, "Go to the first step (Home)").clicked() {
            ray.go_to(0, steps);
        }
        if button(ui, "Back", !first, "One step back (Left)").clicked() {
            ray.step(-1, steps);
        }
        let [name, tip] =
            if ray.playing { ["Pause", "Stop the replay (Space)"] } else { ["Play", "Replay the steps (Space)"] };
        if button(ui, name, steps > 1, tip).clicked() {
            ray.toggle_play(steps);
        }
        if button(ui, "Step", !last, "One step on (Right)").clicked() {
            ray.step(1, steps);
        }
        let next = record.next_hit(ray.cursor);
        if button(ui, "Next hit", next.is_some(), "Go on to the next step that finds a nearer hit (Down)").clicked() {
            next_hit(ray, record);
        }
        let (is_part, has_hit) = (ray.zoom.is_some(), record.hit.is_some());
        let [name, tip] = if is_part {
            ["Whole ray", "Show the whole ray in the strip again (Z)"]
        } else {
            ["Zoom to hit", "Show the last part before the hit in the strip (Z); the wheel zooms anywhere"]
        };
        if button(ui, name, is_part || has_hit, tip).clicked() {
            ray.toggle_zoom(record);
        }
        ui.add_space(4.0);
        scrub(ui, state, steps);
        ui.add_space(8.0);
        speed(ui, state);
        ui.separator();
        side_view(ui, state, shown, record);
        copy(ui, state, record);
    });
}

fn button(ui: &mut Ui, name: &str, enabled: bool, tip: &str) -> Response {
    ui.add_enabled(enabled, Button::new(name)).tip(tip)
}

/// The slider over all steps, with the number of the present one.
fn scrub(ui: &mut Ui, state: &mut AppState, steps: usize) {
    let ray = &mut state.model.ray;
    ui.spacing_mut().slider_width = SLIDER_WIDTH.min(ui.available_width() * 0.5);
    let mut step = ray.cursor + 1;
    let response = ui.add(Slider::new(&mut step, 1..=steps.max(1)).show_value(false));
    response.widget_info(|| WidgetInfo::slider(true, step as f64, "Ray step"));
    if response.changed() {
        ray.go_to(step - 1, steps);
    }
    response.tip("All steps of the ray in their order: drag to go through them");
    let text = |step: usize| format!("step {} of {}", format::count(step as u64), format::count(steps as u64));
    // As wide as the longest, so that nothing moves during the replay.
    let color = theme::palette(ui).text;
    let longest = ui.painter().layout_no_wrap(text(steps), TextStyle::Body.resolve(ui.style()), color);
    ui.add_sized(longest.size(), Label::new(RichText::new(text(step)).color(color)));
}

fn speed(ui: &mut Ui, state: &mut AppState) {
    let speed = &mut state.model.ray.speed;
    ui.spacing_mut().slider_width = SPEED_WIDTH;
    ui.label(RichText::new("Speed").color(theme::palette(ui).dim));
    let response = ui.add(Slider::new(speed, SPEEDS[0]..=SPEEDS[1]).logarithmic(true).show_value(false));
    let value = *speed;
    response.widget_info(|| WidgetInfo::slider(true, value, "Replay speed"));
    response.tip("Speed of the replay in steps a second");
    let text = if value < 10.0 { format!("{value:.1}/s") } else { format!("{value:.0}/s") };
    ui.label(RichText::new(text).color(theme::palette(ui).dim));
}

/// Looks at the ray from the side.
fn side_view(ui: &mut Ui, state: &mut AppState, shown: &Presented, record: &RayRecord) {
    let tip = "Turn the view so that the ray crosses it from left to right: a ray from the eye is seen as a point";
    if button(ui, "Side view", true, tip).clicked() {
        let (bounds, up, aspect) = (shown.accel.scene.bounds, state.model.up(), state.layout.aspect());
        let direction = record.ray.direction.normalize_or(glam::Vec3::X);
        let side = direction.cross(up).try_normalize().unwrap_or_else(|| direction.any_orthonormal_vector());
        let camera = &mut state.wanted.camera;
        (camera.up, camera.target) = (up, bounds.center());
        camera.eye = bounds.center() + (side + up * 0.25).normalize();
        camera.frame_in(&bounds, aspect);
    }
}

fn copy(ui: &mut Ui, state: &mut AppState, record: &RayRecord) {
    if button(ui, "Copy steps", true, "Copy all steps as a table for spreadsheets").clicked() {
        let text = ray_table(String::new(), record).tab_separated();
        state.copy(text, "Copied the steps of the ray");
    }
}

/// Applies the keys to the present step, while `response` has the focus.
pub(super) fn keys(ui: &Ui, response: &Response, ray: &mut PictureRay, record: &RayRecord) {
    if !response.has_focus() {
        return;
    }
    let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    let pressed = |key| ui.input_mut(|input| input.count_and_consume_key(Modifiers::NONE, key)) as isize;
    let steps = record.steps.len();
    let by = pressed(Key::ArrowRight) - pressed(Key::ArrowLeft);
    if by != 0 {
        ray.step(by, steps);
    }
    for _ in 0..pressed(Key::ArrowDown) {
        next_hit(ray, record);
    }
    if pressed(Key::Home) > 0 {
        ray.go_to(0, steps);
    }
    if pressed(Key::End) > 0 {
        ray.go_to(steps, steps);
    }
    if pressed(Key::Z) > 0 {
        ray.toggle_zoom(record);
    }
    if pressed(Key::Space) > 0 {
        ray.toggle_play(steps);
    }
}

/// Goes to the next step that finds a nearer hit, if there is one.
pub(super) fn next_hit(ray: &mut PictureRay, record: &RayRecord) {
    if let Some(step) = record.next_hit(ray.cursor) {
        ray.go_to(step, record.steps.len());
    }
}

/// Shows the present step in words, and the totals of the ray beside those of the picture.
pub(super) fn totals(ui: &mut Ui, state: &AppState, shown: &Presented, record: &RayRecord) {
    let palette = theme::palette(ui);
    let Some(step) = record.steps.get(state.model.ray.cursor) else { return };
    let now = format!("{} · {} so far", step_text(record, step), tests(step.counts));
    let [visited, wasted, skipped] = record.visits();
    let hit = record.hit.map_or_else(
        || "hits nothing".to_owned(),
        |(t, triangle)| {
            format!("hits triangle {} at {}", format::count(triangle.into()), format::significant(t.into()))
        },
    );
    let counts = tests(record.counts);
    let lines = record.lines.map_or_else(String::new, |lines| {
        let [all, of_nodes] = [lines.nodes + lines.triangles, lines.nodes].map(format::count);
        format!("{all} cache lines read, {of_nodes} of nodes; ")
    });
    let passage = hits::passage(&record.crossings, state.model.edges());
    let all =
        format!("In all {counts}; {lines}{visited} visited, {wasted} wasted, {skipped} skipped; {hit}; {passage}");
    // The picture's counts are those of its own traversal of the binary tree, by primary rays.
    let ray = &state.model.ray;
    let is_like = ray.kind == RayKind::Primary && ray.method == RayMethod::Binary(shown.frame.settings.traversal);
    let all = match (heat_here(state, shown), shown.tests_per_ray.filter(|_| is_like)) {
        (Some((value, kind)), _) => {
            format!("{all}. The heat map shows {} {} here", format::count(value.round() as u64), kind.counted())
        }
        (None, Some(means)) => {
            let [containers, triangles] = means.map(|mean| format::significant(mean.into()));
            format!("{all}. Mean of the picture: {containers} container tests, {triangles} triangle tests")
        }
        (None, None) => all,
    };
    ui.add(Label::new(RichText::new(now).color(palette.text)).truncate());
    let tip = "Wasted: nothing nearer was found in the container. Skipped: it begins behind a hit found before, or a \
               hit ended the ray. The wide tree tests up to eight containers and four triangles at once and counts them as one";
    ui.add(Label::new(RichText::new(all).color(palette.dim)).wrap()).tip(tip);
}

/// "27 container tests, 1 triangle test".
pub(super) fn tests(counts: TestCounts) -> String {
    let TestCounts { containers, primitives } = counts;
    format!("{}, {}", format::counted(containers, "container test"), format::counted(primitives, "triangle test"))
}

/// The heat map's value at the pixel of the ray, where one is shown from the same camera.
fn heat_here(state: &AppState, shown: &Presented) -> Option<(f32, HeatKind)> {
    let RaySource { start: RayStart::Pixel([x, y]), camera, size_px } = state.model.ray.source? else { return None };
    let frame = &shown.frame;
    let Shading::Heat(kind) = frame.settings.shading else { return None };
    let traced = match kind {
        HeatKind::Steps | HeatKind::Lines => RayMethod::Wide,
        HeatKind::WholeRay | HeatKind::Copies => return None,
        _ => RayMethod::Binary(frame.settings.traversal),
    };
    let is_like = state.model.ray.kind == RayKind::Primary && state.model.ray.method == traced;
    let is_same = frame.camera == camera && size_px == [frame.width_px, frame.height_px];
    let value = frame.values.get(frame.index_of(x, y)).copied().filter(|_| is_like && is_same)?;
    Some((value, kind))
}
