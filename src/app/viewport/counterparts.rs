//! Nodes of two trees that are the same, because they hold the same triangles: what is hovered or selected in one tree lights up in
//! the other.

use std::sync::{Arc, Weak};

use super::picking::leaf_of;
use crate::accel::{Accel, is_same};
use crate::app::state::{AppState, Presented, SecondNodes, TreeSide};
use crate::visibility::NodeIdentity;

/// Most triangles of a node that is found again in the next tree by a pass over them: more would take long in a UI frame.
const MOST_TRIANGLES: u32 = 1 << 17;

/// The trees of the last UI frame, and what was selected in the second one.
#[derive(Default)]
pub(super) struct Counterparts {
    /// The first and the second tree.
    trees: [Weak<Accel>; 2],
    /// The node selected in the second tree, to be found in the next one.
    identity: Option<(u32, NodeIdentity)>,
}

/// The node of the other tree with the same triangles as `node` of the tree `of`; `None` where there is none or it is not known yet.
pub(super) fn counterpart(state: &AppState, of: TreeSide, node: u32) -> Option<u32> {
    state.survival()?[of as usize].partner(node)
}

impl Counterparts {
    /// Lights up in the second tree what is hovered and selected in the first, or the other way round, by where it was done; called
    /// before the pictures are drawn.
    pub(super) fn follow(&mut self, state: &mut AppState) {
        let (Some(first), Some(second)) = (state.model.presented.clone(), state.model.second.clone()) else {
            (state.selection.second, state.selection.side) = (SecondNodes::default(), TreeSide::A);
            return;
        };
        if state.selection.second.hovered.is_none() {
            let hovered = state.selection.nodes.hovered;
            state.selection.second.hovered = hovered.and_then(|node| counterpart(state, TreeSide::A, node));
        }
        self.follow_side(state, &first, &second);
        self.follow_selected(state, &first, &second);
        self.trees = [&first, &second].map(|shown| Arc::downgrade(&shown.accel));
    }

    /// Finds the selected node of the second tree in a new one, or gives it up where something was selected in the first.
    fn follow_side(&mut self, state: &mut AppState, first: &Presented, second: &Presented) {
        let selection = &mut state.selection;
        // In a new first tree another node was found for the selection, which is no choice.
        if selection.nodes.selected != selection.second.with && is_same(&self.trees[0], &first.accel) {
            selection.side = TreeSide::A;
        }
        if selection.side == TreeSide::B && !is_same(&self.trees[1], &second.accel) {
            let same = self.identity.take().and_then(|(_, identity)| identity.find(&second.accel));
            let picked = selection.picked.as_ref().map(|picked| picked.primitive);
            let leaf = || picked.and_then(|primitive| leaf_of(second, primitive));
            selection.second.selected = same.or_else(leaf);
            if selection.second.selected.is_none() {
                selection.side = TreeSide::A;
            }
        }
    }

    fn follow_selected(&mut self, state: &mut AppState, first: &Presented, second: &Presented) {
        let picked = state.selection.picked.as_ref().map(|picked| picked.primitive);
        let leaf = |shown: &Presented| picked.and_then(|primitive| leaf_of(shown, primitive));
        // Leaves of the picked triangle belong together even where they hold different ones beside it.
        let other = |side: TreeSide, from: &Presented, to: &Presented, node: u32| {
            let same = counterpart(state, side, node);
            same.or_else(|| if leaf(from) == Some(node) { leaf(to) } else { None })
        };
        match state.selection.side {
            TreeSide::A => {
                let node = state.selection.nodes.selected.filter(|&node| (node as usize) < first.table.len());
                state.selection.second.selected = node.and_then(|node| other(TreeSide::A, first, second, node));
                self.identity = None;
            }
            TreeSide::B => {
                let node = state.selection.second.selected;
                state.selection.nodes.selected = node.and_then(|node| other(TreeSide::B, second, first, node));
                if self.identity.map(|(of, _)| of) != node {
                    let small =
                        |node: &u32| second.table.known_primitives(*node).is_some_and(|count| count <= MOST_TRIANGLES);
                    let identity = |node| Some((node, NodeIdentity::of(&second.accel, node)?));
                    self.identity = node.filter(small).and_then(identity);
                }
            }
        }
        state.selection.second.with = state.selection.nodes.selected;
    }
}
