//! The plot: area of what each merge makes over its number, with a cursor that scrubs. Many merges are drawn as their
//! density, a texture made once for each construction, part of it and theme.

use std::sync::{Arc, Weak};

use egui::{
    self, Align2, Color32, ColorImage, CornerRadius, CursorIcon, FontId, Id, Key, Modifiers, Rect, Response, Sense,
    Shape, Stroke, StrokeKind, TextureFilter, TextureHandle, TextureOptions, Ui, WidgetInfo, pos2, vec2,
};

use crate::accel::is_same;
use crate::app::state::AppState;
use crate::app::state::picture_cut::{MergeStudy, PictureCut};
use crate::app::{format, theme};
use crate::lab::merges::{Density, Merges};
use bvhscope_engine::settings::BuilderKind;

/// Room for labels: to the left, above, below in points.
const MARGINS: [f32; 3] = [48.0, 26.0, 16.0];
/// Width in points from which a merge is drawn as a dot of its own.
const DOT_STEP: f32 = 3.0;
/// Smallest distance in points between two marks of the reduction.
const STOP_STEP: f32 = 3.0;
/// Distance in points at which the pointer is at a mark.
const REACH: f32 = 4.0;

/// Where steps and areas are in the window.
struct StepPlot {
    plot: Rect,
    first: f32,
    count: f32,
    range: [f32; 2],
}

impl StepPlot {
    fn x(&self, step: u32) -> f32 {
        self.plot.left() + (step as f32 - self.first + 0.5) / self.count * self.plot.width()
    }

    fn y(&self, log_area: f32) -> f32 {
        self.plot.bottom() - (log_area - self.range[0]) / (self.range[1] - self.range[0]) * self.plot.height()
    }

    fn step(&self, x: f32, last: u32) -> u32 {
        let place = (x - self.plot.left()) / self.plot.width() * self.count + self.first;
        (place.floor().max(0.0) as u32).min(last)
    }

    fn shows(&self, step: u32) -> bool {
        (self.first - 0.5..self.first + self.count).contains(&(step as f32))
    }
}

/// Shows the plot in a rectangle of `size`.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, study: &MergeStudy, size: egui::Vec2) {
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let merges = &study.merges;
    let steps = merges.timeline.steps();
    let window = state.model.cut.window.unwrap_or(steps).min(steps);
    let image = density_image(ui, study, window);
    let [left, top, bottom] = MARGINS;
    let plot = Rect::from_min_max(rect.min + vec2(left, top), rect.max - vec2(4.0, bottom));
    let Density { steps: [first, count], range, .. } = *image.density;
    let axes = StepPlot { plot, first: first as f32, count: count.max(1) as f32, range };

    scrub(ui, &mut state.model.cut, merges, &axes, &response);
    keys(ui, &mut state.model.cut, merges, &response);
    let step = state.model.cut.step(merges);
    response.widget_info(|| WidgetInfo::slider(true, f64::from(step.unwrap_or(0)), "Merge"));

    let palette = theme::palette(ui);
    let painter = ui.painter_at(rect);
    painter.rect_filled(plot, CornerRadius::same(2), ui.visuals().extreme_bg_color);
    labels(&painter, &axes, rect, merges, (palette.dim, palette.line));
    if plot.width() / axes.count >= DOT_STEP {
        for step in first..first + count {
            let place = pos2(axes.x(step), axes.y(merges.log_areas[step as usize - 1]));
            painter.circle_filled(place, 2.0, palette.accent);
        }
    } else {
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(image.texture.id(), plot, whole, Color32::WHITE);
    }
    let stops = visible_stops(merges, &axes);
    for &(x, _) in &stops {
        painter.vline(x, plot.bottom() - 6.0..=plot.bottom(), Stroke::new(1.0, palette.warm.gamma_multiply(0.8)));
    }
    for frame in merges.key_frames.iter().filter(|frame| axes.shows(frame.step)) {
        let tip = pos2(axes.x(frame.step).max(plot.left()), plot.top() - 2.0);
        let points = vec![tip, tip + vec2(-3.5, -7.0), tip + vec2(3.5, -7.0)];
        painter.add(Shape::convex_polygon(points, palette.dim, Stroke::NONE));
    }
    match step {
        Some(step) if axes.shows(step) => cursor(&painter, &axes, merges, step, palette.warm),
        Some(_) => {}
        None => {
            let text = format!("Drag here to go through the {}s, or press Play", merges.noun());
            let font = FontId::proportional(theme::VALUE_SIZE);
            let galley = painter.layout_no_wrap(text, font, palette.text);
            let place = Rect::from_center_size(plot.center(), galley.size() + vec2(16.0, 8.0));
            painter.rect_filled(place, CornerRadius::same(4), palette.veil);
            painter.galley(place.min + vec2(8.0, 4.0), galley, palette.text);
        }
    }
    if response.has_focus() {
        painter.rect_stroke(plot, CornerRadius::same(2), Stroke::new(1.0, palette.accent), StrokeKind::Inside);
    }
    let tip = response.hover_pos().map_or_else(String::new, |pointer| tip(merges, &axes, &stops, pointer, steps));
    response.on_hover_cursor(CursorIcon::ResizeHorizontal).on_hover_text_at_pointer(tip);
}

/// Chooses the step under the pointer while the button is held.
fn scrub(ui: &Ui, state: &mut PictureCut, merges: &Merges, axes: &StepPlot, response: &Response) {
    let held = response.is_pointer_button_down_on() && ui.input(|input| input.pointer.primary_down());
    let held = held || response.clicked_by(egui::PointerButton::Primary);
    if let Some(pointer) = response.interact_pointer_pos().filter(|_| held) {
        response.request_focus();
        let step = axes.step(pointer.x, merges.timeline.steps());
        // At the left edge of all merges nothing is merged yet.
        state.go(merges, if axes.first <= 1.0 && pointer.x < axes.plot.left() + 1.0 { 0 } else { step });
    }
}

/// Keyboard control while focused.
fn keys(ui: &Ui, state: &mut PictureCut, merges: &Merges, response: &Response) {
    if !response.has_focus() {
        return;
    }
    let filter = egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..egui::EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    let with = |modifiers, key| ui.input_mut(|input| input.consume_key(modifiers, key));
    let pressed = |key| with(Modifiers::NONE, key);
    let last = merges.timeline.steps();
    let step = state.step(merges).unwrap_or(0);
    let to = if with(Modifiers::COMMAND, Key::ArrowRight) {
        merges.next_key_frame(step, true).map(|frame| frame.step)
    } else if with(Modifiers::COMMAND, Key::ArrowLeft) {
        merges.next_key_frame(step, false).map(|frame| frame.step)
    } else if pressed(Key::ArrowRight) || pressed(Key::ArrowUp) {
        Some(step.saturating_add(1))
    } else if pressed(Key::ArrowLeft) || pressed(Key::ArrowDown) {
        Some(step.saturating_sub(1))
    } else if pressed(Key::Home) {
        Some(0)
    } else if pressed(Key::End) {
        Some(last)
    } else {
        None
    };
    if let Some(to) = to {
        state.go(merges, to);
    }
    if pressed(Key::Space) {
        state.toggle_play(merges);
    }
}

/// The marks where ranges stop merging, with their places: those nearest to the root where there is no room for all.
fn visible_stops(merges: &Merges, axes: &StepPlot) -> Vec<(f32, usize)> {
    let mut by_level: Vec<usize> = (0..merges.stops.len()).filter(|&at| axes.shows(merges.stops[at].step)).collect();
    by_level.sort_by_key(|&at| merges.stops[at].level);
    let mut taken: Vec<(f32, usize)> = Vec::new();
    for at in by_level {
        let x = axes.x(merges.stops[at].step);
        let place = taken.partition_point(|&(other, _)| other < x);
        let near = |other: Option<&(f32, usize)>| other.is_some_and(|(other, _)| (other - x).abs() < STOP_STEP);
        if !near(taken.get(place)) && !near(place.checked_sub(1).and_then(|before| taken.get(before))) {
            taken.insert(place, (x, at));
        }
    }
    taken
}

/// The line through the present step, with a dot at what it makes.
fn cursor(painter: &egui::Painter, axes: &StepPlot, merges: &Merges, step: u32, color: Color32) {
    let x = axes.x(step).clamp(axes.plot.left(), axes.plot.right());
    painter.vline(x, axes.plot.top() - 4.0..=axes.plot.bottom(), Stroke::new(1.5, color));
    if let Some(&area) = (step as usize).checked_sub(1).and_then(|at| merges.log_areas.get(at)) {
        painter.circle_filled(pos2(x, axes.y(area)), 4.0, color);
    }
}

/// Labels of both axes.
fn labels(painter: &egui::Painter, axes: &StepPlot, rect: Rect, merges: &Merges, (color, line): (Color32, Color32)) {
    let font = FontId::proportional(theme::HEADING_SIZE);
    let text = |place, align, text: String| painter.text(place, align, text, font.clone(), color);
    let mut free = f32::INFINITY;
    for exponent in 0..12 {
        let share = 10_f32.powi(-exponent);
        let y = axes.y(share.log2());
        if y > axes.plot.bottom() - 4.0 {
            break;
        }
        if y < axes.plot.top() - 1.0 || (free - y).abs() < 14.0 {
            continue;
        }
        free = y;
        painter.hline(axes.plot.x_range(), y, Stroke::new(1.0, line));
        // Longer numbers would not fit beside the plot.
        let label = match exponent {
            0..=2 => format!("{:.0} %", f64::from(share) * 100.0),
            3..=4 => format!("{:.*} %", exponent as usize - 2, f64::from(share) * 100.0),
            _ => format!("1e-{} %", exponent - 2),
        };
        text(pos2(axes.plot.left() - 4.0, y.max(rect.top() + 6.0)), Align2::RIGHT_CENTER, label);
    }
    let what = if merges.are_splits() { "node split" } else { "cluster made" };
    text(rect.min, Align2::LEFT_TOP, format!("Area of the {what}, in % of the root's"));
    let bottom = rect.bottom();
    let first = axes.first as u32;
    let first = if first <= 1 { 0 } else { first };
    text(pos2(axes.plot.left(), bottom), Align2::LEFT_BOTTOM, format::count(u64::from(first)));
    text(pos2(axes.plot.center().x, bottom), Align2::CENTER_BOTTOM, format!("{} number", merges.noun()));
    let last = (axes.first + axes.count - 1.0) as u64;
    text(pos2(axes.plot.right(), bottom), Align2::RIGHT_BOTTOM, format::count(last));
}

/// Facts about the step under the pointer.
fn tip(merges: &Merges, axes: &StepPlot, stops: &[(f32, usize)], pointer: egui::Pos2, steps: u32) -> String {
    let step = axes.step(pointer.x, steps);
    let mut lines = Vec::new();
    if pointer.y < axes.plot.top() {
        let near = |frame: &&crate::lab::merges::KeyFrame| (axes.x(frame.step) - pointer.x).abs() <= REACH;
        lines.extend(merges.key_frames.iter().filter(near).map(|frame| frame.label.clone()));
    }
    if pointer.y > axes.plot.bottom() - 10.0
        && let Some(&(_, at)) = stops.iter().find(|(x, _)| (x - pointer.x).abs() <= REACH)
    {
        let stop = merges.stops[at];
        let is_reduced =
            merges.history.construction().is_some_and(|construction| construction.builder == BuilderKind::Aac);
        lines.push(format!(
            "A range of {} at level {} stops merging: {} left{}",
            format::counted(u64::from(stop.primitives), "primitive"),
            stop.level,
            format::counted(u64::from(stop.left), "cluster"),
            if is_reduced { ", f(x)" } else { "" }
        ));
    }
    if let Some(share) = merges.area_share(step) {
        lines.push(format!(
            "{} {}: area {} of the root's",
            format::capital(merges.noun()),
            format::count(u64::from(step)),
            format::percent(f64::from(share))
        ));
    }
    lines.push("Drag to scrub; arrow keys step, with Ctrl to key frames, Space plays".to_owned());
    lines.join("\n")
}

/// Columns and rows of the density of a part.
const SIZE: [usize; 2] = [512, 96];

/// The density of the merges that a plot shows, with its picture.
pub(super) struct DensityImage {
    study: Weak<Density>,
    window: u32,
    color: Color32,
    /// The density.
    pub(super) density: Arc<Density>,
    /// Its picture.
    pub(super) texture: TextureHandle,
}

/// The density of the last `window` merges or the first splits of `study`, each cell the stronger the more merges are in it.
pub(super) fn density_image(ui: &Ui, study: &MergeStudy, window: u32) -> Arc<DensityImage> {
    let id = Id::unique("density of merges");
    let color = theme::palette(ui).accent;
    let whole = &study.merges.density;
    let known = ui.data(|data| data.get_temp::<Arc<DensityImage>>(id));
    let is_wanted =
        |known: &Arc<DensityImage>| is_same(&known.study, whole) && known.window == window && known.color == color;
    if let Some(known) = known.filter(is_wanted) {
        return known;
    }
    let areas = &study.merges.log_areas;
    let steps = study.merges.window(window);
    let density =
        if steps.len() == areas.len() { Arc::clone(whole) } else { Arc::new(Density::new(areas, steps, SIZE)) };
    let largest = (1.0 + density.largest() as f32).ln();
    let pixel = |&count: &u32| {
        // Logarithmic, since most merges are alike and the few large ones matter.
        let strength = (1.0 + count as f32).ln() / largest;
        if count == 0 { Color32::TRANSPARENT } else { color.gamma_multiply(0.3 + 0.7 * strength) }
    };
    let image = ColorImage::new(density.size, density.counts.iter().map(pixel).collect());
    let options = TextureOptions {
        magnification: TextureFilter::Nearest,
        minification: TextureFilter::Linear,
        ..TextureOptions::default()
    };
    let texture = ui.ctx().load_texture("density of merges", image, options);
    let made = Arc::new(DensityImage { study: Arc::downgrade(whole), window, color, density, texture });
    ui.data_mut(|data| data.insert_temp(id, Arc::clone(&made)));
    made
}
