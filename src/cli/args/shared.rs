//! Flags that several commands share: build settings and loading.

use std::path::PathBuf;

use clap::Args;

use crate::budget::MemoryLimit;
use crate::cli::named::{help, named, passes};
use crate::cli::values;
use bvhscope_engine::settings::{BuilderKind, Curve, Passes, Preset};
use bvhscope_engine::tree::ContainerKind;

/// Build settings that do not depend on the builders and containers that a command offers.
#[derive(Debug, Args)]
pub struct ShapeArgs {
    /// AAC: fewer primitives than this are clustered, not split, 2 to 64 [default: 6]
    #[arg(long, value_name = "N", value_parser = values::threshold)]
    pub threshold: Option<u32>,
    /// AAC: exponent of the reduction function, 0 to 0.5 [default: 0.2]
    #[arg(long, value_name = "X", value_parser = values::epsilon)]
    pub epsilon: Option<f32>,
    /// AAC: threshold and ε by name: fast (6, 0.2), hq (12, 0.1), aac-fast (4, 0.2), aac-hq (20, 0.1), best (6, 0.2 and
    /// collapse, restructure, reinsert), finest (6, 0.2 and every pass: takes minutes)
    #[arg(long, value_name = "NAME", value_parser = named::<Preset>)]
    pub preset: Option<Preset>,
    /// Optimisation passes, separated by commas: split (large triangles, boxes only), collapse, restructure, reinsert and
    /// anneal (boxes only; anneal takes minutes); or all, none [default: none]
    #[arg(long, value_name = "LIST", value_parser = passes)]
    pub optimize: Option<Passes>,
    /// The pass anneal: number of rounds, 1 to 4096; more give a better tree in proportionally more time [default: 200]
    #[arg(long, value_name = "N", value_parser = values::rounds)]
    pub rounds: Option<u32>,
    /// AAC and LBVH: the curve along which triangles are sorted: morton, hilbert or extended (Morton and size) [default:
    /// morton]
    #[arg(long, value_name = "NAME", value_parser = named::<Curve>)]
    pub curve: Option<Curve>,
}

/// The tree of a file in place of one that is built.
#[derive(Debug, Args)]
#[command(next_help_heading = "Tree")]
pub struct TreeFileArgs {
    /// Take the tree that this file holds, of any builder, instead of building one; docs/tree-file.md says how it is written
    #[arg(long, value_name = "FILE.bvh",
          conflicts_with_all = ["builder", "container", "threshold", "epsilon", "preset", "optimize", "rounds", "curve"])]
    pub tree: Option<PathBuf>,
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
