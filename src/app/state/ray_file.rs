//! The rays of a file by which trees are measured.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::accel::Accel;
use crate::app::state::study::Study;
use crate::ray_file::{RayFileError, RaySet};
use crate::text::shown_path;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::kernel::SimdLevel;

/// Most rays that are drawn over the picture, at equal distances in the file.
const MOST_DRAWN: usize = 2000;

/// The file, its rays, and which of them the user looks at.
#[derive(Debug)]
pub struct RayFile {
    /// Rays of a file and of the number of times that one was opened; or why it cannot be read.
    pub study: Study<(PathBuf, u32), Result<ReadRays, String>>,
    /// The rays that were read last, with their file.
    read: Option<((PathBuf, u32), Arc<ReadRays>)>,
    /// Number of times that a file was opened, so that one is read again that has changed.
    opened: u32,
    /// The rays are drawn over the picture where visits are measured by them.
    pub are_drawn: bool,
    /// Place in the set of the ray that the view "Ray" shows.
    pub chosen: usize,
}

/// The rays of a file in the coordinates of a scene.
#[derive(Debug, Clone)]
pub struct ReadRays {
    /// All of them.
    pub set: Arc<RaySet>,
    /// Their offset.
    offset: DVec3,
    /// Some of them, to be drawn.
    pub drawn: Vec<DrawnRay>,
}

/// A line over the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnRay {
    /// Both ends: of a ray that hits nothing the second is beyond the model.
    pub ends: [Vec3; 2],
    /// It hits something.
    pub is_hit: bool,
}

impl Default for RayFile {
    fn default() -> Self {
        Self { study: Study::default(), read: None, opened: 0, are_drawn: true, chosen: 0 }
    }
}

impl RayFile {
    /// Reads the file again.
    pub fn open_again(&mut self) {
        self.opened += 1;
        self.study.resume();
    }

    /// The rays of the wanted file, once they are read.
    pub fn rays(&self) -> Option<&Arc<ReadRays>> {
        self.read.as_ref().map(|(_, read)| read)
    }

    /// Forgets the rays.
    pub fn forget(&mut self) {
        self.read = None;
    }

    /// Takes what was read of `path` for `accel`.
    pub(super) fn follow(&mut self, accel: &Arc<Accel>, path: &Path) -> Reading {
        let key = (path.to_owned(), self.opened);
        let is_known = |(of, read): &((PathBuf, u32), Arc<ReadRays>)| *of == key && read.offset == accel.scene.offset;
        if self.read.as_ref().is_some_and(is_known) {
            return Reading::Known;
        }
        match self.study.get(accel, &key).map(|outcome| (**outcome).clone()) {
            None => Reading::Wanted(key),
            Some(Err(reason)) => Reading::Failed(reason),
            Some(Ok(read)) => {
                let read = Arc::new(read);
                (self.read, self.chosen) = (Some((key, Arc::clone(&read))), 0);
                Reading::New(read)
            }
        }
    }
}

/// How far the wanted file is read.
pub(super) enum Reading {
    /// Its rays are known.
    Known,
    /// They were read just now.
    New(Arc<ReadRays>),
    /// It is still to be read.
    Wanted((PathBuf, u32)),
    /// It cannot be read, for this reason.
    Failed(String),
}

impl ReadRays {
    /// Reads a file of rays through the model of `accel`; the error says why it cannot be used.
    pub fn read(accel: &Arc<Accel>, path: &Path, token: &CancelToken) -> Result<Result<Self, String>, Cancelled> {
        let refusal = |reason: &str| Ok(Err(format!("{}: {reason}", shown_path(path))));
        let set = match RaySet::read(path, accel.scene.offset, token) {
            Ok(set) if set.rays.is_empty() => return refusal("has no ray that can be traced"),
            Ok(set) => Arc::new(set),
            Err(RayFileError::Cancelled(cancelled)) => return Err(cancelled),
            Err(error) => return refusal(&error.to_string()),
        };
        let step = set.rays.len().div_ceil(MOST_DRAWN);
        let rays: Vec<_> = set.rays.iter().step_by(step).map(|ray| ray.ray).collect();
        let mut hits = vec![None; rays.len()];
        accel.tracer(SimdLevel::default()).nearest(&rays, &mut hits);
        let [low, high] = [accel.scene.bounds.min, accel.scene.bounds.max];
        let line = |(ray, hit): (&Ray, Option<Hit>)| {
            let beyond = (ray.origin.distance((low + high) * 0.5) + low.distance(high)) / ray.direction.length();
            let end = hit.map_or(beyond, |hit| hit.t).min(ray.t_max);
            DrawnRay { ends: [ray.at(ray.t_min), ray.at(end)], is_hit: hit.is_some() }
        };
        let drawn = rays.iter().zip(hits).map(line).collect();
        Ok(Ok(Self { set, offset: accel.scene.offset, drawn }))
    }
}
