//! Rendering: tiles of rays through an [`Accel`](crate::accel::Accel), shaded into a [`Frame`]. Knows no egui and no wgpu.

pub mod rows;
mod settings;

mod frame;

mod request;

mod values;

mod assemble;
mod tile;
mod tiles;

mod grid;

mod section;

mod visible;

mod trace_context;

mod surface;

mod sampling;

mod shade;

mod crossings;
mod queries;

mod edges;

mod lit;

mod lights;

mod brdf;

mod ground;

mod adaptation;

mod exposure;

mod tone;

mod ambient_occlusion;

pub mod cluster_cut;
pub mod clusters;

pub mod primary;

mod single_ray;

pub use adaptation::{Adaptation, Metered};
pub use crossings::{Crossing, Crossings};
pub use frame::{Frame, FrameStats};
pub use primary::{PrimaryTrace, TestSummary, count_tests, trace_primary, trace_primary_wide};
pub use request::RenderRequest;
pub use settings::{Background, Exposure, HeatKind, Light, NormalSource, RenderSettings, Shading};
pub use single_ray::{NoRay, RayKind, RayStart, rays_of_picture, single_ray};
pub use tiles::{RenderError, render, render_adapting, render_radiance};
pub(crate) use values::nth_smallest;
pub use visible::Visible;
