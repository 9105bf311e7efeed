//! Camera moves: pure functions on [`Camera`], used by mouse, keys, axes gizmo and commands. Angles are in radians.

use bvhscope_engine::geometry::Aabb;
use glam::{Mat3, Quat, Vec2, Vec3};

use crate::camera::Camera;
use crate::scene::Scene;
use crate::vectors::length;
use crate::view::NamedView;

/// Orbits around the target: by `yaw` around the scene's up axis, and by `pitch` around the picture's horizontal axis. The
/// camera's up vector follows across the poles, so that neither orbiting stops nor the picture flips there.
pub fn orbit(camera: &mut Camera, up: Vec3, yaw: f32, pitch: f32) {
    let up = up.normalize_or(Vec3::Y);
    let backward = camera.eye - camera.target;
    // The picture's horizontal axis. Past a pole the picture is upside down, and dragging turns the other way.
    let side = camera.forward().cross(camera.up).normalize_or(camera.forward().any_orthogonal_vector());
    let true_up = side.cross(camera.forward());
    let sign = if true_up.dot(up) < -1e-4 { -1.0 } else { 1.0 };
    let turn = Quat::from_axis_angle(up, -yaw * sign) * Quat::from_axis_angle(side, -pitch);
    camera.eye = camera.target + turn * backward;
    camera.up = (turn * true_up).normalize_or(up);
}

/// Scales the distance to `toward` by 1 / `factor` (above 1: nearer); the point keeps its place in the picture.
pub fn zoom(camera: &mut Camera, factor: f32, toward: Vec3) {
    let scale = 1.0 / factor.clamp(0.01, 100.0);
    let moved = Camera {
        eye: toward + (camera.eye - toward) * scale,
        target: toward + (camera.target - toward) * scale,
        ..*camera
    };
    let distance = moved.distance();
    if moved.eye.is_finite() && distance > 0.0 && distance.is_finite() && distance > length(moved.target) * 1e-7 {
        *camera = moved;
    }
}

/// Moves eye and target parallel to the picture by `delta_px` pixels (y down) of a viewport `height_px` high.
pub fn pan(camera: &mut Camera, delta_px: Vec2, height_px: f32) {
    let (right, up, _) = camera.for_size(1, 1).axes();
    let per_pixel = 2.0 * camera.distance() * (camera.fov_y * 0.5).tan() / height_px.max(1.0);
    let shift = (up * delta_px.y - right * delta_px.x) * per_pixel;
    camera.eye += shift;
    camera.target += shift;
}

/// Views the target from direction `axis` (target to eye) at the same distance.
pub fn view_along(camera: &mut Camera, axis: Vec3, up: Vec3) {
    let distance = camera.distance();
    let axis = axis.normalize_or(Vec3::Z);
    camera.eye = camera.target + axis * distance;
    camera.up = up;
    // Straight from above or below the scene's up axis cannot be the picture's: use the view direction of the front view.
    if axis.cross(up).length() < 1e-3 {
        let (front, _) = front_and_right(up);
        camera.up = if axis.dot(up) > 0.0 { -front } else { front };
    }
}

/// Directions to the eye for the front and right views of a scene with this up axis.
pub fn front_and_right(up: Vec3) -> (Vec3, Vec3) {
    let front = if up.y.abs() > 0.5 { Vec3::Z } else { Vec3::NEG_Y };
    (front, up.cross(front).normalize_or(Vec3::X))
}

/// Resets the camera to a view of the model in a picture of this ratio of width to height; the projection stays.
pub fn reset(camera: &mut Camera, view: NamedView, scene: &Scene, up: Vec3, aspect: f32) {
    *camera = Camera { projection: camera.projection, ..view.camera_in(scene, up, aspect) };
}

/// Makes `point` the target, and so the centre of picture and orbit; direction and distance stay.
pub fn focus(camera: &mut Camera, point: Vec3) {
    let shift = point - camera.target;
    camera.eye += shift;
    camera.target = point;
}

/// Turns the view direction around the eye: by `yaw` around `up`, by `pitch` upwards.
pub fn look(camera: &mut Camera, up: Vec3, yaw: f32, pitch: f32) {
    let up = up.normalize_or(Vec3::Y);
    let forward = camera.forward();
    let side = forward.cross(up).normalize_or(forward.any_orthogonal_vector());
    let elevation = forward.dot(up).clamp(-1.0, 1.0).asin();
    // Stop just short of straight up and down.
    let pitch = (elevation + pitch).clamp(-1.55, 1.55) - elevation;
    let turn = Mat3::from_axis_angle(up, -yaw) * Mat3::from_axis_angle(side, pitch);
    camera.target = camera.eye + turn * forward * camera.distance();
    camera.up = up;
}

/// Whether the centre of `bounds` is in view, and the model neither tiny nor far larger than the picture.
pub fn still_sees(camera: &Camera, bounds: &Aabb) -> bool {
    let radius = (length(bounds.extent()) * 0.5).max(f32::MIN_POSITIVE);
    let to_center = bounds.center() - camera.eye;
    let depth = to_center.dot(camera.forward());
    let lateral = length(to_center - camera.forward() * depth);
    let half_height = depth * (camera.fov_y * 0.5).tan();
    depth > 0.0 && lateral < half_height && radius > half_height * 0.1 && radius < half_height * 8.0
}
