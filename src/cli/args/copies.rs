//! Flags of `copies`.

use std::path::PathBuf;

use clap::Args;

use super::picture::CameraArgs;
use super::shared::{BuildArgs, RayCostArgs, StrictLoadArgs};
use crate::cli::named::simd;
use crate::cli::values::{self, List, ModelParser};
use crate::scene::SceneSource;
use bvhscope_engine::kernel::SimdLevel;

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope copies builtin:forest:10000
  bvhscope copies city.gltf --rays all --most 50
  bvhscope copies city.gltf --rays mine.rays --json
  bvhscope copies city.gltf --preset best --csv copies.csv
  bvhscope copies city.gltf --open 1,2,4 --plot open.svg
  bvhscope copies city.gltf --advice

The scene is loaded in two levels unless --instances says otherwise. docs/copies.md says what is counted.")]
pub struct CopiesArgs {
    /// The model: a file, or builtin:forest[:N], village[:N], stack[:N] or traffic[:N] [default: builtin:forest]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    /// Number of copies, those with most tests, that have a row of their own
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub most: usize,
    /// Measure forms of the scene instead: flat, where memory allows, and in two levels with the tree over the copies opened to at most so
    /// many parts a copy: a list of numbers from 1, which opens none, to 64, or all for 1,1.5,2,3,4,8
    #[arg(long, value_name = "LIST", value_parser = values::openings)]
    pub open: Option<List<f32>>,
    /// Measure what other meshes would save instead: each of those with most tests in 2, 4 and 8 parts, and each two as one whose copies
    /// stand together
    #[arg(long, conflicts_with = "open")]
    pub advice: bool,
    /// Also plot nodes and blocks of a ray over how far the tree is opened: FILE.png or FILE.svg
    #[arg(long, value_name = "FILE", requires = "open")]
    pub plot: Option<PathBuf>,
    #[command(flatten)]
    pub costs: RayCostArgs,
    /// Vector instructions of the build: sse2, avx2, avx512 or neon, where this machine has them [default: the best]
    #[arg(long, value_name = "LEVEL", value_parser = simd)]
    pub simd: Option<SimdLevel>,
    #[command(flatten)]
    pub build: BuildArgs,
    #[command(flatten)]
    pub load: StrictLoadArgs,
    #[command(flatten)]
    pub camera: CameraArgs,
}
