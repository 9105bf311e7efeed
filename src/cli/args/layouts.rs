//! Flags of `layouts`.

use std::path::PathBuf;

use clap::Args;

use super::picture::CameraArgs;
use super::shared::{BuildArgs, MomentArgs, RayCostArgs, StrictLoadArgs, TreeFileArgs};
use crate::cli::named::{help, simd};
use crate::cli::values::{List, ModelParser, named_list, number_list};
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
    #[command(flatten)]
    pub costs: RayCostArgs,
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
