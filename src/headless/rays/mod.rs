//! `rays`: writes the rays of a population as a file, prints what a file of rays holds, and checks what is found along them.

mod export;
mod summary;
mod verify;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::context::{Context, Failure, Finished};
use crate::export::{Protected, check_target};
use crate::lab::population::Population;
use crate::ray_file::{RayFileError, RayReader, RaySet};
use crate::render::RenderSettings;
use crate::scene::{Scene, SceneSource};
use crate::text::{counted, printable, shown_path};
use crate::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Ray;
use bvhscope_engine::settings::BuildSettings;

use super::tree_origin::TreeOrigin;

use summary::note_skipped;
pub use verify::Sample;

/// Which rays `rays` is about.
#[derive(Debug, Clone, PartialEq)]
pub enum ChosenRays {
    /// Those of a population, about so many.
    Population(Population, Option<u32>),
    /// Those of a file; `-` is standard input.
    File(PathBuf),
    /// Those of a file, of which so many are checked.
    Checked(PathBuf, Sample),
}

/// Settings of `rays`.
#[derive(Debug, Clone)]
pub struct RaysCommand {
    /// The model.
    pub source: SceneSource,
    /// Build settings of the tree, where it is built.
    pub build: BuildSettings,
    /// Where the tree comes from.
    pub tree: TreeOrigin,
    /// The rays.
    pub rays: ChosenRays,
    /// The camera of the picture whose rays are written.
    pub camera: CameraChoice,
    /// Width and height of that picture in pixels.
    pub size: [u32; 2],
    /// Light and SIMD level; the others do not matter.
    pub settings: RenderSettings,
    /// The ray file to write.
    pub output: Option<PathBuf>,
    /// Print one JSON object instead of text.
    pub json: bool,
}

/// Writes or summarizes the rays.
pub fn run(command: &RaysCommand, context: &mut Context<'_>) -> Result<Finished, Failure> {
    if let Some(text) = command.build.refusal(0) {
        return Err(Failure::Usage(text));
    }
    let mut read = Protected::default();
    read.add_read(command.source.path().into_iter().chain(command.tree.path()));
    if let ChosenRays::File(path) | ChosenRays::Checked(path, _) = &command.rays {
        read.add_read([path]);
    }
    read.add_standard_streams();
    if let Some(path) = &command.output {
        check_target(path, &read)?;
    }
    let scene = context.load(&command.source)?;
    if let Some(path) = &command.output {
        // Again, as only now it is known what else was read: buffers, textures, material libraries.
        read.add_read(&scene.files_read);
        check_target(path, &read)?;
    }
    let finished = match &command.rays {
        ChosenRays::Population(population, count) => {
            export::run(command, (*population, *count), (&scene, &read), context)
        }
        ChosenRays::File(path) => summary::run(command, path, (&scene, &read), context),
        ChosenRays::Checked(path, sample) => verify::run(command, (path, *sample), (&scene, &read), context),
    }?;
    Ok(Finished { warned: finished.warned || !scene.warnings.is_empty() })
}

/// All rays of a file in the coordinates of `scene`, where one is named; prints those that were skipped to stderr.
pub(super) fn read_rays(
    path: Option<&Path>,
    scene: &Scene,
    token: &CancelToken,
) -> Result<Option<Arc<RaySet>>, Failure> {
    let Some(path) = path else { return Ok(None) };
    let set = RaySet::read(path, scene.offset, token).map_err(|error| of_ray_file(path, error))?;
    note_skipped(path, &set.faults);
    if set.rays.is_empty() {
        return Err(Failure::Failed(format!("{}: has no ray that can be traced", shown_path(path))));
    }
    Ok(Some(Arc::new(set)))
}

/// The ray of a file with the number `number`.
pub(super) fn nth_ray(path: &Path, number: u64, scene: &Scene, token: &CancelToken) -> Result<Ray, Failure> {
    let failed = |error| of_ray_file(path, error);
    let mut reader = RayReader::open(path, scene.offset, token).map_err(failed)?;
    let mut chunk = Vec::new();
    while reader.read(&mut chunk, token).map_err(failed)? {
        if let Some(found) = chunk.iter().find(|ray| ray.index == number) {
            return Ok(found.ray);
        }
        if reader.position() > number {
            return Err(Failure::Failed(format!("{}: {}", shown_path(path), reader.faults())));
        }
    }
    let rays = counted(reader.position(), "rays");
    Err(Failure::Failed(format!("{}: there is no ray {number}: the file has {rays}, counted from 0", shown_path(path))))
}

/// A file of rays that cannot be read.
fn of_ray_file(path: &Path, error: RayFileError) -> Failure {
    match error {
        RayFileError::Cancelled(_) => Failure::Interrupted,
        error => Failure::Failed(format!("{}: {}", shown_path(path), printable(&error.to_string()))),
    }
}
