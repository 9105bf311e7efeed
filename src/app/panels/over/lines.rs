//! Lines of the laboratory in the viewport: the recorded ray, faint where the surface hides it, with the triangles that
//! were tested and the place of the present step; the curve through the primitives' centres, with the cells at which
//! the recursion splits them.

use egui::{Color32, Painter, Pos2, Rect, Shape, Stroke, Ui, lerp};
use glam::Vec3;

use super::Projected;
use crate::app::state::ray_file::DrawnRay;
use crate::app::state::{AppState, Presented};
use crate::app::theme;
use crate::lab::population::Population;
use crate::lab::ray::{RayRecord, RayStep};
use crate::overlay::Role;

/// Pieces of the line, each of which is hidden or not.
const PIECES: u16 = 96;
/// Pieces of one line of many.
const FEW_PIECES: u16 = 4;
/// Opacity of rays that hit nothing over that of others: of a camera's rays most may miss, and would veil the picture.
const MISSED: f32 = 0.2;
/// Number of lines of full opacity; more are fainter.
const FAINT_RAYS: f32 = 200.0;
/// Length of the line before the model as a fraction of that within.
const APPROACH: f32 = 0.4;
/// Opacity of what the surface hides.
const HIDDEN: f32 = 0.35;
/// How far behind the surface of the picture a point still counts as on it, as a fraction of its depth.
const ON_SURFACE: f32 = 2e-3;
/// Most tested triangles that are outlined, the newest.
const MOST_TRIANGLES: usize = 200;

/// Shows the recorded ray within `rect`, the viewport's rectangle, while the view "Ray" is open.
pub(crate) fn ray(ui: &Ui, rect: Rect, state: &AppState) {
    let (Some(shown), Some(outcome)) = (&state.model.presented, state.model.ray.shown()) else { return };
    let (Ok(record), true) = (&**outcome, state.shows_ray()) else { return };
    let Some(step) = record.steps.get(state.model.ray.cursor) else { return };
    let drawing = Drawing::new(ui, rect, state, shown);
    drawing.triangles(record, state.model.ray.cursor);
    drawing.line(record);
    drawing.points(record, step);
}

/// Shows rays of a file while visits are measured by them, faint where the surface hides them.
pub(crate) fn rays_of_file(ui: &Ui, rect: Rect, state: &AppState) {
    let derived = &state.model.derived;
    let is_wanted = derived.population == Population::File && derived.ray_file.are_drawn;
    let (Some(shown), Some(read), true) = (&state.model.presented, derived.ray_file.rays(), is_wanted) else { return };
    let drawing = Drawing::new(ui, rect, state, shown);
    // Many lines over each other still let the picture be seen.
    let opacity = (FAINT_RAYS / read.drawn.len() as f32).clamp(0.15, 1.0);
    for &DrawnRay { ends: [from, to], is_hit } in &read.drawn {
        drawing.faint_line(from, to, if is_hit { opacity } else { opacity * MISSED });
    }
}

struct Drawing<'a> {
    view: Projected,
    painter: Painter,
    rect: Rect,
    shown: &'a Presented,
    /// Whether the picture hides what is behind its surface.
    tests_surface: bool,
    color: Color32,
    warm: Color32,
}

impl<'a> Drawing<'a> {
    fn new(ui: &Ui, rect: Rect, state: &AppState, shown: &'a Presented) -> Self {
        let [r, g, b] = Role::Traced.color().unwrap_or([255; 3]);
        Self {
            view: Projected::new(shown.frame.camera, rect),
            painter: ui.painter().with_clip_rect(rect),
            rect,
            shown,
            tests_surface: state.preferences.show_geometry,
            color: Color32::from_rgb(r, g, b),
            warm: theme::palette(ui).warm,
        }
    }

    /// A thin line in few pieces.
    fn faint_line(&self, from: Vec3, to: Vec3, opacity: f32) {
        let at = |piece: u16| from.lerp(to, f32::from(piece) / f32::from(FEW_PIECES));
        for piece in 0..FEW_PIECES {
            let [a, b] = [at(piece), at(piece + 1)];
            let hidden = if self.is_hidden((a + b) * 0.5) { HIDDEN } else { 1.0 };
            self.segment(a, b, Stroke::new(1.0, self.color.gamma_multiply(opacity * hidden)));
        }
    }

    /// The ray from where it comes near the model to its hit, or to where it leaves the model.
    fn line(&self, record: &RayRecord) {
        let [from, to] = record.reach();
        // From outside of the model, so that it is seen where the ray comes from.
        let from = (from - APPROACH * (to - from)).max(record.ray.t_min.max(0.0));
        let to = record.hit.map_or(to, |(t, _)| t).min(record.ray.t_max);
        let at = |piece: u16| record.ray.at(from + (to - from) * f32::from(piece) / f32::from(PIECES));
        for piece in 0..PIECES {
            let [a, b] = [at(piece), at(piece + 1)];
            let color = if self.is_hidden((a + b) * 0.5) { self.color.gamma_multiply(HIDDEN) } else { self.color };
            self.segment(a, b, Stroke::new(2.0, color));
        }
    }

    fn segment(&self, a: Vec3, b: Vec3, stroke: Stroke) {
        if let (Some(a), Some(b)) = (self.view.place(a), self.view.place(b)) {
            self.painter.line_segment([a, b], stroke);
        }
    }

    /// Whether the picture shows a surface in front of a point.
    fn is_hidden(&self, point: Vec3) -> bool {
        let frame = &self.shown.frame;
        let Some(at) = self.view.place(point).filter(|at| self.tests_surface && self.rect.contains(*at)) else {
            return false;
        };
        let share = (at - self.rect.min) / self.rect.size();
        let pixel = |share: f32, count: u32| ((share * count as f32) as u32).min(count.saturating_sub(1));
        let index = pixel(share.y, frame.height_px) * frame.width_px + pixel(share.x, frame.width_px);
        let depth = frame.depth.get(index as usize).copied().unwrap_or(f32::INFINITY);
        self.view.depth(point) > depth * (1.0 + ON_SURFACE)
    }

    /// The triangles that were tested, that of the present step in the warm colour.
    fn triangles(&self, record: &RayRecord, cursor: usize) {
        let tested = record.steps.iter().enumerate().take(cursor + 1).rev();
        let tested = tested.filter_map(|(index, step)| Some((index, step.what.triangle()?)));
        for (index, triangle) in tested.take(MOST_TRIANGLES) {
            let Some(triangle) = self.shown.accel.scene.triangles.get(triangle as usize) else { continue };
            let stroke = if index == cursor {
                Stroke::new(2.5, self.warm)
            } else {
                Stroke::new(1.0, self.color.gamma_multiply(0.8))
            };
            for (a, b) in [(triangle.a, triangle.b), (triangle.b, triangle.c), (triangle.c, triangle.a)] {
                self.segment(a, b, stroke);
            }
        }
    }

    /// A disc at the hit, and a ring where the ray is in the present step.
    fn points(&self, record: &RayRecord, step: &RayStep) {
        let place = |t: f32| self.view.place(record.ray.at(t));
        let disc = |at: Pos2| {
            self.painter.circle(at, 4.0, self.color, Stroke::new(1.5, Color32::from_black_alpha(180)));
        };
        record.hit.and_then(|(t, _)| place(t)).into_iter().for_each(disc);
        let span = step.span.and_then(|span| record.spans.get(span as usize));
        if let Some(at) = step.what.t().or(span.map(|span| span.t[0])).and_then(place) {
            self.painter.circle_stroke(at, 6.5, Stroke::new(2.0, self.warm));
        }
    }
}

/// The edges of a box, by the bits of its corners.
const EDGES: [[usize; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/// Paints it within `rect`, the viewport's rectangle.
pub(crate) fn scaffold(ui: &Ui, rect: Rect, state: &AppState) {
    let curve = &state.model.curve;
    let Some(shown) = state.model.presented.as_ref().filter(|_| curve.shown) else { return };
    let Some(Ok(scaffold)) = curve.scaffold.of_tree(&shown.accel).map(|known| (**known).as_ref()) else { return };
    let view = Projected::new(shown.frame.camera, rect);
    let palette = theme::palette(ui);
    let painter = ui.painter().with_clip_rect(rect);
    let mut shapes = Vec::new();
    let stroke = Stroke::new(1.0, palette.text.gamma_multiply(0.35));
    for cell in &scaffold.cells {
        let corners: [Vec3; 8] = std::array::from_fn(|corner| {
            let side = |bit: usize, low: f32, high: f32| if corner >> bit & 1 == 0 { low } else { high };
            let [low, high] = [cell.bounds.min, cell.bounds.max];
            Vec3::new(side(0, low.x, high.x), side(1, low.y, high.y), side(2, low.z, high.z))
        });
        let placed = corners.map(|corner| view.place(corner));
        for [from, to] in EDGES {
            if let (Some(from), Some(to)) = (placed[from], placed[to]) {
                shapes.push(Shape::line_segment([from, to], stroke));
            }
        }
    }
    let last = scaffold.points.len().saturating_sub(1).max(1) as f32;
    for (index, ends) in scaffold.points.windows(2).enumerate() {
        if let (Some(from), Some(to)) = (view.place(ends[0]), view.place(ends[1])) {
            let color = mix(palette.accent, palette.warm, index as f32 / last);
            shapes.push(Shape::line_segment([from, to], Stroke::new(1.5, color)));
        }
    }
    painter.extend(shapes);
}

/// A colour between two.
fn mix(from: Color32, to: Color32, share: f32) -> Color32 {
    let channel = |from: u8, to: u8| lerp(f32::from(from)..=f32::from(to), share).round() as u8;
    Color32::from_rgb(channel(from.r(), to.r()), channel(from.g(), to.g()), channel(from.b(), to.b()))
}
