//! Which ray, and how it is to be traced.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::accel::Accel;
use crate::camera::Camera;
use crate::render::{RayKind, RayStart, RenderSettings};
use crate::visibility::TriangleSet;
use bvhscope_engine::tree::traverse::Traversal;

/// The traversal that a ray is recorded in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RayMethod {
    /// The tree as it was built, in this order. Any hit ends an occlusion ray, but not in the paper's order, which has no
    /// such end.
    Binary(Traversal),
    /// The wide tree, which pictures are traced through.
    Wide,
}

impl RayMethod {
    /// All methods.
    pub const ALL: [Self; 3] = [Self::Binary(Traversal::Ordered), Self::Binary(Traversal::Paper), Self::Wide];

    /// The name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Binary(traversal) => traversal.name(),
            Self::Wide => "wide",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Binary(Traversal::Ordered) => "Ordered",
            Self::Binary(Traversal::Paper) => "Paper",
            Self::Wide => "Wide tree",
        }
    }
}

/// A ray of a picture and how it is to be traced. Equal requests of one tree give equal records.
#[derive(Debug, Clone, PartialEq)]
pub struct RayRequest {
    /// Where it comes from.
    pub start: RayStart,
    /// Its purpose.
    pub kind: RayKind,
    /// The traversal.
    pub method: RayMethod,
    /// The camera of the picture.
    pub camera: Camera,
    /// Width and height of the picture in pixels.
    pub size_px: [u32; 2],
    /// The settings of the picture. See [`RenderSettings::of_rays`].
    pub settings: RenderSettings,
    /// Triangles that rays pass through; `None` for none.
    pub hidden: Option<Arc<TriangleSet>>,
}

impl RayRequest {
    /// How it is traced: a wide tree of a scene of copies leads to trees that it does not show.
    pub(super) fn method_in(&self, accel: &Accel) -> RayMethod {
        if accel.levels().is_some() && self.method == RayMethod::Wide {
            RayMethod::Binary(Traversal::Ordered)
        } else {
            self.method
        }
    }

    /// The first hit ends the ray. Behind hidden triangles pictures look for the nearest.
    pub(super) fn ends_at_any_hit(&self) -> bool {
        self.kind.ends_at_any_hit() && self.method != RayMethod::Binary(Traversal::Paper) && self.hidden.is_none()
    }
}
