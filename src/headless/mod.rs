//! The commands that need no window. Each gets its resolved settings, writes results to the given output and progress to
//! stderr, and returns its outcome. Knows no command line flags.

mod context;

pub mod render;

pub mod info;

pub mod measure;
pub mod plot;
mod progress;
mod tree_numbers;

pub use context::{Context, Failure, Finished, ignore_missing_reader};
pub use render::RenderCommand;
