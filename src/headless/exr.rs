//! OpenEXR files of 32-bit floats: hit distances, and linear radiance.

use std::io::Write;
use std::path::Path;

use crate::export::{ExportError, Protected, write_bytes};
use crate::render::Frame;
use bvhscope_engine::cancel::CancelToken;

/// Writes hit distances as an EXR, which is none of the `protected` files, with the distance in red, green and blue, infinity
/// for misses; fails when cancelled.
pub fn write_distances(
    path: &Path,
    protected: &Protected,
    frame: &Frame,
    token: &CancelToken,
) -> Result<(), ExportError> {
    let pixels = frame.distance.iter().flat_map(|&t| [t, t, t]).collect();
    write_exr(path, protected, [frame.width_px, frame.height_px], pixels, token)
}

/// Writes red, green and blue of each pixel as an EXR of 32-bit floats, which is none of the `protected` files; fails when
/// cancelled.
pub(super) fn write_exr(
    path: &Path,
    protected: &Protected,
    [width_px, height_px]: [u32; 2],
    pixels: Vec<f32>,
    token: &CancelToken,
) -> Result<(), ExportError> {
    let picture = image::Rgb32FImage::from_raw(width_px, height_px, pixels)
        .ok_or_else(|| ExportError::new(path, "the picture has fewer pixels than its size says"))?;
    let mut bytes = CancellableBuffer { bytes: std::io::Cursor::new(Vec::new()), token };
    picture
        .write_to(&mut bytes, image::ImageFormat::OpenExr)
        .map_err(|error| ExportError::new(path, format!("cannot be encoded: {error}")))?;
    write_bytes(path, protected, bytes.bytes.get_ref())
}

/// An in-memory file whose writes fail once its token is cancelled, which stops an encoder at its next block.
struct CancellableBuffer<'a> {
    bytes: std::io::Cursor<Vec<u8>>,
    token: &'a CancelToken,
}

impl Write for CancellableBuffer<'_> {
    fn write(&mut self, buffer: &[u8]) -> std::io::Result<usize> {
        self.token.check().map_err(std::io::Error::other)?;
        self.bytes.write(buffer)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl std::io::Seek for CancellableBuffer<'_> {
    fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
        self.bytes.seek(to)
    }
}
