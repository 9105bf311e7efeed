//! The camera: primary rays for tracing and the matching matrix for the overlay.
//!
//! Right-handed, looking along `target - eye`. Depth is infinite reverse-Z as wgpu wants it, so `clip.w` of a projected
//! point is its linear view depth.

use glam::{Mat4, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::vectors::{direction, length};
use bvhscope_engine::geometry::{Aabb, Ray};

/// How points are projected onto the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Projection {
    /// All rays start at the eye.
    Perspective,
    /// Rays are parallel; the view is as high as the perspective one is at the target's distance.
    Orthographic,
}

/// Position, orientation and projection of the observer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Position of the observer in world units.
    pub eye: Vec3,
    /// The point at the centre of the picture and of orbiting.
    pub target: Vec3,
    /// The up direction; need not be perpendicular to the view direction.
    pub up: Vec3,
    /// Vertical field of view in radians.
    pub fov_y: f32,
    /// Perspective or orthographic.
    pub projection: Projection,
}

/// A camera's basis for one picture size, computed once for many rays.
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

/// Default vertical field of view in radians: 45 degrees.
pub const DEFAULT_FOV_Y: f32 = std::f32::consts::FRAC_PI_4;

/// Distance of the target, in an orthographic view, below which its reciprocal would leave the range of single precision.
const LEAST_DISTANCE: f32 = 1e-31;

impl Camera {
    /// The camera moved, without a turn.
    #[must_use]
    pub fn shifted(self, shift: Vec3) -> Self {
        Self { eye: self.eye + shift, target: self.target + shift, ..self }
    }

    /// The default camera of a model that is seen from outside: perspective with a field of view of 45°, looking at the centre of
    /// `bounds` from the direction (0.5, 0.35, 1) of a y-up world (rotated accordingly for another `up`), at
    /// the distance at which the box fills 90 % of a square picture ([`Camera::frame`]).
    ///
    /// ```
    /// use bvhscope::camera::Camera;
    /// use bvhscope_engine::geometry::Aabb;
    /// use glam::Vec3;
    ///
    /// let bounds = Aabb { min: Vec3::splat(-1.0), max: Vec3::ONE };
    /// let camera = Camera::framing(&bounds, Vec3::Y);
    /// let ray = camera.for_size(800, 600).ray(400.0, 300.0);
    /// assert_eq!(camera.target, Vec3::ZERO);
    /// assert!((ray.at(camera.distance()) - camera.target).length() < 1e-3);
    /// ```
    pub fn framing(bounds: &Aabb, up: Vec3) -> Self {
        let mut camera =
            Self { eye: Vec3::Z, target: Vec3::ZERO, up, fov_y: DEFAULT_FOV_Y, projection: Projection::Perspective };
        let side = if up.y.abs() > 0.5 { Vec3::Z } else { Vec3::NEG_Y };
        let right = up.cross(side).normalize_or(Vec3::X);
        camera.eye = (right * 0.5 + up * 0.35 + side).normalize();
        camera.frame(bounds);
        camera
    }

    /// Moves along the view direction until `bounds` fills 90 % of a square picture; a wider picture has margins at its sides.
    /// Keeps the direction. The camera stays finite for empty and flat boxes.
    pub fn frame(&mut self, bounds: &Aabb) {
        self.frame_in(bounds, 1.0);
    }

    /// The same in a picture of this ratio of width to height: one that is narrower than high is filled to 90 % of its width.
    pub fn frame_in(&mut self, bounds: &Aabb, aspect: f32) {
        let usable = !bounds.is_empty() && bounds.extent().is_finite();
        let (center, half_extent) =
            if usable { (bounds.center(), bounds.extent() * 0.5) } else { (Vec3::ZERO, Vec3::ONE) };
        let backward = direction(self.eye - self.target).unwrap_or(Vec3::Z);
        let right = self.up.cross(backward).try_normalize().unwrap_or_else(|| backward.any_orthonormal_vector());
        let up = backward.cross(right);
        let tan = (self.fov_y.clamp(0.01, 3.0) * 0.5).tan() * 0.9;
        let narrowing = aspect.clamp(0.01, 1.0);
        // Each corner must lie inside the four planes through the eye: |x| and |y| at most tan · depth.
        let distance = (0..8).fold(0.0_f32, |distance, corner| {
            let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let corner = half_extent * Vec3::new(sign(0), sign(1), sign(2));
            let widest = (corner.dot(right).abs() / narrowing).max(corner.dot(up).abs());
            distance.max(corner.dot(backward) + widest / tan)
        });
        self.target = center;
        // A point is seen from where the eye can still be told from it.
        let least = if distance > 0.0 { 0.0 } else { 1e-6 };
        let distance = distance.max(center.abs().max_element() * 4.0 * f32::EPSILON).max(least);
        self.eye = center + backward * distance;
    }

    /// Unit vector of the view direction.
    pub fn forward(&self) -> Vec3 {
        direction(self.target - self.eye).unwrap_or(Vec3::NEG_Z)
    }

    /// Distance from the eye to the target.
    pub fn distance(&self) -> f32 {
        length(self.target - self.eye)
    }

    /// True if it looks anywhere: finite, the eye apart from the target, with an up direction and a sensible field of view.
    pub fn is_usable(&self) -> bool {
        let finite = self.eye.is_finite() && self.target.is_finite() && self.up.is_finite();
        finite && self.distance() > 0.0 && self.up.length_squared() >= 1e-12 && (0.01..3.1).contains(&self.fov_y)
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
            Projection::Orthographic => tan * self.distance().max(LEAST_DISTANCE),
        };
        let half = Vec2::new(half_height * width_px / height_px, half_height);
        CameraFrame { camera: *self, right, up, forward, half, width_px, height_px }
    }
}

impl CameraFrame {
    /// The ray through the point (x, y) of the picture in pixels, y down; a pixel's centre is at +0.5. Its direction has
    /// unit length.
    #[inline]
    pub fn ray(&self, x_px: f32, y_px: f32) -> Ray {
        let across = self.right * ((x_px / self.width_px * 2.0 - 1.0) * self.half.x);
        let along = self.up * ((1.0 - y_px / self.height_px * 2.0) * self.half.y);
        match self.camera.projection {
            Projection::Perspective => Ray::new(self.camera.eye, (self.forward + across + along).normalize()),
            // Starts far behind the eye, so that zooming in never clips the model.
            Projection::Orthographic => {
                let back = self.forward * self.ortho_offset();
                Ray::new(self.camera.eye + across + along - back, self.forward)
            }
        }
    }

    /// Width of a pixel at `view_depth`, in world units.
    pub fn pixel_size(&self, view_depth: f32) -> f32 {
        let depth = if self.camera.projection == Projection::Perspective { view_depth } else { 1.0 };
        2.0 * self.half.y * depth / self.height_px
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
                let near = (self.camera.distance() * 1e-4).max(f32::MIN_POSITIVE);
                let fov_y = self.camera.fov_y.clamp(0.001, 3.1);
                glam::camera::rh::proj::directx::perspective_infinite_reverse(
                    fov_y,
                    self.width_px / self.height_px,
                    near,
                ) * self.view_from_world()
            }
            Projection::Orthographic => {
                let far = self.ortho_offset().max(LEAST_DISTANCE);
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

    /// The camera that this basis belongs to.
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

#[cfg(test)]
mod tests {
    use super::*;

    const SIZES: [(u32, u32); 4] = [(1280, 800), (1003, 612), (1920, 1080), (640, 1000)];

    fn cameras() -> Vec<Camera> {
        let bounds = Aabb { min: Vec3::new(-1.0, -2.0, 3.0), max: Vec3::new(4.0, 1.0, 5.0) };
        let far_away = Aabb { min: Vec3::splat(20.0), max: Vec3::splat(23.0) };
        let mut cameras = Vec::new();
        for up in [Vec3::Y, Vec3::Z] {
            for bounds in [bounds, far_away] {
                for projection in [Projection::Perspective, Projection::Orthographic] {
                    cameras.push(Camera { projection, ..Camera::framing(&bounds, up) });
                }
            }
        }
        cameras
    }

    /// Projects a world point onto the picture, in pixels.
    fn project(frame: &CameraFrame, point: Vec3, (width, height): (u32, u32)) -> Vec2 {
        let clip = frame.clip_from_world() * point.extend(1.0);
        let ndc = Vec2::new(clip.x, clip.y) / clip.w;
        Vec2::new((ndc.x * 0.5 + 0.5) * width as f32, (0.5 - ndc.y * 0.5) * height as f32)
    }

    #[test]
    fn rays_and_matrix_agree_within_a_hundredth_of_a_pixel() {
        for camera in cameras() {
            for size in SIZES {
                let frame = camera.for_size(size.0, size.1);
                for (x, y) in [(0.1, 0.2), (0.5, 0.5), (0.93, 0.04), (0.3, 0.99)] {
                    let pixel = Vec2::new(size.0 as f32 * x, size.1 as f32 * y);
                    let ray = frame.ray(pixel.x, pixel.y);
                    for depth in [0.5, 1.0, 1.7] {
                        let t = frame.ortho_offset() + camera.distance() * depth;
                        let error = (project(&frame, ray.at(t), size) - pixel).length();
                        assert!(error < 0.01, "{camera:?} {size:?} {pixel} {depth}: {error} px");
                    }
                }
            }
        }
    }

    #[test]
    fn a_framed_box_lies_within_the_picture_whatever_its_shape() {
        let bounds = Aabb { min: Vec3::new(-5.0, -0.5, -0.5), max: Vec3::new(5.0, 0.5, 0.5) };
        for size in [(1280, 800), (400, 400), (360, 640), (200, 900)] {
            let mut camera = Camera::framing(&bounds, Vec3::Y);
            camera.frame_in(&bounds, size.0 as f32 / size.1 as f32);
            let frame = camera.for_size(size.0, size.1);
            let corners = (0..8).map(|corner: u32| {
                Vec3::from_array(
                    [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] }),
                )
            });
            let places: Vec<Vec2> = corners.map(|corner| project(&frame, corner, size)).collect();
            let [left, right] = [f32::min, f32::max].map(|of| places.iter().map(|place| place.x).fold(places[0].x, of));
            assert!(left >= 0.0 && right <= size.0 as f32, "{size:?}: {left} to {right}");
            // It fills a narrow picture.
            assert!(
                size.0 > size.1 || right > 0.94 * size.0 as f32 || left < 0.06 * size.0 as f32,
                "{size:?}: {left} to {right}"
            );
        }
    }

    #[test]
    fn clip_w_is_the_view_depth_in_perspective() {
        for camera in cameras() {
            let frame = camera.for_size(800, 600);
            let ray = frame.ray(211.0, 97.0);
            let t = frame.ortho_offset() + camera.distance();
            let depth = frame.view_depth(&ray, t);
            let clip = frame.clip_from_world() * ray.at(t).extend(1.0);
            let in_view = frame.view_from_world() * ray.at(t).extend(1.0);
            assert!((in_view.z + depth).abs() < 1e-3 * depth);
            match camera.projection {
                Projection::Perspective => assert!((clip.w - depth).abs() < 1e-4 * depth),
                Projection::Orthographic => assert!((depth - camera.distance()).abs() < 1e-4 * depth && clip.w == 1.0),
            }
        }
    }

    #[test]
    fn depth_in_clip_space_is_reversed_and_within_zero_and_one() {
        for camera in cameras() {
            let frame = camera.for_size(800, 600);
            let ray = frame.ray(400.0, 300.0);
            let z: Vec<f32> = [0.5, 1.0, 4.0, 40.0]
                .map(|depth| {
                    let point = ray.at(frame.ortho_offset() + camera.distance() * depth);
                    let clip = frame.clip_from_world() * point.extend(1.0);
                    clip.z / clip.w
                })
                .to_vec();
            assert!(z.windows(2).all(|pair| pair[0] > pair[1]), "{z:?}");
            assert!(z.iter().all(|z| (0.0..=1.0).contains(z)), "{z:?}");
        }
    }

    #[test]
    fn rays_have_unit_length_and_axes_are_a_right_handed_picture() {
        for camera in cameras() {
            let frame = camera.for_size(640, 480);
            let (right, up, forward) = frame.axes();
            assert!((right.cross(up) + forward).length() < 1e-5);
            assert!(up.dot(camera.up) > 0.0);
            let corner = frame.ray(0.0, 0.0);
            assert!((corner.direction.length() - 1.0).abs() < 1e-5);
            let from_centre =
                corner.at(frame.ortho_offset() + 1.0) - frame.ray(320.0, 240.0).at(frame.ortho_offset() + 1.0);
            assert!(from_centre.dot(right) < 0.0 && from_centre.dot(up) > 0.0, "the first pixel is the upper left one");
        }
    }

    #[test]
    fn framing_shows_the_whole_box() {
        let bounds = Aabb { min: Vec3::new(-1.0, -2.0, 3.0), max: Vec3::new(4.0, 1.0, 5.0) };
        for up in [Vec3::Y, Vec3::Z] {
            let size = (800, 600);
            let frame = Camera::framing(&bounds, up).for_size(size.0, size.1);
            for corner in 0..8 {
                let pick = |axis: usize| if corner >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
                let pixel = project(&frame, Vec3::new(pick(0), pick(1), pick(2)), size);
                assert!(pixel.x > 0.0 && pixel.y > 0.0 && pixel.x < 800.0 && pixel.y < 600.0, "{pixel}");
            }
        }
    }

    #[test]
    fn models_of_any_size_are_framed_alike() {
        let sized = |size: f32| {
            let bounds = Aabb { min: Vec3::new(-1.0, -2.0, 3.0) * size, max: Vec3::new(4.0, 1.0, 5.0) * size };
            Camera::framing(&bounds, Vec3::Y)
        };
        let expected = sized(1.0);
        for size in [1e-30, 1e-20, 1e-9, 1e9, 1e18] {
            let camera = sized(size);
            assert!((camera.eye / size - expected.eye).length() < 1e-3, "{size}: {}", camera.eye / size);
            assert!(
                (camera.distance() / size / expected.distance() - 1.0).abs() < 1e-4 && camera.is_usable(),
                "{size}"
            );
            for projection in [Projection::Perspective, Projection::Orthographic] {
                let [own, other] = [camera, expected].map(|camera| Camera { projection, ..camera }.for_size(80, 60));
                assert!((own.ray(5.0, 50.0).direction - other.ray(5.0, 50.0).direction).length() < 1e-5, "{size}");
                assert!(own.clip_from_world().is_finite(), "{size}: {}", own.clip_from_world());
                let [near, far] = [own.ray(0.0, 0.0).origin, own.ray(80.0, 60.0).origin];
                assert!(near.is_finite() && (near != far || projection == Projection::Perspective), "{size}");
            }
        }
    }

    #[test]
    fn degenerate_cameras_stay_finite() {
        let flat = Aabb { min: Vec3::ONE, max: Vec3::ONE };
        for bounds in [Aabb::EMPTY, flat, Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY }] {
            let mut camera = Camera::framing(&bounds, Vec3::Y);
            for (fov_y, up) in
                [(0.0, Vec3::Y), (std::f32::consts::PI, Vec3::Y), (1.0, camera.forward()), (1.0, Vec3::ZERO)]
            {
                for projection in [Projection::Perspective, Projection::Orthographic] {
                    (camera.fov_y, camera.up, camera.projection) = (fov_y, up, projection);
                    let frame = camera.for_size(0, 0);
                    assert!(frame.clip_from_world().is_finite(), "{camera:?}");
                    let ray = frame.ray(0.3, 0.7);
                    assert!(ray.origin.is_finite() && (ray.direction.length() - 1.0).abs() < 1e-4, "{camera:?}");
                }
            }
        }
        let nowhere = Camera { eye: Vec3::ONE, target: Vec3::ONE, ..Camera::framing(&flat, Vec3::Y) };
        assert!(nowhere.for_size(10, 10).clip_from_world().is_finite());
    }
}
