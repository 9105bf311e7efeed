//! Data derived from a tree for the view "Merges", and the clusters that the overlay draws in place of a range of depths.

use std::collections::HashSet;
use std::sync::Arc;

use crate::lab::merges::{History, Merges};
use crate::overlay::NodeTable;
use bvhscope_engine::construction::Timeline;

/// The merges of a tree, and the table of the tree that they made where that is not the presented one.
#[derive(Debug)]
pub struct MergeStudy {
    /// The merges.
    pub merges: Merges,
    /// Nodes of the tree before its passes; `None` where the merges are those of the presented tree.
    pub table: Option<Arc<NodeTable>>,
}

/// A merge whose choice is explained.
#[derive(Debug, Clone)]
pub struct ChoiceOf {
    /// The construction.
    pub history: Arc<History>,
    /// Number of the merge.
    pub merge: u32,
}

impl PartialEq for ChoiceOf {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.history, &other.history) && self.merge == other.merge
    }
}

/// The nodes of a cut.
#[derive(Debug, Default)]
pub struct CutNodes {
    /// The nodes, largest first.
    pub largest: Vec<u32>,
    /// The same nodes.
    pub set: HashSet<u32>,
}

/// Where clusters come from.
#[derive(Debug, Clone)]
enum Source {
    /// A step of a construction.
    Step(Arc<Result<MergeStudy, String>>, u32),
    /// A cut through the presented tree.
    Cut(Arc<CutNodes>),
}

/// The clusters that the overlay draws, each of which holds its triangles alone.
#[derive(Debug, Clone)]
pub struct Standing {
    source: Source,
    /// Maximum number that was asked for.
    pub count: usize,
    /// The largest of them, largest first.
    pub nodes: Vec<u32>,
    /// Number of all.
    pub all: usize,
    /// The node that the step makes, whose two children are being merged, or that it splits into them.
    pub made: Option<u32>,
    /// The step is a split.
    pub is_split: bool,
}

impl PartialEq for Standing {
    fn eq(&self, other: &Self) -> bool {
        let same = match (&self.source, &other.source) {
            (Source::Step(a, step), Source::Step(b, other)) => Arc::ptr_eq(a, b) && step == other,
            (Source::Cut(a), Source::Cut(b)) => Arc::ptr_eq(a, b),
            _ => false,
        };
        same && self.count == other.count
    }
}

impl Standing {
    /// The clusters of `study` after `step` merges or splits; `None` where there are no merges.
    pub(super) fn at_step(study: &Arc<Result<MergeStudy, String>>, step: u32, count: usize) -> Option<Self> {
        let merges = &study.as_ref().as_ref().ok()?.merges;
        let nodes = merges.timeline.largest_at(step, count.min(Timeline::MAX_LARGEST));
        let all = merges.timeline.standing(step) as usize;
        let source = Source::Step(Arc::clone(study), step);
        Some(Self { source, count, nodes, all, made: merges.made_at(step), is_split: merges.are_splits() })
    }

    /// The nodes of a cut.
    pub(super) fn of_cut(cut: Arc<CutNodes>, count: usize) -> Self {
        let nodes = cut.largest.iter().take(count).copied().collect();
        let all = cut.largest.len();
        Self { source: Source::Cut(cut), count, nodes, all, made: None, is_split: false }
    }

    /// Whether these are the clusters of `study` after `step` merges.
    pub(super) fn is_at(&self, study: &Arc<Result<MergeStudy, String>>, step: u32, count: usize) -> bool {
        let same = matches!(&self.source, Source::Step(own, at) if Arc::ptr_eq(own, study) && *at == step);
        same && self.count == count
    }

    /// The table of the tree that they are nodes of; `None` for the presented tree.
    pub fn table(&self) -> Option<&Arc<NodeTable>> {
        match &self.source {
            Source::Step(study, _) => study.as_ref().as_ref().ok()?.table.as_ref(),
            Source::Cut(_) => None,
        }
    }

    /// Whether `node` is an active cluster, drawn or not.
    pub fn stands(&self, node: u32) -> bool {
        match &self.source {
            Source::Step(study, step) => {
                study.as_ref().as_ref().is_ok_and(|study| study.merges.timeline.stands(node, *step))
            }
            Source::Cut(cut) => cut.set.contains(&node),
        }
    }
}
