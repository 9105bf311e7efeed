//! Pictures: tiles of rays through an [`Accel`](crate::accel::Accel), shaded into a [`Frame`]. Knows no egui and no wgpu.

mod settings;

mod frame;

mod values;

mod tiles;

mod grid;

mod view;

mod surface;

mod sampling;

mod shade;

mod edges;

mod lit;

mod ambient_occlusion;

pub mod clusters;

pub mod primary;

pub mod color_map;

mod srgb;

pub use color_map::ColorMap;
pub use frame::{Frame, FrameStats};
pub use primary::{PrimaryTrace, TestSummary, count_tests, trace_primary, trace_primary_wide};
pub use settings::{HeatKind, Light, RenderSettings, Shading};
pub use tiles::{RenderError, RenderRequest, render};
