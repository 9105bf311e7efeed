//! Named views of a model, and cameras specified in part. Shared by the command line and the window.

use std::fmt;

use glam::{DVec3, Mat3, Vec3};

use crate::camera::{Camera, Projection};
use crate::scene::{FileCamera, Interior, Scene, from_file, to_file};

/// Vertical field of view inside a model in radians: 60 degrees.
const INSIDE_FOV_Y: f32 = std::f32::consts::FRAC_PI_3;

/// A standard view of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NamedView {
    /// That of the file where it has one to start with ([`Scene::starts_at_camera`]); from inside where the model encloses its
    /// centre, as a room does ([`Scene::interior`]); otherwise from outside.
    #[default]
    Default,
    /// The view of [`Camera::framing`]: the whole model from an oblique direction.
    Outside,
    /// Looking at the side that faces +z in a y-up scene, −y in a z-up one.
    Front,
    /// Looking at the side opposite the front.
    Back,
    /// From the observer's left of the front view.
    Left,
    /// From the observer's right of the front view.
    Right,
    /// From above.
    Top,
    /// From below.
    Bottom,
}

impl NamedView {
    /// Every view.
    pub const ALL: [Self; 8] =
        [Self::Default, Self::Outside, Self::Front, Self::Back, Self::Left, Self::Right, Self::Top, Self::Bottom];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Outside => "outside",
            Self::Front => "front",
            Self::Back => "back",
            Self::Left => "left",
            Self::Right => "right",
            Self::Top => "top",
            Self::Bottom => "bottom",
        }
    }

    /// Where its camera stands in `scene`.
    pub fn place(self, scene: &Scene) -> Place {
        match (self, scene.interior) {
            (Self::Default, _) if scene.starts_at_camera && !scene.cameras.is_empty() => Place::OfFile(0),
            (Self::Default, Some(interior)) => Place::Inside(interior),
            (Self::Default, None) => Place::Outside(Self::Outside),
            _ => Place::Outside(self),
        }
    }

    /// The camera of this view of `scene`, whose up direction the user may have changed to `up`.
    pub fn camera(self, scene: &Scene, up: Vec3) -> Camera {
        self.camera_in(scene, up, 1.0)
    }

    /// The same for a picture of this ratio of width to height, which shows the whole model where it is narrow too.
    pub fn camera_in(self, scene: &Scene, up: Vec3, aspect: f32) -> Camera {
        let bounds = &scene.subject;
        let view = match self.place(scene) {
            Place::OfFile(index) => return of_file(&scene.cameras[index]),
            Place::Inside(Interior { eye, target }) => {
                return Camera { eye, target, fov_y: INSIDE_FOV_Y, ..Camera::framing(bounds, up) };
            }
            Place::Outside(view) => view,
            Place::Given => self,
        };
        let mut camera = Camera::framing(bounds, up);
        if aspect < 1.0 {
            camera.frame_in(bounds, aspect);
        }
        let front = if up.y.abs() > 0.5 { Vec3::Z } else { Vec3::NEG_Y };
        let right = up.cross(front).normalize_or(Vec3::X);
        let [x, y, z] = match view {
            Self::Default | Self::Outside => return camera,
            Self::Front => [0.0, 0.0, 1.0],
            Self::Back => [0.0, 0.0, -1.0],
            Self::Left => [-1.0, 0.0, 0.0],
            Self::Right => [1.0, 0.0, 0.0],
            Self::Top => [0.0, 1.0, 0.0],
            Self::Bottom => [0.0, -1.0, 0.0],
        };
        let toward_eye = Mat3::from_cols(right, up, front) * Vec3::new(x, y, z);
        // Seen from above or below, the front side is at the bottom or top of the picture.
        if y != 0.0 {
            camera.up = front * -y;
        }
        camera.eye = camera.target + toward_eye;
        camera.frame_in(bounds, aspect);
        camera
    }
}

/// Where a camera stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// Inside a model that encloses its centre.
    Inside(Interior),
    /// Outside of the model, which fills the picture.
    Outside(NamedView),
    /// At a camera of the file, counted from 0.
    OfFile(usize),
    /// Where the user has put it.
    Given,
}

/// The name in rows and tables.
impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Inside(_) => f.write_str("inside"),
            Self::Outside(view) => f.write_str(view.name()),
            Self::OfFile(index) => write!(f, "file {index}"),
            Self::Given => f.write_str("given"),
        }
    }
}

/// A camera of the scene's file.
pub fn of_file(camera: &FileCamera) -> Camera {
    let &FileCamera { eye, target, up, fov_y, orthographic, .. } = camera;
    let projection = if orthographic { Projection::Orthographic } else { Projection::Perspective };
    Camera { eye, target, up, fov_y, projection }
}

/// A named view with overrides for single components of the camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraChoice {
    /// The view that supplies whatever is not overridden.
    pub view: NamedView,
    /// The camera of the file in its place, counted from 0.
    pub of_file: Option<usize>,
    /// A camera in the coordinates of the scene, in the place of either.
    pub of_scene: Option<Camera>,
    /// Position of the observer, in the coordinates of the file.
    pub eye: Option<DVec3>,
    /// The point at the centre of the picture, in the coordinates of the file.
    pub target: Option<DVec3>,
    /// The up direction, of unit length.
    pub up: Option<Vec3>,
    /// Vertical field of view in radians. Without `eye` the distance is adapted, so that the model fills the picture
    /// that is seen from outside.
    pub fov_y: Option<f32>,
    /// Orthographic projection.
    pub orthographic: bool,
}

impl CameraChoice {
    /// The camera as it is, in the coordinates of the scene.
    pub fn of_scene(camera: Camera) -> Self {
        Self { of_scene: Some(camera), ..Self::default() }
    }

    /// The camera where it is in the file, of whose coordinates its own are less by `offset`.
    pub fn in_file(camera: Camera, offset: DVec3) -> Self {
        let [eye, target] = [camera.eye, camera.target].map(|point| Some(to_file(point, offset)));
        Self { eye, target, ..Self::of_scene(camera) }
    }

    /// Where the camera stands in `scene`.
    pub fn place(&self, scene: &Scene) -> Place {
        match self.of_file {
            _ if self.of_scene.is_some() || self.eye.is_some() || self.target.is_some() => Place::Given,
            Some(index) => Place::OfFile(index),
            None => self.view.place(scene),
        }
    }

    /// The camera for a scene.
    pub fn camera(&self, scene: &Scene) -> Camera {
        let of_file = self.of_file.and_then(|index| scene.cameras.get(index)).map(of_file);
        let own = self.of_scene.or(of_file);
        let mut camera = own.unwrap_or_else(|| self.view.camera(scene, scene.up));
        if let Some(fov_y) = self.fov_y {
            camera.fov_y = fov_y;
            if own.is_none() && matches!(self.view.place(scene), Place::Outside(_)) {
                camera.frame(&scene.subject);
            }
        }
        if let Some(up) = self.up {
            camera.up = up;
        }
        if self.orthographic {
            camera.projection = Projection::Orthographic;
        }
        if let Some(target) = self.target.map(|target| from_file(target, scene.offset)) {
            // A target alone moves the whole camera, so that the direction of the view stays.
            camera.eye += target - camera.target;
            camera.target = target;
        }
        if let Some(eye) = self.eye.map(|eye| from_file(eye, scene.offset)) {
            camera.eye = eye;
        }
        camera
    }
}
