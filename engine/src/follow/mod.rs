//! Trees that follow triangles that move, frame by frame, by a policy: the binary tree and the wide one.
//!
//! ```
//! use bvhscope_engine::follow::{Follower, Policy};
//! use bvhscope_engine::glam::Vec3;
//! use bvhscope_engine::{BuildSettings, CancelToken, Ray, Triangle};
//!
//! let at = |z: f32| vec![Triangle { a: Vec3::Z * z, b: Vec3::X + Vec3::Z * z, c: Vec3::Y + Vec3::Z * z }; 20];
//! let token = CancelToken::new();
//! let mut follower = Follower::new(Policy::Refit, &BuildSettings::default(), &[at(0.0)], &token)?;
//! for z in [1.0, 2.0] {
//!     let update = follower.follow(&at(z), &token)?;
//!     let hit = follower.wide().closest_hit(&Ray::new(Vec3::new(0.2, 0.2, 5.0), Vec3::NEG_Z));
//!     assert_eq!((hit.map(|hit| hit.t), update.built), (Some(5.0 - z), 0));
//! }
//! # Ok::<(), bvhscope_engine::BuildError>(())
//! ```

mod policy;

use std::sync::Arc;
use std::time::{Duration, Instant};

pub use policy::Policy;

use crate::builders::{BuildError, build_binary};
use crate::bvh::WideBvh;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::refit::{
    BuiltCosts, GrownParts, WideRefit, build_for_poses, grow, partial_rebuild, refit, refit_and_reinsert,
    refit_and_rotate,
};
use crate::settings::BuildSettings;
use crate::tree::AnyTree;

/// Poses at equal distances in the clip for [`Policy::WholeClip`]. Mean SAH cost over 30 frames of walker, cloth and explosion of 100,000
/// triangles: 31.01, 24.68, 1605 with one pose, 29.48, 24.26, 224 with 4, 29.34, 24.26, 225 with 8, 29.30, 24.19, 229 with 16, which take
/// twice as long.
pub const POSES: usize = 8;
/// Triangles for each subtree that [`Policy::Reinsert`] moves at most in a frame.
const TRIANGLES_PER_MOVE: usize = 100;
/// Subtrees that [`Policy::PartialRebuild`] builds again. On walker, of 100,000 triangles and 30 frames, an update takes 0.43 of the time
/// of a rebuild; without a least number of triangles it took 0.93, in many tiny builds. With a growth of 1.1 it takes 0.64 for 3 % less
/// cost, with 1.5 it takes 0.30 and repairs nothing.
const GROWN: GrownParts = GrownParts { growth: 1.2, triangles: 2048 };
/// Frames after which a tree that [`Policy::RebuildBehind`] begins to build takes over: those that a build takes on another thread. The
/// fewer the better: mean SAH cost over 30 frames of walker, cloth and explosion 30.5, 26.2, 88 after one, 31.3, 26.9, 117 after 2, 32.7,
/// 26.6, 209 after 4, 32.9, 26.8, 485 after 8. Four are a choice for models of a million triangles.
pub const FRAMES_BEHIND: usize = 4;

/// A tree that follows moving triangles. A clone shares no memory with it, so that its updates cost as much.
#[derive(Debug, Clone)]
pub struct Follower {
    policy: Policy,
    settings: BuildSettings,
    tree: AnyTree,
    wide: Wide,
    /// Of [`Policy::PartialRebuild`].
    built: Option<BuiltCosts>,
    /// Of [`Policy::RebuildBehind`]: the tree that is built, and how many frames ago that began.
    behind: Option<(AnyTree, Wide, usize)>,
    /// A frame was followed. The tree of the first needs none behind it.
    has_begun: bool,
    preparation: Duration,
}

/// The wide tree, and the lanes by which it is fitted, once they are needed.
#[derive(Debug)]
struct Wide {
    tree: Arc<WideBvh>,
    /// The tree of the frame before, with the same lanes, where readers held it: fitted next, once they have dropped it.
    before: Option<Arc<WideBvh>>,
    lanes: Option<WideRefit>,
}

/// Outcome of an update. Times are wall-clock times.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Update {
    /// Time of updating the binary tree.
    pub tree_time: Duration,
    /// Time of fitting the wide tree, or of making it again. It holds the triangles, so that it is written by every policy.
    pub wide_time: Duration,
    /// Time of work for later frames that another thread would do meanwhile.
    pub behind_time: Duration,
    /// Number of triangles in subtrees that were built.
    pub built: usize,
    /// The nodes are others than before, or at other places; otherwise only containers have changed.
    pub is_other_tree: bool,
}

impl Update {
    /// Time until rays can be traced.
    pub fn ready_time(&self) -> Duration {
        self.tree_time + self.wide_time
    }
}

impl Follower {
    /// Builds the first tree in the calling thread's rayon pool. `poses` are the triangles of the first frame, for
    /// [`Policy::WholeClip`] followed by those of others, [`POSES`] in all at equal distances in time; other policies take the first alone.
    /// For [`Policy::Keep`], [`Follower::enclose`] is then called with each frame.
    ///
    /// # Errors
    ///
    /// As [`build_binary`], and where the policy does not take the settings; see [`Policy::refusal`].
    pub fn new<P: AsRef<[Triangle]>>(
        policy: Policy,
        settings: &BuildSettings,
        poses: &[P],
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let first = poses.first().map_or(&[][..], |pose| pose.as_ref());
        if let Some(refusal) = policy.refusal(settings, first.len()) {
            return Err(BuildError::Refused(refusal));
        }
        let start = Instant::now();
        let tree = match policy {
            Policy::WholeClip => build_for_poses(poses, settings, token)?,
            _ => build_binary(first, settings, token)?.0,
        };
        let built = (policy == Policy::PartialRebuild).then(|| BuiltCosts::new(&tree, token)).transpose()?;
        let is_fitted = !matches!(policy, Policy::Rotate | Policy::Reinsert | Policy::Rebuild);
        let wide = Wide::new(&tree, first, is_fitted, token)?;
        let preparation = start.elapsed();
        Ok(Self { policy, settings: *settings, tree, wide, built, behind: None, has_begun: false, preparation })
    }

    /// Grows the containers of a tree that is kept around a frame that will follow. Of other policies nothing.
    pub fn enclose(&mut self, triangles: &[Triangle], token: &CancelToken) -> Result<(), Cancelled> {
        if self.policy == Policy::Keep {
            let start = Instant::now();
            grow(&mut self.tree, triangles, token)?;
            self.preparation += start.elapsed();
        }
        Ok(())
    }

    /// Makes the tree that of a frame, in the calling thread's rayon pool. `triangles` are those of [`Follower::new`], wherever they
    /// are now. Trees, but not times, are the same for any number of threads.
    ///
    /// # Errors
    ///
    /// As [`build_binary`]. The trees are not to be traced then.
    ///
    /// # Panics
    ///
    /// Where the list is shorter than the first.
    pub fn follow(&mut self, triangles: &[Triangle], token: &CancelToken) -> Result<Update, BuildError> {
        let mut update = Update::default();
        let start = Instant::now();
        match self.policy {
            Policy::Keep => {}
            Policy::Refit | Policy::WholeClip => refit(&mut self.tree, triangles, token)?,
            Policy::Rotate => update.is_other_tree = refit_and_rotate(&mut self.tree, triangles, token)? > 0,
            Policy::Reinsert => {
                let moves = triangles.len().div_ceil(TRIANGLES_PER_MOVE);
                update.is_other_tree = refit_and_reinsert(&mut self.tree, triangles, moves, token)? > 0.0;
            }
            Policy::PartialRebuild => {
                if let Some(built) = &mut self.built {
                    let (tree, settings) = (&mut self.tree, &self.settings);
                    update.built = partial_rebuild(tree, built, triangles, settings, GROWN, token)?;
                    update.is_other_tree = update.built > 0;
                }
            }
            Policy::Rebuild => {
                self.tree = build_binary(triangles, &self.settings, token)?.0;
                (update.built, update.is_other_tree) = (triangles.len(), true);
            }
            Policy::RebuildBehind => {
                update.is_other_tree = self.take_over();
                refit(&mut self.tree, triangles, token)?;
            }
        }
        update.tree_time = start.elapsed();
        if self.policy == Policy::Keep {
            // Nothing for frames that it encloses already, as it does if the clip is known. Not timed.
            grow(&mut self.tree, triangles, token)?;
        }
        let start = Instant::now();
        if update.is_other_tree && self.policy != Policy::RebuildBehind {
            self.wide = Wide::new(&self.tree, triangles, false, token)?;
        } else {
            self.wide.fit(&self.tree, triangles, token)?;
        }
        update.wide_time = start.elapsed();
        if self.policy == Policy::RebuildBehind && self.behind.is_none() && self.has_begun {
            let start = Instant::now();
            let tree = build_binary(triangles, &self.settings, token)?.0;
            let wide = Wide::new(&tree, triangles, true, token)?;
            self.behind = Some((tree, wide, 0));
            update.behind_time = start.elapsed();
            update.built = triangles.len();
        }
        self.has_begun = true;
        Ok(update)
    }

    /// Replaces the tree by the one that is built behind it, once its frames are over.
    fn take_over(&mut self) -> bool {
        if let Some((_, _, frames)) = &mut self.behind {
            *frames += 1;
        }
        let is_ready = |(_, _, frames): &mut (AnyTree, Wide, usize)| *frames >= FRAMES_BEHIND;
        let Some((tree, wide, _)) = self.behind.take_if(is_ready) else { return false };
        (self.tree, self.wide) = (tree, wide);
        true
    }

    /// The policy.
    pub fn policy(&self) -> Policy {
        self.policy
    }

    /// The binary tree of the last frame that was followed.
    pub fn tree(&self) -> &AnyTree {
        &self.tree
    }

    /// The wide tree of that frame, with its triangles. It may be shared: an update writes to memory that no reader holds.
    pub fn wide(&self) -> &Arc<WideBvh> {
        &self.wide.tree
    }

    /// Wall-clock time of everything before the first frame was followed.
    pub fn preparation(&self) -> Duration {
        self.preparation
    }
}

impl Clone for Wide {
    fn clone(&self) -> Self {
        let before = self.before.as_ref().map(|before| Arc::new(WideBvh::clone(before)));
        Self { tree: Arc::new(WideBvh::clone(&self.tree)), before, lanes: self.lanes.clone() }
    }
}

impl Wide {
    /// The wide tree of a binary one, with its lanes where it will be fitted.
    fn new(tree: &AnyTree, triangles: &[Triangle], is_fitted: bool, token: &CancelToken) -> Result<Self, Cancelled> {
        let mut wide = Self { tree: Arc::new(WideBvh::new(tree, triangles, token)?), before: None, lanes: None };
        if is_fitted {
            wide.lanes = Some(wide.lanes(tree, token)?);
        }
        Ok(wide)
    }

    /// The lanes of the binary tree that it was made from.
    fn lanes(&mut self, tree: &AnyTree, token: &CancelToken) -> Result<WideRefit, Cancelled> {
        self.lanes.take().map_or_else(|| WideRefit::new(&self.tree.tree, tree, token), Ok)
    }

    /// Fits it to triangles that its binary tree is fitted to.
    fn fit(&mut self, tree: &AnyTree, triangles: &[Triangle], token: &CancelToken) -> Result<(), Cancelled> {
        let lanes = self.lanes(tree, token)?;
        let fitted = lanes.apply(&mut self.writable().tree, tree, triangles, token);
        self.lanes = Some(lanes);
        fitted
    }

    /// The wide tree in memory that no reader holds: as it is, that of the frame before, or a copy.
    fn writable(&mut self) -> &mut WideBvh {
        if Arc::get_mut(&mut self.tree).is_none() {
            let free = self.before.take().filter(|before| Arc::strong_count(before) == 1);
            let next = free.unwrap_or_else(|| Arc::new(WideBvh::clone(&self.tree)));
            self.before = Some(std::mem::replace(&mut self.tree, next));
        }
        Arc::make_mut(&mut self.tree)
    }
}
