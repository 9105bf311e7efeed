//! Render settings: shading mode, light, colour maps, sampling.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::colors::ColorMap;
use crate::scene::SmoothNormals;
use crate::section::SectionPlane;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::traverse::Traversal;

/// A shading mode: the meaning of a pixel's colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shading {
    /// Light, materials and textures.
    Lit,
    /// The surface normal.
    Normals,
    /// Distance along the view direction.
    Depth,
    /// Ambient occlusion.
    AmbientOcclusion,
    /// How thick the model is along the whole ray.
    Thickness,
    /// Distance of the section plane from the surface.
    Distance,
    /// The colour of the surface's ancestor node at the chosen depth.
    Clusters,
    /// The colour of the copy that the surface belongs to, in a scene of two levels.
    Copies,
    /// The colour of the mesh that the surface belongs to a copy of, in a scene of two levels.
    Meshes,
    /// Number of tests of the pixel's ray.
    Heat(HeatKind),
}

/// The tests that a heat map counts.
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
    /// Cache lines of the wide tree that are read, each once for a ray.
    Lines,
    /// Containers along the whole ray, whatever surface is in between: how many lie one over the other in a pixel.
    WholeRay,
    /// Copies of meshes that the ray is carried into, whose trees it is tested with; none in a flat scene.
    Copies,
    /// Tests of a query for all hits of the ray.
    AllHits,
    /// Tests of a query for the point of the surface that is closest to a point of the section plane.
    ClosestPoint,
}

impl HeatKind {
    /// Rays are counted through the wide tree.
    pub const fn is_of_wide_tree(self) -> bool {
        matches!(self, Self::Steps | Self::Lines)
    }

    /// A layout of wide trees has such counts.
    pub const fn is_of_layouts(self) -> bool {
        matches!(self, Self::Containers | Self::Primitives | Self::Both | Self::Steps | Self::Lines | Self::WholeRay)
    }

    /// The counted quantity in the plural, for labels.
    pub const fn counted(self) -> &'static str {
        match self {
            Self::Containers => "container tests",
            Self::Primitives => "triangle tests",
            Self::Both => "tests",
            Self::Steps => "wide tree steps",
            Self::Lines => "cache lines",
            Self::WholeRay => "containers along the ray",
            Self::Copies => "copies entered",
            Self::AllHits => "tests for all hits",
            Self::ClosestPoint => "tests for the closest point",
        }
    }
}

/// The key light of lit shading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Light {
    /// At the camera; no shadows.
    Headlight,
    /// From a fixed high direction, with shadow rays.
    Sun,
    /// The lights of the file, with shadow rays; the sun where it has none.
    File,
}

impl Light {
    /// All lights.
    pub const ALL: [Self; 3] = [Self::Headlight, Self::Sun, Self::File];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Headlight => "headlight",
            Self::Sun => "sun",
            Self::File => "file",
        }
    }
}

/// Where the normals of surfaces come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormalSource {
    /// The file, or the crease angle where it has none.
    #[default]
    File,
    /// The crease angle: triangles that meet at less are smooth.
    Crease,
    /// The triangles: every one is flat.
    Flat,
}

impl NormalSource {
    /// All sources, in the order of menus.
    pub const ALL: [Self; 3] = [Self::File, Self::Crease, Self::Flat];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::File => "file",
            Self::Crease => "crease",
            Self::Flat => "flat",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::File => "From file",
            Self::Crease => "By crease angle",
            Self::Flat => "Flat",
        }
    }
}

/// Exposure of lit shading: how much light is shown as white.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Exposure {
    /// Metered from the light that arrives at the surfaces in view, so that a dark interior is as easy to see as an outdoor
    /// scene, and a black model stays black.
    #[default]
    Auto,
    /// Fixed, in stops (EV): each doubles the light, 0 shows it as it is.
    Fixed(f32),
}

impl Exposure {
    /// Largest number of stops in either direction that the meter chooses.
    pub const MAX_AUTO: f32 = 4.0;
    /// Largest number of stops in either direction that can be set.
    pub const MAX_FIXED: f32 = 8.0;
}

/// The colour where no surface is, in modes that show surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Background {
    /// Dark grey, lighter at the top.
    #[default]
    Dark,
    /// Light grey, lighter at the top: for the light theme.
    Light,
    /// White: for paper.
    White,
    /// Nothing: pixels are as opaque as the surfaces cover them.
    Transparent,
}

impl Background {
    /// All backgrounds.
    pub const ALL: [Self; 4] = [Self::Dark, Self::Light, Self::White, Self::Transparent];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Dark => "dark",
            Self::Light => "light",
            Self::White => "white",
            Self::Transparent => "transparent",
        }
    }

    /// The colour that is drawn where the picture is left out: sRGB, premultiplied by the opacity.
    pub const fn backdrop(self) -> [f32; 4] {
        match self {
            Self::Dark => [0.105, 0.11, 0.12, 1.0],
            Self::Light => [0.84, 0.845, 0.85, 1.0],
            Self::White => [1.0; 4],
            Self::Transparent => [0.0; 4],
        }
    }

    /// Text over it is light.
    pub const fn is_dark(self) -> bool {
        matches!(self, Self::Dark)
    }

    /// Linear colour at `y`, from 0 at the upper edge of the picture to 1 at the lower. Of a transparent one, how clear it is.
    pub(super) fn color(self, y: f32) -> Vec3 {
        let [top, bottom] = match self {
            Self::Dark => [Vec3::new(0.052, 0.055, 0.062), Vec3::new(0.016, 0.017, 0.019)],
            Self::Light => [Vec3::new(0.78, 0.79, 0.80), Vec3::new(0.52, 0.53, 0.55)],
            Self::White | Self::Transparent => return Vec3::ONE,
        };
        top.lerp(bottom, y.clamp(0.0, 1.0))
    }
}

/// Everything that decides a picture beside scene, tree, camera and size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RenderSettings {
    /// A shading mode: the meaning of a pixel's colour.
    pub shading: Shading,
    /// The key light of lit shading.
    pub light: Light,
    /// Exposure of lit shading.
    #[serde(default)]
    pub exposure: Exposure,
    /// Where normals come from.
    #[serde(default)]
    pub normals: NormalSource,
    /// Crease angle in degrees, 0 to 180: triangles that meet at less are smooth.
    #[serde(default = "default_crease_degrees")]
    pub crease_degrees: f32,
    /// Catches the model's shadow on a ground below it, in lit shading.
    #[serde(default)]
    pub ground: bool,
    /// Depth of the nodes that cluster colours show where no cut is given; leaves above keep their own colour.
    pub cluster_depth: u32,
    /// Traversal order wherever tests are counted.
    pub traversal: Traversal,
    /// Counts at the two ends of the heat map; `None` fits the range to the picture.
    pub heat_range: Option<[f32; 2]>,
    /// Colour map of depth and heat maps.
    pub color_map: ColorMap,
    /// The colour where no surface is. The window sets it by its theme.
    #[serde(default)]
    pub background: Background,
    /// Draws the triangles' edges over the surface.
    #[serde(default)]
    pub mesh_edges: bool,
    /// The plane that cuts the model and its containers open; `None` for the whole model.
    #[serde(default)]
    pub section: Option<SectionPlane>,
    /// SIMD level of the traversal; changes only the speed.
    #[serde(skip)]
    pub simd: SimdLevel,
    /// Antialiasing samples per pixel at full resolution; see [`RenderSettings::wanted_samples`].
    pub samples: u32,
}

/// Place of the nearest surface of a depth map on the colour map, whose start may be black.
const NEAREST: f32 = 0.2;

const fn default_crease_degrees() -> f32 {
    SmoothNormals::DEFAULT_CREASE_DEGREES
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            shading: Shading::Lit,
            light: Light::Sun,
            exposure: Exposure::Auto,
            normals: NormalSource::File,
            crease_degrees: default_crease_degrees(),
            ground: false,
            cluster_depth: 6,
            traversal: Traversal::Ordered,
            heat_range: None,
            color_map: ColorMap::Inferno,
            background: Background::Dark,
            mesh_edges: false,
            section: None,
            simd: SimdLevel::best(),
            samples: 64,
        }
    }
}

impl RenderSettings {
    /// Samples per pixel of a picture at full resolution: `samples`, at least 1, and always 1 in modes whose colours encode a
    /// single value.
    pub fn wanted_samples(&self) -> u32 {
        if self.shading.has_values() { 1 } else { self.samples.max(1) }
    }

    /// The colour of a value at `position` between both ends of the range, 0 to 1, as sRGB bytes. The nearest surface of a depth map is
    /// not as dark as a background.
    pub fn value_color(&self, position: f32) -> [u8; 3] {
        let start = if self.shading == Shading::Depth { NEAREST } else { 0.0 };
        self.color_map.srgb(start + (1.0 - start) * position.clamp(0.0, 1.0))
    }

    /// The settings that decide a picture's rays: the light, the normals, the section plane and the SIMD level; the rest as by
    /// default.
    #[must_use]
    pub fn of_rays(&self) -> Self {
        let Self { light, normals, crease_degrees, section, simd, .. } = *self;
        Self { light, normals, crease_degrees, section, simd, ..Self::default() }
    }
}

impl Shading {
    /// Colours encode numbers, so that [`Frame::values`](super::Frame::values) is filled and there is a legend.
    pub const fn has_values(self) -> bool {
        self.is_length() || matches!(self, Self::Heat(_))
    }

    /// Colours encode lengths, and the background has none.
    pub const fn is_length(self) -> bool {
        matches!(self, Self::Depth | Self::Thickness | Self::Distance)
    }

    /// Colours stand for numbers or nodes, so that coloured lines over them would be mistaken for more of these.
    pub const fn is_coded(self) -> bool {
        self.has_values() || matches!(self, Self::Clusters | Self::Copies | Self::Meshes)
    }

    /// A heat map of what a layout of wide trees has counts of.
    pub const fn is_of_layouts(self) -> bool {
        matches!(self, Self::Heat(kind) if kind.is_of_layouts())
    }

    /// All modes, in the order of menus.
    pub const ALL: [Self; 18] = [
        Self::Lit,
        Self::Normals,
        Self::Depth,
        Self::AmbientOcclusion,
        Self::Clusters,
        Self::Heat(HeatKind::Both),
        Self::Heat(HeatKind::Containers),
        Self::Heat(HeatKind::Primitives),
        Self::Heat(HeatKind::Steps),
        Self::Heat(HeatKind::Lines),
        Self::Heat(HeatKind::WholeRay),
        Self::Heat(HeatKind::Copies),
        Self::Copies,
        Self::Meshes,
        Self::Thickness,
        Self::Distance,
        Self::Heat(HeatKind::AllHits),
        Self::Heat(HeatKind::ClosestPoint),
    ];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Lit => "lit",
            Self::Normals => "normals",
            Self::Depth => "depth",
            Self::AmbientOcclusion => "ao",
            Self::Thickness => "thickness",
            Self::Distance => "distance",
            Self::Clusters => "clusters",
            Self::Copies => "copies",
            Self::Meshes => "meshes",
            Self::Heat(HeatKind::Both) => "heat",
            Self::Heat(HeatKind::Containers) => "heat-containers",
            Self::Heat(HeatKind::Primitives) => "heat-primitives",
            Self::Heat(HeatKind::Steps) => "heat-steps",
            Self::Heat(HeatKind::Lines) => "heat-lines",
            Self::Heat(HeatKind::WholeRay) => "heat-whole-ray",
            Self::Heat(HeatKind::Copies) => "heat-copies",
            Self::Heat(HeatKind::AllHits) => "heat-all-hits",
            Self::Heat(HeatKind::ClosestPoint) => "heat-closest-point",
        }
    }

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Lit => "Lit",
            Self::Normals => "Normals",
            Self::Depth => "Depth",
            Self::AmbientOcclusion => "Ambient occlusion",
            Self::Thickness => "Thickness",
            Self::Distance => "Distance to the surface",
            Self::Clusters => "Cluster colours",
            Self::Copies => "Colours by copy",
            Self::Meshes => "Colours by mesh",
            Self::Heat(HeatKind::Both) => "Heat: all tests",
            Self::Heat(HeatKind::Containers) => "Heat: container tests",
            Self::Heat(HeatKind::Primitives) => "Heat: triangle tests",
            Self::Heat(HeatKind::Steps) => "Heat: wide tree steps",
            Self::Heat(HeatKind::Lines) => "Heat: cache lines",
            Self::Heat(HeatKind::WholeRay) => "Heat: whole ray",
            Self::Heat(HeatKind::Copies) => "Heat: copies entered",
            Self::Heat(HeatKind::AllHits) => "Heat: all hits",
            Self::Heat(HeatKind::ClosestPoint) => "Heat: closest point",
        }
    }
}
