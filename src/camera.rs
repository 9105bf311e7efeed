//! The camera: the ray through a pixel, and the same camera as a matrix for the overlay.
//!
//! Right-handed, looking along `target - eye`. Depth is infinite reverse-Z as wgpu wants it, so `clip.w` of a projected
//! point is its linear view depth.

use glam::{Mat4, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::geometry::{Aabb, Ray};

/// How points are brought onto the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Projection {
    /// Rays meet in the eye.
    Perspective,
    /// Rays are parallel; the height of the view is what perspective shows at the target's distance.
    Orthographic,
}

/// Where the picture is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Where the observer is, in world units.
    pub eye: Vec3,
    /// The point in the middle of the picture, around which the observer orbits.
    pub target: Vec3,
    /// What is up in the picture; need not be perpendicular to the view direction.
    pub up: Vec3,
    /// Vertical opening angle in radians.
    pub fov_y: f32,
    /// Perspective or orthographic.
    pub projection: Projection,
}

/// A camera's axes for one picture size, computed once for many rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraFrame {
    camera: Camera,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    /// Half the width and height of the image plane at distance 1 (perspective) or in world units (orthographic).
    half: Vec2,
    width_px: f32,
    height_px: f32,
}

/// Default vertical opening angle: 45 degrees.
pub const DEFAULT_FOV_Y: f32 = std::f32::consts::FRAC_PI_4;

impl Camera {
    /// The documented default camera of a model, the same in the window and on the command line: perspective, 45° high,
    /// looking at the middle of `bounds` from the direction (0.5, 0.35, 1) of a y-up world (turned accordingly for
    /// another `up`), far enough for the bounding sphere to fit into the height of the picture.
    pub fn framing(bounds: &Aabb, up: Vec3) -> Self {
        let mut camera =
            Self { eye: Vec3::Z, target: Vec3::ZERO, up, fov_y: DEFAULT_FOV_Y, projection: Projection::Perspective };
        let side = if up.y.abs() > 0.5 { Vec3::Z } else { Vec3::NEG_Y };
        let right = up.cross(side).normalize_or(Vec3::X);
        camera.eye = (right * 0.5 + up * 0.35 + side).normalize();
        camera.frame(bounds);
        camera
    }

    /// Moves along the view direction so that `bounds` fills the picture. Keeps the direction; an empty or flat box gives
    /// a finite camera all the same.
    pub fn frame(&mut self, bounds: &Aabb) {
        let (center, radius) = if bounds.is_empty() || !(bounds.extent().is_finite()) {
            (Vec3::ZERO, 1.0)
        } else {
            (bounds.center(), (bounds.extent().length() * 0.5).max(1e-6))
        };
        let backward = (self.eye - self.target).normalize_or(Vec3::Z);
        let distance = radius / (self.fov_y.clamp(0.01, 3.0) * 0.5).sin();
        self.target = center;
        self.eye = center + backward * distance;
    }

    /// Unit vector of the view direction.
    pub fn forward(&self) -> Vec3 {
        (self.target - self.eye).normalize_or(Vec3::NEG_Z)
    }

    /// Distance from the eye to the target.
    pub fn distance(&self) -> f32 {
        (self.target - self.eye).length()
    }

    /// The camera's axes for a picture of this size in pixels (at least 1×1).
    pub fn for_size(&self, width_px: u32, height_px: u32) -> CameraFrame {
        let forward = self.forward();
        let mut right = forward.cross(self.up);
        if right.length_squared() < 1e-12 {
            right = forward.any_orthogonal_vector();
        }
        let right = right.normalize();
        let up = right.cross(forward);
        let (width_px, height_px) = (width_px.max(1) as f32, height_px.max(1) as f32);
        let tan = (self.fov_y.clamp(0.001, 3.1) * 0.5).tan();
        let half_height = match self.projection {
            Projection::Perspective => tan,
            Projection::Orthographic => tan * self.distance().max(1e-9),
        };
        let half = Vec2::new(half_height * width_px / height_px, half_height);
        CameraFrame { camera: *self, right, up, forward, half, width_px, height_px }
    }
}

impl CameraFrame {
    /// The ray through the point (x, y) of the picture in pixels, y down; a pixel's centre is at +0.5. Its direction has
    /// unit length.
    pub fn ray(&self, x_px: f32, y_px: f32) -> Ray {
        let across = self.right * ((x_px / self.width_px * 2.0 - 1.0) * self.half.x);
        let along = self.up * ((1.0 - y_px / self.height_px * 2.0) * self.half.y);
        match self.camera.projection {
            Projection::Perspective => Ray::new(self.camera.eye, (self.forward + across + along).normalize()),
            // Starting far behind the eye, so that zooming in never cuts the model open.
            Projection::Orthographic => {
                let back = self.forward * self.ortho_offset();
                Ray::new(self.camera.eye + across + along - back, self.forward)
            }
        }
    }

    /// How far behind the eye orthographic rays start, in world units; zero in perspective.
    pub fn ortho_offset(&self) -> f32 {
        match self.camera.projection {
            Projection::Perspective => 0.0,
            Projection::Orthographic => self.camera.distance() * 64.0,
        }
    }

    /// World space to clip space in wgpu's convention (y up, z in 0..1, reverse infinite depth). In perspective, `clip.w` is
    /// the linear view depth.
    pub fn clip_from_world(&self) -> Mat4 {
        match self.camera.projection {
            Projection::Perspective => {
                let near = (self.camera.distance() * 1e-4).max(1e-9);
                let fov_y = self.camera.fov_y.clamp(0.001, 3.1);
                glam::camera::rh::proj::directx::perspective_infinite_reverse(
                    fov_y,
                    self.width_px / self.height_px,
                    near,
                ) * self.view_from_world()
            }
            Projection::Orthographic => {
                let far = self.ortho_offset().max(1e-9);
                // Maps view z = +far (behind the eye) to 1 and z = -far to 0.
                let scale = Mat4::from_cols(
                    glam::Vec4::new(1.0 / self.half.x, 0.0, 0.0, 0.0),
                    glam::Vec4::new(0.0, 1.0 / self.half.y, 0.0, 0.0),
                    glam::Vec4::new(0.0, 0.0, 0.5 / far, 0.0),
                    glam::Vec4::new(0.0, 0.0, 0.5, 1.0),
                );
                scale * self.view_from_world()
            }
        }
    }

    /// World space to view space: x right, y up, z towards the observer.
    pub fn view_from_world(&self) -> Mat4 {
        let eye = self.camera.eye;
        let (r, u, b) = (self.right, self.up, -self.forward);
        Mat4::from_cols(
            glam::Vec4::new(r.x, u.x, b.x, 0.0),
            glam::Vec4::new(r.y, u.y, b.y, 0.0),
            glam::Vec4::new(r.z, u.z, b.z, 0.0),
            glam::Vec4::new(-r.dot(eye), -u.dot(eye), -b.dot(eye), 1.0),
        )
    }

    /// Linear view depth of the point at distance `t` along `ray`: its distance from the eye along the view direction.
    pub fn view_depth(&self, ray: &Ray, t: f32) -> f32 {
        (ray.at(t) - self.camera.eye).dot(self.forward)
    }

    /// The camera that this was made from.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Half the width and height of the image plane: at distance 1 in perspective, in world units in orthographic.
    pub fn half_extent(&self) -> Vec2 {
        self.half
    }

    /// Unit axes of the picture in world space: right, up, forward.
    pub fn axes(&self) -> (Vec3, Vec3, Vec3) {
        (self.right, self.up, self.forward)
    }
}
