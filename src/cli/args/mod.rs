//! The flags as clap parses them. Only `cli` uses these types.

mod measure;
mod picture;
mod shared;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

pub use measure::{BenchArgs, CompareArgs, MeasureArgs, OneTreeArgs, PlotArgs, ScalingArgs, SweepArgs};
pub use picture::{CameraArgs, NodeArgs, OverlayArgs, PictureArgs};
pub use shared::{LoadArgs, ShapeArgs, StrictLoadArgs};

use super::named::{help, named};
use super::values::{self, ModelParser};
use crate::render::Background;
use crate::scene::{BUILTIN_SCENES, SceneSource, format_names};
use crate::section::SectionChoice;
use bvhscope_engine::settings::BuilderKind;
use bvhscope_engine::tree::ContainerKind;

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

MODEL is an {} file, or builtin:NAME[:SIZE] with NAME one of
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
    /// Draw a plot from the JSON lines of bench, sweep, scaling or compare
    Plot(PlotArgs),
    /// Print the contents of a model, statistics of its tree, and problems found in both
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
  bvhscope render bunny.obj -o bunny.exr
  bvhscope render bunny.obj -o bunny.png --depth-image bunny-depth.exr")]
pub struct RenderArgs {
    /// The model: a file, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    /// The picture that is written: a PNG, or an EXR of linear radiance, neither exposed nor tone mapped
    #[arg(short, long, value_name = "FILE", required_unless_present = "depth_image")]
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
    pub load: StrictLoadArgs,
    #[command(flatten)]
    pub camera: CameraArgs,
    /// Background where no surface is: dark or light [default: dark]
    #[arg(long, value_name = "NAME", value_parser = named::<Background>, help_heading = "Picture")]
    pub background: Option<Background>,
    /// A camera kept in the window (Ctrl+D), by its name
    #[cfg(feature = "gui")]
    #[arg(long, value_name = "NAME", help_heading = "Camera",
          conflicts_with_all = ["camera", "eye", "target", "up", "fov", "orthographic"])]
    pub bookmark: Option<String>,
    #[command(flatten)]
    pub picture: PictureArgs,
    #[command(flatten)]
    pub overlay: OverlayArgs,
    #[command(flatten)]
    pub nodes: NodeArgs,
    /// Cut model and containers open: x, y or z, or a normal X,Y,Z, and a position in the model's unit or in percent; -x keeps the
    /// other half
    #[arg(long, value_name = "AXIS=POSITION", value_parser = SectionChoice::parse, allow_hyphen_values = true,
          help_heading = "Picture")]
    pub section: Option<SectionChoice>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Tree")]
pub struct BuildArgs {
    #[arg(long, value_name = "NAME", value_parser = named::<BuilderKind>,
          help = help::<BuilderKind>("The algorithm: ", " [default: aac]"))]
    pub builder: Option<BuilderKind>,
    #[arg(long, value_name = "KIND", value_parser = named::<ContainerKind>,
          help = help::<ContainerKind>("What the tree is made of: ", " [default: box]"))]
    pub container: Option<ContainerKind>,
    #[command(flatten)]
    pub shape: ShapeArgs,
    /// Threads for building and tracing, 1 to 1024, but no more than there are cores [default: all]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub threads: Option<usize>,
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
    pub load: StrictLoadArgs,
}
