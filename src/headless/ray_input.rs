//! Files of rays as commands read them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::context::Failure;
use crate::console::note;
use crate::lab::population::Populations;
use crate::ray_file::{RayFaults, RayFileError, RayReader, RaySet};
use crate::scene::Scene;
use crate::text::{counted, printable, shown_path};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Ray;

/// The rays by which a command measures trees.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeasuringRays {
    /// Their populations.
    pub populations: Populations,
    /// The file of those of a file; `-` is standard input.
    pub file: Option<PathBuf>,
}

impl MeasuringRays {
    /// All rays of the file in the coordinates of `scene`, where one is named; prints those that were skipped to stderr.
    pub(super) fn read_file(&self, scene: &Scene, token: &CancelToken) -> Result<Option<Arc<RaySet>>, Failure> {
        let Some(path) = &self.file else { return Ok(None) };
        let set = RaySet::read(path, scene.offset, token).map_err(|error| of_ray_file(path, error))?;
        note_skipped(path, &set.faults);
        if set.rays.is_empty() {
            return Err(Failure::Failed(format!("{}: has no ray that can be traced", shown_path(path))));
        }
        Ok(Some(Arc::new(set)))
    }
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
pub(super) fn of_ray_file(path: &Path, error: RayFileError) -> Failure {
    match error {
        RayFileError::Cancelled(_) => Failure::Interrupted,
        error => Failure::Failed(format!("{}: {}", shown_path(path), printable(&error.to_string()))),
    }
}

/// Prints the rays that were skipped to stderr.
pub(super) fn note_skipped(path: &Path, faults: &RayFaults) {
    for text in faults.texts() {
        note(format_args!("bvhscope: {}: {text}", shown_path(path)));
    }
}
