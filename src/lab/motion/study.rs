//! The study: a tree for each policy, and its numbers in one frame after another.

use std::sync::Arc;
use std::time::Instant;

use crate::accel::{Accel, EPO_SAMPLES, Follow};
use crate::budget::Budget;
use crate::catalog::reading::Times;
use crate::lab::measure::LabError;
use crate::lab::population::{MeasuredRays, Population, ViewRays};
use crate::scene::{Moment, Motion, Pose, Scene, Warnings};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::follow::{Follower, POSES, Policy, Update};
use bvhscope_engine::geometry::{Hit, Ray, Triangle};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::kernel::parallel::par_tasks;
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::overlap::{EndPointOverlap, end_point_overlap};
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::wide::AnyWideTree;
use bvhscope_engine::{AnyTree, BuildError, TreeStats, WideBvh};

/// Frames at most.
pub const MAX_FRAMES: usize = 10_000;
/// Rays that a task traces.
const RAYS_PER_TASK: usize = 1 << 10;

/// The trees and rays of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionPlan {
    /// The policies, which must take the settings; see [`Policy::refusal`].
    pub policies: Vec<Policy>,
    /// How trees are built.
    pub build: BuildSettings,
    /// Index of the clip.
    pub clip: usize,
    /// Number of frames, at equal distances from the first key to the last.
    pub frames: usize,
    /// The rays that are traced in each frame: those of the first are timed.
    pub rays: Vec<ViewRays>,
    /// Instructions of the timed rays.
    pub simd: SimdLevel,
    /// Number of times that rays are traced to take the median.
    pub repeat: usize,
}

impl MotionPlan {
    /// The moment of a frame.
    pub fn moment(&self, motion: &Motion, frame: usize) -> Moment {
        moment_at(motion, self.clip, frame, self.frames)
    }

    /// Why a scene cannot be studied by it; `None` if it can.
    pub fn refusal(&self, scene: &Scene) -> Option<String> {
        let Some(motion) = &scene.motion else { return Some("the model does not move".to_owned()) };
        if self.clip >= motion.clips.len() {
            return Some("the model has no such clip".to_owned());
        }
        if self.frames == 0 || self.frames > MAX_FRAMES {
            return Some(format!("1 to {MAX_FRAMES} frames are expected"));
        }
        self.policies.iter().find_map(|&policy| Follow::refusal(policy, &self.build, scene))
    }
}

/// A moment of `count` at equal distances from the first key of a clip to the last.
fn moment_at(motion: &Motion, clip: usize, index: usize, count: usize) -> Moment {
    Moment { clip, seconds: motion.clips[clip].at_frame(index, count) }
}

/// A tree in a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionRow {
    /// The policy that it follows by.
    pub policy: Policy,
    /// The frame, from 0.
    pub frame: usize,
    /// Time of the clip in seconds.
    pub seconds: f32,
    /// Times of its update, and what that did.
    pub update: Update,
    /// Statistics of the binary tree, with its SAH cost.
    pub stats: TreeStats,
    /// Bytes of the binary tree.
    pub tree_bytes: usize,
    /// End-point overlap of the binary tree.
    pub epo: EndPointOverlap,
    /// Tests and cost of the rays of each population, in the order of the plan.
    pub rays: Vec<MeasuredRays>,
    /// Wall-clock time of a ray of the first population through the wide tree in nanoseconds, all threads together; 0 without rays.
    pub ray_ns: f64,
    /// Fastest and slowest repetition of that; `None` where it was measured once.
    pub ray_spread_ns: Option<[f64; 2]>,
    /// Warnings of the model at this moment.
    pub warnings: Warnings,
}

impl MotionRow {
    /// Containers and triangles that a ray of the first population is tested against, on average over all of them.
    pub fn tests_per_ray(&self) -> Option<f64> {
        self.rays.first()?.tests_per_ray
    }
}

/// A study under way: a tree for each policy, and the next frame.
#[derive(Debug)]
pub struct MotionStudy {
    scene: Arc<Scene>,
    motion: Arc<Motion>,
    plan: MotionPlan,
    followers: Vec<Follower>,
    next: usize,
}

impl MotionStudy {
    /// Builds the first trees in the calling thread's rayon pool.
    pub fn new(scene: &Arc<Scene>, plan: MotionPlan, token: &CancelToken) -> Result<Self, LabError> {
        if let Some(refusal) = plan.refusal(scene) {
            return Err(LabError::Refused(refusal));
        }
        let Some(motion) = scene.motion.clone() else { return Err(LabError::Refused("it does not move".to_owned())) };
        let poses = sampled_poses(scene, &motion, &plan, token)?;
        let part = |index: usize| token.part(index, plan.policies.len());
        let followers = plan.policies.iter().zip(0..);
        let followers = followers.map(|(&policy, index)| Follower::new(policy, &plan.build, &poses, &part(index)));
        let mut followers = followers.collect::<Result<Vec<_>, _>>()?;
        drop(poses);
        let mut pose = Pose::default();
        for follower in followers.iter_mut().filter(|follower| follower.policy() == Policy::Keep) {
            for frame in 0..plan.frames {
                token.check()?;
                motion.pose(plan.moment(&motion, frame), &mut pose, token).map_err(BuildError::from)?;
                follower.enclose(&pose.triangles, token)?;
            }
        }
        Ok(Self { scene: Arc::clone(scene), motion, plan, followers, next: 0 })
    }

    /// The rows of the next frame, one for each policy, in the calling thread's rayon pool; `None` after the last.
    pub fn next_frame(&mut self, token: &CancelToken) -> Result<Option<Vec<MotionRow>>, LabError> {
        let frame = self.next;
        if frame >= self.plan.frames {
            return Ok(None);
        }
        self.next += 1;
        let moment = self.plan.moment(&self.motion, frame);
        let scene = Arc::new(self.scene.at(moment, token).map_err(BuildError::from)?);
        let mut lists: Vec<Option<Vec<Ray>>> = vec![None; self.plan.rays.len()];
        let count = self.followers.len();
        let mut rows = Vec::with_capacity(count);
        for (index, follower) in self.followers.iter_mut().enumerate() {
            let token = &token.part(index, count);
            token.check()?;
            let update = follower.follow(&scene.triangles, token)?;
            let traced =
                Traced { scene: &scene, tree: follower.tree(), wide: follower.wide(), build: &self.plan.build };
            let (rays, ray) = traced.measure(&self.plan, &mut lists, token)?;
            rows.push(MotionRow {
                policy: follower.policy(),
                frame,
                seconds: moment.seconds,
                update,
                stats: tree_stats(follower.tree(), token)?,
                tree_bytes: follower.tree().bytes(),
                epo: end_point_overlap(follower.tree(), &scene.triangles, EPO_SAMPLES, token)?,
                rays,
                ray_ns: ray.ms,
                ray_spread_ns: ray.spread,
                warnings: scene.warnings.clone(),
            });
            token.set_progress(1.0);
        }
        Ok(Some(rows))
    }
}

/// The first frame, and for [`Policy::WholeClip`] others of the clip.
fn sampled_poses(
    scene: &Scene,
    motion: &Motion,
    plan: &MotionPlan,
    token: &CancelToken,
) -> Result<Vec<Vec<Triangle>>, LabError> {
    let count = if plan.policies.contains(&Policy::WholeClip) { POSES } else { 1 };
    let bytes = (count * size_of_val(&scene.triangles[..])) as u64;
    Budget::of_process().check("the poses of a clip", bytes).map_err(|error| LabError::Refused(error.to_string()))?;
    let mut poses = Vec::with_capacity(count);
    for index in 0..count {
        let mut pose = Pose::default();
        motion.pose(moment_at(motion, plan.clip, index, count), &mut pose, token).map_err(BuildError::from)?;
        poses.push(pose.triangles);
    }
    Ok(poses)
}

/// A tree of a frame that is measured.
struct Traced<'a> {
    scene: &'a Arc<Scene>,
    tree: &'a AnyTree,
    wide: &'a WideBvh,
    build: &'a BuildSettings,
}

impl Traced<'_> {
    /// Counts the tests of the rays of each population, and times those of the first. `lists` keeps rays that are the same in every tree of
    /// the frame.
    fn measure(
        &self,
        plan: &MotionPlan,
        lists: &mut [Option<Vec<Ray>>],
        token: &CancelToken,
    ) -> Result<(Vec<MeasuredRays>, Times), Cancelled> {
        let triangles = self.tree.leaf_triangles(&self.scene.triangles, token)?;
        let (mut measured, mut ray) = (Vec::new(), Times::single(0.0));
        for (at, (rays, list)) in plan.rays.iter().zip(lists).enumerate() {
            let own;
            let list: &[Ray] = if rays.population() == Population::Random {
                own = rays.random_lines(self.tree);
                &own
            } else {
                let known = match list.take() {
                    Some(known) => known,
                    // By any tree: all hit the same.
                    None => rays.list(&self.accel(token)?, token)?,
                };
                list.insert(known)
            };
            measured.push(rays.visits(self.scene, self.tree, &triangles, list, token)?.sums);
            if at == 0 {
                ray = time_of_ray(&self.wide.tree, list, plan.simd, plan.repeat, token)?;
            }
        }
        Ok((measured, ray))
    }

    /// The tree as pictures take it, copied.
    fn accel(&self, token: &CancelToken) -> Result<Arc<Accel>, Cancelled> {
        Ok(Arc::new(Accel::with_tree(self.scene, self.build, self.tree.clone(), token)?))
    }
}

/// Wall-clock times in nanoseconds, instead of milliseconds, of finding the nearest hit of a ray, all threads together.
fn time_of_ray(
    wide: &AnyWideTree,
    rays: &[Ray],
    simd: SimdLevel,
    repeat: usize,
    token: &CancelToken,
) -> Result<Times, Cancelled> {
    if rays.is_empty() {
        return Ok(Times::single(0.0));
    }
    let mut hits: Vec<Option<Hit>> = vec![None; rays.len()];
    let mut times = Vec::with_capacity(repeat);
    for _ in 0..repeat.max(1) {
        let start = Instant::now();
        par_tasks(rays.chunks(RAYS_PER_TASK).zip(hits.chunks_mut(RAYS_PER_TASK)), token, |(rays, hits), _| {
            wide.closest_hits(simd.level(), rays, hits);
            Ok(())
        })?;
        times.push(start.elapsed().as_secs_f64() * 1e9 / rays.len() as f64);
    }
    Ok(Times::of(times))
}
