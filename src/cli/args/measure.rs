//! Flags of the measuring commands and of `plot`.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;

use super::picture::{CameraArgs, CamerasArgs};
use super::setting_flags::{RangeFlags, ShapeFlags};
use super::shared::{MomentArgs, StrictLoadArgs};
use crate::cli::named::{
    self, Containers, Policies, containers, containers_help, help, named, rays, rays_help, simd, tree_builder,
    tree_builder_help,
};
use crate::cli::tree_settings::diff_tree;
use crate::cli::values::{self, ModelParser};
use crate::headless::MeasuringRays;
use crate::headless::diff::DiffTree;
use crate::lab::motion::MAX_FRAMES;
use crate::lab::report_table::TableFormat;
use crate::scene::SceneSource;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::BuilderKind;
use bvhscope_engine::tree::traverse::Traversal;

/// How trees are built and traced to be measured.
#[derive(Debug, Args)]
pub struct TraceArgs {
    /// Size of the traced picture in pixels
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, default_value = "1024x1024")]
    pub size: [u32; 2],
    /// Rounds in which each tree is measured once; medians are shown, and fewer than 8 decide only large differences
    #[arg(long, value_name = "N", value_parser = values::repeat, default_value = "9")]
    pub repeat: usize,
    /// How rays visit nodes: ordered (near child first, culled by distance), or paper (neither)
    #[arg(long, value_name = "NAME", value_parser = named::<Traversal>, default_value = "ordered")]
    pub traversal: Traversal,
    /// Estimate EPO from N triangles, with its interval, instead of computing it from all
    #[arg(long, value_name = "N", value_parser = |text: &str| values::whole::<usize>(text, 1, usize::MAX))]
    pub epo_samples: Option<usize>,
    /// Threads for building and tracing, 1 to 1024, but no more than there are cores [default: all]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub threads: Option<usize>,
    /// Vector instructions of builds and rays: sse2, avx2, avx512 or neon, where this machine has them [default: the best]
    #[arg(long, value_name = "LEVEL", value_parser = simd)]
    pub simd: Option<SimdLevel>,
}

/// Flags of every measuring command.
#[derive(Debug, Args)]
pub struct MeasureArgs {
    /// The models: files, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub models: Vec<SceneSource>,
    #[command(flatten)]
    pub trace: TraceArgs,
    #[arg(long, value_name = "LIST", value_parser = rays, help = rays_help("Also measure what such rays cost in each tree, and how well SAH cost and EPO predict it: "))]
    pub rays: Option<MeasuringRays>,
    /// Print one JSON object a line instead of the table
    #[arg(long)]
    pub json: bool,
    #[arg(long, value_name = "NAME", value_parser = named::<TableFormat>, default_value = "text",
          conflicts_with = "json", help = help::<TableFormat>("How the table is written: ", ""))]
    pub format: TableFormat,
    /// Also write the rows as CSV; - prints them instead of the table
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Also draw the plot
    #[arg(long, value_name = "FILE.png|.svg")]
    pub plot: Option<PathBuf>,
    #[command(flatten)]
    pub cameras: CamerasArgs,
    #[command(flatten)]
    pub load: StrictLoadArgs,
}

/// Trees to measure beside those that are built, and the moment of the model that all are of.
#[derive(Debug, Default, Args)]
pub struct TreesFromFilesArgs {
    /// Also measure the tree that this file holds; may be given more than once
    #[arg(long = "tree", value_name = "FILE.bvh", help_heading = "Tree")]
    pub trees: Vec<PathBuf>,
    /// Name of the tree of a --tree in tables and plots, the first of the first and so on [default: its file]
    #[arg(long = "label", value_name = "NAME", help_heading = "Tree")]
    pub labels: Vec<String>,
    #[command(flatten)]
    pub moment: MomentArgs,
}

/// Build flags of the commands that measure one tree: bench, scaling and animate.
#[derive(Debug, Args)]
pub struct OneTreeArgs {
    #[arg(long, value_name = "NAME", help_heading = "Tree", value_parser = tree_builder,
          help = tree_builder_help("The algorithm: ", " [default: aac]"))]
    pub builder: Option<BuilderKind>,
    #[arg(long, value_name = "KIND", help_heading = "Tree", value_parser = containers,
          help = containers_help("What the tree is made of: ", " [default: both for bench, else box]"))]
    pub container: Option<Containers>,
    #[command(flatten)]
    pub shape: ShapeFlags,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope bench bunny.obj dragon.ply
  bvhscope bench bunny.obj --traversal paper --repeat 15 --json
  bvhscope bench bunny.obj --tree mine.bvh   with the tree of a file below ours
  bvhscope bench sponza.obj --camera default,outside --rays all   from inside and from outside
  bvhscope bench builtin:teapot:4 --no-bvh --plot bench.svg")]
pub struct BenchArgs {
    #[command(flatten)]
    pub tree: OneTreeArgs,
    #[command(flatten)]
    pub files: TreesFromFilesArgs,
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
  bvhscope sweep bunny.obj --tree mine.bvh --plot sweep.svg   with the tree of a file as a line across
  bvhscope sweep bunny.obj --shard 2/8 --json > part2.jsonl")]
pub struct SweepArgs {
    #[command(flatten)]
    pub ranges: RangeFlags,
    #[arg(long, value_name = "KIND", value_parser = containers, default_value = "box",
          help = containers_help("What the trees are made of: ", ""))]
    pub container: Containers,
    /// Measure only the I-th of N shards of the rows, so that a sweep can be spread over machines
    #[arg(long, value_name = "I/N", value_parser = values::shard)]
    pub shard: Option<(usize, usize)>,
    #[command(flatten)]
    pub files: TreesFromFilesArgs,
    #[command(flatten)]
    pub measure: MeasureArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope scaling bunny.obj --plot scaling.svg
  bvhscope scaling bunny.obj --threads 8 --container both   1 to 8 threads
  bvhscope scaling bunny.obj --predict --repeat 15          and what 1 to 64 cores would gain")]
pub struct ScalingArgs {
    #[command(flatten)]
    pub tree: OneTreeArgs,
    /// Also predict the speed-up on 1 to 64 cores: a greedy schedule of all tasks of the build, until rays can be traced at full
    /// speed, and of the trace. Their times and the price of a fork are measured on one thread and on two; the bounds are what
    /// sharing the memory may cost at worst and at best. Not for trees with passes over them
    #[arg(long)]
    pub predict: bool,
    #[command(flatten)]
    pub measure: MeasureArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope compare bunny.obj
  bvhscope compare bunny.obj --container both --csv builders.csv
  bvhscope compare bunny.obj --tree mine.bvh --tree embree.bvh
  bvhscope compare bunny.obj --rays all   how well SAH cost and EPO predict what rays cost
  bvhscope compare bunny.obj --rays mine.rays   what the rays of a file cost (docs/ray-file.md)")]
pub struct CompareArgs {
    #[arg(long, value_name = "KIND", value_parser = containers, default_value = "box",
          help = containers_help("What the trees are made of: ", ""))]
    pub container: Containers,
    /// With the preset finest, which takes minutes
    #[arg(long)]
    pub slow: bool,
    #[command(flatten)]
    pub files: TreesFromFilesArgs,
    #[command(flatten)]
    pub measure: MeasureArgs,
}

/// The end of `bvhscope animate --help`.
fn policies() -> String {
    let mut text = "Examples:
  bvhscope animate builtin:walker
  bvhscope animate fox.glb --clip Run --frames 60 --policy refit,rebuild --plot run.png
  bvhscope animate builtin:explosion --policy all --rays bounce --csv explosion.csv
  bvhscope animate builtin:traffic --instances two-level

Policies:
"
    .to_owned();
    for policy in Policy::ALL {
        let _ = writeln!(text, "  {:<16} {}", policy.name(), policy.meaning());
    }
    text
}

#[derive(Debug, Args)]
// Of each frame: the frames decide.
#[command(after_help = policies(), mut_arg("repeat", |arg| arg.default_value("3")))]
pub struct AnimateArgs {
    #[arg(long, value_name = "LIST", value_parser = named::policies, default_value = "all",
          help = help::<Policy>("How the tree follows from frame to frame: a list, separated by commas, of ", ", or all that apply"))]
    pub policy: Policies,
    /// The clip, by its name or its number from 0 [default: the first]
    #[arg(long, value_name = "NAME")]
    pub clip: Option<String>,
    /// Frames, 1 to 10000, at equal distances from the first key of the clip to the last
    #[arg(long, value_name = "N", value_parser = |text: &str| values::whole::<usize>(text, 1, MAX_FRAMES), default_value = "30")]
    pub frames: usize,
    #[command(flatten)]
    pub tree: OneTreeArgs,
    #[command(flatten)]
    pub measure: MeasureArgs,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope diff bunny.obj --a preset=fast --b preset=hq
  bvhscope diff bunny.obj --a 'builder=lbvh' --b 'threshold=12 epsilon=0.1 optimize=collapse,reinsert' -o difference.png
  bvhscope diff bunny.obj --a container=box --b container=sphere --json
  bvhscope diff bunny.obj --b mine.bvh --rays ao,bounce --label ours --label mine

A FILE that ends in .bvh holds the tree. SETTINGS are the tree flags of the other commands without their dashes, separated by blanks: builder=, container=, preset=,
threshold=, epsilon=, curve=, optimize= and rounds=. What is not given has its default.

The picture has the tests of B minus those of A in each pixel: blue where B takes fewer, grey where both take as many,
orange where B takes more.")]
pub struct DiffArgs {
    /// The model: a file, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    /// Tree A
    #[arg(long, value_name = "SETTINGS|FILE.bvh", value_parser = diff_tree, default_value = "preset=fast", help_heading = "Tree")]
    pub a: DiffTree,
    /// Tree B
    #[arg(long, value_name = "SETTINGS|FILE.bvh", value_parser = diff_tree, help_heading = "Tree")]
    pub b: DiffTree,
    /// Name of tree A, and given again of tree B [default: their settings or files]
    #[arg(long = "label", value_name = "NAME", help_heading = "Tree")]
    pub labels: Vec<String>,
    #[arg(long, value_name = "LIST", value_parser = rays, help = rays_help("Also compare the tests by such rays, and the visits by depth: "))]
    pub rays: Option<MeasuringRays>,
    /// Write a picture of the difference
    #[arg(short, long, value_name = "FILE.png")]
    pub output: Option<PathBuf>,
    /// Legend below the picture: on or off [default: on, from 240 pixels of width]
    #[arg(long, value_name = "on|off", value_parser = values::on_or_off)]
    pub legend: Option<bool>,
    #[command(flatten)]
    pub trace: TraceArgs,
    /// Print one JSON object instead of the table
    #[arg(long)]
    pub json: bool,
    /// Also write both rows as CSV; - prints them instead of the table
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Also draw the plot
    #[arg(long, value_name = "FILE.png|.svg")]
    pub plot: Option<PathBuf>,
    #[command(flatten)]
    pub camera: CameraArgs,
    #[command(flatten)]
    pub load: StrictLoadArgs,
    #[command(flatten)]
    pub moment: MomentArgs,
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
