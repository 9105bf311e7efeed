//! Conversions between the window's points, the picture's pixels and points of the scene.

use egui::{PaintCallbackInfo, Pos2, Rect};
use glam::Vec3;

use super::picking;
use crate::app::state::AppState;
use crate::camera::Camera;

/// A rectangle in points as x, y, width and height in pixels of a screen of `screen_size_px`.
pub(crate) fn rect_px(rect: Rect, pixels_per_point: f32, screen_size_px: [u32; 2]) -> [u32; 4] {
    let info = PaintCallbackInfo { viewport: rect, clip_rect: rect, pixels_per_point, screen_size_px };
    let px = info.viewport_in_pixels();
    [px.left_px.max(0) as u32, px.top_px.max(0) as u32, px.width_px.max(0) as u32, px.height_px.max(0) as u32]
}

/// The pixel of the picture under a point of the window; `scale` is in pixels per point, `rect` the viewport's rectangle.
pub(crate) fn pixel_at(at: Pos2, rect: Rect, scale: f32, size_px: [u32; 2]) -> [u32; 2] {
    let inside = (at - rect.min) * scale;
    [(inside.x.max(0.0) as u32).min(size_px[0].max(1) - 1), (inside.y.max(0.0) as u32).min(size_px[1].max(1) - 1)]
}

/// Camera of the presented picture; the wanted one before the first picture.
pub(crate) fn shown_camera(state: &AppState) -> Camera {
    state.model.presented.as_ref().map_or(state.wanted.camera, |presented| presented.frame.camera)
}

/// The surface point that a pixel shows; on the background, the point of its ray at the depth of the camera's target.
pub(crate) fn point_at([x, y]: [u32; 2], state: &AppState) -> Vec3 {
    if let Some(point) = state.model.presented.as_ref().and_then(|shown| picking::surface_point(&shown.frame, x, y)) {
        return point;
    }
    let camera = shown_camera(state);
    let view = camera.for_size(state.layout.viewport_px[0], state.layout.viewport_px[1]);
    let ray = view.ray(x as f32 + 0.5, y as f32 + 0.5);
    let ahead = ray.direction.dot(camera.forward()).max(1e-3);
    ray.at((camera.target - ray.origin).dot(camera.forward()) / ahead)
}
