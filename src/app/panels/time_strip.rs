//! Time strip of a model that moves: play, step, scrub, speed, and the clip.

use std::sync::Arc;

use egui::{
    self, Align, Button, ComboBox, Layout, PopupCloseBehavior, Response, RichText, Role, ScrollArea, Sense, Slider,
    TextEdit, Ui, WidgetInfo, vec2,
};

use crate::app::commands::{Action, refused_policy};
use crate::app::state::{AppState, Playback};
use crate::app::widgets::{DropDown, Icon, Tip as _, icon_button};
use crate::app::{format, theme};
use crate::scene::Motion;
use bvhscope_engine::follow::Policy;

/// Longest time in seconds by which playing advances at once.
const LONGEST_FRAME: f32 = 0.25;
/// Most clips that are listed without a field that filters them.
const UNFILTERED: usize = 12;
/// Width of the list of clips in points, least and largest, and its share of the strip.
const CLIP_WIDTH: [f32; 2] = [72.0, 160.0];
const CLIP_SHARE: f32 = 0.16;
/// Width of the window in points from which loop and speed have room.
const WIDE: f32 = 560.0;
/// Least width of the slider in points.
const LEAST_SLIDER: f32 = 40.0;
/// The pose without a clip, by its name in lists.
const FILE_POSE: &str = "pose of the file";

/// Goes on playing. Called before the panels, which then all show the same moment.
pub(super) fn play(ui: &Ui, state: &mut AppState) {
    if state.model.playback.playing
        && let Some(mut clock) = state.clock()
    {
        clock.play(ui.input(|input| input.stable_dt).min(LONGEST_FRAME));
        ui.ctx().request_repaint();
    }
}

/// Shows the strip.
pub(super) fn show(ui: &mut Ui, state: &mut AppState, motion: &Arc<Motion>) {
    let is_wide = ui.available_width() >= WIDE;
    ui.horizontal(|ui| {
        ui.set_height(theme::ROW_HEIGHT);
        ui.label(RichText::new("time").color(theme::palette(ui).dim));
        ui.spacing_mut().item_spacing.x = 4.0;
        transport(ui, state, motion);
        ui.add_space(4.0);
        clips(ui, state, motion);
        policy(ui, state);
        ui.add_space(4.0);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if is_wide {
                pace(ui, state);
            }
            scrub(ui, state, motion);
        });
    });
}

/// Buttons that play and step.
fn transport(ui: &mut Ui, state: &mut AppState, motion: &Motion) {
    let (play, name, tip) = if state.model.playback.playing {
        (Icon::Pause, "Pause clip", "Pause the clip: the picture is then refined (Space)")
    } else {
        (Icon::Play, "Play clip", "Play the clip; each frame gets a tree of its own (Space)")
    };
    let rate = format::frame_rate(motion.frame_seconds());
    let back = format!("To the frame before, at {rate} (Shift+Left)");
    let forward = format!("To the next frame, at {rate} (Shift+Right)");
    let buttons = [
        (Icon::Step(false), "Previous frame", back.as_str(), Action::StepFrame(false)),
        (play, name, tip, Action::PlayClip),
        (Icon::Step(true), "Next frame", forward.as_str(), Action::StepFrame(true)),
    ];
    for (icon, name, tip, action) in buttons {
        if square(ui, icon, name, tip).clicked() {
            action.perform(state);
        }
    }
}

fn square(ui: &mut Ui, icon: Icon, name: &str, tip: &str) -> Response {
    let (rect, _) = ui.allocate_exact_size(vec2(theme::ROW_HEIGHT, theme::ROW_HEIGHT), Sense::hover());
    icon_button(ui, rect, icon, name).tip(tip)
}

/// Loop and speed; laid out from the right.
fn pace(ui: &mut Ui, state: &mut AppState) {
    let playback = &mut state.model.playback;
    let speeds = Playback::SPEEDS.map(|speed| (speed, format!("{speed} ×")));
    let tip = "Seconds of the clip in a second. Frames for which there is no time are left out";
    let choices: Vec<_> = speeds.iter().map(|(speed, name)| (*speed, name.as_str(), tip)).collect();
    DropDown::new("Speed of the clip", &choices).width(56.0).show(ui, &mut playback.speed).tip(tip);
    let response = ui.add(Button::new("Loop").selected(playback.looped));
    let on = playback.looped;
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, on, "Loop clip"));
    if response.tip("Begin again after the end of the clip (L)").clicked() {
        playback.looped = !on;
    }
}

/// The slider over the clip, with the time; laid out from the right.
fn scrub(ui: &mut Ui, state: &mut AppState, motion: &Motion) {
    let palette = theme::palette(ui);
    let shown = state.clip().map(|(moment, clip)| (moment, clip.clone()));
    let clip = shown.as_ref().map_or(&motion.clips[0], |(_, clip)| clip).clone();
    let text = match &shown {
        Some((moment, clip)) => format!("{:.2} of {:.2} s", moment.seconds - clip.start, clip.duration()),
        None => format!("– of {:.2} s", clip.duration()),
    };
    let label = ui.add(egui::Label::new(RichText::new(text).color(palette.text)).truncate());
    label.tip("Time since the first key of the clip, and its length");
    let mut seconds = shown.map_or(clip.start, |(moment, _)| moment.seconds);
    ui.spacing_mut().slider_width = (ui.available_width() - 8.0).max(LEAST_SLIDER);
    let can_move = clip.duration() > 0.0;
    let response = ui.add_enabled(can_move, Slider::new(&mut seconds, clip.start..=clip.end).show_value(false));
    response.widget_info(|| WidgetInfo::slider(can_move, f64::from(seconds), "Time"));
    if let Some(mut clock) = state.clock().filter(|_| response.changed()) {
        clock.go_to(seconds);
    }
    response.tip("Drag to any moment of the clip").disabled_tip("This clip is a single moment: nothing moves in it");
}

/// The list of policies by which the tree follows the model.
fn policy(ui: &mut Ui, state: &mut AppState) {
    let refused = Policy::ALL.map(|policy| refused_policy(state, policy));
    let refusal = |policy: Policy| refused[policy as usize].clone();
    let choices = Policy::ALL.map(|policy| (policy, policy.label(), policy.meaning()));
    let width = (ui.available_width() * CLIP_SHARE).clamp(CLIP_WIDTH[0], CLIP_WIDTH[1]);
    let side = state.edited_side();
    if state.wanted.second.is_some() {
        ui.weak(side.name()).tip("The tree that the list beside it is of: the one being edited (4 edits the other)");
    }
    let policy = state.wanted.policy_mut(side);
    let response = DropDown::new("Policy", &choices).exact_width(width).refusing(&refusal).show(ui, policy);
    response.tip("How the tree follows while the model moves; the view Motion (T) compares the policies");
}

/// The name of a clip in lists.
fn name_of(motion: &Motion, clip: usize) -> String {
    let name = motion.clips[clip].name.trim();
    if name.is_empty() { format!("clip {clip}") } else { name.to_owned() }
}

/// The list of clips, of which only those in view are laid out: there may be thousands.
fn clips(ui: &mut Ui, state: &mut AppState, motion: &Arc<Motion>) {
    let chosen = state.clip().map(|(moment, _)| moment.clip);
    let selected = chosen.map_or_else(|| FILE_POSE.to_owned(), |clip| name_of(motion, clip));
    let width = (ui.available_width() * CLIP_SHARE).clamp(CLIP_WIDTH[0], CLIP_WIDTH[1]);
    let list = ComboBox::from_id_salt("clips").width(width).height(420.0).truncate();
    let list = list.close_behavior(PopupCloseBehavior::CloseOnClickOutside).selected_text(selected.clone());
    let response = list.show_ui(ui, |ui| {
        let found = filtered(ui, motion);
        entry(ui, state, FILE_POSE, "Show the model as its nodes and skins are in the file", chosen.is_none(), None);
        let height = ui.spacing().interact_size.y;
        let area = ScrollArea::vertical().id_salt("clips").max_height(320.0);
        area.show_rows(ui, height, found.len(), |ui, rows| {
            for &clip in found.get(rows).unwrap_or_default() {
                let seconds = format::significant(f64::from(motion.clips[clip].duration()));
                let tip = format!("Clip {clip}: {seconds} s");
                entry(ui, state, &name_of(motion, clip), &tip, chosen == Some(clip), Some(clip));
            }
        });
    });
    response.response.widget_info(|| {
        let mut info = WidgetInfo::labeled(Role::ComboBox, true, "Clip");
        info.current_text_value = Some(selected.clone());
        info
    });
    response.response.tip("The clip of the model that is shown");
}

/// A field that filters the clips, where there are many, and the clips that remain.
fn filtered(ui: &mut Ui, motion: &Motion) -> Vec<usize> {
    let all = 0..motion.clips.len();
    if all.len() <= UNFILTERED {
        return all.collect();
    }
    let id = ui.scope_id().with("filter");
    let mut filter: String = ui.data(|data| data.get_temp(id)).unwrap_or_default();
    let hint = format!("Filter {} clips", format::count(all.len() as u64));
    ui.add(TextEdit::singleline(&mut filter).hint_text(hint));
    let wanted = filter.to_lowercase();
    ui.data_mut(|data| data.insert_temp(id, filter));
    all.filter(|&clip| name_of(motion, clip).to_lowercase().contains(&wanted)).collect()
}

/// A clip, or the pose without one, in the list.
fn entry(ui: &mut Ui, state: &mut AppState, name: &str, tip: &str, on: bool, clip: Option<usize>) {
    let response = ui.add(Button::selectable(on, name).truncate()).tip(tip);
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, on, name));
    if let Some(mut clock) = state.clock().filter(|_| response.clicked()) {
        clock.choose_clip(clip);
        ui.close();
    }
}
