//! The inputs of one picture.

use std::sync::Arc;

use crate::accel::Accel;
use crate::accel::laid::CountedLayout;
use crate::camera::Camera;
use crate::visibility::TriangleSet;

use super::cluster_cut::ClusterCut;
use super::settings::RenderSettings;
use super::visible::Visible;

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
    /// The layout of the tree that heat maps count, where [`HeatKind::is_of_layouts`](super::HeatKind::is_of_layouts); `None` for the trees
    /// that are traced.
    pub layout: Option<CountedLayout>,
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
            layout: None,
        }
    }

    /// The layout that the picture counts.
    pub fn counted_layout(&self) -> Option<&CountedLayout> {
        self.layout.as_ref().filter(|_| self.settings.shading.is_of_layouts())
    }

    /// The visible part: less than all where there is a section plane or where triangles are hidden.
    pub fn visible(&self) -> Visible<'_> {
        let hidden = self.hidden.as_deref().filter(|hidden| !hidden.is_empty());
        Visible { scene: &self.accel.scene, section: self.settings.section, hidden }
    }
}
