//! The curves of the policies with their lowest and highest frames, the cheapest policy of each frame, and what a click on them does.

use egui::{
    self, Color32, CornerRadius, CursorIcon, Pos2, Rect, RichText, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2,
    vec2,
};

use super::state::{MotionQuantity, MotionView, PolicyCurve};
use crate::app::state::AppState;
use crate::app::views::axes::{Axes, Lettering, rest};
use crate::app::views::parts::NO_OVERLAP;
use crate::app::widgets::empty_view;
use crate::app::{format, theme};
use crate::lab::motion::{FrameCost, MotionRow, cheaper_in, cheapest, factor, least, pays_from};
use crate::lab::plot::{Axis, COLORS, Scale};
use crate::scene::Moment;
use bvhscope_engine::follow::Policy;

/// Height of the band of cheapest policies in points.
const BAND: f32 = 12.0;
/// Height of the lines below the plot in points.
const BELOW: f32 = 44.0;
/// Distance in points within which the pointer is at a curve.
const REACH: f32 = 28.0;

/// Colour of a policy: those of exported plots, and grey for a tree that is kept.
pub(super) fn color(ui: &Ui, policy: Policy) -> Color32 {
    let palette = theme::palette(ui);
    match policy as usize {
        0 => palette.dim,
        place => match COLORS[(place - 1) % COLORS.len()] {
            [0, 0, 0] => palette.text,
            [r, g, b] => Color32::from_rgb(r, g, b),
        },
    }
}

/// Shows the plot, the band and the findings.
pub(super) fn show(ui: &mut Ui, view: &MotionView, state: &mut AppState, curves: &[PolicyCurve]) {
    let drawn: Vec<&PolicyCurve> =
        curves.iter().filter(|curve| !view.hidden.contains(&curve.policy) && !curve.rows.is_empty()).collect();
    let Some(first) = drawn.first() else {
        ui.weak("All policies are hidden: a click on one shows it");
        return;
    };
    let (quantity, rays) = (view.quantity, view.rays);
    let start = state.clip().map_or(0.0, |(_, clip)| clip.start);
    let seconds = |row: &MotionRow| since_start(row, start);
    let values = |curve: &PolicyCurve| -> Vec<[f64; 2]> {
        let point = |row: &MotionRow| Some([seconds(row), quantity.of(row, rays)?]);
        curve.rows.iter().filter_map(point).collect()
    };
    if quantity == MotionQuantity::Epo && first.rows.iter().all(|row| row.epo.is_none()) {
        empty_view(ui, NO_OVERLAP);
        return;
    }
    let points: Vec<Vec<[f64; 2]>> = drawn.iter().map(|curve| values(curve)).collect();
    let all = || points.iter().flatten();
    let across = match &first.rows[..] {
        // No longer than the clip, as the band of cheapest policies.
        [start, .., end] if start.seconds < end.seconds => {
            Axis { low: seconds(start), high: seconds(end), scale: Scale::Linear }
        }
        rows => Axis::linear(rows.iter().map(seconds)),
    };
    let up = Axis::fitted(all().map(|point| point[1]));
    let size = rest(ui) - vec2(0.0, BAND + BELOW);
    let (rect, response) = ui.allocate_exact_size(size.max(vec2(160.0, 60.0)), Sense::click());
    let label = quantity.label();
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("Plot of {label} over the clip")));
    let heading = format!("{label} · of each policy, lowest filled, highest ringed");
    let lettering = Lettering { heading: &heading, across: "Time of the clip (s)", ..Lettering::default() };
    let axes = Axes::paint(ui, rect, [across, up], &lettering);
    now(ui, state, &axes, rect);
    for (curve, points) in drawn.iter().zip(&points) {
        draw(ui, &axes, points, color(ui, curve.policy), state.wanted.follow.policy == curve.policy);
    }
    let pointed = response.hover_pos().and_then(|at| nearest(&axes, &points, at));
    if let Some((policy, at)) = pointed {
        let row = &drawn[policy].rows[at.min(drawn[policy].rows.len() - 1)];
        let place = axes.at(points[policy][at]);
        ui.painter().circle_stroke(place, 5.0, Stroke::new(1.5, theme::palette(ui).text));
        if response.clicked() {
            go_to(state, row);
        }
        let tip = text_of(row, quantity, rays, start);
        response.on_hover_cursor(CursorIcon::PointingHand).on_hover_text_at_pointer(tip);
    }
    band(ui, state, &axes, &drawn, rays);
    findings(ui, rays, &drawn, start);
}

/// Seconds since the clip's first key, as the time strip counts them; `start` is that key's time.
fn since_start(row: &MotionRow, start: f32) -> f64 {
    f64::from(row.seconds - start)
}

/// A line at the moment that is shown.
fn now(ui: &Ui, state: &AppState, axes: &Axes, rect: Rect) {
    let Some((moment, clip)) = state.clip() else { return };
    let x = axes.at([f64::from(moment.seconds - clip.start), 1.0]).x;
    if axes.plot.x_range().contains(x) {
        let warm = theme::palette(ui).warm.gamma_multiply(0.7);
        ui.painter().with_clip_rect(rect).vline(x, axes.plot.y_range(), Stroke::new(1.0, warm));
    }
}

/// A curve with its lowest and its highest point.
fn draw(ui: &Ui, axes: &Axes, points: &[[f64; 2]], color: Color32, is_chosen: bool) {
    let painter = axes.painter(ui);
    let line: Vec<Pos2> = points.iter().map(|&point| axes.at(point)).collect();
    painter.add(Shape::line(line, Stroke::new(if is_chosen { 2.5 } else { 1.5 }, color)));
    let by_value = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
    if let (Some(&low), Some(&high)) = (points.iter().min_by(by_value), points.iter().max_by(by_value)) {
        painter.circle_filled(axes.at(low), 3.0, color);
        painter.circle_stroke(axes.at(high), 3.5, Stroke::new(1.5, color));
    }
}

/// The curve nearest above or below the pointer, and its point of the frame there.
fn nearest(axes: &Axes, points: &[Vec<[f64; 2]>], at: Pos2) -> Option<(usize, usize)> {
    let of_curve = |(curve, points): (usize, &Vec<[f64; 2]>)| {
        let places = points.iter().map(|&values| axes.at(values)).enumerate();
        let across = |place: Pos2| (place.x - at.x).abs();
        let (point, place) = places.min_by(|a, b| across(a.1).total_cmp(&across(b.1)))?;
        Some((curve, point, (place.y - at.y).abs()))
    };
    let found = points.iter().enumerate().filter_map(of_curve).min_by(|a, b| a.2.total_cmp(&b.2));
    let found = found.filter(|(.., distance)| *distance <= REACH && axes.plot.expand(REACH).contains(at));
    found.map(|(curve, point, _)| (curve, point))
}

/// Shows the model in a frame, with its tree by the policy.
fn go_to(state: &mut AppState, row: &MotionRow) {
    let clip = state.clip().map_or(0, |(moment, _)| moment.clip);
    state.wanted.moment = Some(Moment { clip, seconds: row.seconds });
    state.wanted.follow.policy = row.policy;
    state.model.playback.playing = false;
}

/// A tree in a frame as text: "Refit, frame 12 (0.48 s): SAH cost 23.4".
fn text_of(row: &MotionRow, quantity: MotionQuantity, rays: f64, start: f32) -> String {
    let value = quantity.of(row, rays).map_or_else(|| "–".to_owned(), format::significant);
    format!(
        "{}, frame {} ({:.2} s): {} {value}\nClick to see this frame with a tree by this policy",
        row.policy.label(),
        row.frame,
        since_start(row, start),
        quantity.label(),
    )
}

/// The cheapest policy of each frame, as a band below the plot.
fn band(ui: &mut Ui, state: &mut AppState, axes: &Axes, drawn: &[&PolicyCurve], rays: f64) {
    let best = cheapest(&costs(drawn), rays);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), BAND), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Cheapest policy of each frame"));
    let rows = &drawn[0].rows;
    let start = state.clip().map_or(0.0, |(_, clip)| clip.start);
    let x = |row: &MotionRow| axes.at([since_start(row, start), 1.0]).x;
    let edge = |frame: usize| match (frame.checked_sub(1).and_then(|before| rows.get(before)), rows.get(frame)) {
        (None, _) => axes.plot.left(),
        (Some(before), Some(row)) => (x(before) + x(row)) * 0.5,
        (Some(_), None) => axes.plot.right(),
    };
    for (frame, &policy) in best.iter().enumerate() {
        let part = Rect::from_min_max(pos2(edge(frame), rect.top()), pos2(edge(frame + 1), rect.bottom()));
        ui.painter().rect_filled(part, CornerRadius::ZERO, color(ui, drawn[policy].policy));
    }
    let Some(at) = response.hover_pos() else { return };
    let frame = (0..best.len()).find(|&frame| (edge(frame)..edge(frame + 1)).contains(&at.x));
    if let Some(row) = frame.map(|frame| &drawn[best[frame]].rows[frame]) {
        let tip = text_of(row, MotionQuantity::Frame, rays, start);
        if response.clicked() {
            go_to(state, row);
        }
        response.on_hover_text_at_pointer(format!("Cheapest: {tip}"));
    }
}

/// The times of each policy, frame by frame.
fn costs(drawn: &[&PolicyCurve]) -> Vec<Vec<FrameCost>> {
    drawn.iter().map(|curve| curve.rows.iter().map(MotionRow::cost).collect()).collect()
}

/// In how many frames each policy is the cheapest, which takes the least time for certain, and when rebuilding pays.
fn findings(ui: &mut Ui, rays: f64, drawn: &[&PolicyCurve], start: f32) {
    let costs = costs(drawn);
    let best = cheapest(&costs, rays);
    let counted = drawn.iter().enumerate().filter_map(|(index, curve)| {
        let count = best.iter().filter(|&&policy| policy == index).count();
        (count > 0).then(|| format!("{} in {count}", curve.policy.label()))
    });
    let counted = counted.collect::<Vec<_>>().join(", ");
    let name = |policy: usize| drawn[policy].policy.label();
    let least = least(&costs, rays).map_or_else(String::new, |least| match least.rivals[..] {
        [] => format!(". {} takes the least time", name(least.policy)),
        ref rivals => {
            let names: Vec<&str> = std::iter::once(least.policy).chain(rivals.iter().copied()).map(name).collect();
            format!(". Which takes the least time is not decided between {}", names.join(", "))
        }
    });
    let of = |policy: Policy| drawn.iter().position(|curve| curve.policy == policy).map(|index| &costs[index]);
    let pays = of(Policy::Refit).zip(of(Policy::Rebuild)).map_or_else(String::new, |(refit, rebuild)| {
        let seconds = |frame: usize| drawn[0].rows.get(frame).map_or(0.0, |row| since_start(row, start));
        pays_text(refit, rebuild, rays, &seconds)
    });
    let million = format::significant(rays / 1e6);
    let text = format!("Cheapest with {million} million rays a frame: {counted} of {} frames{least}{pays}", best.len());
    ui.add(egui::Label::new(RichText::new(text).color(theme::palette(ui).dim)).wrap());
}

/// When rebuilding pays over refitting, as far as that is decided.
fn pays_text(refit: &[FrameCost], rebuild: &[FrameCost], rays: f64, seconds: &dyn Fn(usize) -> f64) -> String {
    let (count, frames) = (cheaper_in(refit, rebuild, rays), refit.len().min(rebuild.len()));
    if let Some(frame) = pays_from(refit, rebuild, rays) {
        return format!(". Rebuilding pays over refitting from frame {frame}, at {:.2} s, to the end", seconds(frame));
    }
    let decided = factor(refit, rebuild, rays).and_then(|factor| factor.decided());
    match (decided, count) {
        (_, 0) => ". Rebuilding never pays over refitting".to_owned(),
        (Some(_), _) => format!(". Rebuilding pays over refitting in {count} of {frames} frames"),
        (None, _) => format!(". Rebuilding pays over refitting in {count} of {frames} frames, which decides nothing"),
    }
}
