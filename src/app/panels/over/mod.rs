//! Everything painted over the viewport: legends, axes gizmo, facts of the hovered pixel, messages. [`Projected`] projects
//! points of the scene to points of the window.

pub(super) mod compare;
pub(super) mod guides;
pub(super) mod handles;
pub(super) mod hints;
pub(super) mod legend;
pub(super) mod lines;
pub(super) mod messages;
pub(super) mod pointer;

use egui::{Pos2, Rect, vec2};
use glam::Vec3;

use crate::camera::{Camera, CameraFrame, Projection};

/// The picture's camera over a rectangle of the window.
struct Projected {
    camera: Camera,
    frame: CameraFrame,
    rect: Rect,
}

impl Projected {
    fn new(camera: Camera, rect: Rect) -> Self {
        Self { camera, frame: camera.for_size(rect.width() as u32, rect.height() as u32), rect }
    }

    /// Where a point is; `None` behind the eye.
    fn place(&self, point: Vec3) -> Option<Pos2> {
        let clip = self.frame.clip_from_world() * point.extend(1.0);
        let ahead = self.camera.projection == Projection::Orthographic || clip.w > self.camera.distance() * 1e-3;
        let [x, y] = [clip.x / clip.w, clip.y / clip.w];
        let at = self.rect.center() + vec2(x * self.rect.width(), -y * self.rect.height()) * 0.5;
        (ahead && at.is_finite()).then_some(at)
    }

    /// Distance of a point from the eye along the view direction.
    fn depth(&self, point: Vec3) -> f32 {
        (point - self.camera.eye).dot(self.camera.forward())
    }

    /// Size of a point of the window at a point of the scene, in world units.
    fn pixel_size(&self, point: Vec3) -> f32 {
        self.frame.pixel_size(self.depth(point).max(1e-12))
    }
}
