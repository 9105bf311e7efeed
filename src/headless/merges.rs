//! `merges`: a film of the construction of a tree, as a GIF or as a folder of PNGs.

use std::path::PathBuf;
use std::sync::Arc;
#[cfg(feature = "gui")]
use std::time::Duration;

#[cfg(feature = "gui")]
use super::cluster_artist::{Artist, KEYS};
use super::context::{Context, Failure, Finished, camera_of, in_pool};
#[cfg(feature = "gui")]
use super::film::Film;
use super::film::check_output;
#[cfg(feature = "gui")]
use super::picture::note_written;
use super::progress::Progress;
use crate::accel::Accel;
use crate::console::note;
use crate::export::Protected;
#[cfg(feature = "gui")]
use crate::lab::merges::paced_steps;
use crate::lab::merges::{History, Merges};
#[cfg(feature = "gui")]
use crate::legend;
use crate::overlay::OverlaySettings;
use crate::render::{Frame, RenderRequest, RenderSettings};
use crate::scene::SceneSource;
#[cfg(feature = "gui")]
use crate::text::counted;
use crate::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::construction::MergeOrder;
use bvhscope_engine::settings::BuildSettings;

/// Time that the last frame of a film is shown.
#[cfg(feature = "gui")]
const LAST_FRAME: Duration = Duration::from_millis(2500);

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
    check_output(&command.output, &read)?;
    if let Some(text) = command.build.refusal(0) {
        return Err(Failure::Usage(text));
    }
    let scene = context.load(&command.source)?;
    read.add_read(&scene.files_read);
    check_output(&command.output, &read)?;
    let token = &context.token;
    in_pool(|| {
        let progress = Progress::new("Building", token);
        let of_build = |error| Failure::of_build(error, &command.source);
        let accel = Arc::new(Accel::build(&scene, &command.build, token).map_err(of_build)?);
        progress.set_label("Recording the construction");
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
    let steps = paced_steps(merges.timeline.steps(), merges.are_splits(), command.frames, &merges.key_frames);
    let count = steps.len();
    let mut drawn = steps.iter().enumerate().map(|(at, &step)| {
        token.check().map_err(|_| Failure::Interrupted)?;
        token.set_progress(at as f32 / count as f32);
        artist.draw(step)
    });
    let delay = Duration::from_millis(u64::from(100 / command.rate.max(1)) * 10);
    let film = Film { output: &command.output, size_px: size, count, delays: [delay, LAST_FRAME] };
    film.write(read, &mut drawn, token)?;
    note_written(&command.output, &counted(count as u64, &format!("frames of {}×{} pixels", size[0], size[1])));
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
