//! The hidden and the isolated nodes, in terms that outlive the tree in which they were chosen.

use std::sync::Arc;

use crate::accel::Accel;
use crate::overlay::Selection;
use crate::visibility::{NodeIdentity, TriangleSet};

/// The nodes that the user has hidden, and the isolated one. Those that the present tree lacks are kept, so that they are hidden
/// again in the next tree that has them.
#[derive(Debug, Clone, Default)]
pub struct HiddenNodes {
    hidden: Vec<HiddenNode>,
    isolated: Option<HiddenNode>,
    /// The triangles that are shown alone.
    only: Option<Arc<TriangleSet>>,
}

#[derive(Debug, Clone, Copy)]
struct HiddenNode {
    identity: NodeIdentity,
    /// Its index in the present tree, if that has it.
    node: Option<u32>,
}

impl HiddenNodes {
    /// Adopts what is hidden and isolated in `accel`, the tree of the last [`HiddenNodes::resolve`]. Where nodes were shown again,
    /// those that the tree lacks are forgotten.
    pub fn record(&mut self, accel: &Accel, nodes: &Selection) {
        let Selection { hidden, isolated, only, .. } = nodes;
        self.only.clone_from(only);
        let shown_again = |entry: &HiddenNode| entry.node.is_some_and(|node| !hidden.contains(&node));
        let isolated_before = self.isolated.and_then(|entry| entry.node);
        if self.hidden.iter().any(shown_again) || isolated_before != *isolated {
            self.hidden.retain(|entry| entry.node.is_some_and(|node| hidden.contains(&node)));
            self.isolated = None;
        }
        let find = |node: u32| Some(HiddenNode { identity: NodeIdentity::of(accel, node)?, node: Some(node) });
        if let Some(node) = isolated.filter(|&node| self.isolated.and_then(|entry| entry.node) != Some(node)) {
            self.isolated = find(node);
        }
        if self.hidden.iter().filter(|entry| entry.node.is_some()).count() < hidden.len() {
            let mut new: Vec<u32> = hidden.iter().copied().collect();
            new.retain(|&node| self.hidden.iter().all(|entry| entry.node != Some(node)));
            new.sort_unstable();
            self.hidden.extend(new.into_iter().filter_map(find));
        }
    }

    /// Hides and isolates in `nodes` those that `accel` has; all others are shown.
    pub fn resolve(&mut self, accel: &Accel, nodes: &mut Selection) {
        for entry in self.hidden.iter_mut().chain(&mut self.isolated) {
            entry.node = entry.identity.find(accel);
        }
        nodes.hidden = self.hidden.iter().filter_map(|entry| entry.node).collect();
        nodes.isolated = self.isolated.and_then(|entry| entry.node);
        nodes.only.clone_from(&self.only);
    }

    /// Number of nodes that the tree of the last [`HiddenNodes::resolve`] lacks.
    pub fn missing(&self) -> usize {
        self.hidden.iter().chain(&self.isolated).filter(|entry| entry.node.is_none()).count()
    }

    /// Whether nothing is hidden or isolated.
    pub const fn is_empty(&self) -> bool {
        self.hidden.is_empty() && self.isolated.is_none() && self.only.is_none()
    }
}

/// Equal where the same nodes are hidden, in whichever tree and order.
impl PartialEq for HiddenNodes {
    fn eq(&self, other: &Self) -> bool {
        let identity = |entry: &Option<HiddenNode>| entry.map(|entry| entry.identity);
        let holds = |entry: &HiddenNode| other.hidden.iter().any(|theirs| theirs.identity == entry.identity);
        self.hidden.len() == other.hidden.len()
            && identity(&self.isolated) == identity(&other.isolated)
            && self.only == other.only
            && self.hidden.iter().all(holds)
    }
}
