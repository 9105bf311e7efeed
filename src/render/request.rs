//! The inputs of one picture.

use std::sync::Arc;

use crate::accel::Accel;
use crate::camera::Camera;
use crate::visibility::TriangleSet;
use bvhscope_engine::geometry::{Hit, Ray};

use super::cluster_cut::ClusterCut;
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
    /// True if tests per ray are counted at full resolution, in a pass of their own unless the shading counts them anyway.
    pub count_tests: bool,
    /// Triangles that rays pass through; `None` for none.
    pub hidden: Option<Arc<TriangleSet>>,
    /// The cut whose nodes cluster colours show; `None` for the nodes at [`RenderSettings::cluster_depth`].
    pub clusters: Option<ClusterCut>,
}

impl RenderRequest {
    /// A whole picture at full resolution of this width and height in pixels.
    pub fn new(accel: &Arc<Accel>, camera: Camera, settings: RenderSettings, [width_px, height_px]: [u32; 2]) -> Self {
        Self {
            accel: Arc::clone(accel),
            camera,
            settings,
            width_px,
            height_px,
            coarseness: 1.0,
            count_tests: false,
            hidden: None,
            clusters: None,
        }
    }

    /// The part of a ray that the section plane leaves.
    #[inline]
    pub fn cut(&self, ray: Ray) -> Ray {
        self.settings.section.map_or(ray, |section| section.clip(&ray))
    }

    /// The first hit of `closest` that is not hidden, in the part of a ray that the section plane leaves. Behind a hidden triangle
    /// the ray is traced again, and its tests count too.
    #[inline(always)]
    pub fn first_visible(&self, ray: Ray, mut closest: impl FnMut(&Ray) -> Option<Hit>) -> Option<Hit> {
        let mut rest = self.cut(ray);
        loop {
            let hit = closest(&rest)?;
            if !self.hidden.as_ref().is_some_and(|hidden| hidden.contains(hit.primitive_index)) {
                return Some(hit);
            }
            rest.t_min = hit.t.next_up();
        }
    }
}
