//! Size of the window.

/// Minimum width and height of the window in points.
pub(crate) const MIN_SIZE: [f32; 2] = [640.0, 400.0];
/// Width and height of the window at first start in points.
pub(crate) const DEFAULT_SIZE: [f32; 2] = [1280.0, 800.0];

/// Corrects a restored size in the first UI frame. Not every desktop enforces the minimum size, and a window that is larger
/// than the driver's largest texture cannot be drawn.
pub(crate) fn correct_on_first_frame(ctx: &egui::Context) {
    if ctx.cumulative_frame_nr() != 1 {
        return;
    }
    let max_side = ctx.input(|input| input.max_texture_side) as f32 / ctx.pixels_per_point();
    ctx.send_viewport_cmd(egui::ViewportCommand::MaxInnerSize(egui::Vec2::splat(max_side)));
    let size = ctx.input(|input| input.viewport().inner_rect.map(|rect| rect.size()));
    let too_small = size.is_some_and(|size| size.x < MIN_SIZE[0] * 0.5 || size.y < MIN_SIZE[1] * 0.5);
    if too_small {
        ctx.send_viewport_cmd(egui::ViewportCommand::InnerSize(egui::Vec2::from(DEFAULT_SIZE)));
    }
}
