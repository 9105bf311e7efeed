//! Models that move: how long each engine takes to bring its tree to triangles that have moved. The upper half of the model is twisted
//! around the y axis, back and forth.

use std::cell::RefCell;
use std::rc::Rc;

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::follow::{Follower, Policy};
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::ContainerKind;
use glam::Vec3;

use crate::peer::{BuildTimes, OWN, Updater};
use crate::rays::Tally;

/// Angles in radians of the top.
const ANGLES: [f32; 2] = [0.3, 0.6];
/// Rays handed over at a time.
const AT_ONCE: usize = 4096;

/// The twist of a model.
pub struct Twist {
    center: Vec3,
    half_height: f32,
}

impl Twist {
    /// Of a model in these bounds.
    pub fn of(bounds: &Aabb) -> Self {
        Self { center: bounds.center(), half_height: (bounds.extent().y * 0.5).max(f32::MIN_POSITIVE) }
    }

    /// Where a point is at a moment, of which there are [`Twist::moments`].
    pub fn moved(&self, point: Vec3, moment: usize) -> Vec3 {
        let from = point - self.center;
        let (sin, cos) = (ANGLES[moment] * (from.y / self.half_height).max(0.0)).sin_cos();
        self.center + Vec3::new(cos * from.x + sin * from.z, from.y, cos * from.z - sin * from.x)
    }

    /// True if a triangle is at another place at another moment.
    pub fn moves(&self, triangle: &Triangle) -> bool {
        triangle.bounds().max.y > self.center.y
    }

    /// The triangles at every moment.
    pub fn moments(&self, triangles: &[Triangle]) -> Vec<Vec<Triangle>> {
        let at = |moment: usize| {
            let moved = |t: &Triangle| Triangle {
                a: self.moved(t.a, moment),
                b: self.moved(t.b, moment),
                c: self.moved(t.c, moment),
            };
            triangles.iter().map(moved).collect()
        };
        (0..ANGLES.len()).map(at).collect()
    }
}

/// Policies of this engine, by name in the table.
const POLICIES: [(&str, Policy); 5] = [
    ("refit", Policy::Refit),
    ("refit + rotations", Policy::Rotate),
    ("refit + reinsertion", Policy::Reinsert),
    ("partial rebuild", Policy::PartialRebuild),
    ("rebuild", Policy::Rebuild),
];

/// Every update of this engine's trees of boxes.
pub fn updaters<'a>(at_rest: &[Triangle], moments: &'a [Vec<Triangle>], threads: usize) -> Vec<Updater<'a>> {
    let settings = BuildSettings::preset(Preset::Fast, ContainerKind::Aabb);
    let updater = |(name, policy): (&str, Policy)| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        let token = CancelToken::new();
        let new = || Follower::new(policy, &settings, &[at_rest], &token).expect("nothing to refuse");
        let follower = Rc::new(RefCell::new(pool.install(new)));
        let traced = Rc::clone(&follower);
        Updater {
            engine: OWN,
            name: format!("box fast, {name}"),
            threads,
            update: Box::new(move |moment| {
                let follower: &mut Follower = &mut follower.borrow_mut();
                let update = pool.install(|| follower.follow(&moments[moment], &token)).expect("nothing to refuse");
                BuildTimes { binary: Some(update.tree_time), ready: update.ready_time() }
            }),
            trace: Box::new(move |work| {
                let follower = traced.borrow();
                let (mut tally, mut hits) = (Tally::default(), vec![None; AT_ONCE]);
                for rays in work.rays.chunks(AT_ONCE) {
                    follower.wide().tree.closest_hits(SimdLevel::of_builds().level(), rays, &mut hits);
                    hits[..rays.len()].iter().for_each(|hit| tally.add(hit.map_or(f32::INFINITY, |hit| hit.t)));
                }
                tally
            }),
        }
    };
    POLICIES.into_iter().map(updater).collect()
}
