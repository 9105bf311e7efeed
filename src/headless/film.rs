//! A film of equal pictures, as a GIF, an animated PNG (APNG), or a folder of PNGs.

use std::cell::RefCell;
use std::io::Write;
use std::path::Path;
use std::time::Duration;

use super::context::Failure;
use super::picture::{check_written, encoding_error, png_encoder, write_png};
use crate::export::{Protected, check_target, write_file, wrong_ending};
use crate::text::shown_path;
use bvhscope_engine::cancel::CancelToken;

/// Effort of choosing the 256 colours of a frame of a GIF, 1 (best) to 30 (fastest).
const COLOR_EFFORT: i32 = 10;
/// The shortest time of a frame of a GIF in hundredths of a second: programs show shorter ones for a tenth.
const SHORTEST_OF_GIF: u16 = 2;

/// A film to be written.
pub(super) struct Film<'a> {
    /// A file that ends in .gif or .png, or the folder of the PNGs, which is made where it does not exist.
    pub(super) output: &'a Path,
    /// Width and height in pixels, at most 65,535 each.
    pub(super) size_px: [u32; 2],
    /// Number of frames.
    pub(super) count: usize,
    /// Time that each frame of a file is shown, and that of the last one.
    pub(super) delays: [Duration; 2],
}

/// The files that hold a whole film.
#[derive(Clone, Copy)]
enum FilmFile {
    /// Of 256 colours a frame.
    Gif,
    /// Of all colours.
    Apng,
}

impl FilmFile {
    /// The file at `output`; `None` for a folder.
    fn of(output: &Path) -> Option<Self> {
        let ends_in = |extension| output.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension));
        let found = if ends_in("gif") { Some(Self::Gif) } else { ends_in("png").then_some(Self::Apng) };
        found.filter(|_| !output.is_dir())
    }
}

/// The frames of a film, or why there are no more.
type Frames<'a> = &'a mut dyn Iterator<Item = Result<Vec<[u8; 4]>, Failure>>;

/// Checks that a film can be written to `output` before work is spent on it.
pub(super) fn check_output(output: &Path, read: &Protected) -> Result<(), Failure> {
    if FilmFile::of(output).is_some() {
        check_target(output, read)?;
        return Ok(());
    }
    if output.extension().is_some() && !output.is_dir() {
        let text = "the film must end in .gif or .png, or be a folder for pictures, whose name has no extension";
        return Err(Failure::Usage(wrong_ending(output, text)));
    }
    if output.is_dir() || !output.exists() {
        return Ok(());
    }
    Err(Failure::Failed(format!("{}: is a file, where a folder for the pictures is expected", shown_path(output))))
}

impl Film<'_> {
    /// Writes the frames one after another as they are made. Files play again and again.
    pub(super) fn write(&self, read: &Protected, frames: Frames<'_>, token: &CancelToken) -> Result<(), Failure> {
        let Some(file) = FilmFile::of(self.output) else { return self.write_folder(read, frames, token) };
        let failure = RefCell::new(None);
        let mut frames = frames.map_while(|frame| frame.map_err(|error| *failure.borrow_mut() = Some(error)).ok());
        let written = write_file(self.output, read, |writer| {
            match file {
                FilmFile::Gif => self.encode_gif(writer, &mut frames),
                FilmFile::Apng => self.encode_apng(writer, &mut frames),
            }?;
            // A film that ends before its last frame is not kept.
            failure.borrow().as_ref().map_or(Ok(()), |failure: &Failure| Err(failure.to_string()))
        });
        match failure.take() {
            Some(failure) => Err(failure),
            None => check_written(written, token),
        }
    }

    /// Time of a frame.
    fn delay(&self, at: usize) -> Duration {
        self.delays[usize::from(at + 1 == self.count)]
    }

    fn encode_gif(&self, writer: &mut dyn Write, frames: &mut dyn Iterator<Item = Vec<[u8; 4]>>) -> Result<(), String> {
        let [width, height] = self.size_px.map(|side| side as u16);
        let failed = |error: gif::EncodingError| format!("cannot be written: {error}");
        let mut encoder = gif::Encoder::new(writer, width, height, &[]).map_err(failed)?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(failed)?;
        for (at, mut pixels) in frames.enumerate() {
            let mut picture = gif::Frame::from_rgba_speed(width, height, pixels.as_flattened_mut(), COLOR_EFFORT);
            picture.delay = ((self.delay(at).as_secs_f32() * 100.0).round() as u16).max(SHORTEST_OF_GIF);
            encoder.write_frame(&picture).map_err(failed)?;
        }
        Ok(())
    }

    fn encode_apng(
        &self,
        writer: &mut dyn Write,
        frames: &mut dyn Iterator<Item = Vec<[u8; 4]>>,
    ) -> Result<(), String> {
        let mut encode = |writer: &mut dyn Write| -> Result<(), png::EncodingError> {
            let mut encoder = png_encoder(writer, self.size_px);
            // 0 plays are endless ones.
            encoder.set_animated(self.count as u32, 0)?;
            let mut file = encoder.write_header()?;
            for (at, pixels) in frames.enumerate() {
                file.set_frame_delay(u16::try_from(self.delay(at).as_millis()).unwrap_or(u16::MAX), 1000)?;
                file.write_image_data(pixels.as_flattened())?;
            }
            file.finish()
        };
        encode(writer).map_err(encoding_error)
    }

    /// Writes numbered PNGs.
    fn write_folder(&self, read: &Protected, frames: Frames<'_>, token: &CancelToken) -> Result<(), Failure> {
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
