//! Flags that several commands share: building and loading.

use std::path::PathBuf;

use clap::Args;

use super::setting_flags::SettingFlags;
use crate::budget::MemoryLimit;
use crate::catalog::settings::{OPTIMIZE, SETTINGS};
use crate::cli::named::{help, named, rays};
use crate::cli::values;
use crate::headless::MeasuringRays;
use crate::lab::motion::MAX_FRAMES;
use crate::lab::report_table::TableFormat;
use crate::scene::Instancing;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::settings::BuildSettings;

/// The tree of a file in place of one that is built.
#[derive(Debug, Args)]
#[command(next_help_heading = "Tree")]
pub struct TreeFileArgs {
    /// Take the tree that this file holds, of any builder, instead of building one; docs/tree-file.md describes the format. Of the
    /// passes only orient runs over it
    #[arg(long, value_name = "FILE.bvh",
          conflicts_with_all = SETTINGS.map(|row| row.key).into_iter().filter(|key| *key != OPTIMIZE.key))]
    pub tree: Option<PathBuf>,
}

/// The moment of a model that moves.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Motion")]
pub struct MomentArgs {
    /// Take the model at this time of its clip, in seconds
    #[arg(long, value_name = "T", value_parser = values::seconds, allow_hyphen_values = true)]
    pub time: Option<f32>,
    /// The clip, by its name or its number from 0 [default: the first]
    #[arg(long, value_name = "NAME")]
    pub clip: Option<String>,
}

/// Loading flags of every command.
#[derive(Debug, Args)]
#[command(next_help_heading = "Loading")]
pub struct LoadArgs {
    /// Let a model read files outside of its own folder (materials, textures, buffers)
    #[arg(long)]
    pub allow_outside: bool,
    /// Scene of a glTF file that has several, counted from 0 [default: the one that the file names]
    #[arg(long, value_name = "N")]
    pub scene: Option<usize>,
    /// Frames a second of a row of numbered files, as walk_####.obj for walk_0001.obj and so on [default: 24]
    #[arg(long, value_name = "N", value_parser = values::fps)]
    pub fps: Option<f32>,
    /// A scene of copies of meshes: flat, two-level, or auto, which is flat where that fits into memory [default: auto]
    #[arg(long, value_name = "NAME", value_parser = named::<Instancing>)]
    pub instances: Option<Instancing>,
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
    #[command(flatten)]
    pub settings: SettingFlags<BuildSettings>,
    /// Threads for building and tracing, 1 to 1024, but no more than there are cores [default: all]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub threads: Option<usize>,
}

/// A moment, and how its tree is made.
#[derive(Debug, Args)]
pub struct FollowedMomentArgs {
    #[command(flatten)]
    pub moment: MomentArgs,
    #[command(flatten)]
    pub follow: FollowArgs,
}

/// How the tree of a moment is made.
#[derive(Debug, Args)]
#[command(next_help_heading = "Motion")]
pub struct FollowArgs {
    #[arg(long, value_name = "NAME", value_parser = named::<Policy>, conflicts_with = "tree",
          help = help::<Policy>("How the first frame's tree follows until this moment: ", " [default: rebuild]"))]
    pub policy: Option<Policy>,
    /// Frames of the whole clip, 1 to 10000, by which the tree gets to this moment [default: 25]
    #[arg(long, value_name = "N", value_parser = |text: &str| values::whole::<u32>(text, 1, MAX_FRAMES as u32),
          requires = "policy")]
    pub policy_frames: Option<u32>,
}

/// The rays of a view whose costs are measured, and where their rows go.
#[derive(Debug, Args)]
pub struct RayCostArgs {
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
}
