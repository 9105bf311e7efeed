//! The flags as clap parses them. Only `cli` uses these types.

mod copies;
mod layouts;
mod measure;
mod picture;
mod ray;
mod rays;
mod setting_flags;
mod shared;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

pub use copies::CopiesArgs;
pub use layouts::LayoutsArgs;
pub use measure::{
    AnimateArgs, BenchArgs, CompareArgs, DiffArgs, MeasureArgs, OneTreeArgs, PlotArgs, ScalingArgs, SweepArgs,
    TraceArgs, TreesFromFilesArgs,
};
pub use picture::{CameraArgs, CameraParts, CamerasArgs, NodeArgs};
pub use ray::RayArgs;
pub use rays::RaysArgs;
pub use setting_flags::SettingFlags;
pub use shared::{BuildArgs, FollowArgs, FollowedMomentArgs, LoadArgs, MomentArgs, StrictLoadArgs, TreeFileArgs};

use super::named::{help, named, rays, rays_help, simd};
use super::values::{self, ModelParser};
#[cfg(feature = "gui")]
use crate::app::SharedState;
use crate::catalog::layouts::LayoutChoice;
use crate::headless::{MeasuringRays, Times};
use crate::overlay::OverlaySettings;
use crate::render::{Background, RenderSettings};
use crate::scene::{BUILTIN_SCENES, SceneSource, format_names};
use crate::section::SectionChoice;
use bvhscope_engine::construction::MergeOrder;
use bvhscope_engine::kernel::SimdLevel;

/// The end of `bvhscope --help`.
fn after_help() -> String {
    let scenes: Vec<&str> = BUILTIN_SCENES.iter().map(|scene| scene.name).collect();
    format!(
        "Examples:
  bvhscope                                 the viewer with the built-in teapot
  bvhscope bunny.obj --preset hq           the viewer with a model
  bvhscope render bunny.obj -o bunny.png   a picture without a window
  bvhscope bench bunny.obj                 box and sphere compared, as in the paper
  bvhscope COMMAND --help                  the flags of a command

MODEL is an {} file, which gzip may have packed (a.ply.gz), or builtin:NAME[:SIZE] with NAME one of
{}.

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 done with warnings under --strict, 130 interrupted.",
        format_names("or"),
        scenes.join(", ")
    )
}

/// The command line of the program.
#[derive(Debug, Parser)]
#[command(
    name = "bvhscope",
    version,
    about = "Shows the bounding volume hierarchies of 3D models, built by agglomerative clustering",
    long_about = "Opens a 3D model, ray traces it on the CPU through a bounding volume hierarchy (BVH) built by approximate \
                  agglomerative clustering (AAC), and shows the tree. Without a command it opens the viewer.",
    args_conflicts_with_subcommands = true,
    after_help = after_help()
)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<CommandArgs>,
    #[command(flatten)]
    pub viewer: ViewerArgs,
}

#[derive(Debug, Subcommand)]
pub enum CommandArgs {
    /// Render one frame into a PNG or EXR without a window, with or without overlay
    Render(RenderArgs),
    /// Measure box and sphere: build, trace, tests per ray (the paper's tables 1 and 2)
    Bench(BenchArgs),
    /// Measure a range of thresholds (the paper's figures 9 and 10)
    Sweep(SweepArgs),
    /// Measure the speed-up over threads (the paper's figure 11)
    Scaling(ScalingArgs),
    /// Measure the builders side by side
    Compare(CompareArgs),
    /// Measure what becomes of the tree of a model that moves: refitted, rebuilt, or one for the whole clip
    Animate(AnimateArgs),
    /// Measure layouts of wide trees: what children, collapse, planes and leaves do to tests, lines and bytes of a ray
    Layouts(LayoutsArgs),
    /// List what the copies of meshes cost rays in a scene of two levels: which meshes and which copies make them slow
    Copies(CopiesArgs),
    /// Compare two trees of a model: numbers, common nodes, and tests in each pixel
    Diff(DiffArgs),
    /// Draw a plot from the JSON lines of bench, sweep, scaling, compare or animate
    Plot(PlotArgs),
    /// Write a film of how a tree is built, merge by merge, as a GIF or as PNGs
    Merges(MergesArgs),
    /// Print the contents of a model, statistics of its tree, and problems found in both
    Info(InfoArgs),
    /// Print every step of one ray through the tree
    Ray(RayArgs),
    /// Write the rays of a population as a file, or read those of another program
    Rays(RaysArgs),
    /// Write the tree of a model as a file for other programs, as a table, or as boxes
    Tree(TreeArgs),
}

#[derive(Debug, Args)]
pub struct ViewerArgs {
    /// The model: a file, or builtin:NAME[:SIZE]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub tree: TreeFileArgs,
    /// Measure trees by the rays of this file: a ray file, an array of NumPy (.npy) or lines of numbers
    #[arg(long, value_name = "FILE")]
    pub rays: Option<PathBuf>,
    #[command(flatten)]
    pub load: LoadArgs,
    #[command(flatten)]
    pub camera: CameraArgs,
    #[command(flatten)]
    pub picture: SettingFlags<RenderSettings>,
    #[command(flatten)]
    pub overlay: SettingFlags<OverlaySettings>,
    /// Show what another window showed: the text that its Ctrl+L copied
    #[cfg(feature = "gui")]
    #[arg(long, value_name = "LINE", value_parser = values::shared_state, conflicts_with = "model")]
    pub state: Option<Box<SharedState>>,
    /// Add the lessons in the files *.txt of this folder to the menu Help; may be given more than once
    #[arg(long, value_name = "FOLDER")]
    pub lessons: Vec<PathBuf>,
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

/// The moments of a picture or a film.
#[derive(Debug, Args)]
#[command(next_help_heading = "Motion")]
pub struct MotionArgs {
    #[command(flatten)]
    pub moment: MomentArgs,
    /// A film of these times in seconds, each with a tree of its own; without STEP the frames of a sequence, of other models 25 a second
    #[arg(long, value_name = "A..B:STEP", value_parser = Times::parse_range, allow_hyphen_values = true,
          conflicts_with_all = ["time", "tree", "depth_image"])]
    pub frames: Option<Times>,
}

/// Surroundings of the model in a picture that is written.
#[derive(Debug, Args)]
pub struct AroundArgs {
    /// Background where no surface is: dark, light, white or transparent [default: dark]
    #[arg(long, value_name = "NAME", value_parser = named::<Background>, help_heading = "Picture")]
    pub background: Option<Background>,
    /// Legend below a picture whose colours stand for numbers or nodes: on or off [default: on, from 240 pixels of width]
    #[arg(long, value_name = "on|off", value_parser = values::on_or_off, help_heading = "Picture")]
    pub legend: Option<bool>,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope render bunny.obj -o bunny.png --size 1920x1080 --samples 64
  bvhscope render bunny.obj -o boxes.png --overlay box --depth 5..7 --camera front
  bvhscope render bunny.obj -o heat.png --shading heat --heat-range 0..80
  bvhscope render bunny.obj -o lines.png --shading heat-lines --layout '4 optimal, 8, leaves 4'
  bvhscope render bunny.obj -o bunny.exr
  bvhscope render fox.glb -o fox.png --clip Run --time 0.4
  bvhscope render builtin:walker -o walker.gif --frames 0..1:0.04 --size 480x480
  bvhscope render 'walk_####.obj' -o walk.png --frames 0..2
  bvhscope render bunny.obj --overlay box --background white -o bunny.svg
  bvhscope render bunny.obj -o bunny.png --depth-image bunny-depth.exr")]
pub struct RenderArgs {
    /// The model: a file, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    /// The picture that is written: a PNG, an SVG with containers as lines, or an EXR of linear radiance, neither exposed nor
    /// tone mapped; of --frames a GIF, an animated PNG or a folder
    #[arg(short, long, value_name = "FILE", required_unless_present = "depth_image")]
    pub output: Option<PathBuf>,
    /// Also write each pixel's hit distance along its unit ray, infinity where nothing is hit
    #[arg(long, value_name = "FILE.exr")]
    pub depth_image: Option<PathBuf>,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, default_value = "1280x720")]
    pub size: [u32; 2],
    /// Print what was measured as one JSON object
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub tree: TreeFileArgs,
    #[command(flatten)]
    pub load: StrictLoadArgs,
    #[command(flatten)]
    pub camera: CameraArgs,
    #[command(flatten)]
    pub around: AroundArgs,
    /// A camera kept in the window (Ctrl+D), by its name
    #[cfg(feature = "gui")]
    #[arg(long, value_name = "NAME", help_heading = "Camera",
          conflicts_with_all = ["camera", "eye", "target", "up", "fov", "orthographic"])]
    pub bookmark: Option<String>,
    #[command(flatten)]
    pub picture: SettingFlags<RenderSettings>,
    #[command(flatten)]
    pub overlay: SettingFlags<OverlaySettings>,
    #[command(flatten)]
    pub nodes: NodeArgs,
    #[command(flatten)]
    pub motion: MotionArgs,
    #[command(flatten)]
    pub follow: FollowArgs,
    /// Cut model and containers open: x, y or z, or a normal X,Y,Z, and a position in the model's unit or in percent; -x keeps
    /// the other half
    #[arg(long, value_name = "AXIS=POSITION", value_parser = SectionChoice::parse, allow_hyphen_values = true,
          help_heading = "Picture")]
    pub section: Option<SectionChoice>,
    /// Count heat maps in this layout of the tree, and draw its nodes: 'engine', or as 'layouts' names it, '4 optimal, 8, leaves 4'
    #[arg(long, value_name = "NAME", value_parser = LayoutChoice::parse, help_heading = "Picture")]
    pub layout: Option<LayoutChoice>,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope info bunny.obj
  bvhscope info scene.glb --preset hq --json
  bvhscope info bunny.obj --tree mine.bvh
  bvhscope info bunny.obj --triangles bunny.f32
  bvhscope info bunny.obj --rays primary,random
  bvhscope info fox.glb --time 0.4 --policy refit")]
pub struct InfoArgs {
    /// The model: a file, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    #[arg(long, value_name = "LIST", value_parser = rays, help = rays_help("Also count the visits of the nodes by such rays: "))]
    pub rays: Option<MeasuringRays>,
    /// Estimate EPO from N triangles, with its interval, instead of computing it from all
    #[arg(long, value_name = "N", value_parser = |text: &str| values::whole::<usize>(text, 1, usize::MAX))]
    pub epo_samples: Option<usize>,
    /// Print one JSON object instead of the text
    #[arg(long)]
    pub json: bool,
    /// Also write the triangles, nine f32 each, little-endian, in the order in which tree files count them
    #[arg(long, value_name = "FILE")]
    pub triangles: Option<PathBuf>,
    /// Vector instructions of the build: sse2, avx2, avx512 or neon, where this machine has them [default: the best]
    #[arg(long, value_name = "LEVEL", value_parser = simd)]
    pub simd: Option<SimdLevel>,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub tree: TreeFileArgs,
    #[command(flatten)]
    pub load: StrictLoadArgs,
    #[command(flatten)]
    pub camera: CameraArgs,
    #[command(flatten)]
    pub motion: FollowedMomentArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope tree bunny.obj -o bunny.bvh --preset hq
  bvhscope tree bunny.obj -o bunny.bvh --wide --with-triangles
  bvhscope tree bunny.obj -o nodes.csv --tree mine.bvh
  bvhscope tree bunny.obj -o boxes.obj
  bvhscope tree fox.glb -o refitted.bvh --clip Run --time 0.4 --policy refit

docs/tree-file.md says what the files hold.")]
pub struct TreeArgs {
    /// The model: a file, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    /// The file that is written: a tree file (.bvh), a table of the nodes (.csv, .json), or their boxes as a model (.obj)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Write the wide tree, through which pictures are traced; its nodes have up to eight children
    #[arg(long)]
    pub wide: bool,
    /// Write the triangles too, so that the file is a model of its own
    #[arg(long)]
    pub with_triangles: bool,
    /// Vector instructions of the build: sse2, avx2, avx512 or neon, where this machine has them [default: the best]
    #[arg(long, value_name = "LEVEL", value_parser = simd)]
    pub simd: Option<SimdLevel>,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub tree: TreeFileArgs,
    #[command(flatten)]
    pub load: StrictLoadArgs,
    #[command(flatten)]
    pub motion: FollowedMomentArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope merges bunny.obj -o construction.gif
  bvhscope merges bunny.obj -o last.gif --order distance --frames 200 --camera front
  bvhscope merges bunny.obj -o frames --size 1920x1080")]
pub struct MergesArgs {
    /// The model: a file, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    /// The film that is written: a GIF, an animated PNG, or a folder of numbered PNGs
    #[arg(short, long, value_name = "FILE.gif|FILE.png|FOLDER")]
    pub output: PathBuf,
    #[arg(long, value_name = "NAME", value_parser = named::<MergeOrder>, default_value = MergeOrder::Built.name(),
          hide_default_value = true, help = help::<MergeOrder>("Order of the merges: ", " [default: built]"))]
    pub order: MergeOrder,
    /// Frames at most, 2 to 10000; the fewer clusters are left, the fewer merges there are from one to the next
    #[arg(long, value_name = "N", value_parser = |text: &str| values::whole::<usize>(text, 2, 10_000), default_value = "90")]
    pub frames: usize,
    /// Frames a second of a GIF, 1 to 50
    #[arg(long, value_name = "N", value_parser = |text: &str| values::whole::<u32>(text, 1, 50), default_value = "12")]
    pub rate: u32,
    /// Size of the film in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, default_value = "800x600")]
    pub size: [u32; 2],
    /// Maximum number of clusters that are drawn, the largest first, 1 to 4096
    #[arg(long, value_name = "N", value_parser = |text: &str| values::whole::<u32>(text, 1, 4096), default_value = "4096",
          help_heading = "Overlay")]
    pub at_most: u32,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub load: StrictLoadArgs,
    #[command(flatten)]
    pub camera: CameraArgs,
    #[command(flatten)]
    pub around: AroundArgs,
    #[command(flatten)]
    pub picture: SettingFlags<RenderSettings>,
}
