//! Steps worth stopping at: where levels of the recursion begin, where ranges stop merging, and the end.

use bvhscope_engine::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use bvhscope_engine::construction::{MergeOrder, SplitTree, Timeline};
use bvhscope_engine::settings::BuilderKind;
use bvhscope_engine::with_tree;

use super::history::History;
use crate::text::counted;

/// Numbers of clusters that key frames before the end leave.
const LAST: [u32; 2] = [100, 10];
/// Number of stops that are kept.
const MAX_STOPS: usize = 512;

/// A step worth stopping at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyFrame {
    /// The step.
    pub step: u32,
    /// Description in a few words.
    pub label: String,
}

/// A range of the recursion that stops merging: its list is down to f(x).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReductionStop {
    /// Step of its last merge.
    pub step: u32,
    /// Level of the recursion; 0 over all primitives.
    pub level: u32,
    /// Number of primitives of the range, x.
    pub primitives: u32,
    /// Number of clusters that it leaves, f(x).
    pub left: u32,
}

/// The key frames of `timeline`, ascending, one a step.
pub(super) fn key_frames(history: &History, timeline: &Timeline) -> Vec<KeyFrame> {
    let frame = |step, label: String| KeyFrame { step, label };
    let mut frames = vec![frame(0, "Phase one (downward) has ended: nothing is merged yet".to_owned())];
    if history.construction().is_none() {
        "Nothing is joined yet: every leaf stands".clone_into(&mut frames[0].label);
    }
    for (level, step) in first_steps(history, timeline) {
        frames.push(frame(step, first_merge(history, level)));
    }
    for left in LAST.into_iter().filter(|&left| left <= timeline.steps()) {
        frames.push(frame(timeline.steps() + 1 - left, format!("The last {left} clusters stand")));
    }
    frames.push(frame(timeline.steps(), "The root stands alone".to_owned()));
    in_order(frames)
}

/// Ascending, one a step.
fn in_order(mut frames: Vec<KeyFrame>) -> Vec<KeyFrame> {
    // The first of several at a step is the more specific one.
    frames.sort_by_key(|frame| frame.step);
    frames.dedup_by_key(|frame| frame.step);
    frames
}

/// The first merge of a level of the recursion, or of a round.
fn first_merge(history: &History, level: u32) -> String {
    match history.construction() {
        Some(construction) if construction.builder == BuilderKind::Ploc => {
            format!("First merge of round {}", construction.record.steps().len() as u32 - level)
        }
        _ => format!("First merge of level {level}"),
    }
}

/// The key frames of splits, ascending, one a step.
pub(super) fn of_splits(
    splits: &SplitTree,
    timeline: &Timeline,
    token: &CancelToken,
) -> Result<Vec<KeyFrame>, Cancelled> {
    let frame = |step, label: String| KeyFrame { step, label };
    let mut frames = vec![frame(0, "Nothing is split yet: the root holds all triangles".to_owned())];
    let depths = with_tree!(&splits.tree, tree => tree.depths(token)?);
    let mut reached = 0;
    for (step, &node) in (1..).zip(timeline.nodes()) {
        token.check_every(LIGHT_STEPS, step as usize)?;
        let depth = depths[node as usize];
        if depth >= reached {
            frames.push(frame(step, format!("First split at depth {depth}")));
            reached = depth + 1;
        }
    }
    let spatial = timeline.nodes().iter().position(|&node| splits.duplicates(node) > 0);
    if let Some(at) = spatial {
        let cut = counted(u64::from(splits.duplicates(timeline.nodes()[at])), "triangles");
        let label = format!("First spatial split: {cut} on both sides");
        frames.insert(1, frame(at as u32 + 1, label));
    }
    for nodes in LAST.into_iter().filter(|&nodes| nodes <= timeline.steps()) {
        frames.push(frame(nodes - 1, format!("{nodes} nodes")));
    }
    frames.push(frame(timeline.steps(), "Every leaf is split off".to_owned()));
    Ok(in_order(frames))
}

/// The first step of each level of the recursion that merges anything, by level. The last call has no level of its own.
fn first_steps(history: &History, timeline: &Timeline) -> Vec<(u32, u32)> {
    let Some(construction) = history.construction() else { return Vec::new() };
    let record = &construction.record;
    let steps = record.steps();
    let mut first: Vec<Option<u32>> = Vec::new();
    for step in &steps[..steps.len().saturating_sub(1)] {
        let level = step.level as usize;
        first.resize(first.len().max(level + 1), None);
        // In every order, the merges of a call come in the order in which it does them, or in that of their area.
        for merge in step.merges() {
            let at = timeline.lifetime(record.nodes()[merge as usize]).start;
            first[level] = Some(first[level].map_or(at, |known| known.min(at)));
        }
    }
    (0..).zip(first).filter_map(|(level, step)| Some((level, step?))).collect()
}

/// Where the ranges nearest to the root stop merging, as many as there is room for; none where the order mixes the ranges, and of rounds.
pub(super) fn stops(history: &History, timeline: &Timeline) -> Vec<ReductionStop> {
    let Some(construction) = history.construction() else { return Vec::new() };
    if timeline.order() == MergeOrder::Distance || construction.builder == BuilderKind::Ploc {
        return Vec::new();
    }
    let record = &construction.record;
    let steps = record.steps();
    let mut steps: Vec<_> = steps.iter().take(steps.len().saturating_sub(1)).collect();
    steps.sort_by_key(|step| (step.level, step.first_merge));
    let ends = steps.into_iter().filter_map(|step| {
        let last = step.merges().last()?;
        let at = timeline.lifetime(record.nodes()[last as usize]).start;
        Some(ReductionStop { step: at, level: step.level, primitives: step.primitives, left: step.after })
    });
    let mut stops: Vec<_> = ends.take(MAX_STOPS).collect();
    stops.sort_by_key(|stop| stop.step);
    stops
}
