//! Flags of `copies`.

use std::path::PathBuf;

use clap::Args;

use super::picture::CameraArgs;
use super::shared::{BuildArgs, StrictLoadArgs};
use crate::cli::named::{help, named, rays, simd};
use crate::cli::values::{self, ModelParser};
use crate::headless::MeasuringRays;
use crate::lab::report_table::TableFormat;
use crate::scene::SceneSource;
use bvhscope_engine::kernel::SimdLevel;

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  bvhscope copies builtin:forest:10000
  bvhscope copies city.gltf --rays all --most 50
  bvhscope copies city.gltf --rays mine.rays --json
  bvhscope copies city.gltf --preset best --csv copies.csv

The scene is loaded in two levels unless --instances says otherwise. docs/copies.md says what is counted.")]
pub struct CopiesArgs {
    /// The model: a file, or builtin:forest[:N], village[:N] or stack[:N] [default: builtin:forest]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    /// Number of copies, those with most tests, that have a row of their own
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub most: usize,
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
