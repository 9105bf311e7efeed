//! Size of a container on screen, by which containers are chosen.

use glam::{Vec2, Vec3};

use crate::camera::{Camera, Projection};
use crate::section::SectionPlane;
use bvhscope_engine::geometry::Aabb;

/// A camera, the size of its picture, and the section plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewpoint {
    /// The camera.
    pub camera: Camera,
    /// Width and height of the picture in pixels, at least 1.
    pub size_px: [u32; 2],
    /// The plane that cuts the containers open.
    pub section: Option<SectionPlane>,
}

/// A container's size on screen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    /// Diameter of the sphere around it in pixels.
    pub(super) diameter_px: f32,
    /// True if it may be in the picture.
    pub(super) is_inside: bool,
}

/// A viewpoint prepared for measuring many containers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measure {
    eye: Vec3,
    axes: [Vec3; 3],
    /// Half the width and height of the image plane, at distance 1 in perspective.
    half: Vec2,
    is_perspective: bool,
    height_px: f32,
}

impl Viewpoint {
    pub(super) fn measure(&self) -> Measure {
        let [width, height] = self.size_px;
        let frame = self.camera.for_size(width, height);
        let (right, up, forward) = frame.axes();
        Measure {
            eye: self.camera.eye,
            axes: [right, up, forward],
            half: frame.half_extent(),
            is_perspective: self.camera.projection == Projection::Perspective,
            height_px: height.max(1) as f32,
        }
    }
}

impl Measure {
    /// The size on screen of the sphere around `bounds`. The shaders compute the same.
    pub(super) fn extent(&self, bounds: &Aabb) -> Extent {
        let radius = bounds.extent().length() * 0.5;
        let from_eye = bounds.center() - self.eye;
        let [x, y, depth] = self.axes.map(|axis| from_eye.dot(axis));
        let unit = if self.is_perspective { depth.max(radius) } else { 1.0 };
        // The sides of a perspective view are slanted, so the sphere reaches farther across than its radius.
        let margin = if self.is_perspective { radius * (1.0 + self.half.max_element()) } else { radius };
        let reach = self.half * unit + margin;
        Extent {
            diameter_px: radius / (self.half.y * unit) * self.height_px,
            is_inside: x.abs() <= reach.x && y.abs() <= reach.y && (!self.is_perspective || depth > -radius),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube_at(center: Vec3) -> Aabb {
        Aabb { min: center - 1.0, max: center + 1.0 }
    }

    #[test]
    fn what_is_nearer_is_larger_and_what_is_beside_is_outside() {
        let camera = Camera {
            eye: Vec3::Z * 10.0,
            target: Vec3::ZERO,
            up: Vec3::Y,
            fov_y: std::f32::consts::FRAC_PI_2,
            projection: Projection::Perspective,
        };
        let perspective = Viewpoint { camera, size_px: [300, 100], section: None }.measure();
        let orthographic = Viewpoint {
            camera: Camera { projection: Projection::Orthographic, ..camera },
            size_px: [300, 100],
            section: None,
        }
        .measure();
        let size = |measure: &Measure, at: Vec3| measure.extent(&cube_at(at)).diameter_px;
        // The picture is 20 units high at the target: a sphere of radius √3 takes √3 / 10 of its 100 pixels.
        let expected = 3.0_f32.sqrt() * 10.0;
        for measure in [perspective, orthographic] {
            assert!((size(&measure, Vec3::ZERO) - expected).abs() < 0.01);
            assert!(measure.extent(&cube_at(Vec3::new(25.0, 0.0, 0.0))).is_inside);
            assert!(!measure.extent(&cube_at(Vec3::new(40.0, 0.0, 0.0))).is_inside);
            assert!(!measure.extent(&cube_at(Vec3::new(0.0, 20.0, 0.0))).is_inside);
        }
        assert!((size(&perspective, Vec3::Z * 5.0) - 2.0 * expected).abs() < 0.01);
        assert!((size(&orthographic, Vec3::Z * 5.0) - expected).abs() < 0.01);
        assert!(!perspective.extent(&cube_at(Vec3::Z * 20.0)).is_inside, "behind the eye");
        assert!(size(&perspective, Vec3::Z * 10.0).is_finite(), "around the eye");
    }
}
