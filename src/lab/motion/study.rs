//! The study: a tree for each policy, and its numbers in one frame after another.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::break_even::FrameCost;
use crate::accel::{Accel, Follow, MeshTrees, WeightedRay};
use crate::budget::Budget;
use crate::catalog::reading::Times;
use crate::lab::measure::{LabError, turns};
use crate::lab::measurement::millis;
use crate::lab::population::{MeasuredRays, Population, ViewRays};
use crate::scene::{Moment, Motion, Pose, Scene, Warnings};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::follow::{Follower, POSES, Policy, Update};
use bvhscope_engine::geometry::{Hit, Ray, Triangle};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::kernel::parallel::par_tasks;
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::tree::overlap::EndPointOverlap;
use bvhscope_engine::{AnyTree, BuildError, CopyCosts, TreeStats};

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
    /// Number of rounds of each frame, in which each tree is updated and traced once.
    pub repeat: usize,
    /// Number of samples of which the end-point overlap is estimated; exact without.
    pub epo_samples: Option<usize>,
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
        let of_policy = || self.policies.iter().find_map(|&policy| Follow::refusal(policy, &self.build, scene));
        Accel::refusal(scene, &self.build).or_else(of_policy)
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
    /// The work of its update, with the times of the last round.
    pub update: Update,
    /// Times of each round.
    pub rounds: FrameRounds,
    /// Wall-clock time of everything before the first frame.
    pub preparation: Duration,
    /// Statistics of the binary tree, with its SAH cost.
    pub stats: TreeStats,
    /// Bytes of the binary tree.
    pub tree_bytes: usize,
    /// End-point overlap of the binary tree; `None` of a scene of copies.
    pub epo: Option<EndPointOverlap>,
    /// Tests and cost of the rays of each population, in the order of the plan.
    pub rays: Vec<MeasuredRays>,
    /// Warnings of the model at this moment.
    pub warnings: Warnings,
}

/// Times of a tree in a frame in each round.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameRounds {
    /// Of updating the binary tree, in milliseconds.
    pub update_ms: Vec<f64>,
    /// Until rays can be traced, in milliseconds.
    pub ready_ms: Vec<f64>,
    /// Wall-clock time of a ray of the first population through the wide tree in nanoseconds, all threads together; empty without rays.
    pub ray_ns: Vec<f64>,
}

impl FrameRounds {
    fn push(&mut self, update: &Update, ray_ns: Option<f64>) {
        self.update_ms.push(millis(update.tree_time));
        self.ready_ms.push(millis(update.ready_time()));
        self.ray_ns.extend(ray_ns);
    }
}

impl MotionRow {
    /// Median time until rays can be traced in milliseconds.
    pub fn ready_ms(&self) -> f64 {
        Times::of(self.rounds.ready_ms.clone()).ms
    }

    /// Median time of a ray of the first population in nanoseconds; 0 without rays.
    pub fn ray_ns(&self) -> f64 {
        Times::of(self.rounds.ray_ns.clone()).ms
    }

    /// Both, by which policies are compared.
    pub fn cost(&self) -> FrameCost {
        FrameCost { frame: self.frame, ready_ms: self.ready_ms(), ray_ns: self.ray_ns() }
    }

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
    /// Of a scene of copies, which stay as they are.
    meshes: MeshTrees,
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
        Ok(Self { scene: Arc::clone(scene), motion, plan, followers, meshes: MeshTrees::default(), next: 0 })
    }

    /// The rows of the next frame, one for each policy, in the calling thread's rayon pool; `None` after the last. In each round each tree
    /// of the frame before is updated and traced in turn, of which the last round's stay.
    pub fn next_frame(&mut self, token: &CancelToken) -> Result<Option<Vec<MotionRow>>, LabError> {
        let frame = self.next;
        if frame >= self.plan.frames {
            return Ok(None);
        }
        self.next += 1;
        let moment = self.plan.moment(&self.motion, frame);
        let scene = Arc::new(self.scene.at(moment, token).map_err(BuildError::from)?);
        let mut lists: Vec<Option<Vec<Ray>>> = vec![None; self.plan.rays.len()];
        let (count, repeat) = (self.followers.len(), self.plan.repeat.max(1));
        let mut rounds = vec![FrameRounds::default(); count];
        let mut updates = vec![Update::default(); count];
        for round in 0..repeat {
            for (turn, index) in turns(round, count).enumerate() {
                let token = &token.part(round * count + turn, repeat * count + count);
                token.check()?;
                let mut copy;
                let follower = if round + 1 < repeat {
                    copy = self.followers[index].clone();
                    &mut copy
                } else {
                    &mut self.followers[index]
                };
                updates[index] = follower.follow(&scene.triangles, token)?;
                let ray_ns = self.plan.traced(&scene, follower, &mut self.meshes).time(&mut lists, token)?;
                rounds[index].push(&updates[index], ray_ns);
                token.set_progress(1.0);
            }
        }
        let mut rows = Vec::with_capacity(count);
        for (index, (follower, (update, rounds))) in
            self.followers.iter().zip(updates.into_iter().zip(rounds)).enumerate()
        {
            let token = &token.part(repeat * count + index, repeat * count + count);
            token.check()?;
            let accel = self.plan.traced(&scene, follower, &mut self.meshes).accel(token)?;
            rows.push(MotionRow {
                policy: follower.policy(),
                frame,
                seconds: moment.seconds,
                update,
                rounds,
                preparation: follower.preparation(),
                stats: accel.report.stats.clone(),
                tree_bytes: follower.tree().bytes(),
                epo: accel.epo(self.plan.epo_samples, token)?,
                rays: self.plan.count(&accel, &mut lists, token)?,
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
    let bytes = (count * size_of_val(scene.built_triangles())) as u64;
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
    plan: &'a MotionPlan,
    scene: &'a Arc<Scene>,
    follower: &'a Follower,
    meshes: &'a mut MeshTrees,
}

impl MotionPlan {
    fn traced<'a>(&'a self, scene: &'a Arc<Scene>, follower: &'a Follower, meshes: &'a mut MeshTrees) -> Traced<'a> {
        Traced { plan: self, scene, follower, meshes }
    }

    /// Counts the tests of the rays of each population. `lists` keeps rays that are the same in every tree of the frame.
    fn count(
        &self,
        accel: &Arc<Accel>,
        lists: &mut [Option<Vec<Ray>>],
        token: &CancelToken,
    ) -> Result<Vec<MeasuredRays>, LabError> {
        let trace = |count: u32, ray: WeightedRay<'_>, token: &CancelToken| accel.visits(count, ray, token);
        let sums = self.rays.iter().zip(lists).map(|(rays, known)| {
            let list = list(rays, known, &accel.tree, || Ok(Arc::clone(accel)), token)?;
            let sums = rays.visits(&accel.scene, &accel.tree, &trace, &list, token)?.sums;
            let costs = accel.copy_costs(list.len() as u32, &rays.weighted(&list), token)?;
            let tests_per_ray = costs.and_then(|costs| tests_per_ray(&costs)).or(sums.tests_per_ray);
            Ok(MeasuredRays { tests_per_ray, ..sums })
        });
        sums.collect()
    }
}

impl Traced<'_> {
    fn accel(&mut self, token: &CancelToken) -> Result<Arc<Accel>, LabError> {
        Ok(Arc::new(Accel::of_follower(self.scene, &self.plan.build, self.follower, self.meshes, token)?))
    }

    /// Wall-clock time in nanoseconds of finding the nearest hit of a ray of the first population, all threads together; `None` without
    /// rays.
    fn time(&mut self, lists: &mut [Option<Vec<Ray>>], token: &CancelToken) -> Result<Option<f64>, LabError> {
        let Some((rays, known)) = self.plan.rays.first().zip(lists.first_mut()) else { return Ok(None) };
        let list = list(rays, known, self.follower.tree(), || self.accel(token), token)?;
        if list.is_empty() {
            return Ok(None);
        }
        // A flat scene has no need of the binary tree, of which this is a copy.
        let levels = self.scene.copies.is_some().then(|| self.accel(token)).transpose()?;
        let (wide, simd) = (&self.follower.wide().tree, self.plan.simd.level());
        let mut hits: Vec<Option<Hit>> = vec![None; list.len()];
        let start = Instant::now();
        par_tasks(list.chunks(RAYS_PER_TASK).zip(hits.chunks_mut(RAYS_PER_TASK)), token, |(rays, hits), _| {
            match &levels {
                Some(levels) => levels.closest_hits(rays, hits),
                None => wide.closest_hits(simd, rays, hits),
            }
            Ok(())
        })?;
        Ok(Some(start.elapsed().as_secs_f64() * 1e9 / list.len() as f64))
    }
}

/// Mean of the tests in both levels; `None` without rays.
fn tests_per_ray(costs: &CopyCosts) -> Option<f64> {
    let below: u64 = costs.copies.iter().map(|copy| copy.tests.total()).sum();
    (costs.rays > 0).then(|| (costs.containers_above + below) as f64 / costs.rays as f64)
}

/// The rays of a population in a `tree`, which `accel` has.
fn list<'a>(
    rays: &ViewRays,
    known: &'a mut Option<Vec<Ray>>,
    tree: &AnyTree,
    accel: impl FnOnce() -> Result<Arc<Accel>, LabError>,
    token: &CancelToken,
) -> Result<Cow<'a, [Ray]>, LabError> {
    if rays.population() == Population::Random {
        return Ok(rays.random_lines(tree).into());
    }
    let list = match known.take() {
        Some(list) => list,
        // By any tree: all hit the same.
        None => rays.list(&accel()?, token)?,
    };
    Ok(Cow::from(&known.insert(list)[..]))
}
