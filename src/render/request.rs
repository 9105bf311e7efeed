//! The inputs of one picture.

use std::sync::Arc;

use crate::accel::Accel;
use crate::camera::Camera;
use crate::visibility::TriangleSet;
use bvhscope_engine::geometry::Ray;

use super::settings::RenderSettings;

/// A picture to be traced. Equal requests give equal pictures.
#[derive(Debug, Clone)]
pub struct RenderRequest {
    /// The scene with its tree.
    pub accel: Arc<Accel>,
    /// The camera.
    pub camera: Camera,
    /// Shading, light and colour maps.
    pub settings: RenderSettings,
    /// Width in pixels, at least 1.
    pub width_px: u32,
    /// Height in pixels, at least 1.
    pub height_px: u32,
    /// Edge in pixels of the square that shares one ray; 1 is full resolution.
    pub coarseness: f32,
    /// Whether tests per ray are counted at full resolution, in a pass of their own unless the shading counts them anyway.
    pub count_tests: bool,
    /// Triangles that rays pass through; `None` for none.
    pub hidden: Option<Arc<TriangleSet>>,
}

impl RenderRequest {
    /// The part of a ray that the section plane leaves.
    #[inline]
    pub(super) fn cut(&self, ray: Ray) -> Ray {
        self.settings.section.map_or(ray, |section| section.clip(&ray))
    }

    /// Whether rays pass through the triangle because it is hidden.
    #[inline]
    pub(super) fn hides(&self, triangle: u32) -> bool {
        self.hidden.as_ref().is_some_and(|hidden| hidden.contains(triangle))
    }
}
