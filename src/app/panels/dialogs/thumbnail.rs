//! A card with the thumbnail of a model and its name.

use std::sync::Arc;

use egui::{
    Align2, ColorImage, CornerRadius, FontId, Id, Rect, Response, Role, Sense, Stroke, StrokeKind, TextureHandle,
    TextureOptions, Ui, WidgetInfo, pos2, vec2,
};

use crate::app::state::{THUMBNAIL_SIZE, Thumbnail};
use crate::app::theme;

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
