//! The flags as they are typed. Nothing beyond this folder sees these types.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use glam::Vec3;

use super::values::{self, Epsilons, ModelParser, Numbers};
use crate::budget::MemoryLimit;
use crate::bvh::traverse::Traversal;
use crate::bvh::{BuilderKind, ContainerKind, Curve, Passes, Preset, SimdLevel};
use crate::overlay::{ColorBy, OverlayKinds};
use crate::render::{ColorMap, Light, Shading};
use crate::scene::SceneSource;
use crate::view::View;

/// Looks into bounding volume hierarchies made by agglomerative clustering.
#[derive(Debug, Parser)]
#[command(
    name = "bvhscope",
    version,
    about = "Looks into bounding volume hierarchies made by agglomerative clustering",
    long_about = "Opens a 3D model, ray traces it on the CPU through a bounding volume hierarchy (BVH) built by approximate \
                  agglomerative clustering (AAC), and shows the tree. Without a command it opens the viewer.",
    args_conflicts_with_subcommands = true,
    after_help = "Examples:
  bvhscope                                 the viewer with the built-in teapot
  bvhscope bunny.obj --preset hq           the viewer with a model
  bvhscope render bunny.obj -o bunny.png   a picture without a window
  bvhscope bench bunny.obj                 box and sphere compared, as in the paper
  bvhscope COMMAND --help                  the flags of a command

MODEL is an OBJ, glTF, GLB, PLY or STL file, or builtin:NAME[:SIZE] with NAME one of
teapot, cornell, sphereflake, terrain, slivers, clusters.

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 done with warnings under --strict, 130 interrupted."
)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<CommandArgs>,
    #[command(flatten)]
    pub viewer: ViewerArgs,
}

#[derive(Debug, Subcommand)]
pub enum CommandArgs {
    /// Render one frame into a PNG without a window, with or without overlay
    Render(RenderArgs),
    /// Measure box and sphere: build, trace, tests per ray (the paper's tables 1 and 2)
    Bench(BenchArgs),
    /// Measure a range of thresholds (the paper's figures 9 and 10)
    Sweep(SweepArgs),
    /// Measure the speed-up over threads (the paper's figure 11)
    Scaling(ScalingArgs),
    /// Measure the builders side by side
    Compare(CompareArgs),
    /// Draw a plot from the JSON lines of bench, sweep, scaling or compare
    Plot(PlotArgs),
    /// Say what a model holds, what its tree looks like and what is sick about it
    Info(InfoArgs),
}

#[derive(Debug, Args)]
pub struct ViewerArgs {
    /// The model: a file, or builtin:NAME[:SIZE]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub load: LoadArgs,
    #[command(flatten)]
    pub camera: CameraArgs,
    #[command(flatten)]
    pub picture: PictureArgs,
    #[command(flatten)]
    pub overlay: OverlayArgs,
    /// Neither read nor write settings
    #[arg(long, help_heading = "Settings")]
    pub no_config: bool,
    /// Begin with default settings; the old ones are kept aside
    #[arg(long, help_heading = "Settings")]
    pub reset_settings: bool,
    /// Go on where the last run ended, after the graphics driver was lost
    #[arg(long, hide = true)]
    pub restore: bool,
    /// Lose the graphics driver after the first picture
    #[arg(long, hide = true)]
    pub lose_device: bool,
    /// For tests: the driver refuses a buffer once something is shown
    #[arg(long, hide = true)]
    pub refuse_buffer: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope render bunny.obj -o bunny.png --size 1920x1080 --samples 64
  bvhscope render bunny.obj -o boxes.png --overlay box --depth 5..7 --camera front
  bvhscope render bunny.obj -o heat.png --shading heat --heat-range 0..80
  bvhscope render bunny.obj -o bunny.png --depth-image bunny.exr")]
pub struct RenderArgs {
    /// The model: a file, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    /// The PNG that is written
    #[arg(short, long, value_name = "FILE.png", required_unless_present = "depth_image")]
    pub output: Option<PathBuf>,
    /// Also write each pixel's hit distance along its unit ray, infinity where nothing is hit
    #[arg(long, value_name = "FILE.exr")]
    pub depth_image: Option<PathBuf>,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "1280x720")]
    pub size: [u32; 2],
    /// Print what was measured as one JSON object
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub load: LoadArgs,
    #[command(flatten)]
    pub strict: StrictArgs,
    #[command(flatten)]
    pub camera: CameraArgs,
    #[command(flatten)]
    pub picture: PictureArgs,
    #[command(flatten)]
    pub overlay: OverlayArgs,
    #[command(flatten)]
    pub nodes: NodeArgs,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Tree")]
pub struct BuildArgs {
    /// The algorithm: aac, lbvh, binned-sah, exact or none [default: aac]
    #[arg(long, value_name = "NAME", value_parser = |text: &str| values::named(text, &BuilderKind::ALL, |kind| kind.name().to_owned()))]
    pub builder: Option<BuilderKind>,
    /// What the tree is made of: box or sphere [default: box]
    #[arg(long, value_name = "KIND", value_parser = |text: &str| values::named(text, &ContainerKind::ALL, |kind| kind.name().to_owned()))]
    pub container: Option<ContainerKind>,
    #[command(flatten)]
    pub shape: ShapeArgs,
    /// Threads for building and tracing, 1 to 1024 [default: all]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub threads: Option<usize>,
}

/// How a tree is built, whichever builders and containers a command offers.
#[derive(Debug, Args)]
pub struct ShapeArgs {
    /// AAC: fewer primitives than this are clustered, not split, 2 to 64 [default: 6]
    #[arg(long, value_name = "N", value_parser = values::threshold)]
    pub threshold: Option<u32>,
    /// AAC: exponent of the reduction function, 0 to 0.5 [default: 0.2]
    #[arg(long, value_name = "X", value_parser = values::epsilon)]
    pub epsilon: Option<f32>,
    /// AAC: threshold and ε by name: fast (6, 0.2), hq (12, 0.1), aac-fast (4, 0.2), aac-hq (20, 0.1), best (6, 0.2 and all passes)
    #[arg(long, value_name = "NAME", value_parser = |text: &str| values::named(text, &Preset::ALL, |preset| preset.name().to_owned()))]
    pub preset: Option<Preset>,
    /// Passes over the finished tree, with commas between: collapse, restructure and reinsert (boxes only); or all, none [default: none]
    #[arg(long, value_name = "LIST", value_parser = values::passes)]
    pub optimize: Option<Passes>,
    /// AAC and LBVH: the curve along which triangles are sorted: morton, hilbert or extended (Morton and size) [default: morton]
    #[arg(long, value_name = "NAME", value_parser = |text: &str| values::named(text, &Curve::ALL, |curve| curve.name().to_owned()))]
    pub curve: Option<Curve>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Loading")]
pub struct LoadArgs {
    /// Let a model read files outside of its own folder (materials, textures, buffers)
    #[arg(long)]
    pub allow_outside: bool,
    /// Memory that the program may use, as 4GB, 500MB or 50% of what is available [default: 75%]
    #[arg(long, value_name = "SIZE|PERCENT", value_parser = values::memory)]
    pub memory_limit: Option<MemoryLimit>,
}

/// What every command takes that ends by itself.
#[derive(Debug, Args)]
#[command(next_help_heading = "Loading")]
pub struct StrictArgs {
    /// Exit with code 3 where a file was loaded with warnings
    #[arg(long)]
    pub strict: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub struct CameraArgs {
    /// A view of the whole model: default, front, back, left, right, top or bottom
    #[arg(long, value_name = "NAME", default_value = "default", hide_default_value = true,
          value_parser = |text: &str| values::named(text, &View::ALL, |view| view.name().to_owned()))]
    pub camera: View,
    /// Where the observer is
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub eye: Option<Vec3>,
    /// The point in the middle of the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub target: Option<Vec3>,
    /// What is up in the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    pub up: Option<Vec3>,
    /// Vertical opening angle in degrees, 1 to 170 [default: 45]
    #[arg(long, value_name = "DEG", value_parser = values::fov)]
    pub fov: Option<f32>,
    /// Parallel rays instead of perspective
    #[arg(long)]
    pub orthographic: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Picture")]
pub struct PictureArgs {
    /// What colours mean: lit, normals, depth, ao, clusters, heat, heat-containers, heat-primitives or heat-steps [default: lit]
    #[arg(long, value_name = "NAME", value_parser = |text: &str| values::named(text, &Shading::ALL, |mode| mode.name().to_owned()))]
    pub shading: Option<Shading>,
    /// Light of the lit mode: sun (with shadows) or headlight [default: sun]
    #[arg(long, value_name = "NAME", value_parser = |text: &str| values::named(text, &[Light::Headlight, Light::Sun],
          |light| if light == Light::Sun { "sun".to_owned() } else { "headlight".to_owned() }))]
    pub light: Option<Light>,
    /// How rays visit nodes where tests are counted: ordered, or paper (unordered, no culling by distance)
    #[arg(long, value_name = "NAME", value_parser = parse_traversal)]
    pub traversal: Option<Traversal>,
    /// Test counts at the two ends of the heat map [default: fitted to the picture]
    #[arg(long, value_name = "A..B", value_parser = values::heat_range)]
    pub heat_range: Option<[f32; 2]>,
    /// Colours of depth and heat maps: viridis, inferno or turbo [default: inferno]
    #[arg(long, value_name = "NAME", value_parser = |text: &str| values::named(text, &ColorMap::ALL, |map| map.label().to_lowercase()))]
    pub color_map: Option<ColorMap>,
    /// Tree level that cluster colours show [default: 6]
    #[arg(long, value_name = "LEVEL", value_parser = |text: &str| values::whole::<u32>(text, 0, 1_000_000))]
    pub cluster_depth: Option<u32>,
    /// Draw the edges of the triangles over the picture
    #[arg(long)]
    pub mesh_edges: bool,
    /// Vector instructions: sse2, sse4, avx2, avx512 or neon, where this machine has them [default: the best]
    #[arg(long, value_name = "LEVEL", value_parser = values::simd)]
    pub simd: Option<SimdLevel>,
    /// Antialiasing samples a pixel, 1 to 1024 [default: 16]
    #[arg(long, value_name = "N", value_parser = values::samples)]
    pub samples: Option<u32>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Overlay")]
pub struct OverlayArgs {
    /// Lay containers over the picture: box, sphere, both, or none but the selected node's
    #[arg(long, value_name = "KIND", value_parser = values::overlay_kinds)]
    pub overlay: Option<OverlayKinds>,
    /// Tree levels that are drawn, root 0, both ends included [default: 4..6]
    #[arg(long, value_name = "A..B", value_parser = values::depths)]
    pub depth: Option<[u32; 2]>,
    /// Draw only leaves
    #[arg(long)]
    pub leaves: bool,
    /// Draw all levels above the chosen ones too
    #[arg(long)]
    pub parents: bool,
    /// What the colour of a line means: depth, size, overlap or primitives [default: depth]
    #[arg(long, value_name = "NAME", value_parser = |text: &str| values::named(text, &ColorBy::ALL, |by| by.label().to_lowercase()))]
    pub color_by: Option<ColorBy>,
    /// Strength of lines behind the surface, 0 to 1 [default: 0.15]
    #[arg(long, value_name = "X", value_parser = |text: &str| values::decimal(text, 0.0, 1.0))]
    pub hidden_lines: Option<f32>,
    /// Width of the lines, 0.25 to 64 pixels; in the viewer points [default: 1.25]
    #[arg(long, value_name = "PX", value_parser = |text: &str| values::decimal(text, 0.25, 64.0))]
    pub line_width: Option<f32>,
    /// Draw at most so many containers of each kind, the largest, 1 to 1000000 [default: 4000]
    #[arg(long, value_name = "N", value_parser = |text: &str| values::whole::<u32>(text, 1, 1_000_000))]
    pub at_most: Option<u32>,
}

/// Single nodes of the overlay, by the numbers that the window shows of a selected one.
#[derive(Debug, Args)]
#[command(next_help_heading = "Overlay")]
pub struct NodeArgs {
    /// Draw this node thick, and its children in its tints
    #[arg(long, value_name = "NODE", requires = "overlay", value_parser = values::node)]
    pub select: Option<u32>,
    /// Do not draw these nodes, separated by commas
    #[arg(long, value_name = "NODE,…", requires = "overlay", value_delimiter = ',', value_parser = values::node)]
    pub hide: Vec<u32>,
    /// A neutral background in place of the traced picture
    #[arg(long, requires = "overlay")]
    pub no_geometry: bool,
}

/// What every measuring command takes.
#[derive(Debug, Args)]
pub struct MeasureArgs {
    /// The models: files, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub models: Vec<SceneSource>,
    /// Size of the traced picture in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "1024x1024")]
    pub size: [u32; 2],
    /// Repetitions of each measurement; medians are shown
    #[arg(long, value_name = "N", value_parser = values::repeat, default_value = "3")]
    pub repeat: usize,
    /// How rays visit nodes: ordered (near child first, culled by distance), or paper (neither)
    #[arg(long, value_name = "NAME", value_parser = parse_traversal, default_value = "ordered")]
    pub traversal: Traversal,
    /// Threads for building and tracing, 1 to 1024 [default: all]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub threads: Option<usize>,
    /// Vector instructions for tracing: sse2, sse4, avx2, avx512 or neon, where this machine has them [default: the best]
    #[arg(long, value_name = "LEVEL", value_parser = values::simd)]
    pub simd: Option<SimdLevel>,
    /// Print one JSON object a line instead of the table
    #[arg(long)]
    pub json: bool,
    /// Also write the rows as CSV
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Also draw the plot
    #[arg(long, value_name = "FILE.png|.svg")]
    pub plot: Option<PathBuf>,
    #[command(flatten)]
    pub camera: CameraArgs,
    #[command(flatten)]
    pub load: LoadArgs,
    #[command(flatten)]
    pub strict: StrictArgs,
}

/// Containers of a measuring command.
#[derive(Debug, Clone)]
pub struct Containers(pub Vec<ContainerKind>);

fn parse_containers(text: &str) -> Result<Containers, String> {
    match text {
        "box" => Ok(Containers(vec![ContainerKind::Aabb])),
        "sphere" => Ok(Containers(vec![ContainerKind::Sphere])),
        "both" => Ok(Containers(ContainerKind::ALL.to_vec())),
        _ => Err("one of box, sphere, both is expected".to_owned()),
    }
}

fn parse_traversal(text: &str) -> Result<Traversal, String> {
    match text {
        "ordered" => Ok(Traversal::Ordered),
        "paper" => Ok(Traversal::Paper),
        _ => Err("one of ordered, paper is expected".to_owned()),
    }
}

/// Settings of the one tree that bench and scaling measure.
#[derive(Debug, Args)]
pub struct OneTreeArgs {
    /// The algorithm: aac, lbvh, binned-sah or exact [default: aac]
    #[arg(long, value_name = "NAME", value_parser = |text: &str| values::named(text, &BuilderKind::ALL[..4], |kind| kind.name().to_owned()))]
    pub builder: Option<BuilderKind>,
    /// What the tree is made of: box, sphere or both [default: both for bench, box for scaling]
    #[arg(long, value_name = "KIND", value_parser = parse_containers)]
    pub container: Option<Containers>,
    #[command(flatten)]
    pub shape: ShapeArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope bench bunny.obj dragon.ply
  bvhscope bench bunny.obj --traversal paper --repeat 9 --json
  bvhscope bench builtin:teapot:4 --no-bvh --plot bench.svg")]
pub struct BenchArgs {
    #[command(flatten)]
    pub tree: OneTreeArgs,
    /// Also test every triangle, on a sample of the pixels that is printed
    #[arg(long)]
    pub no_bvh: bool,
    #[command(flatten)]
    pub measure: MeasureArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope sweep bunny.obj --threshold 2..=32 --plot sweep.png
  bvhscope sweep bunny.obj dragon.ply --epsilon 0.1,0.2 --container both --csv sweep.csv
  bvhscope sweep bunny.obj --shard 2/8 --json > part2.jsonl")]
pub struct SweepArgs {
    /// Thresholds: N, A,B,C or A..=B, within 2 to 64
    #[arg(long, value_name = "RANGE", value_parser = values::thresholds, default_value = "2..=32")]
    pub threshold: Numbers,
    /// Each ε, 0 to 0.5, separated by commas
    #[arg(long, value_name = "X,…", value_parser = values::epsilons, default_value = "0.2")]
    pub epsilon: Epsilons,
    /// What the trees are made of: box, sphere or both
    #[arg(long, value_name = "KIND", value_parser = parse_containers, default_value = "box")]
    pub container: Containers,
    /// Measure only the I-th of N shares of the rows, so that a sweep can be spread over machines
    #[arg(long, value_name = "I/N", value_parser = values::shard)]
    pub shard: Option<(usize, usize)>,
    #[command(flatten)]
    pub measure: MeasureArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope scaling bunny.obj --plot scaling.svg
  bvhscope scaling bunny.obj --threads 8 --container both   1 to 8 threads")]
pub struct ScalingArgs {
    #[command(flatten)]
    pub tree: OneTreeArgs,
    #[command(flatten)]
    pub measure: MeasureArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope compare bunny.obj
  bvhscope compare bunny.obj --container both --csv builders.csv")]
pub struct CompareArgs {
    /// What the trees are made of: box, sphere or both
    #[arg(long, value_name = "KIND", value_parser = parse_containers, default_value = "box")]
    pub container: Containers,
    #[command(flatten)]
    pub measure: MeasureArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope plot part1.jsonl part2.jsonl -o sweep.svg
  bvhscope sweep bunny.obj --json | bvhscope plot - -o sweep.png")]
pub struct PlotArgs {
    /// Files of JSON lines; - is standard input
    #[arg(value_name = "FILES", required = true)]
    pub files: Vec<PathBuf>,
    /// The picture that is written
    #[arg(short, long, value_name = "FILE.png|.svg")]
    pub output: PathBuf,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope info bunny.obj
  bvhscope info scene.glb --preset hq --json")]
pub struct InfoArgs {
    /// The model: a file, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    /// Print one JSON object instead of the text
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub load: LoadArgs,
    #[command(flatten)]
    pub strict: StrictArgs,
}
