//! Walking the tree: from the selected node to parent, child or sibling.

use super::action::Action;
use crate::app::state::{AppState, TreeSide};

/// Index of the node that a walking action selects; `None` where there is no such node.
pub(crate) fn target(action: Action, state: &AppState) -> Option<u32> {
    let Some((shown, node)) = state.selected() else {
        let table = &state.model.presented.as_ref()?.table;
        return (action == Action::SelectChild && !table.is_empty()).then_some(0);
    };
    let table = &shown.table;
    match action {
        Action::SelectParent => table.parent(node),
        Action::SelectChild => {
            // Prefer the child on the path to the picked triangle, so that walking up and down again ends where it started.
            let picked = state.selection.picked.as_ref().and_then(|picked| {
                let path = match state.selection.side {
                    TreeSide::A => picked.path.clone(),
                    TreeSide::B => shown.accel.path_to(picked.primitive),
                };
                let here = path.iter().position(|&step| step == node)?;
                path.get(here + 1).copied()
            });
            picked.or_else(|| table.children(node).next())
        }
        Action::SelectSecondChild => table.children(node).nth(1),
        Action::SelectNextSibling => table.sibling(node, 1),
        Action::SelectPreviousSibling => table.sibling(node, -1),
        _ => None,
    }
}
