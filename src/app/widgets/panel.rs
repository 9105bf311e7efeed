//! Parts of a panel: frame, scroll area, collapsible sections, and the line where there is nothing to show.

use std::collections::BTreeMap;

use egui::collapsing_header::{CollapsingState, paint_default_icon};
use egui::{
    self, Align2, Button, Context, Frame, Id, Margin, Rect, RichText, Role, ScrollArea, Sense, Stroke, TextStyle, Ui,
    WidgetInfo, pos2, vec2,
};

use super::icon::{Icon, icon_button};
use super::tip::Tip as _;
use crate::app::theme;
use crate::app::theme::ROW_HEIGHT;

/// Frame of a panel: margins without a fill, because the window is cleared with the panels' colour.
pub(crate) fn panel_frame(margin: Margin) -> Frame {
    Frame::new().inner_margin(margin)
}

/// Shows the content of a side panel in a vertical scroll area. Its bar lies in the margin, so that the content keeps its width.
pub(crate) fn scroll(ui: &mut Ui, id: &str, content: impl FnOnce(&mut Ui)) {
    ui.spacing_mut().scroll.floating_allocated_width = 0.0;
    ScrollArea::vertical()
        .id_salt(id)
        .auto_shrink(false)
        .content_margin(Margin { left: 12, right: 12, top: 0, bottom: 8 })
        .show(ui, content);
}

/// Contents of a section's header besides its title.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Header<'a> {
    /// Accessible name of the section; its title where empty.
    pub(crate) name: &'a str,
    /// Value shown at the right end.
    pub(crate) summary: &'a str,
    /// Whether the section is collapsed until the user expands it.
    pub(crate) folded: bool,
    /// Tooltip of the button that resets the section's settings; `None` for no button.
    pub(crate) reset: Option<&'a str>,
}

/// Shows a collapsible section. Returns whether its reset button was clicked.
pub(crate) fn section(ui: &mut Ui, title: &str, header: Header<'_>, body: impl FnOnce(&mut Ui)) -> bool {
    let palette = theme::palette(ui);
    let name = if header.name.is_empty() { sentence_case(title) } else { header.name.to_owned() };
    let id = section_id(&name);
    let mut state = CollapsingState::load_with_default_open(ui.ctx(), id, !header.folded);
    ui.add_space(4.0);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW_HEIGHT), Sense::click());
    let response = response.tip(if state.is_open() { "Collapse this section" } else { "Expand this section" });
    if response.clicked() {
        state.toggle(ui);
    }
    let open = state.is_open();
    note_section(ui.ctx(), &name, open);
    response.widget_info(|| WidgetInfo::selected(Role::DisclosureTriangle, true, open, format!("{name} section")));
    let color = if response.hovered() { ui.visuals().strong_text_color() } else { palette.dim };
    let icon = response
        .clone()
        .with_new_rect(Rect::from_center_size(pos2(rect.left() + 4.0, rect.center().y), vec2(8.0, 8.0)));
    paint_default_icon(ui, state.openness(ui.ctx()), &icon);
    let font = TextStyle::Heading.resolve(ui.style());
    ui.painter().text(pos2(rect.left() + 16.0, rect.center().y), Align2::LEFT_CENTER, title, font, color);
    let mut right = rect.right();
    let mut reset_pressed = false;
    if let Some(tip) = header.reset {
        let button = Rect::from_min_max(pos2(right - ROW_HEIGHT, rect.top()), rect.max);
        let name = format!("Reset {}", name.to_lowercase());
        reset_pressed = icon_button(ui, button, Icon::Reset, &name).tip(tip).clicked();
        right -= ROW_HEIGHT + 4.0;
    }
    if !header.summary.is_empty() {
        let font = TextStyle::Body.resolve(ui.style());
        ui.painter().text(pos2(right, rect.center().y), Align2::RIGHT_CENTER, header.summary, font, palette.text);
    }
    state.show_body_unindented(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 4.0;
        body(ui);
    });
    ui.add_space(4.0);
    let (line, _) = ui.allocate_exact_size(vec2(ui.available_width(), 1.0), Sense::hover());
    ui.painter().hline(line.x_range(), line.center().y, Stroke::new(1.0, palette.line));
    reset_pressed
}

/// Rows that are rarely needed, folded below a button "More". `name` tells them apart from those of other sections.
pub(crate) fn more(ui: &mut Ui, name: &str, body: impl FnOnce(&mut Ui)) {
    let name = format!("More of {name}");
    let mut state = CollapsingState::load_with_default_open(ui.ctx(), section_id(&name), false);
    let open = state.is_open();
    let text = RichText::new(if open { "Less" } else { "More" }).color(theme::palette(ui).dim);
    let response = ui.add(Button::new(text).frame_when_inactive(false));
    response.widget_info(|| WidgetInfo::selected(Role::DisclosureTriangle, true, open, &name));
    if response.tip("Settings that are rarely needed").clicked() {
        state.toggle(ui);
    }
    note_section(ui.ctx(), &name, state.is_open());
    state.show_body_unindented(ui, body);
}

fn sentence_case(title: &str) -> String {
    let mut chars = title.chars();
    chars
        .next()
        .map_or_else(String::new, |first| first.to_uppercase().chain(chars.flat_map(char::to_lowercase)).collect())
}

fn section_id(name: &str) -> Id {
    Id::unique(("section", name))
}

/// Where the open state of all sections is kept until [`sections`] takes it.
fn known_id() -> Id {
    Id::unique("known sections")
}

fn note_section(ctx: &Context, name: &str, open: bool) {
    ctx.data_mut(|data| {
        data.get_temp_mut_or_default::<BTreeMap<String, bool>>(known_id()).insert(name.to_owned(), open);
    });
}

/// Expands or collapses sections as the user left them in the last run, by name; once a context.
pub(crate) fn restore_sections(ctx: &Context, open: &BTreeMap<String, bool>) {
    let restored = Id::unique("sections restored");
    if ctx.data_mut(|data| std::mem::replace(data.get_temp_mut_or_default::<bool>(restored), true)) {
        return;
    }
    for (name, open) in open {
        let mut state = CollapsingState::load_with_default_open(ctx, section_id(name), *open);
        state.set_open(*open);
        state.store(ctx);
    }
}

/// The sections shown so far by name, and whether each is expanded.
pub(crate) fn sections(ctx: &Context) -> BTreeMap<String, bool> {
    ctx.data(|data| data.get_temp(known_id())).unwrap_or_default()
}

/// Shows what to do so that the view has something to show.
pub(crate) fn empty_view(ui: &mut Ui, text: &str) {
    let text = RichText::new(text).color(theme::palette(ui).dim);
    ui.centered_and_justified(|ui| ui.add(egui::Label::new(text).wrap().selectable(false)));
}
