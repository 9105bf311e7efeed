//! Pictures: tiles of rays through an [`Accel`](crate::accel::Accel), shaded into a [`Frame`]. Knows no egui and no wgpu.

mod frame;
mod settings;
mod tiles;

pub mod color_map;

pub use color_map::ColorMap;
pub use frame::{Frame, FrameStats};
pub use settings::{HeatKind, Light, RenderSettings, Shading};
pub use tiles::{RenderError, RenderRequest, render};
