//! The reduction function f(x) with the numbers that the build really had; its parameters are dragged on the curve.

use std::fmt::Write as _;

use bvhscope_engine::construction::{Reduction, ReductionLevel};
use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use egui::{
    self, Align2, CornerRadius, CursorIcon, FontId, Key, Label, Painter, Pos2, Rect, RichText, Sense, Shape, Stroke,
    Ui, WidgetInfo, pos2, vec2,
};

use crate::app::state::AppState;
use crate::app::state::picture_cut::MergeStudy;
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::catalog::settings::{EPSILON, Setting, Stated, THRESHOLD, Value};
use crate::lab::merges::{reduction_through, threshold_at};

/// Room for labels to the left and below in points.
const MARGINS: [f32; 2] = [36.0, 28.0];
/// Smallest height of the plot in points.
const MIN_HEIGHT: f32 = 104.0;
/// Side of a handle in points.
const HANDLE: f32 = 16.0;
/// Number of line pieces of the curve.
const PIECES: u16 = 64;

/// A plot with logarithmic axes from 1.
struct LogPlot {
    plot: Rect,
    /// Largest number of primitives and of clusters.
    most: [f64; 2],
}

impl LogPlot {
    fn at(&self, x: f64, y: f64) -> Pos2 {
        let part = |value: f64, most: f64| (value.max(1.0).ln() / most.ln()) as f32;
        let [x, y] = [part(x, self.most[0]), part(y, self.most[1])];
        pos2(self.plot.left() + x * self.plot.width(), self.plot.bottom() - y * self.plot.height())
    }

    fn values(&self, place: Pos2) -> [f64; 2] {
        let part = |part: f32, most: f64| (f64::from(part) * most.ln()).exp();
        let x = (place.x - self.plot.left()) / self.plot.width();
        let y = (self.plot.bottom() - place.y) / self.plot.height();
        [part(x, self.most[0]), part(y, self.most[1])]
    }
}

/// Shows the curve.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, study: &MergeStudy) {
    let palette = theme::palette(ui);
    let history = &study.merges.history;
    if state.wanted.build.builder != BuilderKind::Aac || history.construction().is_none() {
        let text = if state.wanted.build.builder == BuilderKind::Swift {
            "AAC of leaf blocks reduces its lists by f(x), too, but its merges are not recorded: choose AAC to see them"
        } else {
            "Only AAC reduces its lists by f(x): exact clustering merges one list of all primitives, PLOC merges in rounds, H-PLOC down to 16 clusters of a list, and builders from the top merge none"
        };
        ui.add(Label::new(RichText::new(text).color(palette.dim)).wrap());
        return;
    }
    let primitives = history.levels.iter().map(|level| level.primitives.max).max().unwrap_or(2);
    let most_left = history.levels.iter().map(|level| level.after.max).max().unwrap_or(1);
    let build = state.wanted.build;
    let reduction = Reduction::of(&build);
    let x = f64::from(primitives).max(f64::from(BuildSettings::MAX_THRESHOLD) * 2.0);
    // Room for the handles up to their limits.
    let y = reduction.value(x).max(f64::from(most_left)).max(f64::from(build.threshold)) * 4.0;
    let size = vec2(ui.available_width() - 4.0, (ui.available_height() - 26.0).max(MIN_HEIGHT));
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let numbers = Stated::of(&build).by_symbol().join(", ");
    let text = format!("Reduction of {numbers}");
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, &text));
    let [left, bottom] = MARGINS;
    let axes =
        LogPlot { plot: Rect::from_min_max(rect.min + vec2(left, 4.0), rect.max - vec2(8.0, bottom)), most: [x, y] };
    let painter = ui.painter_at(rect);
    painter.rect_filled(axes.plot, CornerRadius::same(2), ui.visuals().extreme_bg_color);
    labels(&painter, &axes, &palette);
    for level in &history.levels {
        let x = f64::from(level.primitives.median);
        let whisker = [level.after.min, level.after.max].map(|left| axes.at(x, f64::from(left)));
        painter.line_segment(whisker, Stroke::new(1.0, palette.dim));
        painter.circle_filled(axes.at(x, f64::from(level.after.median)), 3.0, palette.accent);
    }
    let delta = f64::from(build.threshold);
    let from = axes.at(1.0, (delta * 0.5).max(1.0));
    let curve = (0..=PIECES).map(|piece| {
        let x = (delta.ln() + (x.ln() - delta.ln()) * f64::from(piece) / f64::from(PIECES)).exp();
        axes.at(x, reduction.value(x))
    });
    let points: Vec<Pos2> = std::iter::once(from).chain(curve).collect();
    painter.add(Shape::line(points, Stroke::new(1.5, palette.warm)));
    let end = [x, reduction.value(x)];
    handles(ui, state, &axes, &painter, end);
    let left = format::count(reduction.reduced_count(primitives as usize) as u64);
    let of = format::count(u64::from(primitives));
    let text = format!("{numbers}: f({of}) = {left}. Dots: what was built");
    let tip = "A dot is the median of the ranges of a level, its line their range from the smallest to the largest";
    ui.horizontal(|ui| {
        if ui.button("Copy curve").tip("Copy what the build really had, level by level, beside f(x)").clicked() {
            state.copy(tsv(&history.levels, &reduction), "Levels copied");
        }
        let label = ui.add(Label::new(RichText::new(text).color(palette.dim)).truncate());
        label.tip(tip);
    });
}

/// The levels of the build as tab-separated text, with f of the median.
fn tsv(levels: &[ReductionLevel], reduction: &Reduction) -> String {
    let mut text =
        String::from("Level\tSteps\tPrimitives: least\tmedian\tmost\tClusters left: least\tmedian\tmost\tf(median)\n");
    for ReductionLevel { level, steps, primitives: x, after: y, .. } in levels {
        let left = reduction.reduced_count(x.median as usize);
        // Writing into a string cannot fail.
        let _ = write!(text, "{level}\t{steps}\t{}\t{}\t{}\t", x.min, x.median, x.max);
        let _ = writeln!(text, "{}\t{}\t{}\t{left}", y.min, y.median, y.max);
    }
    text
}

/// The two points of the curve that can be dragged: where it begins, by δ, and its far end, by ε.
fn handles(ui: &mut Ui, state: &mut AppState, axes: &LogPlot, painter: &Painter, end: [f64; 2]) {
    let build = state.wanted.build;
    let delta = f64::from(build.threshold);
    let mut changed = build;
    let tip = "Threshold δ: ranges of fewer triangles are clustered whole. Drag sideways: the tree is built again";
    let place = axes.at(delta, delta * 0.5);
    let (dragged, steps) = handle(
        ui,
        painter,
        "Threshold on the curve",
        place,
        number(&THRESHOLD, &build),
        tip,
        CursorIcon::ResizeHorizontal,
    );
    match dragged {
        Some(place) => changed.threshold = threshold_at(axes.values(place)[0]),
        None => changed = THRESHOLD.stepped(changed, steps),
    }
    let tip = "Reduction ε: how much the curve flattens. Drag up for more clusters: a better tree, and a slower build";
    let place = axes.at(end[0], end[1]);
    let (dragged, steps) =
        handle(ui, painter, "Reduction on the curve", place, number(&EPSILON, &build), tip, CursorIcon::ResizeVertical);
    match dragged.and_then(|place| reduction_through(build.threshold, [end[0], axes.values(place)[1]])) {
        Some(value) => changed = EPSILON.with_number(changed, value),
        // Up is more clusters, which is a lower ε.
        None => changed = EPSILON.stepped(changed, -steps),
    }
    if changed != build {
        state.wanted.build = changed;
    }
}

fn number(setting: &Setting, build: &BuildSettings) -> f64 {
    if let Value::Number(number) = &setting.value { f64::from((number.get)(build)) } else { f64::NAN }
}

/// A point that can be dragged. Returns the place that it is dragged to, and the number of steps by arrow keys, up and right
/// counted positive.
fn handle(
    ui: &mut Ui,
    painter: &Painter,
    name: &str,
    place: Pos2,
    value: f64,
    tip: &str,
    cursor: CursorIcon,
) -> (Option<Pos2>, i32) {
    let rect = Rect::from_center_size(place, vec2(HANDLE, HANDLE));
    let response = ui.interact(rect, ui.scope_id().with(name), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::slider(true, value, name));
    let palette = theme::palette(ui);
    let hot = response.hovered() || response.dragged() || response.has_focus();
    painter.circle(place, if hot { 6.0 } else { 5.0 }, palette.warm, Stroke::new(1.5, palette.text));
    let mut steps = 0;
    if response.has_focus() {
        let filter = egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..Default::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        let pressed = |key| i32::from(ui.input(|input| input.key_pressed(key)));
        steps = pressed(Key::ArrowRight) + pressed(Key::ArrowUp) - pressed(Key::ArrowLeft) - pressed(Key::ArrowDown);
    }
    let dragged = response.interact_pointer_pos().filter(|_| response.dragged());
    response.on_hover_cursor(cursor).tip(tip);
    (dragged, steps)
}

/// Powers of ten along both axes, and what they count.
fn labels(painter: &Painter, axes: &LogPlot, palette: &theme::Palette) {
    let font = FontId::proportional(theme::HEADING_SIZE);
    let text = |place, align, text: String| painter.text(place, align, text, font.clone(), palette.dim);
    let line = Stroke::new(1.0, palette.line);
    for exponent in 0..10 {
        let value = 10_f64.powi(exponent);
        let label = format::count(value as u64);
        if value <= axes.most[0] {
            let place = axes.at(value, 1.0);
            painter.vline(place.x, axes.plot.y_range(), line);
            text(place + vec2(0.0, 2.0), Align2::CENTER_TOP, label.clone());
        }
        if value <= axes.most[1] {
            let place = axes.at(1.0, value);
            painter.hline(axes.plot.x_range(), place.y, line);
            text(place - vec2(4.0, 0.0), Align2::RIGHT_CENTER, label);
        }
    }
    let bottom = pos2(axes.plot.right(), axes.plot.bottom() + MARGINS[1]);
    text(bottom, Align2::RIGHT_BOTTOM, "x: primitives of a range".to_owned());
    text(axes.plot.min + vec2(4.0, 2.0), Align2::LEFT_TOP, "clusters left, f(x)".to_owned());
}
