//! Flags of `rays`.

use std::path::PathBuf;

use clap::{ArgGroup, Args};

use super::picture::CameraArgs;
use super::shared::{BuildArgs, StrictLoadArgs, TreeFileArgs};
use crate::cli::named::{help, named, simd};
use crate::cli::values::{self, ModelParser};
use crate::headless::rays::Sample;
use crate::lab::population::Population;
use crate::render::Light;
use crate::scene::SceneSource;
use bvhscope_engine::kernel::SimdLevel;

/// Most rays of a population that are written.
const MAX_COUNT: u32 = 1_000_000_000;

/// Parses a number of rays, or `all`.
fn sample(text: &str) -> Result<Sample, String> {
    if text == "all" { Ok(Sample::All) } else { values::whole(text, 1, MAX_COUNT as usize).map(Sample::Rays) }
}

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("which").required(true).args(["kind", "rays"]), after_help = "Examples:
  bvhscope rays bunny.obj --kind ao --count 100000 -o ao.rays
  bvhscope rays bunny.obj --rays mine.rays
  bvhscope rays bunny.obj --rays mine.npy -o mine.rays
  bvhscope rays bunny.obj --rays mine.rays --verify -o worst.rays
  my_renderer --dump-rays | bvhscope rays bunny.obj --rays -

docs/ray-file.md says what the files hold.")]
pub struct RaysArgs {
    /// The model: a file, or builtin:NAME[:SIZE] [default: builtin:teapot]
    #[arg(value_name = "MODEL", value_parser = ModelParser)]
    pub model: Option<SceneSource>,
    #[arg(long, value_name = "NAME", value_parser = named::<Population>, requires = "output",
          help = help::<Population>("Write such rays of the view: ", ""))]
    pub kind: Option<Population>,
    /// How many, at equal distances over the view [default: one for each of at most 256 x 256 squares]
    #[arg(long, value_name = "N", value_parser = |text: &str| values::whole::<u32>(text, 1, MAX_COUNT), requires = "kind")]
    pub count: Option<u32>,
    /// Read the rays of this file: a ray file, an array of NumPy (.npy) or lines of numbers; - is standard input
    #[arg(long, value_name = "FILE", conflicts_with_all = ["kind", "count"])]
    pub rays: Option<PathBuf>,
    /// Check trees of all containers and passes, and what the file expects, against a test of every triangle in double precision; -o
    /// then takes the worst rays
    #[arg(long, requires = "rays")]
    pub verify: bool,
    /// How many rays are checked, at equal distances, or all [default: as many as take some seconds]
    #[arg(long, value_name = "N|all", value_parser = sample, requires = "verify")]
    pub sample: Option<Sample>,
    /// The ray file that is written
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Print one JSON object instead of the text
    #[arg(long, requires = "rays")]
    pub json: bool,
    /// Size of the view in pixels, of which its sides matter
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_hyphen_values = true, default_value = "1280x720")]
    pub size: [u32; 2],
    /// Light of shadow rays: sun, file (its own lights), or headlight, which has none [default: sun]
    #[arg(long, value_name = "NAME", value_parser = named::<Light>)]
    pub light: Option<Light>,
    /// Vector instructions of builds and rays: sse2, avx2, avx512 or neon, where this machine has them [default: the best]
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
}
