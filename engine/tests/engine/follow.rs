//! Trees that follow moving triangles by each policy: hits are those of a scan, and trees do not depend on threads.

use std::sync::Arc;

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::fingerprint;
use bvhscope_engine::follow::{FRAMES_BEHIND, Follower, POSES, Policy};
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::refit::refit;
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::{AnyTree, BuildError, BuildSettings, CancelToken, ContainerKind, Preset, WideBvh};

use crate::brute_force::{check, check_form};
use crate::refit::{expected, moved, rays, scenes, settings};
use crate::trees;

/// The frames of a clip: [`POSES`], mixed more and more.
fn clip(at_rest: &[Triangle]) -> Vec<Vec<Triangle>> {
    (0..POSES).map(|frame| moved(at_rest, 1, frame as f32 * 0.1)).collect()
}

fn follower(policy: Policy, settings: &BuildSettings, frames: &[Vec<Triangle>]) -> Follower {
    let token = CancelToken::new();
    let mut follower = Follower::new(policy, settings, frames, &token).unwrap();
    frames.iter().for_each(|frame| follower.enclose(frame, &token).unwrap());
    follower
}

fn cost(tree: &AnyTree) -> f32 {
    tree_stats(tree, &CancelToken::new()).unwrap().sah_cost
}

#[test]
fn every_policy_hits_what_a_scan_hits() {
    let token = CancelToken::new();
    for (name, at_rest) in scenes() {
        let frames = clip(&at_rest);
        for settings in settings() {
            for policy in Policy::ALL {
                if policy.refusal(&settings, at_rest.len()).is_some() {
                    continue;
                }
                let mut follower = follower(policy, &settings, &frames);
                // Also where the clip does not go.
                let others = [(0, 0.4), (2, 1.0), (3, 2.0), (1, 0.0)].map(|(way, by)| moved(&at_rest, way, by));
                for (at, triangles) in frames.iter().chain(&others).enumerate() {
                    let rays = rays(triangles, 12, 11);
                    let name = format!("{name} {settings:?} by {}, frame {at}", policy.name());
                    follower.follow(triangles, &token).unwrap();
                    let expected = expected(triangles, &rays);
                    check_form(&name, &follower.wide().tree, &rays, &expected);
                    if at % 3 == 0 {
                        check(&name, triangles, follower.tree(), &rays, &expected);
                    }
                }
            }
        }
    }
}

#[test]
fn trees_do_not_depend_on_the_number_of_threads() {
    let frames: Vec<_> = clip(&trees::soup(5_000, 0.03, 9)).into_iter().step_by(2).collect();
    for settings in settings() {
        for policy in Policy::ALL.into_iter().filter(|policy| policy.refusal(&settings, 5_000).is_none()) {
            let on = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let token = CancelToken::new();
                    let mut follower = follower(policy, &settings, &frames);
                    for frame in &frames {
                        follower.follow(frame, &token).unwrap();
                    }
                    (follower.tree().clone(), fingerprint::of_wide_tree(&follower.wide().tree, &token))
                })
            };
            assert!(on(1) == on(3), "{policy:?}, {settings:?}");
        }
    }
}

#[test]
fn wide_trees_that_readers_hold_stay_as_they_were() {
    let token = CancelToken::new();
    let frames: Vec<_> = clip(&trees::soup(500, 0.1, 6));
    let hash = |wide: &WideBvh| fingerprint::of_wide_tree(&wide.tree, &token).unwrap();
    for policy in Policy::ALL {
        let new = || follower(policy, &BuildSettings::default(), &frames);
        let (mut alone, mut shared) = (new(), new());
        // Those of one frame, of two, and of all before.
        for kept in [1, 2, frames.len()] {
            let mut held: Vec<(Arc<WideBvh>, u64)> = Vec::new();
            for frame in &frames {
                alone.follow(frame, &token).unwrap();
                shared.follow(frame, &token).unwrap();
                let expected = hash(alone.wide());
                assert_eq!(hash(shared.wide()), expected, "{policy:?}, {kept} held");
                held.push((Arc::clone(shared.wide()), expected));
                held.drain(..held.len().saturating_sub(kept));
                assert!(held.iter().all(|(wide, as_it_was)| hash(wide) == *as_it_was), "{policy:?}, {kept} held");
            }
        }
    }
}

#[test]
fn a_tree_behind_takes_over_fitted_after_its_frames() {
    let (settings, token) = (BuildSettings::default(), CancelToken::new());
    let at_rest = trees::soup(300, 0.1, 4);
    let frames: Vec<_> = (0..2 * FRAMES_BEHIND + 2).map(|frame| moved(&at_rest, 1, frame as f32 * 0.05)).collect();
    let mut follower = follower(Policy::RebuildBehind, &settings, &frames);
    for (at, triangles) in frames.iter().enumerate() {
        let update = follower.follow(triangles, &token).unwrap();
        // The first is that of frame 0; one is begun in frame 1, and then whenever one takes over.
        let begun = at.saturating_sub(1) / FRAMES_BEHIND * FRAMES_BEHIND + 1;
        let from = begun.saturating_sub(FRAMES_BEHIND);
        let mut tree = build_binary(&frames[from], &settings, &token).unwrap().0;
        refit(&mut tree, triangles, &token).unwrap();
        assert!(*follower.tree() == tree, "frame {at}");
        assert_eq!(update.is_other_tree, at == begun && from > 0, "frame {at}");
        assert_eq!(update.built > 0, at == begun, "a new one is begun in frame {at}");
    }
}

#[test]
fn updates_cost_less_the_more_they_change() {
    // Each policy changes more than the one before it, but for the last two.
    let (settings, token) = (BuildSettings::default(), CancelToken::new());
    let frames = clip(&trees::soup(2_000, 0.02, 1));
    let mean_of = |policy| {
        let mut follower = follower(policy, &settings, &frames);
        let costs = frames.iter().map(|frame| {
            follower.follow(frame, &token).unwrap();
            cost(follower.tree())
        });
        costs.sum::<f32>() / frames.len() as f32
    };
    let [keep, refit, rotate, reinsert, partial, rebuild, behind, whole] = Policy::ALL.map(mean_of);
    let all = [keep, refit, rotate, reinsert, partial, rebuild, behind, whole];
    assert!(rotate < refit * 0.95 && reinsert < refit && partial < refit * 0.8 && rebuild < refit * 0.8, "{all:?}");
    assert!(partial < rebuild * 1.3 && behind < refit && behind > rebuild, "{all:?}");
    assert!(whole < refit * 0.95, "{all:?}");
}

#[test]
fn what_a_policy_cannot_do_is_refused_with_a_way_out() {
    let settings = BuildSettings::preset(Preset::Fast, ContainerKind::Sphere);
    let frames = [trees::soup(3, 0.2, 3)];
    let refused = Follower::new(Policy::Reinsert, &settings, &frames, &CancelToken::new());
    let Err(BuildError::Refused(text)) = refused else { panic!("{refused:?}") };
    assert!(text.contains("'reinsert'") && text.contains("'rotate'"), "{text}");
    for policy in Policy::ALL {
        let cancelled = CancelToken::new();
        cancelled.cancel();
        let built = Follower::new(policy, &BuildSettings::default(), &frames, &cancelled);
        assert!(matches!(built, Err(BuildError::Cancelled(_))), "{policy:?}");
    }
}
