//! Menu bar, made from the list of actions, with the model's name and buttons for the panels and the command palette.

use egui::{
    self, Align, Atom, AtomExt as _, Button, Layout, Popup, RichText, Role, ScrollArea, Sense, Ui, WidgetInfo, vec2,
};

use crate::app::commands::{Action, Category, Entry, entries_for};
use crate::app::state::{AppState, Side};
use crate::app::widgets::{Icon, Tip as _, icon_button};
use crate::app::{format, theme};

/// Shows the bar.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    let entries = entries_for(state);
    let palette = theme::palette(ui);
    egui::MenuBar::new().ui(ui, |ui| {
        for category in Category::ALL {
            ui.menu_button(category.label(), |ui| menu(ui, state, category, &entries));
        }
        let menus_end = ui.cursor().left();
        let commands = ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            for (side, action, what) in [
                (Side::Right, Action::ToggleRightPanel, "the settings (F4)"),
                (Side::Left, Action::ToggleLeftPanel, "scene, statistics and selection (F3)"),
            ] {
                let shown = state.shows_panel(side);
                let (rect, _) = ui.allocate_exact_size(vec2(20.0, 20.0), Sense::hover());
                let verb = if shown { "Hide" } else { "Show" };
                let response = icon_button(ui, rect, Icon::Panel(side, shown), &format!("{verb} {what}"));
                if response.tip(format!("{verb} {what}")).clicked() {
                    action.perform(state);
                }
            }
            let button = Button::new(RichText::new("commands").color(palette.dim))
                .shortcut_text("Ctrl+P")
                .frame_when_inactive(false);
            let response = ui.add(button).tip("Find and run any command by typing (Ctrl+P)");
            response.widget_info(|| WidgetInfo::labeled(Role::Button, true, "Commands"));
            if response.clicked() {
                Action::Palette.perform(state);
            }
            response.rect.left()
        });
        title(ui, state, menus_end + 16.0, commands.inner - 16.0);
    });
}

/// Width of a menu in points.
const MENU_WIDTH: f32 = 252.0;
/// Width of a submenu in points: file names may be long.
const SUBMENU_WIDTH: f32 = 300.0;
/// Size of the place in front of each item for its tick, in points.
const TICK: f32 = 12.0;

/// One menu, its groups separated by lines. Scrolls where the window is too low.
fn menu(ui: &mut Ui, state: &mut AppState, category: Category, entries: &[Entry]) {
    let height = ui.ctx().content_rect().bottom() - ui.max_rect().top() - 12.0;
    within(ui, MENU_WIDTH, height, |ui| {
        let entries: Vec<&Entry> = entries.iter().filter(|entry| entry.category == category).collect();
        let place = |entry: &Entry| (entry.group, entry.submenu);
        let mut group = None;
        for run in entries.chunk_by(|a, b| place(a) == place(b)) {
            if group.replace(run[0].group).is_some_and(|before| before != run[0].group) {
                ui.separator();
            }
            if run[0].submenu.is_empty() {
                for entry in run {
                    item(ui, state, entry, &entry.label);
                }
            } else {
                submenu(ui, state, run);
            }
        }
    });
}

/// Content of a menu of a certain width that scrolls where it is higher than `height`.
fn within(ui: &mut Ui, width: f32, height: f32, content: impl FnOnce(&mut Ui)) {
    let height = height.max(80.0);
    ui.set_width(width);
    // Beside the keys, not over them.
    ui.spacing_mut().scroll.floating_allocated_width = 10.0;
    // Menus offer less height than the window has.
    ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        content(ui);
    });
}

/// The entries of a submenu. Its name is left out of their labels.
fn submenu(ui: &mut Ui, state: &mut AppState, entries: &[&Entry]) {
    ui.menu_button((Atom::default().atom_size(vec2(TICK, 0.0)), entries[0].submenu), |ui| {
        let height = ui.ctx().content_rect().height() - 24.0;
        within(ui, SUBMENU_WIDTH, height, |ui| {
            for entry in entries {
                let label = ["Open tree ", "Open "].iter().find_map(|prefix| entry.label.strip_prefix(prefix));
                let label = label.or_else(|| Some(entry.label.split_once(": ")?.1)).unwrap_or(&entry.label);
                item(ui, state, entry, &format::elide_middle(&capitalized(label), 40));
            }
        });
    });
}

fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// An item with a place for its tick in front, so that all labels are aligned.
fn item(ui: &mut Ui, state: &mut AppState, entry: &Entry, label: &str) {
    let on = entry.action.is_on(state);
    let enabled = entry.action.is_enabled(state);
    let space = Atom::default().atom_size(vec2(TICK, 0.0));
    let button = Button::new((space, label.to_owned())).shortcut_text(entry.first_key()).frame_when_inactive(false);
    let response = ui.add_enabled(enabled, button.min_size(vec2(ui.available_width(), 0.0)));
    let response = response.tip(&entry.description);
    if on == Some(true) {
        let color = if enabled { theme::palette(ui).accent } else { theme::palette(ui).dim };
        let center = response.rect.left_center() + vec2(ui.spacing().button_padding.x + TICK * 0.5, 0.0);
        Icon::Tick.paint(ui.painter(), center, color, ui.visuals().window_fill);
    }
    response.widget_info(|| match on {
        Some(on) => WidgetInfo::selected(Role::MenuItemCheckBox, ui.is_enabled(), on, label),
        None => WidgetInfo::labeled(Role::MenuItem, ui.is_enabled(), label),
    });
    if response.clicked() {
        entry.action.perform(state);
        Popup::close_all(ui.ctx());
    }
}

/// Name and triangle count of the model, centred in the bar where they fit between `left` and `right`.
fn title(ui: &Ui, state: &AppState, left: f32, right: f32) {
    let source = state.model.loaded.as_ref().map_or(&state.wanted.source, |scene| &scene.source);
    let mut text = format::elide_middle(&source.label(), 48);
    if let Some(scene) = &state.model.loaded {
        text = format!("{text} · {}", format::counted(scene.triangle_count(), "triangle"));
        if scene.copies.is_some() {
            text = format!("{text} in {} copies", format::count(scene.built_triangles().len() as u64));
        }
    }
    let font = egui::TextStyle::Body.resolve(ui.style());
    let galley = ui.painter().layout_no_wrap(text, font, theme::palette(ui).dim);
    let bar = ui.ctx().content_rect();
    let x = (bar.center().x - galley.size().x * 0.5).max(left);
    if x + galley.size().x <= right {
        let y = ui.max_rect().center().y - galley.size().y * 0.5;
        ui.painter().galley(egui::pos2(x, y), galley, theme::palette(ui).dim);
    }
}
