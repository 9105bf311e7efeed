//! The present step in words, and the totals of the ray beside those of the picture.

use egui::{RichText, Ui};

use super::events::step_text;
use crate::app::state::{AppState, Presented, RaySource};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::lab::ray::RayRecord;
use crate::render::{RayKind, RayStart, Shading};
use bvhscope_engine::tree::traverse::TestCounts;

/// Shows it.
pub(super) fn show(ui: &mut Ui, state: &AppState, shown: &Presented, record: &RayRecord) {
    let palette = theme::palette(ui);
    let Some(step) = record.steps.get(state.lab.ray.cursor) else { return };
    let now = format!("{} · {} so far", step_text(record, step), tests(step.counts));
    let [visited, wasted, skipped] = record.visits();
    let hit = record.hit.map_or_else(
        || "hits nothing".to_owned(),
        |(t, triangle)| {
            format!("hits triangle {} at {}", format::count(triangle.into()), format::significant(t.into()))
        },
    );
    let counts = tests(record.counts);
    let all = format!("In all {counts}; {visited} visited, {wasted} in vain, {skipped} skipped; {hit}");
    let all = match (heat_here(state, shown), shown.tests_per_ray) {
        (Some(value), _) => format!("{all}. The heat map shows {} here", format::count(value.round() as u64)),
        (None, Some(means)) => {
            let [containers, triangles] = means.map(|mean| format::significant(mean.into()));
            format!("{all}. Mean of the picture: {containers}, {triangles}")
        }
        (None, None) => all,
    };
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(now).color(palette.text));
        let tip = "Visited in vain: nothing nearer was found in the container. Skipped: it begins behind a hit found before, or a \
                   hit ended the ray. The wide tree tests up to eight containers and four triangles at once and counts them as one";
        ui.label(RichText::new(all).color(palette.dim)).tip(tip);
    });
}

/// "27 container tests, 1 triangle test".
fn tests(counts: TestCounts) -> String {
    let TestCounts { containers, primitives } = counts;
    format!("{}, {}", format::counted(containers, "container test"), format::counted(primitives, "triangle test"))
}

/// What the heat map shows for the pixel of the ray, where one is shown from the same camera.
fn heat_here(state: &AppState, shown: &Presented) -> Option<f32> {
    let RaySource { start: RayStart::Pixel([x, y]), camera, size_px } = state.lab.ray.source? else { return None };
    let frame = &shown.frame;
    let is_heat = matches!(frame.settings.shading, Shading::Heat(_)) && state.lab.ray.kind == RayKind::Primary;
    let is_same = frame.camera == camera && size_px == [frame.width_px, frame.height_px];
    frame.values.get(frame.index_of(x, y)).copied().filter(|_| is_heat && is_same)
}
