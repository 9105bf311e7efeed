//! Trees that follow a model through a clip by a policy, from its first frame to the moment that is shown.

use std::sync::Arc;

use bvhscope_engine::builders::BuildError;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::follow::{Follower, POSES, Policy};
use bvhscope_engine::settings::BuildSettings;
use bvhscope_engine::{AnyTree, with_tree};

use super::follow::Follow;
use super::{Accel, MeshTrees, TwoLevels, peak_bytes_per_triangle};
use crate::budget::Budget;
use crate::scene::{Moment, Motion, Pose, Scene};

/// Policies under which trees keep their nodes: only containers change, and no moment depends on those before.
const fn keeps_nodes(policy: Policy) -> bool {
    matches!(policy, Policy::Keep | Policy::Refit | Policy::WholeClip)
}

/// The tree of the last moment, which that of a later one follows, and the trees of the meshes that both share in a scene of copies.
#[derive(Debug, Default)]
pub struct FollowSession {
    last: Option<Following>,
    meshes: MeshTrees,
}

#[derive(Debug)]
struct Following {
    motion: Arc<Motion>,
    settings: BuildSettings,
    follow: Follow,
    moment: Moment,
    follower: Follower,
    built_areas: Option<Arc<Vec<f32>>>,
}

impl Accel {
    /// The tree of a moment of a model that moves: it follows that of the last moment of the `session`, else that of the first frame of the
    /// clip through all frames before the moment, so that jumps give the same tree each time. In the calling thread's rayon pool.
    ///
    /// # Errors
    ///
    /// As [`Accel::build_binary`], and where the policy does not take the settings.
    pub fn follow(
        scene: &Arc<Scene>,
        settings: &BuildSettings,
        follow: Follow,
        session: &mut FollowSession,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let is_built = follow == Follow::default();
        let (Some(motion), Some(moment), false) = (&scene.motion, scene.moment, is_built) else {
            return Self::build_above(scene, settings, None, &mut session.meshes, token);
        };
        if let Some(reason) = Self::refusal(scene, settings) {
            return Err(BuildError::Refused(reason));
        }
        let leads_here = |last: &Following| {
            let is_later = keeps_nodes(follow.policy) || last.moment.seconds <= moment.seconds;
            Arc::ptr_eq(&last.motion, motion)
                && (last.settings, last.follow, last.moment.clip) == (*settings, follow, moment.clip)
                && is_later
        };
        let mut last = match session.last.take().filter(leads_here) {
            Some(last) => last,
            None => Following::start(scene, settings, follow, motion, moment, token)?,
        };
        let update = last.follower.follow(scene.built_triangles(), token)?;
        last.moment = moment;
        let mut accel = Self::of_follower(scene, settings, &last.follower, &mut session.meshes, token)?;
        (accel.report.build_time, accel.follow) = (update.tree_time, follow);
        if scene.unfolded.copies.is_empty() {
            accel.built_areas.clone_from(&last.built_areas);
        }
        session.last = Some(last);
        Ok(accel)
    }

    /// The tree that a follower has made for `scene`, with the wide one; of a scene of copies above trees of `meshes`, which are built where
    /// they are others.
    pub fn of_follower(
        scene: &Arc<Scene>,
        settings: &BuildSettings,
        follower: &Follower,
        meshes: &mut MeshTrees,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let (tree, wide) = (follower.tree().clone(), Arc::clone(follower.wide()));
        let mut accel = Self::with_tree(scene, settings, tree, token)?;
        if let Some(copies) = &scene.copies {
            return accel.above(TwoLevels::over(copies, meshes.of(copies, settings, token)?, &wide)?, wide, token);
        }
        accel.wide = wide.into();
        Ok(accel)
    }
}

impl Following {
    /// The tree of the first frame, followed through those before `moment`.
    fn start(
        scene: &Scene,
        settings: &BuildSettings,
        follow: Follow,
        motion: &Arc<Motion>,
        moment: Moment,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let Follow { policy, frames } = follow;
        let count = if policy == Policy::WholeClip { POSES } else { 1 };
        let triangles = scene.built_triangles();
        let bytes =
            (count * size_of_val(triangles)) as u64 + triangles.len() as u64 * peak_bytes_per_triangle(settings);
        let within = Budget::of_process().check("the tree", bytes);
        within.map_err(|error| BuildError::Refused(error.to_string()))?;
        let clip = &motion.clips[moment.clip];
        let pose_at = |index: usize, count: usize, pose: &mut Pose| {
            let seconds = clip.at_frame(index, count);
            motion.pose(Moment { seconds, ..moment }, pose, token).map(|()| seconds)
        };
        let mut poses = Vec::with_capacity(count);
        for index in 0..count {
            let mut pose = Pose::default();
            pose_at(index, count, &mut pose)?;
            poses.push(pose.triangles);
        }
        let mut follower = Follower::new(policy, settings, &poses, token)?;
        drop(poses);
        let built_areas = keeps_nodes(policy).then(|| areas(follower.tree(), token)).transpose()?.map(Arc::new);
        let mut pose = Pose::default();
        for frame in 0..frames as usize {
            token.check()?;
            if policy == Policy::Keep {
                pose_at(frame, frames as usize, &mut pose)?;
                follower.enclose(&pose.triangles, token)?;
            } else if keeps_nodes(policy) || clip.at_frame(frame, frames as usize) >= moment.seconds {
                break;
            } else {
                pose_at(frame, frames as usize, &mut pose)?;
                follower.follow(&pose.triangles, token)?;
            }
        }
        Ok(Self { motion: Arc::clone(motion), settings: *settings, follow, moment, follower, built_areas })
    }
}

/// Surface area of the container of each node.
fn areas(tree: &AnyTree, token: &CancelToken) -> Result<Vec<f32>, Cancelled> {
    token.check()?;
    Ok(with_tree!(tree, tree => (0..tree.nodes.len() as u32).map(|node| tree.area(node)).collect()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, SceneSource, load};
    use bvhscope_engine::glam::Vec3;
    use bvhscope_engine::{Ray, Triangle};

    /// A ray from outside through the middle of a triangle.
    fn towards_triangle(triangles: &[Triangle], index: usize) -> Ray {
        let Triangle { a, b, c } = triangles[index];
        let middle = (a + b + c) / 3.0;
        Ray::new(middle + Vec3::new(30.0, 20.0, 10.0), Vec3::new(-3.0, -2.0, -1.0))
    }

    #[test]
    fn a_jump_gives_the_tree_of_following_frame_by_frame() {
        let token = CancelToken::new();
        let source = SceneSource::Builtin { name: "walker".to_owned(), size: Some(600) };
        let scene = load(&source, &LoadOptions::default(), &token).unwrap();
        let clip = scene.motion.as_ref().unwrap().clips[0].clone();
        let at =
            |frame: usize| Arc::new(scene.at(Moment { clip: 0, seconds: clip.at_frame(frame, 10) }, &token).unwrap());
        let hash = |accel: &Accel| accel.hash(&token).unwrap();
        let settings = BuildSettings::default();
        for policy in Policy::ALL {
            let follow = Follow { policy, frames: 10 };
            let mut session = FollowSession::default();
            let mut steps = Vec::new();
            for frame in 0..6 {
                steps.push(Accel::follow(&at(frame), &settings, follow, &mut session, &token).unwrap());
            }
            let jump = Accel::follow(&at(5), &settings, follow, &mut FollowSession::default(), &token).unwrap();
            assert_eq!(hash(&jump), hash(&steps[5]), "{policy:?}");
            // Back in time, the tree is made as on the way there.
            let back = Accel::follow(&at(2), &settings, follow, &mut session, &token).unwrap();
            assert_eq!(hash(&back), hash(&steps[2]), "{policy:?}, back");
            assert_eq!(back.built_areas().is_some(), keeps_nodes(policy));
            // Ready to be traced, with the containers and triangles of its own frame.
            for accel in steps.iter().chain([&jump, &back]) {
                let wide = accel.known_wide().unwrap();
                let ray = towards_triangle(&accel.scene.triangles, 17);
                let expected = accel.tree.closest_hit_indexed(&accel.scene.triangles, &ray);
                assert!(expected.is_some() && wide.closest_hit(&ray) == expected, "{policy:?}");
            }
        }
    }

    #[test]
    fn areas_are_compared_with_those_of_the_first_frame() {
        let token = CancelToken::new();
        let source = SceneSource::Builtin { name: "explosion".to_owned(), size: Some(200) };
        let scene = load(&source, &LoadOptions::default(), &token).unwrap();
        let clip = scene.motion.as_ref().unwrap().clips[0].clone();
        let growth = |seconds: f32| {
            let scene = Arc::new(scene.at(Moment { clip: 0, seconds }, &token).unwrap());
            let follow = Follow { policy: Policy::Refit, ..Follow::default() };
            let accel = Accel::follow(&scene, &BuildSettings::default(), follow, &mut FollowSession::default(), &token)
                .unwrap();
            with_tree!(&accel.tree, tree => tree.area(0)) / accel.built_areas().unwrap()[0]
        };
        assert!((growth(clip.start) - 1.0).abs() < 1e-6);
        assert!(growth(clip.end) > 4.0, "it flies apart");
    }
}
