//! The construction of a tree merge by merge or split by split, prepared for a view of it: history, density over time, key frames, pacing.
//!
//! Start at [`Merges`]. The record itself and its queries are [`bvhscope_engine::construction`].

mod density;
mod history;
mod key_frames;
mod pacing;
mod reduction_handles;

use std::ops::Range;
use std::sync::Arc;

pub use density::{Density, area_axis};
pub use history::{History, Origin, TreeOfRecord, is_recorded, merges_clusters};
pub use key_frames::{KeyFrame, ReductionStop};
pub use pacing::paced_steps;
pub use reduction_handles::{reduction_through, threshold_at};

use crate::accel::Accel;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::construction::{MergeOrder, Timeline};
use bvhscope_engine::kernel::parallel::par_collect;
use bvhscope_engine::tree::node_metrics;
use bvhscope_engine::with_tree;

/// Columns of the density of all merges.
const COLUMNS: usize = 512;
/// Rows of the density of all merges.
const ROWS: usize = 96;
/// Areas below this fraction of the root's count as it: the logarithm of nothing is no number.
const SMALLEST_SHARE: f32 = 1e-12;

/// The merges or splits of a tree in one order, with what a view shows of them. Holds some 100 bytes per primitive.
#[derive(Debug)]
pub struct Merges {
    /// The construction, which all orders share.
    pub history: Arc<History>,
    /// The active clusters at each step.
    pub timeline: Arc<Timeline>,
    /// log2 of the area of what each step makes, or splits, relative to the root's: that of step k at k − 1.
    pub log_areas: Vec<f32>,
    /// Where among all steps and areas the merges are.
    pub density: Arc<Density>,
    /// Steps worth stopping at, ascending.
    pub key_frames: Vec<KeyFrame>,
    /// Where ranges stop merging, ascending by step: those nearest to the root.
    pub stops: Vec<ReductionStop>,
}

impl Merges {
    /// The merges of `history` in `order`; by distance where nothing is known of their order. `accel` is the tree that the history was
    /// made for.
    pub fn new(
        accel: &Accel,
        history: &Arc<History>,
        order: MergeOrder,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let tree = history.tree(accel);
        let timeline = match &history.origin {
            Origin::Merged(construction) => construction.timeline(order, token)?,
            Origin::Split(splits) => splits.timeline(order, token)?,
            Origin::Unknown => Timeline::by_distance(tree, token)?,
        };
        let timeline = Arc::new(timeline);
        let nodes = timeline.nodes();
        let log_areas = with_tree!(tree, tree => {
            let log_area = |at: usize| node_metrics::area_share(tree, nodes[at]).max(SMALLEST_SHARE).log2();
            par_collect(nodes.len(), token, log_area)?
        });
        let density = Arc::new(Density::new(&log_areas, 0..log_areas.len(), [COLUMNS, ROWS]));
        let key_frames = match history.splits() {
            Some(splits) => key_frames::of_splits(splits, &timeline, token)?,
            None => key_frames::key_frames(history, &timeline),
        };
        let stops = key_frames::stops(history, &timeline);
        Ok(Self { history: Arc::clone(history), timeline, log_areas, density, key_frames, stops })
    }

    /// Its steps are splits.
    pub fn are_splits(&self) -> bool {
        self.timeline.splits()
    }

    /// "merge" or "split".
    pub fn noun(&self) -> &'static str {
        if self.are_splits() { "split" } else { "merge" }
    }

    /// The steps of which the part of so many is the most telling: the last merges, and the first splits.
    pub fn window(&self, steps: u32) -> Range<usize> {
        let (all, steps) = (self.log_areas.len(), steps as usize);
        if self.are_splits() { 0..steps.min(all) } else { all.saturating_sub(steps)..all }
    }

    /// The order of the merges: by distance where nothing is recorded of it.
    pub fn order(&self) -> MergeOrder {
        self.timeline.order()
    }

    /// The node that `step` makes, or splits; `None` for step 0 and for steps that there are not.
    pub fn made_at(&self, step: u32) -> Option<u32> {
        self.timeline.nodes().get((step as usize).checked_sub(1)?).copied()
    }

    /// Area of what `step` makes, or splits, as a fraction of the root's.
    pub fn area_share(&self, step: u32) -> Option<f32> {
        self.log_areas.get((step as usize).checked_sub(1)?).map(|log| log.exp2())
    }

    /// Number of the merge that `step` shows in the order of the build, from 0; `None` where none is recorded.
    pub fn merge_number(&self, step: u32) -> Option<u32> {
        self.history.construction()?.record.merge_of(self.made_at(step)?)
    }

    /// The key frame after `step`, or the last before it.
    pub fn next_key_frame(&self, step: u32, forward: bool) -> Option<&KeyFrame> {
        if forward {
            self.key_frames.iter().find(|frame| frame.step > step)
        } else {
            self.key_frames.iter().rev().find(|frame| frame.step < step)
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use crate::scene::{LoadOptions, SceneSource, load};
    use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass, Passes, Preset};
    use bvhscope_engine::tree::ContainerKind;

    use super::*;

    fn accel(settings: BuildSettings) -> Accel {
        let source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(2) };
        let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
        Accel::build_binary(&scene, &settings, &CancelToken::new()).unwrap()
    }

    fn merges(accel: &Accel, order: MergeOrder) -> Merges {
        let history = Arc::new(History::new(accel, &CancelToken::new()).unwrap());
        Merges::new(accel, &history, order, &CancelToken::new()).unwrap()
    }

    #[test]
    fn each_merge_has_a_place_in_the_plot() {
        let accel = accel(BuildSettings::default());
        for order in MergeOrder::ALL {
            let merges = merges(&accel, order);
            let steps = merges.timeline.steps();
            assert_eq!(merges.density.counts.iter().sum::<u32>(), steps);
            assert_eq!((merges.area_share(steps), merges.area_share(0)), (Some(1.0), None), "the last makes the root");
            let mut numbers: Vec<u32> = (1..=steps).filter_map(|step| merges.merge_number(step)).collect();
            assert_eq!(numbers.is_sorted(), order == MergeOrder::Built);
            numbers.sort_unstable();
            assert!(numbers.into_iter().eq(0..steps));
        }
    }

    #[test]
    fn key_frames_are_where_levels_begin() {
        let accel = accel(BuildSettings::default());
        let merges = merges(&accel, MergeOrder::Level);
        assert!(merges.key_frames.is_sorted_by(|a, b| a.step < b.step));
        let record = &merges.history.construction().unwrap().record;
        let level = |step| record.level_of(merges.made_at(step)?);
        let begin = merges.key_frames.iter().filter(|frame| frame.label.starts_with("First merge of level"));
        let begins: Vec<u32> = begin.map(|frame| frame.step).collect();
        assert!(begins.len() > 3, "{begins:?}");
        for &step in &begins {
            assert!(level(step) < level(step - 1) || step == 1, "a level begins at {step}");
        }
        let last = merges.next_key_frame(merges.timeline.steps(), false).unwrap();
        assert_eq!(last.step + 9, merges.timeline.steps(), "{}", last.label);
        assert_eq!(merges.next_key_frame(0, true).map(|frame| frame.step), Some(1));
    }

    #[test]
    fn ranges_stop_at_f_of_their_primitives() {
        let settings = BuildSettings::default();
        let accel = accel(settings);
        let reduction = bvhscope_engine::construction::Reduction::of(&settings);
        let stops = merges(&accel, MergeOrder::Built).stops;
        assert!(stops.len() > 10 && stops.is_sorted_by_key(|stop| stop.step));
        assert!(stops.iter().all(|stop| stop.left as usize == reduction.reduced_count(stop.primitives as usize)));
        assert!(merges(&accel, MergeOrder::Distance).stops.is_empty(), "this order mixes ranges");
    }

    #[test]
    fn the_record_is_of_the_tree_before_its_passes() {
        let accel = accel(BuildSettings::preset(Preset::Best, ContainerKind::Aabb));
        let history = merges(&accel, MergeOrder::Built).history;
        assert!(matches!(history.of, TreeOfRecord::Before(_)));
        assert!(history.tree(&accel).node_count() > accel.tree.node_count());
        assert!(history.remark(&accel).is_some_and(|text| text.contains("Reinsert")));
    }

    #[test]
    fn trees_from_the_top_are_shown_split_by_split() {
        let accel = accel(BuildSettings { builder: BuilderKind::Sbvh, ..BuildSettings::default() });
        for order in MergeOrder::ALL {
            let merges = merges(&accel, order);
            assert_eq!((merges.order(), merges.merge_number(1), merges.noun()), (order, None, "split"));
            assert!(merges.stops.is_empty(), "nothing is reduced");
            assert_eq!((merges.made_at(1), merges.area_share(1)), (Some(0), Some(1.0)), "the root is split first");
            assert_eq!((merges.window(10), merges.history.remark(&accel)), (0..10, None));
            let labels: Vec<_> = merges.key_frames.iter().map(|frame| (frame.step, frame.label.as_str())).collect();
            assert_eq!(labels[0], (0, "Nothing is split yet: the root holds all triangles"));
            assert!(labels.iter().any(|frame| frame.1.starts_with("First split at depth 3")), "{labels:?}");
            let spatial = labels.iter().find(|frame| frame.1.starts_with("First spatial split")).unwrap();
            let splits = merges.history.splits().unwrap();
            assert!(splits.duplicates(merges.made_at(spatial.0).unwrap()) > 0);
            assert!((1..spatial.0).all(|step| splits.duplicates(merges.made_at(step).unwrap()) == 0));
        }
        let collapsed = Passes::NONE.with(Pass::Collapse);
        let accel = self::accel(BuildSettings { optimize: collapsed, ..accel.settings });
        let remark = merges(&accel, MergeOrder::Built).history.remark(&accel).unwrap();
        assert!(remark.starts_with("These splits made the tree before its passes"), "{remark}");
    }

    #[test]
    fn blocks_that_were_merged_are_shown_by_area() {
        let accel = accel(BuildSettings::preset(Preset::Swift, ContainerKind::Aabb));
        let merges = merges(&accel, MergeOrder::Built);
        assert_eq!((merges.order(), merges.merge_number(1)), (MergeOrder::Distance, None));
        assert_eq!(merges.made_at(merges.timeline.steps()), Some(0));
    }
}
