//! The strip along the ray: a row for each depth, in it the containers from where the ray enters to where it leaves them.

use egui::{
    self, Align2, Color32, CornerRadius, FontId, Painter, PointerButton, Pos2, Rangef, Rect, Response, Role, Sense,
    Shape, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

use super::transport;
use crate::app::state::action::Action;
use crate::app::state::{AppState, Request, TreeSide};
use crate::app::theme::Palette;
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::lab::ray::{RayRecord, RayStep, Span, Visit};

/// Height of the axis below the rows in points.
const AXIS: f32 = 16.0;
/// Smallest and largest height of a row in points.
const ROW: [f32; 2] = [2.0, 16.0];
/// Height of the line above the strip of one of two trees in points.
const CAPTION: f32 = 14.0;
/// Gap between two strips in points.
const GAP: f32 = 4.0;
/// Distance of the lines of a hatch in points.
const HATCH: f32 = 5.0;
/// Length of the mark of each hit on the axis in points.
const HIT_MARK: f32 = 6.0;
/// Opacity of what lies ahead of the present step.
const AHEAD: f32 = 0.35;
/// Most containers that are painted.
const MOST_SPANS: usize = 20_000;
/// Zoom of a point of scrolling: a line of the wheel, 40 points, shows a fifth less.
const WHEEL: f32 = 0.0055;

/// Where the strip is, and which part of the ray.
struct Scale {
    rows: Rect,
    row: f32,
    t: [f32; 2],
}

impl Scale {
    fn new(rect: Rect, record: &RayRecord, zoom: Option<[f32; 2]>) -> Self {
        let depths = record.spans.iter().map(|span| span.depth).max().unwrap_or(0) + 1;
        let rows = Rect::from_min_max(rect.min, pos2(rect.right(), rect.bottom() - AXIS));
        Self {
            rows,
            row: (rows.height() / depths as f32).clamp(ROW[0], ROW[1]),
            t: zoom.unwrap_or_else(|| record.reach()),
        }
    }

    /// The same part of the ray for another record of it, below.
    fn beside(&self, rect: Rect, record: &RayRecord) -> Self {
        Self { t: self.t, ..Self::new(rect, record, None) }
    }

    fn x(&self, t: f32) -> f32 {
        let share = (t - self.t[0]) / (self.t[1] - self.t[0]).max(f32::MIN_POSITIVE);
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        self.rows.left() + share * self.rows.width()
    }

    /// The distance at a place.
    fn t_at(&self, x: f32) -> f32 {
        let share = (x - self.rows.left()) / self.rows.width().max(1.0);
        self.t[0] + share * (self.t[1] - self.t[0])
    }

    /// Whether any part of the container is in view.
    fn shows(&self, span: &Span) -> bool {
        span.t[0] <= self.t[1] && span.t[1] >= self.t[0]
    }

    fn rect(&self, span: &Span) -> Rect {
        let top = self.rows.top() + span.depth as f32 * self.row;
        let [left, right] = span.t.map(|t| self.x(t));
        let gap = if self.row > 4.0 { 1.0 } else { 0.0 };
        Rect::from_min_max(pos2(left, top), pos2(right.max(left + 1.5), top + self.row - gap))
    }
}

/// Shows the strips of the same ray in the first and in the second tree, one below the other, with what it costs in each.
pub(super) fn show_both(ui: &mut Ui, state: &mut AppState, records: [&RayRecord; 2]) {
    let half = vec2(ui.available_width(), ui.available_height() * 0.5 - GAP * 0.5 - CAPTION);
    caption(ui, "A", records[0]);
    show(ui, state, records[0], half);
    ui.add_space(GAP);
    caption(ui, "B", records[1]);
    show_second(ui, state, records, half);
}

/// The letter of a tree and the tests of the ray in it, above its strip, in which containers may be anywhere.
fn caption(ui: &mut Ui, tree: &str, record: &RayRecord) {
    let text = format!("{tree}: {}", transport::tests(record.counts));
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), CAPTION), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &text));
    let font = FontId::proportional(theme::HEADING_SIZE);
    ui.painter().text(rect.left_center(), Align2::LEFT_CENTER, &text, font, theme::palette(ui).dim);
}

/// The strip of the ray in the second tree, of the same part as that in the first.
fn show_second(ui: &mut Ui, state: &mut AppState, [first, record]: [&RayRecord; 2], size: egui::Vec2) {
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let name = format!("Containers along the ray in B: {}", transport::tests(record.counts));
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
    zoom(ui, &response, &mut state.model.ray.zoom, rect.shrink(1.0), first);
    let scale = Scale::new(rect.shrink(1.0), first, state.model.ray.zoom).beside(rect.shrink(1.0), record);
    let palette = theme::palette(ui);
    // The steps of A say nothing of those of B: all are shown.
    let last = record.steps.len().saturating_sub(1);
    paint(&ui.painter().with_clip_rect(rect), &scale, record, last, &palette);
    let pointed = response.hover_pos().and_then(|at| span_at(&scale, record, at));
    if let Some(span) = pointed {
        state.selection.second.hovered = Some(span.tree_node);
        let outline = Stroke::new(1.0, palette.text);
        ui.painter().with_clip_rect(rect).rect_stroke(
            scale.rect(span),
            CornerRadius::ZERO,
            outline,
            StrokeKind::Outside,
        );
        if response.clicked() {
            (state.selection.second.selected, state.selection.side) = (Some(span.tree_node), TreeSide::B);
        }
    }
    response.tip(tip(pointed));
}

/// Shows it.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, record: &RayRecord, size: egui::Vec2) {
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Containers along the ray"));
    if std::mem::take(&mut state.model.ray.wants_focus) {
        response.request_focus();
    }
    transport::keys(ui, &response, &mut state.model.ray, record);
    zoom(ui, &response, &mut state.model.ray.zoom, rect.shrink(1.0), record);
    let scale = Scale::new(rect.shrink(1.0), record, state.model.ray.zoom);
    let palette = theme::palette(ui);
    let painter = ui.painter().with_clip_rect(rect);
    paint(&painter, &scale, record, state.model.ray.cursor, &palette);
    if response.has_focus() {
        painter.rect_stroke(rect, CornerRadius::same(3), Stroke::new(1.0, palette.accent), StrokeKind::Inside);
    }
    let pointed = response.hover_pos().and_then(|at| span_at(&scale, record, at));
    if let Some(span) = pointed {
        state.selection.point_at(span.tree_node);
        let outline = Stroke::new(1.0, palette.text);
        painter.rect_stroke(scale.rect(span), CornerRadius::ZERO, outline, StrokeKind::Outside);
    }
    // Not by the key Space, which plays.
    if response.clicked_by(PointerButton::Primary) {
        response.request_focus();
        if let Some(span) = pointed {
            state.select_node(span.tree_node);
            state.model.ray.go_to(span.entered, record.steps.len());
        }
    }
    if response.double_clicked() {
        if pointed.is_some() {
            state.activity.requests.push(Request::Perform(Action::FrameSelection));
        } else {
            state.model.ray.zoom = None;
        }
    }
    response.tip(tip(pointed));
}

/// The wheel zooms to the place under the pointer, a drag moves what is zoomed.
fn zoom(ui: &Ui, response: &Response, zoom: &mut Option<[f32; 2]>, rect: Rect, record: &RayRecord) {
    let scale = Scale::new(rect, record, *zoom);
    let [first, last] = record.reach();
    let (mut from, mut to) = (scale.t[0], scale.t[1]);
    if let Some(at) = response.hover_pos() {
        let (scroll, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
        let factor = ((-scroll * WHEEL).exp() / pinch).clamp(0.1, 10.0);
        let middle = scale.t_at(at.x);
        // Beyond this, two numbers of single precision are the same place.
        if factor > 1.0 || to - from > 1e-5 * (last.abs() + last - first) {
            (from, to) = (middle + (from - middle) * factor, middle + (to - middle) * factor);
        }
    }
    let moved = scale.t_at(response.drag_delta().x) - scale.t_at(0.0);
    (from, to) = (from - moved, to - moved);
    let length = to - from;
    if length.is_nan() || length >= last - first {
        *zoom = None;
        return;
    }
    let from = from.clamp(first, (last - length).max(first));
    *zoom = Some([from, from + length]);
}

/// Facts about the span under the pointer; about the strip where there is none.
fn tip(pointed: Option<&Span>) -> String {
    let Some(span) = pointed else {
        return "The ray from left to right, a row for each depth of the tree. Filled: visited, and a nearer hit was found in it. \
                Hatched: wasted visits. Outlined: entered, but skipped. A click goes to the step that enters a container, \
                the wheel zooms. Keys: Left and Right step, Space plays, Down goes to the next hit, Z zooms to the last one"
            .to_owned();
    };
    let [from, to] = span.t.map(|t| format::significant(t.into()));
    let visit = match span.visit {
        Visit::Useful => "visited; a nearer hit was found in it",
        Visit::Wasted => "wasted visit: nothing nearer was found in it",
        Visit::Skipped => "entered, but never visited: it begins behind a hit, or a hit ended the ray",
    };
    let kind = if span.is_leaf { "Leaf" } else { "Node" };
    format!("{kind} {} at depth {}, from {from} to {to}: {visit}", format::count(span.tree_node.into()), span.depth)
}

/// The narrowest container under a point.
fn span_at<'a>(scale: &Scale, record: &'a RayRecord, at: Pos2) -> Option<&'a Span> {
    let spans = record.spans.iter().take(MOST_SPANS).filter(|span| scale.shows(span));
    let under = spans.filter(|span| scale.rect(span).expand2(vec2(1.0, 0.5)).contains(at));
    under.min_by(|a, b| (a.t[1] - a.t[0]).total_cmp(&(b.t[1] - b.t[0])))
}

fn paint(painter: &Painter, scale: &Scale, record: &RayRecord, cursor: usize, palette: &Palette) {
    // Siblings that overlap share a row: what was worth its visit lies on top.
    for visit in [Visit::Skipped, Visit::Wasted, Visit::Useful] {
        let spans = record.spans.iter().take(MOST_SPANS);
        for span in spans.filter(|span| span.visit == visit && scale.shows(span)) {
            paint_span(painter, scale.rect(span), span, if span.entered > cursor { AHEAD } else { 1.0 }, palette);
        }
    }
    for step in record.steps.iter().take(cursor + 1).filter(|step| step.what.triangle().is_some()) {
        paint_test(painter, scale, record, step, palette);
    }
    let rows = scale.rows.y_range();
    let in_view = |t: &f32| (scale.t[0]..=scale.t[1]).contains(t);
    for crossing in record.crossings.hits.iter().take(MOST_SPANS).filter(|crossing| in_view(&crossing.t)) {
        let bottom = Rangef::new(scale.rows.bottom() - HIT_MARK, scale.rows.bottom());
        painter.vline(scale.x(crossing.t), bottom, Stroke::new(1.0, palette.dim));
    }
    if let Some((t, _)) = record.hit.filter(|(t, _)| in_view(t)) {
        painter.vline(scale.x(t), rows, Stroke::new(1.5, palette.text));
    }
    let Some(step) = record.steps.get(cursor) else { return };
    let present = step.span.and_then(|span| record.spans.get(span as usize));
    let t = step.what.t().or(present.map(|span| span.t[0])).filter(in_view);
    if let Some(span) = present.filter(|span| scale.shows(span)) {
        let outline = Stroke::new(2.0, palette.warm);
        painter.rect_stroke(scale.rect(span), CornerRadius::ZERO, outline, StrokeKind::Outside);
    }
    if let Some(t) = t {
        let dashes = [pos2(scale.x(t), rows.min), pos2(scale.x(t), rows.max)];
        painter.extend(Shape::dashed_line(&dashes, Stroke::new(1.0, palette.warm), 4.0, 3.0));
    }
    axis(painter, scale, record, t, palette);
}

fn paint_span(painter: &Painter, rect: Rect, span: &Span, opacity: f32, palette: &Palette) {
    match span.visit {
        Visit::Useful => {
            painter.rect_filled(rect, CornerRadius::ZERO, palette.accent.gamma_multiply(0.75 * opacity));
        }
        Visit::Wasted => {
            let color = palette.worse.gamma_multiply(opacity);
            painter.rect_filled(rect, CornerRadius::ZERO, color.gamma_multiply(0.22));
            hatch(painter, rect, color.gamma_multiply(0.8));
            if rect.height() > 4.0 {
                painter.rect_stroke(rect, CornerRadius::ZERO, Stroke::new(0.75, color), StrokeKind::Inside);
            }
        }
        Visit::Skipped => {
            let color = palette.dim.gamma_multiply(opacity);
            painter.rect_stroke(rect, CornerRadius::ZERO, Stroke::new(0.75, color), StrokeKind::Inside);
        }
    }
}

/// Slanted lines across `rect`, at places that do not depend on it.
fn hatch(painter: &Painter, rect: Rect, color: Color32) {
    let inside = painter.with_clip_rect(rect.intersect(painter.clip_rect()));
    let height = rect.height();
    let mut x = ((rect.left() - height) / HATCH).floor() * HATCH;
    while x < rect.right() {
        inside.line_segment([pos2(x, rect.bottom()), pos2(x + height, rect.top())], Stroke::new(1.0, color));
        x += HATCH;
    }
}

/// A tested triangle: a dot where it is hit.
fn paint_test(painter: &Painter, scale: &Scale, record: &RayRecord, step: &RayStep, palette: &Palette) {
    let (Some(t), Some(span)) = (step.what.t(), step.span.and_then(|span| record.spans.get(span as usize))) else {
        return;
    };
    if t < scale.t[0] || t > scale.t[1] {
        return;
    }
    let at = pos2(scale.x(t), scale.rect(span).center().y);
    painter.circle_filled(at, (scale.row * 0.3).clamp(1.5, 3.0), palette.text);
}

/// Distances below the rows: the ends, the hit, the present step.
fn axis(painter: &Painter, scale: &Scale, record: &RayRecord, present: Option<f32>, palette: &Palette) {
    let font = FontId::proportional(theme::HEADING_SIZE);
    let y = scale.rows.bottom() + AXIS * 0.5;
    let mut taken: Vec<Rangef> = Vec::new();
    let hit = record.hit.map(|(t, _)| t).filter(|t| (scale.t[0]..=scale.t[1]).contains(t));
    let [from, to] = scale.t;
    let labels = [
        (hit, "hit ", palette.text),
        (present, "", palette.warm),
        (Some(from), "", palette.dim),
        (Some(to), "", palette.dim),
    ];
    let distances: Vec<f64> = labels.iter().filter_map(|(t, ..)| t.map(f64::from)).collect();
    for (t, prefix, color) in labels.into_iter().filter_map(|(t, prefix, color)| Some((t?, prefix, color))) {
        let text = format!("{prefix}{}", format::told_apart(t.into(), &distances));
        let galley = painter.layout_no_wrap(text, font.clone(), color);
        let half = galley.size().x * 0.5;
        let x = scale.x(t).clamp(scale.rows.left() + half, (scale.rows.right() - half).max(scale.rows.left() + half));
        let range = Rangef::new(x - half - 6.0, x + half + 6.0);
        if taken.iter().all(|other| range.max < other.min || other.max < range.min) {
            let place = Align2::CENTER_CENTER.anchor_size(pos2(x, y), galley.size());
            painter.galley(place.min, galley, color);
            taken.push(range);
        }
    }
}
