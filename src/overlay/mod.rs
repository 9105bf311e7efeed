//! The containers as lines over the picture: nodes into instances (pure), and the wgpu pass that draws them. Never
//! imports `render`.

mod instances;
#[cfg(feature = "gui")]
mod offscreen;
#[cfg(feature = "gui")]
mod pipeline;
mod settings;

pub use instances::{NodeTable, OverlayNode, Selection, Shown};
#[cfg(feature = "gui")]
pub use offscreen::{OffscreenError, draw_offscreen};
#[cfg(feature = "gui")]
pub use pipeline::{DrawInput, OverlayPipeline, PictureInput};
pub use settings::{ColorBy, OverlaySettings};
