//! The frame of the windows in the middle: title, close button, a size that fits the smallest screen.

use eframe::egui::{Align2, Context, Ui, Window, vec2};

/// Shows `content` under `title`, at most `width` and `height` points large, until the close button clears `open`.
pub(crate) fn show(
    ctx: &Context,
    title: &str,
    [width, height]: [f32; 2],
    open: &mut bool,
    content: impl FnOnce(&mut Ui),
) {
    let screen = ctx.content_rect();
    let size = vec2(width.min(screen.width() - 48.0).max(0.0), height.min(screen.height() - 96.0).max(0.0));
    Window::new(title)
        .open(open)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .fixed_size(size)
        .collapsible(false)
        .resizable(false)
        .show(ctx, content);
}
