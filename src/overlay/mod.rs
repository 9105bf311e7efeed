//! The containers as lines over the picture: nodes into instances (pure), and the wgpu pass that draws them. Never
//! imports `render`.
//!
//! Uploaded is what is drawn, when depths, filters or tree change, at most the budget; not every node once a tree: a tree of
//! a million triangles would upload 139 MB, and while the threshold is dragged many trees a second would. Choosing what is
//! drawn of such a tree takes up to 10 ms, its leaves at all depths 40.

mod instances;
#[cfg(feature = "gui")]
mod offscreen;
#[cfg(feature = "gui")]
mod picture;
#[cfg(feature = "gui")]
mod pipeline;
mod ramp;
mod settings;
mod table;
#[cfg(feature = "gui")]
mod uniforms;

pub use instances::{OverlayNode, Role, highlighted};
#[cfg(feature = "gui")]
pub use offscreen::{OffscreenError, draw_offscreen};
#[cfg(feature = "gui")]
pub use picture::{step_within, thinned};
#[cfg(feature = "gui")]
pub use pipeline::{DrawInput, OverlayPipeline, PictureInput, SHADERS};
pub use ramp::{Legend, legend, ramp};
pub use settings::{ColorBy, OverlayKinds, OverlaySettings};
pub use table::{NodeTable, Selection, Shown};
#[cfg(feature = "gui")]
pub use uniforms::View;
