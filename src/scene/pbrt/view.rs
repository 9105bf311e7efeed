//! The camera of a PBRT scene, which is the view that one starts with.

use glam::{DMat4, DVec3, Vec3};

use super::parameters::Parameters;
use crate::scene::assemble::Assembly;
use crate::scene::error::{FileLocation, Warnings};
use crate::scene::file_camera::Lens;

/// Field of view along the shorter side of the picture unless the file says otherwise, in degrees.
const DEFAULT_FOV: f64 = 90.0;

/// The picture that the scene is made for.
pub(super) struct Film {
    /// Width and height in pixels.
    size: [f64; 2],
    /// The last view: the transform that it led to, and the point looked at and the up direction before later transforms.
    look: Option<(DMat4, DVec3, DVec3)>,
    camera: Option<Shot>,
}

impl Default for Film {
    fn default() -> Self {
        Self { size: [1280.0, 720.0], look: None, camera: None }
    }
}

/// A camera and what was known of the view when it was named.
struct Shot {
    camera_from_world: DMat4,
    /// Field of view along the shorter side, in radians.
    fov: f64,
    /// Half the height of an orthographic view, where the file has it.
    window: Option<f64>,
    orthographic: bool,
    look: Option<(DMat4, DVec3, DVec3)>,
    place: FileLocation,
}

impl Film {
    pub(super) fn add_film(&mut self, parameters: &Parameters) {
        for (side, name) in self.size.iter_mut().zip(["xresolution", "yresolution"]) {
            *side = parameters.number(name).filter(|pixels| (1.0..1e9).contains(pixels)).unwrap_or(*side);
        }
    }

    /// The transform after a statement `LookAt`; `None` if that looks nowhere.
    pub(super) fn look_at(&mut self, numbers: [f64; 9], before: DMat4) -> Option<DMat4> {
        let [eye, target, up] = [0, 3, 6]
            .map(|at: usize| DVec3::new(numbers[at], numbers[at.saturating_add(1)], numbers[at.saturating_add(2)]));
        let forward = (target - eye).try_normalize()?;
        // x points to the right of a left-handed camera.
        let right = up.cross(forward).try_normalize()?;
        let [x, y, z] = [right, forward.cross(right), forward].map(|axis| axis.extend(0.0));
        let after = before * DMat4::from_cols(x, y, z, eye.extend(1.0)).inverse();
        self.look = Some((after, target, up));
        Some(after)
    }

    pub(super) fn add_camera(
        &mut self,
        class: &str,
        parameters: &Parameters,
        camera_from_world: DMat4,
        place: FileLocation,
        warnings: &mut Warnings,
    ) {
        if !matches!(class, "perspective" | "orthographic") {
            warnings.add("cameras of other kinds shown in perspective", || place.clone());
        }
        let half = parameters.number("halffov").map(|half| half * 2.0);
        let is_stated = ["halffov", "fov"].into_iter().any(|name| parameters.get(name).is_some());
        let known = half.or_else(|| parameters.number("fov")).filter(|fov| *fov > 0.0 && *fov < 180.0);
        if class != "orthographic" && is_stated && known.is_none() {
            let what = "cameras with a field of view that is not between 0 and 180 degrees shown with 90";
            warnings.add(what, || place.clone());
        }
        let fov = known.unwrap_or(DEFAULT_FOV).to_radians();
        let window = match parameters.numbers("screenwindow") {
            Some(&[_, _, bottom, top]) => Some((top - bottom) * 0.5),
            _ => None,
        };
        let orthographic = class == "orthographic";
        self.camera = Some(Shot { camera_from_world, fov, window, orthographic, look: self.look, place });
    }

    /// Adds the camera to the scene; returns the axis that is up.
    pub(super) fn finish(self, assembly: &mut Assembly) -> Vec3 {
        let [width, height] = self.size;
        let Some(Shot { camera_from_world, fov, window, orthographic, look, place }) = self.camera else {
            return Vec3::Y;
        };
        let world_from_camera = camera_from_world.inverse();
        if !world_from_camera.is_finite() {
            assembly.warnings.add("cameras without a place left out", || place);
            return Vec3::Y;
        }
        let eye = world_from_camera.transform_point3(DVec3::ZERO);
        let forward = world_from_camera.transform_vector3(DVec3::Z).normalize_or_zero();
        let up = world_from_camera.transform_vector3(DVec3::Y);
        let later = look.map(|(after, target, up)| {
            let to_world = world_from_camera * after;
            (to_world.transform_point3(target), to_world.transform_vector3(up))
        });
        // The field of view is that of the shorter side, ours that of the height.
        let ratio = (height / width).max(1.0);
        assembly.lenses.push(Lens {
            name: String::new(),
            eye,
            forward,
            up,
            fov_y: ((fov * 0.5).tan() * ratio).atan() * 2.0,
            half_height: orthographic.then(|| window.unwrap_or(ratio)),
            distance: later.map(|(target, _)| (target - eye).dot(forward)).filter(|&distance| distance > 0.0),
        });
        assembly.starts_at_camera = true;
        axis(later.map_or(up, |(_, up)| up))
    }
}

/// The axis that is closest to a direction.
fn axis(direction: DVec3) -> Vec3 {
    let most = direction.abs().max_element();
    let axes = [DVec3::Y, DVec3::Z, DVec3::X];
    let closest = axes.into_iter().find(|axis| direction.dot(*axis).abs() == most).unwrap_or(DVec3::Y);
    (closest * direction.dot(closest).signum()).as_vec3()
}
