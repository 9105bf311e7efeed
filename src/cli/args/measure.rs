//! The measuring commands, and the plots of their rows.

use std::path::PathBuf;

use clap::Args;

use super::{CameraArgs, ShapeArgs, StrictLoadArgs};
use crate::cli::values::{self, Epsilons, ModelParser, Numbers};
use crate::scene::SceneSource;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::BuilderKind;
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::Traversal;

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
    pub load: StrictLoadArgs,
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

pub(super) fn parse_traversal(text: &str) -> Result<Traversal, String> {
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
