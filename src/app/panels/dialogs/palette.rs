//! Command palette: finds any action by typing and runs it. The field for the number of a node or triangle.

use egui::{self, Align2, Area, Button, Frame, Id, Key, Modifiers, Order, RichText, ScrollArea, TextEdit, vec2};

use crate::app::commands::{entries_for, go_to, search};
use crate::app::state::AppState;
use crate::app::theme;
use crate::app::widgets::{Tip as _, note_front};

/// Largest width of the palette in points.
const WIDTH: f32 = 520.0;

/// Shows the dialog while it is open.
#[expect(clippy::too_many_lines, reason = "the layout of a dialog")]
pub(crate) fn show(ctx: &egui::Context, state: &mut AppState) {
    let chosen_id = Id::unique("palette chosen");
    let Some(mut query) = state.layout.palette.clone() else {
        ctx.data_mut(|data| data.remove::<usize>(chosen_id));
        return;
    };
    let mut found = search(entries_for(state), &query);
    if !query.trim().is_empty() {
        // Enabled actions first, so that Enter runs one.
        found.sort_by_key(|entry| !entry.action.is_enabled(state));
    }
    let known: Option<usize> = ctx.data(|data| data.get_temp(chosen_id));
    let mut chosen = known.unwrap_or(0);
    let (up, down, enter) = ctx.input_mut(|input| {
        (
            input.count_and_consume_key(Modifiers::NONE, Key::ArrowUp),
            input.count_and_consume_key(Modifiers::NONE, Key::ArrowDown),
            input.consume_key(Modifiers::NONE, Key::Enter),
        )
    });
    chosen = (chosen + down).saturating_sub(up).min(found.len().saturating_sub(1));
    let moved = up + down > 0;
    let mut run = if enter { found.get(chosen).map(|entry| entry.action) } else { None };
    run = run.filter(|action| action.is_enabled(state));
    let screen = ctx.content_rect();
    let width = WIDTH.min(screen.width() - 32.0).max(0.0);
    let area = Area::new(Id::unique("palette"))
        .order(Order::Foreground)
        .anchor(Align2::CENTER_TOP, vec2(0.0, 48.0))
        .accessible_name("Command palette");
    let response = area.show(ctx, |ui| {
        Frame::popup(ui.style()).inner_margin(8).show(ui, |ui| {
            ui.set_width(width);
            let field = TextEdit::singleline(&mut query).hint_text("Type a command").desired_width(f32::INFINITY);
            let field = ui.add(field);
            field.widget_info(|| {
                let mut info = egui::WidgetInfo::text_edit(true, &query, &query, "Type a command");
                info.label = Some("Command".to_owned());
                info
            });
            if known.is_none() {
                field.request_focus();
            }
            if field.changed() {
                chosen = 0;
            }
            ui.add_space(4.0);
            let height = (screen.height() - 180.0).clamp(80.0, 360.0);
            ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(ui, |ui| {
                if found.is_empty() {
                    ui.label(RichText::new("No such command").color(theme::palette(ui).dim));
                }
                for (index, entry) in found.iter().enumerate() {
                    let button = Button::selectable(index == chosen, &entry.label)
                        .shortcut_text(entry.first_key())
                        .min_size(vec2(ui.available_width(), 24.0));
                    let response = ui.add_enabled(entry.action.is_enabled(state), button).tip(&entry.description);
                    if index == chosen && moved {
                        response.scroll_to_me(None);
                    }
                    if response.clicked() {
                        run = Some(entry.action);
                    }
                }
            });
        });
    });
    note_front(ctx, response.response.rect);
    let outside = known.is_some() && response.response.clicked_elsewhere();
    ctx.data_mut(|data| data.insert_temp(chosen_id, chosen));
    state.layout.palette = if run.is_some() || outside { None } else { Some(query) };
    if let Some(action) = run {
        action.perform(state);
    }
}

/// Shows the field for a number while it is open.
pub(crate) fn show_go_to(ctx: &egui::Context, state: &mut AppState) {
    let Some((mut text, mut fault)) = state.layout.go_to.clone() else { return };
    let enter = ctx.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Enter));
    let area = Area::new(Id::unique("go to"))
        .order(Order::Foreground)
        .anchor(Align2::CENTER_TOP, vec2(0.0, 48.0))
        .accessible_name("Go to node or triangle");
    let is_new = !ctx.memory(|memory| memory.areas().is_visible(&area.layer()));
    let response = area.show(ctx, |ui| {
        Frame::popup(ui.style()).inner_margin(8).show(ui, |ui| {
            ui.set_width(WIDTH.min(ctx.content_rect().width() - 32.0).max(0.0) * 0.7);
            let hint = "Number of a node, or of a triangle: 123, node 123, triangle 45, t45";
            let field = ui.add(TextEdit::singleline(&mut text).hint_text(hint).desired_width(f32::INFINITY));
            field.widget_info(|| {
                let mut info = egui::WidgetInfo::text_edit(true, &text, &text, hint);
                info.label = Some("Number".to_owned());
                info
            });
            field.request_focus();
            if field.changed() {
                fault.clear();
            }
            let palette = theme::palette(ui);
            let (line, color) = if fault.is_empty() {
                ("Enter selects and frames it, Esc closes", palette.dim)
            } else {
                (fault.as_str(), palette.warning)
            };
            ui.add(egui::Label::new(RichText::new(line).color(color)).wrap());
        });
    });
    note_front(ctx, response.response.rect);
    let outside = !is_new && response.response.clicked_elsewhere();
    state.layout.go_to = Some((text.clone(), fault)).filter(|_| !outside);
    if enter {
        state.layout.go_to = go_to(state, &text).err().map(|fault| (text, fault));
    }
}
