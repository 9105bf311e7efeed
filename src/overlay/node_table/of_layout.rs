//! The table of a layout: the nodes that it keeps of a binary tree.

use std::borrow::Cow;
use std::sync::Arc;

use bvhscope_engine::layouts::KeptNodes;
use bvhscope_engine::tree::statistics::TreeStats;
use rayon::iter::Either;

use super::table::NodeTable;
use crate::accel::Accel;

impl NodeTable {
    /// The table of a layout of `accel`'s tree.
    pub fn of_layout(accel: &Arc<Accel>, kept: &Arc<KeptNodes>) -> Self {
        Self::of_levels(accel, kept.levels(), Some(Arc::clone(kept)))
    }

    /// Statistics of the tree, with the depth of the table, by which colours are scaled.
    pub fn stats(&self) -> Cow<'_, TreeStats> {
        let stats = &self.accel.report.stats;
        match &self.kept {
            Some(_) => Cow::Owned(TreeStats { max_depth: self.max_depth(), ..stats.clone() }),
            None => Cow::Borrowed(stats),
        }
    }

    /// The nodes that the layout keeps of which this is the table; `None` for the whole tree.
    pub fn kept(&self) -> Option<&Arc<KeptNodes>> {
        self.kept.as_ref()
    }

    /// `node` is in the table: every node of the tree but those that a layout does not keep.
    pub fn has(&self, node: u32) -> bool {
        self.kept.as_ref().is_none_or(|kept| kept.keeps(node))
    }

    /// The children in their order, in a layout those of the wide tree; none for a leaf.
    pub fn below(&self, node: u32) -> impl Iterator<Item = u32> {
        match &self.kept {
            Some(kept) => Either::Left(kept.children(node).iter().copied()),
            None => Either::Right(self.children(node)),
        }
    }
}
