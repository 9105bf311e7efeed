//! Controls of the view: order, play, speed, and which clusters are drawn. The present merge in words.

use egui::{self, DragValue, Label, Response, RichText, Sense, Slider, Ui, WidgetInfo, vec2};

use crate::app::state::picture_cut::{CutKind, MergeStudy, PictureCut};
use crate::app::state::{AppState, Presented};
use crate::app::widgets::{DropDown, Icon, Tip as _, chip, icon_button};
use crate::app::{format, theme};
use crate::lab::merges::is_recorded;
use bvhscope_engine::construction::MergeOrder;
use bvhscope_engine::settings::BuilderKind;

/// Numbers of merges at the end, or of splits at the beginning, that the plot can be limited to.
const WINDOWS: [u32; 4] = [100_000, 10_000, 1_000, 100];

/// Shows the controls.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, shown: &Presented, study: &MergeStudy) {
    let containers = state.shows_containers();
    let merges = &mut state.model.cut;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        if is_recorded(&shown.accel) {
            orders(ui, merges, study.merges.are_splits());
            ui.add_space(8.0);
        }
        transport(ui, merges, study);
        ui.add_space(4.0);
        speed(ui, merges, study);
        ui.add_space(8.0);
        left(ui, merges, study);
        ui.add_space(8.0);
        drawn(ui, merges);
        ui.add_space(8.0);
        window(ui, merges, study);
        if merges.left.is_some() || merges.cut_kind != CutKind::Step {
            let tip = "Choose no step: the picture shows the chosen depths again";
            if ui.button("Clear").tip(tip).clicked() {
                merges.clear();
            }
        }
        if !containers {
            let text = RichText::new("Containers are off: B shows them").color(theme::palette(ui).warning);
            ui.label(text);
        }
    });
    if let Some(remark) = study.merges.history.remark(&shown.accel) {
        ui.add(Label::new(RichText::new(remark).color(theme::palette(ui).warning)).wrap());
    }
}

/// The orders of the merges.
fn orders(ui: &mut Ui, merges: &mut PictureCut, are_splits: bool) {
    for order in MergeOrder::ALL {
        let (label, tip) = match (order, are_splits) {
            (MergeOrder::Built, false) => (
                order.label(),
                "As a build by one thread merges: the left side of each range, the right side, then both; of PLOC round by round",
            ),
            (MergeOrder::Distance, false) => (
                order.label(),
                "By the area of what is made, smallest first, as exact clustering would: read backwards, the last active clusters",
            ),
            (MergeOrder::Level, false) => (
                order.label(),
                "By level of the recursion, deepest first: all small ranges, then the ranges made of two of them",
            ),
            (MergeOrder::Built, true) => {
                (order.label(), "As a build by one thread splits: a node, all of its left side, then its right side")
            }
            (MergeOrder::Distance, true) => ("Largest first", "By the area of the node that is split, largest first"),
            (MergeOrder::Level, true) => {
                ("By depth", "By the depth of the node that is split: the root, its children, and so on")
            }
        };
        if chip(ui, label, merges.order == order, tip) && merges.order != order {
            (merges.order, merges.playing) = (order, None);
        }
    }
}

/// Buttons that move in time.
fn transport(ui: &mut Ui, merges: &mut PictureCut, study: &MergeStudy) {
    let study = &study.merges;
    let step = merges.step(study);
    let last = study.timeline.steps();
    let to_key = |forward: bool| study.next_key_frame(step.unwrap_or(if forward { 0 } else { last }), forward);
    let key_tip = |forward: bool, key: &str| {
        let found = to_key(forward).map_or("none on this side", |frame| frame.label.as_str());
        format!("To the {} key frame: {found} ({key})", if forward { "next" } else { "previous" })
    };
    if icon(ui, Icon::Jump(false), "Previous key frame", &key_tip(false, "Ctrl+Left, with the plot focused")).clicked()
        && let Some(frame) = to_key(false)
    {
        merges.go(study, frame.step);
    }
    let noun = study.noun();
    let back = format!("Undo one {noun} (Left arrow, with the plot focused)");
    if icon(ui, Icon::Step(false), "Step back", &back).clicked() {
        merges.go(study, step.unwrap_or(last).saturating_sub(1));
    }
    let playing = merges.playing.is_some();
    let (play, name) = if playing { (Icon::Pause, "Pause") } else { (Icon::Play, "Play") };
    if icon(ui, play, name, "Play the construction, or pause (Space, with the plot focused)").clicked() {
        merges.toggle_play(study);
    }
    let forward = format!("Do one {noun} (Right arrow, with the plot focused)");
    if icon(ui, Icon::Step(true), "Step forward", &forward).clicked() {
        merges.go(study, step.map_or(1, |step| step.saturating_add(1)));
    }
    if icon(ui, Icon::Jump(true), "Next key frame", &key_tip(true, "Ctrl+Right, with the plot focused")).clicked()
        && let Some(frame) = to_key(true)
    {
        merges.go(study, frame.step);
    }
}

fn icon(ui: &mut Ui, icon: Icon, name: &str, tip: &str) -> Response {
    let (rect, _) = ui.allocate_exact_size(vec2(theme::ROW_HEIGHT, theme::ROW_HEIGHT), Sense::hover());
    icon_button(ui, rect, icon, name).tip(tip)
}

/// Speed of playing.
fn speed(ui: &mut Ui, merges: &mut PictureCut, study: &MergeStudy) {
    ui.spacing_mut().slider_width = 72.0;
    let slider = Slider::new(&mut merges.speed, PictureCut::SPEEDS[0]..=PictureCut::SPEEDS[1])
        .logarithmic(true)
        .show_value(false);
    let speed = ui.add(slider);
    let current = merges.speed;
    let (name, tip) = if study.merges.are_splits() {
        (
            "Splits a second",
            "Speed of playing; slow for the beginning, where few large nodes are split, fast for the end",
        )
    } else {
        ("Merges a second", "Speed of playing; slow for the end, where few large merges happen, fast for the beginning")
    };
    speed.widget_info(|| WidgetInfo::slider(ui.is_enabled(), current, name));
    speed.tip(tip);
    let text = format!("{}/s", format::count(merges.speed.round() as u64));
    let (rect, _) = ui.allocate_exact_size(vec2(56.0, theme::ROW_HEIGHT), Sense::hover());
    let font = egui::TextStyle::Body.resolve(ui.style());
    ui.painter().text(rect.left_center(), egui::Align2::LEFT_CENTER, text, font, theme::palette(ui).dim);
}

/// Number of clusters that are left, which chooses the step too.
fn left(ui: &mut Ui, merges: &mut PictureCut, study: &MergeStudy) {
    let are_splits = study.merges.are_splits();
    let [tip, suffix] = if are_splits {
        ["Number of nodes after this split, which are a cut through the tree", " nodes"]
    } else {
        ["Number of active clusters at this step. Ordered by distance, they are a cut through the tree", " clusters"]
    };
    let most = study.merges.timeline.steps() + 1;
    ui.label(RichText::new("Active").color(theme::palette(ui).dim)).tip(tip);
    let first = study.merges.timeline.standing(0);
    let mut left = merges.left.unwrap_or(first).clamp(1, most);
    let speed = (f64::from(left) * 0.01).max(0.1);
    let field = DragValue::new(&mut left).range(1..=most).speed(speed).suffix(suffix);
    let field = field.custom_formatter(|number, _| format::count(number as u64));
    let field = field.custom_parser(|text| text.replace(',', "").trim().parse().ok());
    let response = ui.add(field);
    response.widget_info(|| {
        let mut info = WidgetInfo::drag_value(ui.is_enabled(), f64::from(left));
        info.label = Some("Active clusters".to_owned());
        info
    });
    if response.changed() {
        merges.go(&study.merges, study.merges.timeline.step_with(left));
    }
    response.tip(tip);
}

/// Which clusters are drawn over the picture.
fn drawn(ui: &mut Ui, merges: &mut PictureCut) {
    let choices = [
        (CutKind::Step, "at this step"),
        (CutKind::Area, "of at most this area"),
        (CutKind::Triangles, "of at most this many triangles"),
    ];
    let tip =
        "Clusters over the picture: those that are active at this step, or the largest up to a size, whatever the step";
    let list = choices.map(|(choice, text)| (choice, text.to_owned()));
    choice(ui, "Clusters", tip, 120.0, &mut merges.cut_kind, &list);
    let named = |ui: &Ui, response: &Response, value: f64, label: &str| {
        response.widget_info(|| {
            let mut info = WidgetInfo::drag_value(ui.is_enabled(), value);
            info.label = Some(label.to_owned());
            info
        });
    };
    match merges.cut_kind {
        CutKind::Step => {}
        CutKind::Area => {
            let mut percent = f64::from(merges.cut_area) * 100.0;
            let speed = (percent * 0.02).max(1e-4);
            let [least, most] = PictureCut::CUT_AREA.map(|share| f64::from(share) * 100.0);
            let field = DragValue::new(&mut percent).range(least..=most).speed(speed).max_decimals(4).suffix(" %");
            let response = ui.add(field);
            named(ui, &response, percent, "Largest area");
            if response.changed() {
                merges.cut_area = (percent / 100.0) as f32;
            }
            response.tip("Surface area of the largest clusters, as a share of the root's");
        }
        CutKind::Triangles => {
            let speed = (f64::from(merges.cut_triangles) * 0.02).max(0.1);
            let response = ui.add(DragValue::new(&mut merges.cut_triangles).range(1..=u32::MAX).speed(speed));
            named(ui, &response, f64::from(merges.cut_triangles), "Most triangles");
            response.tip("Number of triangles of the largest clusters");
        }
    }
}

/// How many of the last merges, or of the first splits, the plot shows.
fn window(ui: &mut Ui, merges: &mut PictureCut, study: &MergeStudy) {
    let all = study.merges.timeline.steps();
    let (noun, part) = if study.merges.are_splits() { ("splits", "first") } else { ("merges", "last") };
    let mut choices = vec![(None, format!("all {noun}"))];
    choices.extend(WINDOWS.into_iter().filter(|&count| count < all).map(|count| {
        let text = format!("{part} {}", format::count(u64::from(count)));
        (Some(count), text)
    }));
    if choices.len() > 1 {
        let tip = format!("{} that the plot shows", format::capital(noun));
        choice(ui, "Plot", &tip, 88.0, &mut merges.window, &choices);
    }
}

/// Room for the label of a drop-down list in points.
const LABEL_ROOM: f32 = 64.0;

/// A labelled drop-down list.
fn choice<T: Copy + PartialEq>(ui: &mut Ui, name: &str, tip: &str, width: f32, value: &mut T, choices: &[(T, String)]) {
    // The label stays beside its list where the controls take several rows.
    if ui.available_size_before_wrap().x < width + LABEL_ROOM {
        ui.end_row();
    }
    let choices: Vec<(T, &str, &str)> = choices.iter().map(|(choice, text)| (*choice, text.as_str(), "")).collect();
    DropDown::new(&format!("{name} shown"), &choices).width(width).beside(ui, name, tip, value);
}

/// Height of the line in points.
pub(super) const HEIGHT: f32 = theme::ROW_HEIGHT;

/// Shows the line.
pub(super) fn status(ui: &mut Ui, state: &AppState, study: &MergeStudy) {
    let text = RichText::new(present(state, study)).color(theme::palette(ui).text);
    ui.allocate_ui(vec2(ui.available_width(), HEIGHT), |ui| {
        ui.add(Label::new(text).truncate()).tip("The step at the cursor: its number, and what it makes or splits");
    });
}

/// The present step: "Merge 1,234 of 69,450 · level 5 · 9 in its list · area 0.12 % · 68,217 left".
fn present(state: &AppState, study: &MergeStudy) -> String {
    let merges = &study.merges;
    let steps = format::count(u64::from(merges.timeline.steps()));
    if state.model.cut.cut_kind != CutKind::Step {
        let all =
            state.layout.graphics.standing.as_ref().map_or_else(|| "…".to_owned(), |cut| format::count(cut.all as u64));
        return format!("Cut through the tree: {all} clusters");
    }
    let noun = merges.noun();
    let Some(step) = state.model.cut.step(merges) else { return format!("{steps} {noun}s; no step chosen") };
    let left = format::count(u64::from(merges.timeline.standing(step)));
    let Some(node) = merges.made_at(step) else {
        return if merges.are_splits() {
            format!("Nothing split yet of {steps} splits · the root holds all")
        } else {
            format!("Nothing merged yet of {steps} merges · all {left} clusters stand")
        };
    };
    let mut parts = vec![format!("{} {} of {steps}", format::capital(noun), format::count(u64::from(step)))];
    if let Some(construction) = merges.history.construction() {
        let record = &construction.record;
        if let Some(level) = record.level_of(node) {
            parts.push(match construction.builder {
                BuilderKind::Ploc => format!("round {}", record.steps().len() as u32 - level),
                _ => format!("level {level}"),
            });
        }
        if let Some(length) = merges.merge_number(step).and_then(|merge| record.list_length(merge)) {
            parts.push(format!("{} in its list", format::count(u64::from(length))));
        }
    }
    if let Some(share) = merges.area_share(step) {
        parts.push(format!("area {}", format::percent(f64::from(share))));
    }
    if let Some(splits) = merges.history.splits() {
        if splits.duplicates(node) > 0 {
            let shared = format::counted(u64::from(splits.duplicates(node)), "triangle");
            parts.push(format!("spatial, {shared} on both sides"));
        }
        parts.push(format!("{left} nodes"));
    } else {
        parts.push(format!("{left} left"));
    }
    parts.join(" · ")
}
