//! The containers as lines over the traced picture: nodes into instances (pure), and the wgpu pass that draws them. Never
//! imports `render`.
//!
//! Only what is drawn is uploaded, whenever depths, filters or tree change, and at most the budget: all nodes of a million
//! triangles would be 131 MB for each of the many trees a second that a dragged threshold builds. Choosing the nodes of such a
//! tree takes up to 10 ms, and 40 ms for the leaves of all depths.

mod container_set;
mod level;
mod node;
pub mod rows;
mod selection;
mod settings;
mod viewpoint;

mod node_table;

mod highlight;
mod legend;
mod ramp;
mod tint;

mod vector;

#[cfg(feature = "gui")]
mod enlarge;
#[cfg(feature = "gui")]
mod input;
#[cfg(feature = "gui")]
mod picture;
#[cfg(feature = "gui")]
mod shaders;
#[cfg(feature = "gui")]
mod uniforms;

#[cfg(feature = "gui")]
mod gpu;
#[cfg(feature = "gui")]
mod pipeline;

#[cfg(feature = "gui")]
mod offscreen;

pub use container_set::ContainerSet;
pub use highlight::highlighted;
#[cfg(feature = "gui")]
pub use input::{DrawInput, PictureInput};
pub use legend::{Legend, legend};
pub use level::{level_color, level_width};
pub use node::{OverlayNode, Role};
pub use node_table::{NodeTable, Shown};
#[cfg(feature = "gui")]
pub use offscreen::{Offscreen, OffscreenError, draw_offscreen};
#[cfg(feature = "gui")]
pub use picture::{step_within, thinned};
#[cfg(feature = "gui")]
pub use pipeline::OverlayPipeline;
pub use ramp::{ColorScale, ramp};
pub use selection::Selection;
pub use settings::{ColorBy, OverlaySettings};
#[cfg(feature = "gui")]
pub use shaders::sources as shader_sources;
pub use tint::tinted;
#[cfg(feature = "gui")]
pub use uniforms::ViewUniforms;
pub use vector::{VectorInput, VectorLines, vector_lines};
pub use viewpoint::Viewpoint;
