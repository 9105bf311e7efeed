//! Cameras that a file has, as views of the scene.

use glam::{DVec3, Vec3};

use bvhscope_engine::geometry::Aabb;

/// A camera of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct FileCamera {
    /// Its name in the file; may be empty.
    pub name: String,
    /// Position of the observer.
    pub eye: Vec3,
    /// The point at the centre of the picture.
    pub target: Vec3,
    /// The up direction, of unit length.
    pub up: Vec3,
    /// Vertical field of view in radians; of an orthographic camera that at whose target it shows as much.
    pub fov_y: f32,
    /// Orthographic projection.
    pub orthographic: bool,
}

/// A camera in the coordinates of its file.
pub(super) struct Lens {
    pub(super) name: String,
    pub(super) eye: DVec3,
    pub(super) forward: DVec3,
    pub(super) up: DVec3,
    /// Vertical field of view in radians.
    pub(super) fov_y: f64,
    /// Half the height of an orthographic view.
    pub(super) half_height: Option<f64>,
    /// Distance of what it looks at, if the file names that.
    pub(super) distance: Option<f64>,
}

impl Lens {
    /// The camera for a scene in `bounds` less `offset`; `None` for one that looks nowhere. Where the file does not name a point to
    /// look at, it is as far as the centre of the scene.
    pub(super) fn placed(self, bounds: &Aabb, offset: DVec3) -> Option<FileCamera> {
        let (forward, up) = (self.forward.try_normalize()?, self.up.try_normalize()?);
        let eye = (self.eye - offset).as_vec3();
        let size = f64::from(bounds.extent().length());
        let center = bounds.center().as_dvec3();
        let to_center = (center - eye.as_dvec3()).dot(forward);
        let distance = match self.half_height {
            Some(half) => half / (self.fov_y * 0.5).tan(),
            None => self.distance.unwrap_or_else(|| to_center.max(size * 0.05)),
        };
        let target = (eye.as_dvec3() + forward * distance).as_vec3();
        let camera = FileCamera {
            name: self.name,
            eye,
            target,
            up: up.as_vec3(),
            fov_y: self.fov_y as f32,
            orthographic: self.half_height.is_some(),
        };
        let is_usable = eye.is_finite() && target.is_finite() && eye != target;
        let is_open = (0.01..3.1).contains(&camera.fov_y) && forward.cross(up).length() > 1e-6;
        Some(camera).filter(|_| is_usable && is_open)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn lens() -> Lens {
        Lens {
            name: String::new(),
            eye: DVec3::new(1000.0, 0.0, 5.0),
            forward: DVec3::new(0.0, 0.0, -2.0),
            up: DVec3::Y,
            fov_y: 1.0,
            half_height: None,
            distance: None,
        }
    }

    #[test]
    fn cameras_look_as_far_as_the_centre_of_the_scene() {
        let bounds = Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE };
        let offset = DVec3::new(1000.0, 0.0, 0.0);
        let camera = lens().placed(&bounds, offset).unwrap();
        assert_eq!((camera.eye, camera.target), (Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO));
        let near = Lens { distance: Some(2.0), ..lens() }.placed(&bounds, offset).unwrap();
        assert_eq!(near.target, Vec3::new(0.0, 0.0, 3.0));
        let flat = Lens { half_height: Some(3.0), ..lens() }.placed(&bounds, offset).unwrap();
        let half = (flat.eye - flat.target).length() * (flat.fov_y * 0.5).tan();
        assert!(flat.orthographic && (half - 3.0).abs() < 1e-5);
    }

    #[test]
    fn cameras_that_look_nowhere_are_none() {
        let bounds = Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE };
        for wrong in [
            Lens { forward: DVec3::ZERO, ..lens() },
            Lens { up: DVec3::Z, ..lens() },
            Lens { eye: DVec3::NAN, ..lens() },
            Lens { fov_y: 4.0, ..lens() },
            Lens { distance: Some(f64::INFINITY), ..lens() },
        ] {
            assert_eq!(wrong.placed(&bounds, DVec3::ZERO), None);
        }
    }
}
