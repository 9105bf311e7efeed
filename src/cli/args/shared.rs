//! Flags that several commands share: build settings and loading.

use clap::Args;

use crate::budget::MemoryLimit;
use crate::cli::named::{named, passes};
use crate::cli::values;
use bvhscope_engine::settings::{Curve, Passes, Preset};

/// Build settings that do not depend on the builders and containers that a command offers.
#[derive(Debug, Args)]
pub struct ShapeArgs {
    /// AAC: fewer primitives than this are clustered, not split, 2 to 64 [default: 6]
    #[arg(long, value_name = "N", value_parser = values::threshold)]
    pub threshold: Option<u32>,
    /// AAC: exponent of the reduction function, 0 to 0.5 [default: 0.2]
    #[arg(long, value_name = "X", value_parser = values::epsilon)]
    pub epsilon: Option<f32>,
    /// AAC: threshold and ε by name: fast (6, 0.2), hq (12, 0.1), aac-fast (4, 0.2), aac-hq (20, 0.1), best (6, 0.2 and every pass but split)
    #[arg(long, value_name = "NAME", value_parser = named::<Preset>)]
    pub preset: Option<Preset>,
    /// Optimisation passes, separated by commas: split (large triangles, boxes only), collapse, restructure and reinsert (boxes only); or all, none [default: none]
    #[arg(long, value_name = "LIST", value_parser = passes)]
    pub optimize: Option<Passes>,
    /// AAC and LBVH: the curve along which triangles are sorted: morton, hilbert or extended (Morton and size) [default: morton]
    #[arg(long, value_name = "NAME", value_parser = named::<Curve>)]
    pub curve: Option<Curve>,
}

/// Loading flags of every command.
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

/// Loading flags of the commands without a window.
#[derive(Debug, Args)]
#[command(next_help_heading = "Loading")]
pub struct StrictLoadArgs {
    #[command(flatten)]
    pub any: LoadArgs,
    /// Exit with code 3 where a file was loaded with warnings
    #[arg(long)]
    pub strict: bool,
}
