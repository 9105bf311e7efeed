//! The viewport: the traced picture with the containers drawn over it, and the mouse and keys that act on it. It edits the
//! camera and the selection; it depends on no panels and starts no work but writing a screenshot.

mod view;

mod choice;
mod counterparts;
mod draw;
mod sides;

mod input;
pub mod orbit;
pub mod picking;

pub(crate) mod screenshot;

pub(crate) use input::ZOOM_STEP;
pub use view::Viewport;
