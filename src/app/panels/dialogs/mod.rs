//! The windows in the window: command palette, start page, help, message log, about. Each is centred, with title and
//! close button, and no larger than the screen.

pub(super) mod help;
pub(super) mod palette;
mod path_field;
pub(super) mod start_page;

use egui::{Align2, Context, Ui, Window, vec2};

use crate::app::widgets::note_front;

/// Shows `content` in a window of at most `width` × `height` points while `open` is set; the close button clears it.
pub(crate) fn dialog(
    ctx: &Context,
    title: &str,
    [width, height]: [f32; 2],
    open: &mut bool,
    content: impl FnOnce(&mut Ui),
) {
    let screen = ctx.content_rect();
    let size = vec2(width.min(screen.width() - 48.0).max(0.0), height.min(screen.height() - 96.0).max(0.0));
    let shown = Window::new(title)
        .open(open)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .fixed_size(size)
        .collapsible(false)
        .resizable(false)
        .show(ctx, content);
    if let Some(shown) = shown {
        note_front(ctx, shown.response.rect);
    }
}
