//! The picture in tiles: the unit of work and of cancelling.

use std::sync::Arc;

use super::{Frame, RenderSettings};
use crate::accel::Accel;
use crate::camera::Camera;
use crate::cancel::{CancelToken, Cancelled};

/// One picture that is wanted.
#[derive(Debug, Clone)]
pub struct RenderRequest {
    /// What is seen.
    pub accel: Arc<Accel>,
    /// From where.
    pub camera: Camera,
    /// How.
    pub settings: RenderSettings,
    /// Width in pixels, at least 1.
    pub width_px: u32,
    /// Height in pixels, at least 1.
    pub height_px: u32,
    /// 1 for full resolution; n traces one ray for n×n pixels.
    pub coarseness: u32,
}

/// Why there is no picture.
pub type RenderError = Cancelled;

/// Traces a picture in the calling thread's rayon pool: one sample a pixel through its centre, then, at full resolution,
/// `settings.samples` in all. `deliver` gets the frame after the first pass and after each further power of two of samples;
/// the last one is returned. Equal requests give equal pictures for any number of threads.
pub fn render(
    _request: &RenderRequest,
    _token: &CancelToken,
    _deliver: &(dyn Fn(Frame) + Sync),
) -> Result<Frame, RenderError> {
    todo!("render")
}
