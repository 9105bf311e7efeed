//! The commands that need no window. They get resolved settings, write results to the given output, progress to stderr,
//! and return how they ended. Know no flags.

mod context;

pub mod render;

pub mod info;

pub mod measure;
pub mod plot;
mod tree_numbers;

pub use context::{Context, Failure, Finished};
pub use render::RenderCommand;
