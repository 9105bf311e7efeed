//! Flags of `layouts`.

use std::path::PathBuf;

use clap::Args;

use super::picture::CameraArgs;
use super::shared::{BuildArgs, MomentArgs, StrictLoadArgs, TreeFileArgs};
use crate::cli::named::{help, named, rays, simd};
use crate::cli::values::{self, ModelParser};
use crate::cli::values::{List, named_list, number_list};
use crate::headless::MeasuringRays;
use crate::lab::report_table::TableFormat;
use crate::scene::SceneSource;
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::layouts::{Collapse, MAX_CHILDREN, MAX_LEAF, Planes};

/// Numbers of children that `all` stands for.
const ALL_CHILDREN: [u32; 4] = [2, 4, 8, 16];
/// Leaf sizes that `all` stands for.
const ALL_LEAVES: [u32; 6] = [1, 2, 4, 8, 16, 32];

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope layouts bunny.obj
  bvhscope layouts bunny.obj --children all --collapse all --planes all --leaves 4,8 --plot front.svg
  bvhscope layouts bunny.obj --rays mine.rays --collapse optimal,visits --json
  bvhscope layouts bunny.obj --tree mine.bvh --rays all --csv layouts.csv

The first row of each table is the program's own tree, which pictures are traced through. docs/layouts.md says what is counted.")]
pub struct LayoutsArgs {
    /// The model: a file, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    /// Most children of a node, 2 to 16: a list, separated by commas, or all for 2,4,8,16
    #[arg(long, value_name = "LIST", value_parser = |text: &str| number_list(text, [2, MAX_CHILDREN], &ALL_CHILDREN), default_value = "all")]
    pub children: List<u32>,
    #[arg(long, value_name = "LIST", value_parser = named_list::<Collapse>, default_value = "optimal",
          help = help::<Collapse>("How they are chosen from the binary tree, by area, by SAH, by bytes or by measured visits: a list of ", ", or all"))]
    pub collapse: List<Collapse>,
    #[arg(long, value_name = "LIST", value_parser = named_list::<Planes>, default_value = "f32,8",
          help = help::<Planes>("Planes of their boxes, as they are or of so many bits: a list of ", ", or all"))]
    pub planes: List<Planes>,
    /// Most triangles of a leaf, 1 to 32: a list, or all for 1,2,4,8,16,32
    #[arg(long, value_name = "LIST", value_parser = |text: &str| number_list(text, [1, MAX_LEAF], &ALL_LEAVES), default_value = "4")]
    pub leaves: List<u32>,
    /// The rays: a list of primary, shadow, ao, bounce, random or all, and a file of rays, separated by commas
    #[arg(long, value_name = "LIST", value_parser = rays, default_value = "primary,ao,bounce")]
    pub rays: MeasuringRays,
    /// Size of the view in pixels, of which its sides matter: rays go through at most 256 x 256 squares of it
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, default_value = "1024x1024")]
    pub size: [u32; 2],
    /// Print one JSON object a line instead of the tables
    #[arg(long)]
    pub json: bool,
    #[arg(long, value_name = "NAME", value_parser = named::<TableFormat>, default_value = "text",
          conflicts_with = "json", help = help::<TableFormat>("How the tables are written: ", ""))]
    pub format: TableFormat,
    /// Also write the rows as CSV; - prints them instead of the tables
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Also draw tests over bytes of a ray, and their front
    #[arg(long, value_name = "FILE.png|.svg")]
    pub plot: Option<PathBuf>,
    /// Vector instructions of the build: sse2, avx2, avx512 or neon, where this machine has them [default: the best]
    #[arg(long, value_name = "LEVEL", value_parser = simd)]
    pub simd: Option<SimdLevel>,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub tree: TreeFileArgs,
    #[command(flatten)]
    pub moment: MomentArgs,
    #[command(flatten)]
    pub load: StrictLoadArgs,
    #[command(flatten)]
    pub camera: CameraArgs,
}
