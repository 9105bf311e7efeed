//! What a picture shows.

use serde::{Deserialize, Serialize};

use super::color_map::ColorMap;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::traverse::Traversal;

/// What a pixel's colour means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shading {
    /// Light, materials and textures.
    Lit,
    /// The surface's direction.
    Normals,
    /// Distance along the view direction.
    Depth,
    /// How open the surface is to its surroundings.
    AmbientOcclusion,
    /// The colour of the container, at the chosen depth, that holds the surface.
    Clusters,
    /// Tests that the pixel's ray cost.
    Heat(HeatKind),
}

/// Which tests a heat map counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HeatKind {
    /// Container tests.
    Containers,
    /// Primitive tests.
    Primitives,
    /// Both together.
    Both,
    /// Steps through the wide tree: nodes visited and blocks of triangles tested.
    Steps,
}

impl HeatKind {
    /// What is counted, in the plural, as the window says it.
    pub const fn counted(self) -> &'static str {
        match self {
            Self::Containers => "container tests",
            Self::Primitives => "triangle tests",
            Self::Both => "tests",
            Self::Steps => "wide tree steps",
        }
    }
}

/// Where the light of lit shading comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Light {
    /// From the observer; no shadows.
    Headlight,
    /// From a fixed direction high above, with shadow rays.
    Sun,
}

impl Light {
    /// Every light.
    pub const ALL: [Self; 2] = [Self::Headlight, Self::Sun];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Headlight => "headlight",
            Self::Sun => "sun",
        }
    }
}

/// Everything beside scene, tree, camera and size that decides a picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RenderSettings {
    /// What a pixel's colour means.
    pub shading: Shading,
    /// Where light comes from in lit shading.
    pub light: Light,
    /// The depth of the containers that cluster colours show; leaves higher up keep their own colour.
    pub cluster_depth: u32,
    /// How rays visit nodes wherever tests are counted.
    pub traversal: Traversal,
    /// The counts at the two ends of the heat map; `None` fits the range to the picture.
    pub heat_range: Option<[f32; 2]>,
    /// Colours of depth and heat maps.
    pub color_map: ColorMap,
    /// The edges of the triangles are drawn over their surface.
    #[serde(default)]
    pub mesh_edges: bool,
    /// Vector instructions that rays are traced with; changes nothing but the speed.
    #[serde(skip)]
    pub simd: SimdLevel,
    /// Antialiasing samples a pixel once everything rests; see [`RenderSettings::wanted_samples`].
    pub samples: u32,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            shading: Shading::Lit,
            light: Light::Sun,
            cluster_depth: 6,
            traversal: Traversal::Ordered,
            heat_range: None,
            color_map: ColorMap::Inferno,
            mesh_edges: false,
            simd: SimdLevel::best(),
            samples: 16,
        }
    }
}

impl RenderSettings {
    /// Samples a pixel that a picture at full resolution gets: `samples`, at least 1, but always 1 where a pixel's colour
    /// stands for exactly one value.
    pub fn wanted_samples(&self) -> u32 {
        if self.shading.has_values() { 1 } else { self.samples.max(1) }
    }
}

impl Shading {
    /// Whether colours stand for numbers: [`Frame::values`](super::Frame::values) is filled, and a legend makes sense.
    pub const fn has_values(self) -> bool {
        matches!(self, Self::Depth | Self::Heat(_))
    }

    /// Every mode, in the order of menus.
    pub const ALL: [Self; 9] = [
        Self::Lit,
        Self::Normals,
        Self::Depth,
        Self::AmbientOcclusion,
        Self::Clusters,
        Self::Heat(HeatKind::Both),
        Self::Heat(HeatKind::Containers),
        Self::Heat(HeatKind::Primitives),
        Self::Heat(HeatKind::Steps),
    ];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Lit => "lit",
            Self::Normals => "normals",
            Self::Depth => "depth",
            Self::AmbientOcclusion => "ao",
            Self::Clusters => "clusters",
            Self::Heat(HeatKind::Both) => "heat",
            Self::Heat(HeatKind::Containers) => "heat-containers",
            Self::Heat(HeatKind::Primitives) => "heat-primitives",
            Self::Heat(HeatKind::Steps) => "heat-steps",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Lit => "Lit",
            Self::Normals => "Normals",
            Self::Depth => "Depth",
            Self::AmbientOcclusion => "Ambient occlusion",
            Self::Clusters => "Cluster colours",
            Self::Heat(HeatKind::Both) => "Heat: all tests",
            Self::Heat(HeatKind::Containers) => "Heat: container tests",
            Self::Heat(HeatKind::Primitives) => "Heat: triangle tests",
            Self::Heat(HeatKind::Steps) => "Heat: wide tree steps",
        }
    }
}
