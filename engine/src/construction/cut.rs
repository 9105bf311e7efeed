//! Cuts through a tree: sets of nodes that hold each primitive exactly once.

use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::tree::ancestry::Ancestry;
use crate::tree::{AnyTree, Container, Tree};
use crate::with_tree;

use super::timeline::{MergeOrder, Timeline};

/// A cut through a binary tree: nodes none of which is below another and that together hold every primitive. A plain value, which can be
/// stored; [`Cut::nodes`] finds its nodes in any tree.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Cut {
    /// The clusters that are left when the closest have been merged until there are so many, at least one: those active so
    /// many steps before the end by [`MergeOrder::Distance`], and all leaves where there are fewer.
    Clusters(u32),
    /// The largest nodes whose area is at most this fraction of the root's, and leaves that exceed it.
    Area(f32),
    /// The largest nodes of at most this number of primitives, and leaves that have more.
    Primitives(u32),
    /// The active clusters at a step of an order.
    Step {
        /// The order of the merges.
        order: MergeOrder,
        /// Number of merges that have been done; only the root is active at the last.
        step: u32,
    },
}

/// Reason for which a cut has no nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CutError {
    /// The computation was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The cut is at a step of an order that only a [`super::Construction`] records, and its timeline was not given.
    #[error("a cut at a step needs the timeline of its order")]
    NeedsTimeline,
}

impl Cut {
    /// The order whose timeline [`Cut::nodes`] uses; `None` where it needs none.
    pub fn order(self) -> Option<MergeOrder> {
        match self {
            Self::Clusters(_) => Some(MergeOrder::Distance),
            Self::Step { order, .. } => Some(order),
            Self::Area(_) | Self::Primitives(_) => None,
        }
    }

    /// The nodes of the cut through `tree`, from left to right. `timeline` is that of [`Cut::order`] for this tree; one by distance is
    /// made where it is not given.
    pub fn nodes(self, tree: &AnyTree, timeline: Option<&Timeline>, token: &CancelToken) -> Result<Vec<u32>, CutError> {
        let made;
        let timeline = match self.order() {
            None => None,
            Some(order) => match timeline.filter(|timeline| timeline.order() == order) {
                None if order == MergeOrder::Distance => {
                    made = Timeline::by_distance(tree, token)?;
                    Some(&made)
                }
                None => return Err(CutError::NeedsTimeline),
                given => given,
            },
        };
        Ok(with_tree!(tree, tree => self.nodes_of(tree, timeline, token))?)
    }

    /// [`Cut::nodes`] of a tree of one kind.
    fn nodes_of<C: Container>(
        self,
        tree: &Tree<C>,
        timeline: Option<&Timeline>,
        token: &CancelToken,
    ) -> Result<Vec<u32>, Cancelled> {
        let area_of = |node: u32| tree.area(node);
        match (self, timeline) {
            (Self::Clusters(clusters), Some(timeline)) => {
                let step = timeline.step_with(clusters);
                antichain(tree, |node| timeline.is_whole(node, step), token)
            }
            (Self::Step { step, .. }, Some(timeline)) => {
                let step = step.min(timeline.steps());
                antichain(tree, |node| timeline.is_whole(node, step), token)
            }
            (Self::Area(fraction), _) => {
                let largest = if tree.nodes.is_empty() { 0.0 } else { fraction * area_of(0) };
                antichain(tree, |node| area_of(node) <= largest, token)
            }
            (Self::Primitives(most), _) => {
                let counts = Ancestry::new(tree, token)?.primitive_counts;
                antichain(tree, |node| counts[node as usize] <= most, token)
            }
            (Self::Clusters(_) | Self::Step { .. }, None) => Ok(Vec::new()),
        }
    }
}

/// The highest nodes that are leaves or `included`, from left to right.
fn antichain<C: Container>(
    tree: &Tree<C>,
    included: impl Fn(u32) -> bool,
    token: &CancelToken,
) -> Result<Vec<u32>, Cancelled> {
    let mut cut = Vec::new();
    let mut open: Vec<u32> = (0..tree.nodes.len().min(1) as u32).collect();
    let mut visited = 0_usize;
    while let Some(index) = open.pop() {
        token.check_every(LIGHT_STEPS, visited)?;
        visited += 1;
        let node = &tree.nodes[index as usize];
        if node.is_leaf() || included(index) {
            cut.push(index);
        } else {
            open.extend([node.first + 1, node.first]);
        }
    }
    Ok(cut)
}
