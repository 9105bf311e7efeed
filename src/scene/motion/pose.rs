//! A moment of a clip, the triangles there, and whatever moves them.

use std::sync::Arc;

use glam::{Vec3, Vec4};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::scene::attributes::Surface;
use crate::scene::error::LoadError;
use crate::scene::offset::MAX_COORDINATE;
use crate::scene::scene_copies::SceneCopies;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Triangle};

/// Triangles that a task bounds.
const TRIANGLES_PER_TASK: usize = 1 << 16;

/// A moment of a clip.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Moment {
    /// Index in [`Motion::clips`](super::Motion::clips).
    pub clip: usize,
    /// Time in seconds; before the first key and after the last, nothing moves.
    pub seconds: f32,
}

/// The triangles of a model at a moment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pose {
    /// The triangles in their usual order, all of them finite; of a scene of copies those that stand for the copies.
    pub triangles: Vec<Triangle>,
    /// Normals of the vertices of [`Attributes`](crate::scene::Attributes); empty where these have none.
    pub normals: Vec<Vec3>,
    /// Tangents of the same vertices; empty where the model has none.
    pub(in crate::scene) tangents: Vec<Vec4>,
    /// The surface, where the frames of the model have their own.
    pub(in crate::scene) surface: Option<Arc<Surface>>,
    /// Where the copies are, of a scene of copies.
    pub(in crate::scene) copies: Option<Arc<SceneCopies>>,
    /// Positions of the vertices that the triangles are made of.
    pub(in crate::scene) positions: Vec<Vec3>,
    /// Number of triangles that a clip moves to coordinates that are not numbers or too large: they are points, which no ray hits.
    pub(in crate::scene) lost: u64,
}

/// Whatever moves the triangles of a model.
pub(in crate::scene) trait Mover: std::fmt::Debug + Send + Sync {
    /// Number of triangles; of the frame that has most.
    fn triangle_count(&self) -> usize;

    /// True if all moments have the same triangles, in number and order.
    fn keeps_triangles(&self) -> bool {
        true
    }

    /// The seconds of a frame, where the model is a sequence of frames.
    fn frame_seconds(&self) -> Option<f32> {
        None
    }

    /// Writes the triangles, and the normals where the model has any, at a moment of one of its clips, in the calling thread's rayon
    /// pool. `pose` may hold those of another moment, or nothing.
    ///
    /// # Errors
    ///
    /// Where the frame is a file that cannot be read again, or is another than it was.
    fn pose(&self, moment: Moment, pose: &mut Pose, token: &CancelToken) -> Result<(), LoadError>;

    /// Bytes in memory.
    fn bytes(&self) -> usize;
}

impl Pose {
    /// The box around all triangles, be the scene flat or in two levels.
    pub(in crate::scene) fn bounds(&self, token: &CancelToken) -> Result<Aabb, Cancelled> {
        if let Some(copies) = &self.copies {
            return copies.bounds(&self.triangles, token);
        }
        let around = |part: &[Triangle]| part.iter().fold(Aabb::EMPTY, |all, one| all.union(&one.bounds()));
        let parts = self.triangles.par_chunks(TRIANGLES_PER_TASK).map(around);
        Ok(parts.reduce(|| Aabb::EMPTY, |a, b| a.union(&b)))
    }
}

/// Marks positions where no triangle must be by NaN: numbers that are none, or beyond the largest coordinate.
pub(super) fn mark_unusable(positions: &mut [Vec3]) {
    let is_usable = |number: f32| number.abs() <= MAX_COORDINATE;
    let numbers: &[f32] = bytemuck::cast_slice(positions);
    // All at once, without a branch for each.
    if !numbers.iter().fold(true, |all, &number| all & is_usable(number)) {
        for position in positions.iter_mut().filter(|position| !position.to_array().into_iter().all(is_usable)) {
            *position = Vec3::NAN;
        }
    }
}
