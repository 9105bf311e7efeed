//! A film of equal pictures, as a GIF or as a folder of PNGs.

use std::path::Path;

use super::context::Failure;
use super::picture::{check_written, write_png};
use crate::export::{Protected, check_target, write_file};
use crate::text::shown_path;
use bvhscope_engine::cancel::CancelToken;

/// Effort of choosing the 256 colours of a frame, 1 (best) to 30 (fastest).
const COLOR_EFFORT: i32 = 10;

/// A film to be written.
pub(super) struct Film<'a> {
    /// A file that ends in .gif, or the folder of the PNGs, which is made where it does not exist.
    pub(super) output: &'a Path,
    /// Width and height in pixels, at most 65,535 each.
    pub(super) size_px: [u32; 2],
    /// Number of frames.
    pub(super) count: usize,
    /// Time that each frame of a GIF is shown, and that of the last one, in hundredths of a second.
    pub(super) delays: [u16; 2],
}

/// Whether the film is a GIF.
fn is_gif(output: &Path) -> bool {
    output.extension().is_some_and(|found| found.eq_ignore_ascii_case("gif"))
}

/// Checks that a film can be written to `output` before work is spent on it.
pub(super) fn check_output(output: &Path, read: &Protected) -> Result<(), Failure> {
    if is_gif(output) {
        check_target(output, read)?;
        return Ok(());
    }
    if output.extension().is_some() && !output.is_dir() {
        return Err(Failure::Usage(format!(
            "{}: the film must end in .gif, or be a folder for pictures, whose name has no extension",
            shown_path(output)
        )));
    }
    if output.is_dir() || !output.exists() {
        return Ok(());
    }
    Err(Failure::Failed(format!("{}: is a file, where a folder for the pictures is expected", shown_path(output))))
}

impl Film<'_> {
    /// Writes the frames one after another as they are made.
    pub(super) fn write(
        &self,
        read: &Protected,
        frames: &mut dyn Iterator<Item = Result<Vec<[u8; 4]>, Failure>>,
        token: &CancelToken,
    ) -> Result<(), Failure> {
        if is_gif(self.output) { self.write_gif(read, frames, token) } else { self.write_folder(read, frames, token) }
    }

    /// Writes a GIF that plays again and again.
    fn write_gif(
        &self,
        read: &Protected,
        frames: &mut dyn Iterator<Item = Result<Vec<[u8; 4]>, Failure>>,
        token: &CancelToken,
    ) -> Result<(), Failure> {
        let [width, height] = self.size_px.map(|side| side as u16);
        let mut failure = None;
        let written = write_file(self.output, read, |writer| {
            let failed = |error: gif::EncodingError| format!("cannot be written: {error}");
            let mut encoder = gif::Encoder::new(writer, width, height, &[]).map_err(failed)?;
            encoder.set_repeat(gif::Repeat::Infinite).map_err(failed)?;
            for (at, pixels) in frames.enumerate() {
                let mut pixels = pixels.map_err(|error| {
                    let text = error.to_string();
                    failure = Some(error);
                    text
                })?;
                let mut picture = gif::Frame::from_rgba_speed(width, height, pixels.as_flattened_mut(), COLOR_EFFORT);
                picture.delay = self.delays[usize::from(at + 1 == self.count)];
                encoder.write_frame(&picture).map_err(failed)?;
            }
            Ok(())
        });
        match failure {
            Some(failure) => Err(failure),
            None => check_written(written, token),
        }
    }

    /// Writes numbered PNGs.
    fn write_folder(
        &self,
        read: &Protected,
        frames: &mut dyn Iterator<Item = Result<Vec<[u8; 4]>, Failure>>,
        token: &CancelToken,
    ) -> Result<(), Failure> {
        let folder = self.output;
        std::fs::create_dir_all(folder)
            .map_err(|error| Failure::Failed(format!("{}: the folder cannot be made: {error}", shown_path(folder))))?;
        for (number, pixels) in (1..).zip(frames) {
            let path = folder.join(format!("frame-{number:04}.png"));
            check_target(&path, read)?;
            check_written(write_png(&path, read, self.size_px, &pixels?, token), token)?;
        }
        Ok(())
    }
}
