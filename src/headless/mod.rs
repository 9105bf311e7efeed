//! The commands that need no window. Each gets its resolved settings, writes results to the given output and progress to
//! stderr, and returns its outcome. Knows no command line flags.

mod context;

pub mod render;

mod film;
mod moments;
pub mod picture;
mod svg;

pub mod info;

#[cfg(feature = "gui")]
mod cluster_artist;
pub mod diff;
pub mod exr;
pub mod merges;

pub mod copies;
mod cost_rows;
pub mod layouts;
pub mod measure;
mod output;
pub mod plot;
mod progress;
pub mod ray;
mod ray_input;
pub mod rays;
pub mod tree;
mod tree_numbers;
mod tree_obj;
mod tree_origin;

pub use context::{Context, Failure, Finished, ignore_missing_reader};
pub use merges::MergesCommand;
pub use moments::{MomentChoice, Times};
pub use output::Output;
pub use ray_input::MeasuringRays;
pub use render::RenderCommand;
pub use tree_origin::TreeOrigin;
