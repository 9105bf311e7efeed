//! What is derived from a tree for the view "Merges".

use std::sync::Arc;

use crate::lab::merges::{History, Merges};
use crate::overlay::NodeTable;

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
