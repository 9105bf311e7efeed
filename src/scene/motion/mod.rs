//! Models that move: clips of animation, and the triangles of a model at a moment of one.
//!
//! A model keeps its triangles, in number and order, while they move, so that a tree over them can be kept or refitted; only a sequence of
//! files may have others in each frame. A [`Mover`] writes where they are: a [`rig`] of nodes, skins and morph targets, a formula of a
//! built-in scene, or a row of files.

mod clip;
mod curve;
mod pose;
mod rig;
mod shape;

use std::sync::OnceLock;

use crate::text::{counted, quoted};

use super::error::LoadError;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Aabb;

pub use clip::Clip;
pub(super) use curve::{Curve, Interpolation};
pub(super) use pose::Mover;
pub use pose::{Moment, Pose};
pub(super) use rig::{CopyMotion, Local, Part, Rig, RigCopy, RigNode, RigSkin, Target, Track};
pub(super) use shape::{Columns, Hold, MorphTarget, Shape, Vertices, columns, scale_of, share, turned, turned_tangent};

/// Names of clips that a message lists.
const LISTED: usize = 12;

/// Moments of a clip at which its reach is measured: most, and least where the model is large.
const REACH_MOMENTS: [usize; 2] = [16, 3];
/// Triangles that are moved at most to measure the reach of a clip, unless it takes the least moments.
const REACH_TRIANGLES: usize = 4_000_000;
/// Seconds from one frame to the next of models that move at any time.
const FRAME_SECONDS: f32 = 0.04;

/// The clips of a model, and where each moves its triangles.
#[derive(Debug)]
pub struct Motion {
    /// The clips, at least one, in file order.
    pub clips: Vec<Clip>,
    mover: Box<dyn Mover>,
    /// The box around the model during each clip, made on request.
    reaches: Vec<OnceLock<Aabb>>,
}

impl Motion {
    pub(super) fn new(clips: Vec<Clip>, mover: Box<dyn Mover>) -> Self {
        let reaches = clips.iter().map(|_| OnceLock::new()).collect();
        Self { clips, mover, reaches }
    }

    /// The same, of which the box around the model during its only clip is known.
    pub(super) fn within_reach(clip: Clip, mover: Box<dyn Mover>, reach: Aabb) -> Self {
        Self { clips: vec![clip], mover, reaches: vec![reach.into()] }
    }

    /// True if all moments have the same triangles, in number and order, so that a tree can follow them.
    pub fn keeps_triangles(&self) -> bool {
        self.mover.keeps_triangles()
    }

    /// Seconds from one frame to the next: of a sequence its own, of models that move at any time 0.04.
    pub fn frame_seconds(&self) -> f32 {
        self.mover.frame_seconds().unwrap_or(FRAME_SECONDS)
    }

    /// Index of the clip with this name, or with this number, counted from 0; of the first where none is named. The error, of a value of
    /// `--clip`, lists the clips.
    pub fn choose(&self, name: Option<&str>) -> Result<usize, String> {
        let Some(name) = name else { return Ok(0) };
        let by_name = self.clips.iter().position(|clip| clip.name == name);
        let found = by_name.or_else(|| name.parse().ok().filter(|&number| number < self.clips.len()));
        found.ok_or_else(|| {
            let names = self.clips.iter().enumerate().map(|(number, clip)| format!("{number} {}", quoted(&clip.name)));
            let mut names: Vec<String> = names.take(LISTED).collect();
            if self.clips.len() > LISTED {
                names.push(counted((self.clips.len() - LISTED) as u64, "others"));
            }
            format!("--clip {name}: the model has no such clip; there are {}", names.join(", "))
        })
    }

    /// The moment within the first and the last key of its clip; `None` where there is no such clip, or the time is no number.
    pub fn within(&self, Moment { clip, seconds }: Moment) -> Option<Moment> {
        let Clip { start, end, .. } = self.clips.get(clip)?;
        seconds.is_finite().then(|| Moment { clip, seconds: seconds.max(*start).min(*end) })
    }

    /// Writes the model at `moment`, whose clip exists, into `pose`, in the calling thread's rayon pool.
    ///
    /// # Errors
    ///
    /// Where the frame is a file that cannot be read again, or is another than it was.
    pub fn pose(&self, moment: Moment, pose: &mut Pose, token: &CancelToken) -> Result<(), LoadError> {
        self.mover.pose(moment, pose, token)
    }

    /// The box around the model during a clip: at moments of equal distance, which may miss what juts out between them. The first
    /// request moves the model as often.
    pub fn reach(&self, clip: usize, token: &CancelToken) -> Result<Aabb, LoadError> {
        if let Some(reach) = self.reaches[clip].get() {
            return Ok(*reach);
        }
        let [most, least] = REACH_MOMENTS;
        let count = (REACH_TRIANGLES / self.mover.triangle_count().max(1)).clamp(least, most);
        let (mut pose, mut reach) = (Pose::default(), Aabb::EMPTY);
        for moment in 0..count {
            let Clip { start, end, .. } = self.clips[clip];
            let seconds = start + (end - start) * moment as f32 / (count - 1) as f32;
            self.pose(Moment { clip, seconds }, &mut pose, token)?;
            reach = reach.union(&pose.bounds(token)?);
        }
        Ok(*self.reaches[clip].get_or_init(|| reach))
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        self.mover.bytes()
    }
}
