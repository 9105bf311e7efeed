//! Comparison of the presented tree with the one before it: which of their numbers compare, and which way is better.

use crate::accel::{Accel, Follow, RestReadings};
use crate::camera::Camera;
use crate::catalog::numbers::rows::{BUILD_MS, EPO, MRAYS_PER_S};
use crate::catalog::numbers::{NUMBERS, Number, millions_per_second};
use crate::catalog::reading::{TraceReading, TreeReading};
use crate::colors::ColorMap;
use crate::lab::Reading;
pub use crate::lab::verdict::{Factor, Verdict};
use crate::lab::verdict::{Order, judge};
use crate::render::{Frame, RenderSettings};
use bvhscope_engine::tree::ContainerKind;

/// How a number differs from that of the tree before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Comparison {
    /// There is nothing to compare with: this is the first tree of its model, or the number is not known yet.
    Unknown,
    /// The tree before was counted in another view.
    OtherView,
    /// The tree before has containers of another kind, whose numbers do not compare with these.
    OtherContainer,
    /// One of the two builds was repeated as a whole and the other was not, reused other stages of an earlier build, or changed the tree of
    /// another moment.
    OtherStages,
    /// The numbers compare.
    Change {
        /// The number of the tree before.
        before: f64,
        /// The number of the presented tree.
        now: f64,
        /// Which way it went.
        verdict: Verdict,
        /// Of times and speeds the factor that decides it.
        factor: Option<Factor>,
    },
}

/// Everything beside the tree that its counts and its speed depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Circumstances {
    camera: Camera,
    size_px: [u32; 2],
    settings: RenderSettings,
}

impl Circumstances {
    fn of(frame: &Frame) -> Self {
        // Only the colours of the same counts, and how often the same ray is repeated.
        let settings = RenderSettings { heat_range: None, color_map: ColorMap::Inferno, samples: 1, ..frame.settings };
        Self { camera: frame.camera, size_px: [frame.width_px, frame.height_px], settings }
    }
}

/// Counts of a tree in one view, at full resolution.
#[derive(Debug, Clone, PartialEq)]
pub struct Counted {
    /// `None` where triangles were hidden: counts of such a picture compare with none.
    view: Option<Circumstances>,
    /// Container and triangle tests per primary ray.
    tests_per_ray: [f32; 2],
}

impl Counted {
    /// Adds a picture to what was `counted` so far, which is replaced where it belongs to another view. Coarse pictures and those
    /// without counts change nothing. `hides` states whether triangles of the picture are hidden.
    pub fn observe(counted: &mut Option<Self>, frame: &Frame, hides: bool) {
        let Some(tests_per_ray) = frame.stats.tests_per_ray().filter(|_| frame.coarseness == 1.0) else { return };
        let view = (!hides).then(|| Circumstances::of(frame));
        *counted = Some(Self { view, tests_per_ray });
    }
}

/// The numbers of a tree that was shown at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeNumbers {
    container: ContainerKind,
    /// The numbers by which trees are compared and that are known, by name.
    values: Vec<(&'static str, Reading)>,
    /// The session in which its times were measured: those of one were measured in turn.
    session: Option<u64>,
    /// Hash of the tree, once it is known: trees with the same hash are the same, node for node.
    hash: Option<u64>,
    /// Names of the build stages whose results came from an earlier build.
    reused: Vec<&'static str>,
    /// The build time is that of whole builds, repeated.
    is_whole: bool,
    /// How the tree follows a model that moves.
    follow: Follow,
    /// The view of the counts.
    view: Option<Circumstances>,
}

impl TreeNumbers {
    /// The numbers of a tree and of what was counted while it was shown.
    pub fn new(accel: &Accel, counted: Option<&Counted>) -> Self {
        let trace =
            counted.map(|counted| TraceReading { tests: Some(counted.tests_per_ray), ..TraceReading::default() });
        // Without a picture there is a speed, too.
        let reading = TreeReading { trace: trace.or_else(|| Some(TraceReading::default())), ..accel.reading() };
        let at_rest = accel.at_rest();
        let compared = NUMBERS.iter().filter(|number| number.compared.is_some());
        let value = |number: &'static Number| {
            let rounds = at_rest.as_ref().map_or_else(Vec::new, |readings| rounds(number, readings));
            let epo = reading.epo.filter(|_| number == EPO);
            let margin = epo.and_then(|epo| epo.margin).map_or(0.0, f64::from);
            Some((number.key, Reading { value: (number.get)(&reading)?.as_f64()?, rounds, margin }))
        };
        Self {
            container: accel.tree.container_kind(),
            values: compared.filter_map(value).collect(),
            session: at_rest.as_ref().map(|readings| readings.session),
            hash: accel.known_hash(),
            reused: accel.reused_stages().to_vec(),
            is_whole: accel.whole_builds().is_some(),
            follow: accel.follow,
            view: counted.and_then(|counted| counted.view),
        }
    }

    /// One of the numbers; `None` where it is not known.
    pub fn value(&self, number: &Number) -> Option<f64> {
        self.reading(number).map(|reading| reading.value)
    }

    fn reading(&self, number: &Number) -> Option<&Reading> {
        self.values.iter().find(|(key, _)| *key == number.key).map(|(_, reading)| reading)
    }

    /// How a number differs from that of the tree `before`.
    pub fn compare(&self, before: Option<&Self>, number: &Number) -> Comparison {
        let (Some(before), Some(compared)) = (before, &number.compared) else { return Comparison::Unknown };
        if self.container != before.container && !compared.across_containers {
            return Comparison::OtherContainer;
        }
        if number == BUILD_MS && self.follow.policy != before.follow.policy {
            return Comparison::OtherStages;
        }
        if number == BUILD_MS && !(self.is_whole && before.is_whole) {
            // A single build that ran all its stages may have been the first, which finds cold caches.
            let is_like = self.is_whole == before.is_whole && self.reused == before.reused;
            match (is_like, self.reused.is_empty()) {
                (true, true) => return Comparison::Unknown,
                (true, false) => {}
                (false, _) => return Comparison::OtherStages,
            }
        }
        let (Some(earlier), Some(now)) = (before.reading(number), self.reading(number)) else {
            return Comparison::Unknown;
        };
        if compared.depends_on_view && (self.view.is_none() || self.view != before.view) {
            return Comparison::OtherView;
        }
        let is_same = self.hash.is_some() && self.hash == before.hash;
        let in_turn = self.session.is_some() && self.session == before.session;
        let order = if in_turn { Order::InTurn } else { Order::OneAfterOther };
        let (verdict, factor) = if is_same { (Verdict::Same, None) } else { judge(compared, earlier, now, order) };
        Comparison::Change { before: earlier.value, now: now.value, verdict, factor }
    }
}

/// The values of a time or speed in each round; none of other numbers.
fn rounds(number: &Number, readings: &RestReadings) -> Vec<f64> {
    if number == BUILD_MS {
        readings.builds.as_ref().map_or_else(Vec::new, |builds| builds.rounds.clone())
    } else if number == MRAYS_PER_S {
        readings.trace_rounds.iter().map(|&ms| millions_per_second(readings.rays, ms)).collect()
    } else {
        Vec::new()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::accel::{BuildSession, WholeBuilds};
    use crate::catalog::numbers::rows::{MTRIANGLES_PER_S, SAH_COST};
    use crate::catalog::reading::Times;
    use crate::scene::{LoadOptions, SceneSource, load};
    use bvhscope_engine::cancel::CancelToken;
    use bvhscope_engine::follow::Policy;
    use bvhscope_engine::settings::{BuildSettings, Pass, Passes};

    /// Trees of these thresholds in one session, of which each build reuses the sorted primitives of the one before.
    fn trees(thresholds: [u32; 3]) -> [Accel; 3] {
        let (source, token) = (SceneSource::Builtin { name: "teapot".to_owned(), size: Some(2) }, CancelToken::new());
        let scene = Arc::new(load(&source, &LoadOptions::default(), &token).unwrap());
        let mut session = BuildSession::default();
        thresholds.map(|threshold| {
            let build = BuildSettings { threshold, ..BuildSettings::default() };
            Accel::build_with_session(&scene, &build, Some(&mut session), &token).unwrap()
        })
    }

    /// Nine rounds of a session, each of them so many times as long as usual.
    fn at_rest(session: u64, ms: f64, noise: [f64; 9]) -> RestReadings {
        let rounds: Vec<f64> = noise.map(|noise| ms * noise).to_vec();
        let times = Times::of(rounds.clone());
        let builds = Some(WholeBuilds { times, rounds: rounds.clone(), stages: Vec::new() });
        RestReadings { session, builds, rays: 1_000, traces: times, trace_rounds: rounds }
    }

    const NOISE: [f64; 9] = [1.0, 1.2, 0.9, 1.0, 7.0, 1.1, 1.0, 0.95, 1.0];

    fn compare(before: &Accel, now: &Accel, number: &Number) -> Comparison {
        TreeNumbers::new(now, None).compare(Some(&TreeNumbers::new(before, None)), number)
    }

    #[test]
    fn builds_compare_with_their_like_alone() {
        let [cold, reusing, other] = trees([6, 12, 20]);
        assert!(cold.report.stages.reused.is_empty() && !reusing.report.stages.reused.is_empty());
        assert_eq!(compare(&cold, &reusing, BUILD_MS), Comparison::OtherStages);
        assert!(matches!(compare(&reusing, &other, BUILD_MS), Comparison::Change { verdict: Verdict::Once, .. }));
        assert_eq!(compare(&cold, &cold, BUILD_MS), Comparison::Unknown, "a single build may have been cold");
        let verdict = |comparison| match comparison {
            Comparison::Change { verdict, .. } => Some(verdict),
            _ => None,
        };
        cold.keep_at_rest(at_rest(1, 2.0, NOISE));
        assert_eq!(compare(&cold, &reusing, BUILD_MS), Comparison::OtherStages);
        reusing.keep_at_rest(at_rest(2, 3.0, NOISE));
        other.keep_at_rest(at_rest(2, 3.05, NOISE));
        let found = verdict(compare(&cold, &reusing, BUILD_MS));
        assert_eq!(found, Some(Verdict::Worse), "repeated as a whole, whatever was reused at first");
        assert_eq!(verdict(compare(&reusing, &other, BUILD_MS)), Some(Verdict::Worse), "in turn, round by round");
        assert_eq!(verdict(compare(&reusing, &other, MRAYS_PER_S)), Some(Verdict::Worse));
        other.keep_at_rest(at_rest(3, 3.05, NOISE));
        assert_eq!(verdict(compare(&reusing, &other, BUILD_MS)), Some(Verdict::Undecided), "one after the other");
        let mut turned = NOISE;
        turned.reverse();
        other.keep_at_rest(at_rest(2, 3.05, turned));
        assert_eq!(verdict(compare(&reusing, &other, BUILD_MS)), Some(Verdict::Undecided));
    }

    /// The builder's containers are boxes in both.
    #[test]
    fn costs_of_oriented_boxes_do_not_compare_with_those_of_boxes() {
        let [boxes, ..] = trees([6, 6, 6]);
        let build = BuildSettings { optimize: Passes::NONE.with(Pass::Orient), ..BuildSettings::default() };
        let oriented = Accel::build(&boxes.scene, &build, &CancelToken::new()).unwrap();
        assert_eq!(compare(&boxes, &oriented, SAH_COST), Comparison::OtherContainer);
        assert_eq!(compare(&oriented, &boxes, SAH_COST), Comparison::OtherContainer);
    }

    #[test]
    fn an_update_is_compared_with_no_build() {
        let [built, mut kept, _] = trees([6, 6, 6]);
        kept.follow.policy = Policy::Keep;
        assert!(kept.reading().is_update && !built.reading().is_update);
        assert_eq!(compare(&built, &kept, BUILD_MS), Comparison::OtherStages);
        let speed = |accel: &Accel| (MTRIANGLES_PER_S.get)(&accel.reading());
        assert!(speed(&built).is_some());
        assert_eq!(speed(&kept), None, "nothing was built");
    }

    #[test]
    fn a_tree_is_neither_better_nor_worse_than_itself() {
        let [first, again, _] = trees([6, 6, 6]);
        first.keep_at_rest(at_rest(1, 2.0, NOISE));
        again.keep_at_rest(at_rest(1, 4.0, NOISE));
        assert_eq!(first.hash(&CancelToken::new()), again.hash(&CancelToken::new()));
        for number in [BUILD_MS, SAH_COST] {
            let found = compare(&first, &again, number);
            assert!(matches!(found, Comparison::Change { verdict: Verdict::Same, .. }), "{number:?}: {found:?}");
        }
    }
}
