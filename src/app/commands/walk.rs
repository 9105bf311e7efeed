//! Walking the tree: from the selected node to parent, child or sibling.

use super::action::Action;
use crate::app::state::AppState;

/// Index of the node that a walking action selects; `None` where there is no such node.
pub(crate) fn target(action: Action, state: &AppState) -> Option<u32> {
    let table = &state.model.presented.as_ref()?.table;
    let Some(node) = state.selection.nodes.selected.filter(|&node| (node as usize) < table.len()) else {
        return (action == Action::SelectChild && !table.is_empty()).then_some(0);
    };
    match action {
        Action::SelectParent => table.parent(node),
        Action::SelectChild => {
            // Prefer the child on the path to the picked triangle, so that walking up and down again ends where it started.
            let picked = state.selection.picked.as_ref().and_then(|picked| {
                let here = picked.path.iter().position(|&step| step == node)?;
                picked.path.get(here + 1).copied()
            });
            picked.or_else(|| table.children(node).next())
        }
        Action::SelectSecondChild => table.children(node).nth(1),
        Action::SelectNextSibling => table.sibling(node, 1),
        Action::SelectPreviousSibling => table.sibling(node, -1),
        _ => None,
    }
}
