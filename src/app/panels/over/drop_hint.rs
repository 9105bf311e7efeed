//! While files hover over the window: what dropping them will do.

use egui::{Align2, CornerRadius, FontId, Rect, Stroke, StrokeKind, Ui, vec2};

use crate::app::{format, theme};
use crate::scene::{FileFormat, format_names};

/// Longest file name shown, in characters.
const MAX_NAME: usize = 48;

/// Shows it within `rect`, the viewport's rectangle.
pub(crate) fn show(ui: &Ui, rect: Rect) {
    let paths: Vec<_> = ui.input(|input| input.raw.hovered_files.iter().map(|file| file.path.clone()).collect());
    if paths.is_empty() {
        return;
    }
    let known = |path: &&Option<std::path::PathBuf>| {
        path.as_deref().is_some_and(|path| FileFormat::from_extension(path).is_some())
    };
    let chosen = paths.iter().find(known).or(paths.first()).and_then(Option::as_deref);
    let name = chosen.and_then(|path| path.file_name()).map(|name| name.to_string_lossy().into_owned());
    let is_model = chosen.is_some_and(|path| FileFormat::from_extension(path).is_some());
    let text = match &name {
        Some(name) => format!("Drop to open {}", format::elide_middle(name, MAX_NAME)),
        None => "Drop to open this file".to_owned(),
    };
    let below = if name.is_some() && !is_model {
        format!("Its name is not one of a model: {} are read", format_names("and"))
    } else if paths.len() > 1 {
        format!("The first model of {} files; the others stay closed", paths.len())
    } else {
        "The present model stays until the new one is ready".to_owned()
    };
    let palette = theme::palette(ui);
    let frame = rect.shrink(8.0);
    let painter = ui.painter();
    painter.rect_filled(frame, CornerRadius::same(8), palette.veil);
    painter.rect_stroke(frame, CornerRadius::same(8), Stroke::new(2.0, palette.accent), StrokeKind::Inside);
    let center = frame.center();
    painter.text(center - vec2(0.0, 4.0), Align2::CENTER_BOTTOM, text, FontId::proportional(18.0), palette.text);
    painter.text(
        center + vec2(0.0, 6.0),
        Align2::CENTER_TOP,
        below,
        FontId::proportional(theme::VALUE_SIZE),
        palette.dim,
    );
}
