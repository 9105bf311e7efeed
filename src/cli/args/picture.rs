//! Flags of the camera, the picture and the overlay.

use clap::Args;
use glam::{DVec3, Vec3};

use crate::cli::named::{drawn_containers, help, named, simd};
use crate::cli::values::{self, ViewArg};
use crate::overlay::{ColorBy, ContainerSet};
use crate::render::{ColorMap, Exposure, Light, NormalSource, Shading};
use crate::view::NamedView;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::traverse::Traversal;

#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    #[arg(long, value_name = "NAME", value_parser = values::view,
          help = help::<NamedView>("A view of the model: ", ", or the number of a camera of the file, from 0 (default: that of a \
                                    PBRT scene; from inside where the model encloses its centre; otherwise outside; measurements \
                                    start outside)"))]
    pub camera: Option<ViewArg>,
    /// Position of the observer, in the coordinates of the file
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub eye: Option<DVec3>,
    /// The point at the centre of the picture, in the coordinates of the file
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub target: Option<DVec3>,
    /// The up direction of the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    pub up: Option<Vec3>,
    /// Vertical field of view in degrees, 1 to 170 [default: 45]
    #[arg(long, value_name = "DEG", value_parser = values::fov)]
    pub fov: Option<f32>,
    /// Parallel rays instead of perspective
    #[arg(long)]
    pub orthographic: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Picture")]
pub struct PictureArgs {
    #[arg(long, value_name = "NAME", value_parser = named::<Shading>,
          help = help::<Shading>("What colours mean: ", " [default: lit]"))]
    pub shading: Option<Shading>,
    /// Light of the lit mode: sun (with shadows), headlight, or file (its own lights) [default: sun]
    #[arg(long, value_name = "NAME", value_parser = named::<Light>)]
    pub light: Option<Light>,
    /// Exposure of the lit mode: auto (metered), or a number of stops, -8 to 8, of which each doubles the light [default: auto]
    #[arg(long, value_name = "EV", value_parser = values::exposure, allow_hyphen_values = true)]
    pub exposure: Option<Exposure>,
    /// Normals: file (by crease angle where it has none), crease, or flat triangles [default: file]
    #[arg(long, value_name = "NAME", value_parser = named::<NormalSource>)]
    pub normals: Option<NormalSource>,
    /// Crease angle in degrees, 0 to 180: triangles that meet at less are smooth [default: 40]
    #[arg(long, value_name = "DEG", value_parser = |text: &str| values::decimal(text, 0.0, 180.0))]
    pub crease: Option<f32>,
    /// How rays visit nodes where tests are counted: ordered, or paper (unordered, no culling by distance)
    #[arg(long, value_name = "NAME", value_parser = named::<Traversal>)]
    pub traversal: Option<Traversal>,
    /// Test counts at the two ends of the heat map [default: fitted to the picture]
    #[arg(long, value_name = "A..B", value_parser = values::heat_range, allow_hyphen_values = true)]
    pub heat_range: Option<[f32; 2]>,
    #[arg(long, value_name = "NAME", value_parser = named::<ColorMap>,
          help = help::<ColorMap>("Colours of depth and heat maps: ", " [default: inferno]"))]
    pub color_map: Option<ColorMap>,
    /// Tree level that cluster colours show [default: 6]
    #[arg(long, value_name = "LEVEL", value_parser = |text: &str| values::whole::<u32>(text, 0, 1_000_000))]
    pub cluster_depth: Option<u32>,
    /// Catch the model's shadow on a ground below it, in the lit mode
    #[arg(long)]
    pub ground: bool,
    /// Draw the edges of the triangles over the picture
    #[arg(long)]
    pub mesh_edges: bool,
    /// Vector instructions of builds and rays: sse2, avx2, avx512 or neon, where this machine has them [default: the best]
    #[arg(long, value_name = "LEVEL", value_parser = simd)]
    pub simd: Option<SimdLevel>,
    /// Antialiasing samples a pixel, 1 to 1024 [default: 64]
    #[arg(long, value_name = "N", value_parser = values::samples)]
    pub samples: Option<u32>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Overlay")]
pub struct OverlayArgs {
    /// Draw containers over the picture: box, sphere, dop or oriented, or several separated by commas; both (box and sphere), all (but
    /// oriented), or none but the selected node's
    #[arg(long, value_name = "LIST", value_parser = drawn_containers)]
    pub overlay: Option<ContainerSet>,
    /// Tree levels that are drawn, root 0, both ends included [default: those that hold 100 to 200 nodes]
    #[arg(long, value_name = "A..B", value_parser = values::depths, allow_hyphen_values = true)]
    pub depth: Option<[u32; 2]>,
    /// Draw only leaves
    #[arg(long)]
    pub leaves: bool,
    /// Draw all levels above the chosen ones too
    #[arg(long)]
    pub parents: bool,
    #[arg(long, value_name = "NAME", value_parser = named::<ColorBy>,
          help = help::<ColorBy>("What the colour of a line means: ", " [default: depth]"))]
    pub color_by: Option<ColorBy>,
    /// Fill the sides of containers that face the viewer, faintly
    #[arg(long)]
    pub faces: bool,
    /// Fill what the children of the node of --select have in common, seen through the surface
    #[arg(long)]
    pub overlap: bool,
    /// Strength of lines behind the surface, 0 to 1 [default: 0.15]
    #[arg(long, value_name = "X", value_parser = |text: &str| values::decimal(text, 0.0, 1.0))]
    pub hidden_lines: Option<f32>,
    /// Width of the lines, 0.25 to 64 pixels; in the viewer points [default: 1.25]
    #[arg(long, value_name = "PX", value_parser = |text: &str| values::decimal(text, 0.25, 64.0))]
    pub line_width: Option<f32>,
    /// Maximum number of containers of each kind that are drawn, the largest on screen first, 1 to 1000000
    /// [default: 250000]
    #[arg(long, value_name = "N", value_parser = |text: &str| values::whole::<u32>(text, 1, 1_000_000))]
    pub at_most: Option<u32>,
}

/// Flags for single nodes of the overlay, by the index that the window shows for a selected node.
#[derive(Debug, Args)]
#[command(next_help_heading = "Overlay")]
pub struct NodeArgs {
    /// Draw this node thick, and its children in its tints
    #[arg(long, value_name = "NODE", requires = "overlay", value_parser = values::node)]
    pub select: Option<u32>,
    /// Leave out these nodes, separated by commas, with everything below them and their triangles
    #[arg(long, value_name = "NODE,…", value_delimiter = ',', value_parser = values::node)]
    pub hide: Vec<u32>,
    /// Leave out everything but this node, what is below it and their triangles
    #[arg(long, value_name = "NODE", value_parser = values::node)]
    pub isolate: Option<u32>,
    /// Keep the triangles of left out nodes in the picture
    #[arg(long)]
    pub keep_triangles: bool,
    /// A neutral background in place of the traced picture
    #[arg(long, requires = "overlay")]
    pub no_geometry: bool,
}
