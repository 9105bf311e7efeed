//! `merges`: a film of the construction of a tree, as a GIF or as a folder of PNGs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

#[cfg(feature = "gui")]
use super::cluster_artist::{Artist, KEYS};
use super::context::{Context, Failure, Finished, camera_of, in_pool};
#[cfg(feature = "gui")]
use super::legend;
#[cfg(feature = "gui")]
use super::picture::note_written;
use super::picture::{check_written, write_png};
use super::progress::Progress;
use crate::accel::Accel;
use crate::console::note;
use crate::export::{Protected, check_target, write_file};
#[cfg(feature = "gui")]
use crate::lab::merges::paced_steps;
use crate::lab::merges::{History, Merges};
use crate::overlay::OverlaySettings;
use crate::render::{Frame, RenderRequest, RenderSettings};
use crate::scene::SceneSource;
use crate::text::shown_path;
use crate::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::construction::MergeOrder;
use bvhscope_engine::settings::BuildSettings;

/// Time that the last frame of a film is shown, in hundredths of a second.
const LAST_FRAME: u16 = 250;
/// Effort of choosing the 256 colours of a frame, 1 (best) to 30 (fastest).
const COLOR_EFFORT: i32 = 10;

/// Settings of `merges`.
#[derive(Debug, Clone)]
pub struct MergesCommand {
    /// The model.
    pub source: SceneSource,
    /// Build settings of the tree.
    pub build: BuildSettings,
    /// The camera.
    pub camera: CameraChoice,
    /// Render settings.
    pub settings: RenderSettings,
    /// How the clusters are drawn.
    pub overlay: OverlaySettings,
    /// Order of the merges.
    pub order: MergeOrder,
    /// Maximum number of frames, at least 2.
    pub frames: usize,
    /// Frames a second of a GIF, 1 to 50.
    pub rate: u32,
    /// Width and height in pixels, at most 65,535 each.
    pub size: [u32; 2],
    /// Draw a legend below the pictures; `None` where they are wide enough.
    pub legend: Option<bool>,
    /// A file that ends in .gif, or the folder of the PNGs, which is made where it does not exist.
    pub output: PathBuf,
}

impl MergesCommand {
    fn writes_gif(&self) -> bool {
        self.output.extension().is_some_and(|found| found.eq_ignore_ascii_case("gif"))
    }
}

/// Records the construction and writes the film.
pub fn run(command: &MergesCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    if !cfg!(feature = "gui") {
        return Err(Failure::Failed(
            "this program was built without the feature 'gui', which draws the clusters".to_owned(),
        ));
    }
    let mut read = Protected::default();
    read.add_read(command.source.path());
    read.add_standard_streams();
    check_output(command, &read)?;
    if let Some(text) = command.build.refusal(0) {
        return Err(Failure::Usage(text));
    }
    let scene = context.load(&command.source)?;
    read.add_read(&scene.files_read);
    check_output(command, &read)?;
    let token = &context.token;
    in_pool(|| {
        let progress = Progress::new("Building", token);
        let of_build = |error| Failure::of_build(error, &command.source);
        let accel = Arc::new(Accel::build(&scene, &command.build, token).map_err(of_build)?);
        progress.set_label("Recording merges");
        let history = Arc::new(History::new(&accel, token).map_err(of_build)?);
        let merges = Merges::new(&accel, &history, command.order, token)?;
        if let Some(remark) = history.remark(&accel) {
            note(format_args!("bvhscope: {remark}"));
        }
        progress.set_label("Tracing");
        let request = RenderRequest::new(&accel, camera_of(&command.camera, &scene)?, command.settings, command.size);
        let frame = crate::render::render(&request, token, &|_| ())?;
        progress.set_label("Drawing frames");
        write_film(command, &read, &accel, &merges, &frame, token)
    })?;
    token.check()?;
    Ok(Finished { warned: !scene.warnings.is_empty() })
}

/// Checks that the film can be written before work is spent on it.
fn check_output(command: &MergesCommand, read: &Protected) -> Result<(), Failure> {
    if command.writes_gif() {
        check_target(&command.output, read)?;
        return Ok(());
    }
    if command.output.extension().is_some() && !command.output.is_dir() {
        return Err(Failure::Usage(format!(
            "{}: the film must end in .gif, or be a folder for pictures, whose name has no extension",
            shown_path(&command.output)
        )));
    }
    if command.output.is_dir() || !command.output.exists() {
        return Ok(());
    }
    Err(Failure::Failed(format!(
        "{}: is a file, where a folder for the pictures is expected",
        shown_path(&command.output)
    )))
}

/// Draws the frames one after another and writes each at once.
#[cfg(feature = "gui")]
fn write_film(
    command: &MergesCommand,
    read: &Protected,
    accel: &Arc<Accel>,
    merges: &Merges,
    frame: &Frame,
    token: &CancelToken,
) -> Result<(), Failure> {
    let has_legend = legend::is_wanted(command.legend, command.size[0]);
    let mut artist = Artist::new(accel, merges, frame, command.overlay, has_legend, token)?;
    let legend_px = if has_legend { legend::height_px(command.size[0], KEYS) } else { 0 };
    let size = [command.size[0], command.size[1] + legend_px];
    let steps = paced_steps(merges.timeline.steps(), command.frames, &merges.key_frames);
    let count = steps.len();
    let mut drawn = steps.iter().enumerate().map(|(at, &step)| {
        token.check().map_err(|_| Failure::Interrupted)?;
        token.set_progress(at as f32 / count as f32);
        artist.draw(step)
    });
    if command.writes_gif() {
        write_gif(command, size, read, count, &mut drawn, token)?;
    } else {
        write_folder(command, size, read, &mut drawn, token)?;
    }
    note_written(&command.output, &format!("{count} frames of {}×{} pixels", size[0], size[1]));
    Ok(())
}

#[cfg(not(feature = "gui"))]
fn write_film(
    _: &MergesCommand,
    _: &Protected,
    _: &Arc<Accel>,
    _: &Merges,
    _: &Frame,
    _: &CancelToken,
) -> Result<(), Failure> {
    Err(Failure::Failed("this program was built without the feature 'gui', which draws the clusters".to_owned()))
}

/// Writes the frames as a GIF that plays again and again.
#[cfg_attr(not(feature = "gui"), expect(dead_code, reason = "frames are drawn by the feature gui"))]
fn write_gif(
    command: &MergesCommand,
    size: [u32; 2],
    read: &Protected,
    count: usize,
    frames: &mut dyn Iterator<Item = Result<Vec<[u8; 4]>, Failure>>,
    token: &CancelToken,
) -> Result<(), Failure> {
    let [width, height] = size.map(|side| side as u16);
    let delay = (100 / command.rate.max(1)) as u16;
    let mut failure = None;
    let written = write_file(&command.output, read, |writer| {
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
            picture.delay = if at + 1 == count { LAST_FRAME } else { delay };
            encoder.write_frame(&picture).map_err(failed)?;
        }
        Ok(())
    });
    match failure {
        Some(failure) => Err(failure),
        None => check_written(written, token),
    }
}

/// Writes the frames as numbered PNGs.
#[cfg_attr(not(feature = "gui"), expect(dead_code, reason = "frames are drawn by the feature gui"))]
fn write_folder(
    command: &MergesCommand,
    size: [u32; 2],
    read: &Protected,
    frames: &mut dyn Iterator<Item = Result<Vec<[u8; 4]>, Failure>>,
    token: &CancelToken,
) -> Result<(), Failure> {
    let folder: &Path = &command.output;
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::Failed(format!("{}: the folder cannot be made: {error}", shown_path(folder))))?;
    for (number, pixels) in (1..).zip(frames) {
        let path = folder.join(format!("frame-{number:04}.png"));
        check_target(&path, read)?;
        check_written(write_png(&path, read, size, &pixels?, token), token)?;
    }
    Ok(())
}
