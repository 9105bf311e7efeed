//! The commands that need no window. They get resolved settings, write results to the given output, progress to stderr,
//! and return how they ended. Know no flags.

mod camera;
mod context;
pub mod render;

pub use camera::{CameraChoice, View};
pub use context::{Context, Failure, Finished};
pub use render::{OverlayKinds, RenderJob};
