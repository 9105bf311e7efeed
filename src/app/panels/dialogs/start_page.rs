//! Dialog "Open a model": built-in scenes, recent files, and the file dialog. For a tree file, the field for its path alone.

use std::sync::Arc;

use egui::{
    self, Align2, ColorImage, CornerRadius, FontId, Id, Rect, Response, RichText, Role, ScrollArea, Sense, Stroke,
    StrokeKind, TextureHandle, TextureOptions, Ui, WidgetInfo, pos2, vec2,
};

use crate::app::commands::Action;
use crate::app::panels::dialogs::path_field;
use crate::app::state::{AppState, Request, Severity, THUMBNAIL_SIZE, Thumbnail};
use crate::app::widgets::Tip as _;
use crate::app::{format, theme};
use crate::scene::{BUILTIN_SCENES, SceneSource, format_names};
use crate::text::file_name;

/// Smallest width of a card in points.
const MIN_CARD_WIDTH: f32 = 132.0;

/// Shows the dialog while it is open.
pub(crate) fn show(ctx: &egui::Context, state: &mut AppState) {
    if !state.layout.start_page_open {
        return;
    }
    let mut open = true;
    let mut chosen = None;
    let mut path = None;
    let tree = state.layout.path_field.tree;
    let title = match tree {
        Some(_) => format!("Open a tree of {}", state.wanted.source.label()),
        None => "Open a model".to_owned(),
    };
    super::dialog(ctx, &title, [620.0, 560.0], &mut open, |ui| {
        path = path_field::show(ui, state);
        if tree.is_some() {
            return;
        }
        ui.add_space(4.0);
        ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| content(ui, state, &mut chosen));
    });
    state.layout.start_page_open = open;
    if let Some(path) = path {
        state.layout.start_page_open = false;
        match tree {
            Some(side) => state.activity.requests.push(Request::OpenTree(side, path)),
            // The same names as on the command line.
            None => match SceneSource::parse(path.as_os_str()) {
                Ok(source) => state.activity.requests.push(Request::Open(source)),
                Err(error) => state.messages.notify(Severity::Error, error),
            },
        }
    }
    if !state.layout.start_page_open {
        state.layout.path_field.tree = None;
    }
    if let Some(action) = chosen {
        state.layout.start_page_open = false;
        Action::perform(action, state);
    }
}

fn content(ui: &mut Ui, state: &AppState, chosen: &mut Option<Action>) {
    let dim = theme::palette(ui).dim;
    ui.horizontal_wrapped(|ui| {
        let formats = format_names("or");
        if ui.button("Open a file…").tip(format!("{formats} (Ctrl+O)")).clicked() {
            *chosen = Some(Action::Open);
        }
        ui.label(RichText::new(format!("or drop an {formats} file on the window")).color(dim));
    });
    if !state.preferences.recent.is_empty() {
        heading(ui, "RECENT");
        let recent = state.preferences.recent.iter().enumerate().map(|(index, path)| Card {
            source: SceneSource::File(path.clone()),
            name: file_name(path).into_owned(),
            tip: format!("Open {}; the present scene stays until the new one is built", path.display()),
            action: Action::OpenRecent(index),
        });
        cards(ui, state, recent.collect(), chosen);
    }
    heading(ui, "BUILT IN");
    let builtin = BUILTIN_SCENES.iter().enumerate().map(|(index, scene)| Card {
        source: SceneSource::Builtin { name: scene.name.to_owned(), size: None },
        name: scene.label.to_owned(),
        tip: format!("{}. The present scene stays until the new one is built", scene.description),
        action: Action::OpenBuiltin(index),
    });
    cards(ui, state, builtin.collect(), chosen);
}

/// A model that is offered.
struct Card {
    source: SceneSource,
    name: String,
    tip: String,
    action: Action,
}

/// Cards in rows of equal widths.
fn cards(ui: &mut Ui, state: &AppState, cards: Vec<Card>, chosen: &mut Option<Action>) {
    let gap = 12.0;
    let columns = ((ui.available_width() + gap) / (MIN_CARD_WIDTH + gap)).floor().max(1.0);
    let width = (ui.available_width() - gap * (columns - 1.0)) / columns;
    ui.spacing_mut().item_spacing = vec2(gap, 8.0);
    for row in cards.chunks(columns as usize) {
        ui.horizontal_top(|ui| {
            for Card { source, name, tip, action } in row {
                let shown = format::elide_middle(name, (width / 7.0) as usize);
                let thumbnail = state.layout.thumbnails.get(source);
                if card(ui, width, &source.to_string(), &shown, thumbnail).tip(tip).clicked() {
                    *chosen = Some(*action);
                }
            }
        });
    }
}

fn heading(ui: &mut Ui, text: &str) {
    ui.add_space(12.0);
    ui.label(RichText::new(text).heading().color(theme::palette(ui).dim));
    ui.add_space(4.0);
}

/// Height of the name below the picture in points.
const NAME_HEIGHT: f32 = 22.0;

/// A texture with the thumbnail that it was made of.
type Loaded = (Arc<Thumbnail>, TextureHandle);

/// Shows a card of a width in points. `key` identifies the model.
pub(super) fn card(ui: &mut Ui, width: f32, key: &str, name: &str, thumbnail: Option<&Arc<Thumbnail>>) -> Response {
    let palette = theme::palette(ui);
    let [x, y] = THUMBNAIL_SIZE.map(|side| side as f32);
    let picture_height = width * y / x;
    let (rect, response) = ui.allocate_exact_size(vec2(width, picture_height + NAME_HEIGHT), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, ui.is_enabled(), name));
    let picture = Rect::from_min_size(rect.min, vec2(width, picture_height));
    ui.painter().rect_filled(picture, CornerRadius::same(4), ui.visuals().extreme_bg_color);
    if let Some(thumbnail) = thumbnail {
        let texture = texture(ui, key, thumbnail);
        let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        ui.painter().image(texture.id(), picture, uv, egui::Color32::WHITE);
    }
    let hot = response.hovered() || response.has_focus();
    let color = if hot { palette.accent } else { palette.line };
    ui.painter().rect_stroke(picture, CornerRadius::same(4), Stroke::new(1.0, color), StrokeKind::Outside);
    let text_color = if hot { ui.visuals().strong_text_color() } else { palette.text };
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    let at = pos2(rect.left(), picture.bottom() + NAME_HEIGHT * 0.5);
    painter.text(at, Align2::LEFT_CENTER, name, FontId::proportional(theme::VALUE_SIZE), text_color);
    response
}

/// The texture of a thumbnail, made once.
fn texture(ui: &Ui, key: &str, thumbnail: &Arc<Thumbnail>) -> TextureHandle {
    let id = Id::unique(("thumbnail", key));
    let known: Option<Loaded> = ui.data(|data| data.get_temp(id));
    if let Some((_, texture)) = known.filter(|(of, _)| Arc::ptr_eq(of, thumbnail)) {
        return texture;
    }
    let size = THUMBNAIL_SIZE.map(|side| side as usize);
    let image = ColorImage::from_rgba_unmultiplied(size, thumbnail.rgba.as_flattened());
    let texture = ui.ctx().load_texture(key, image, TextureOptions::LINEAR);
    ui.data_mut(|data| data.insert_temp(id, (Arc::clone(thumbnail), texture.clone())));
    texture
}
