//! The nodes that are drawn over all others: selection and hover.

use crate::overlay::node::Role;
use crate::overlay::node_table::NodeTable;
use crate::overlay::selection::Selection;

/// Faulty nodes that are drawn at most.
const MAX_FAULTY: usize = 4096;

/// Highlighted nodes with their roles, in drawing order: faulty ones, those of a recorded ray, the children of the selected node, the
/// selected node, the hovered node. They are drawn even where depth range or budget leave them out.
pub fn highlighted(table: &NodeTable, selection: &Selection) -> Vec<(u32, Role)> {
    let exists = |node: &u32| (*node as usize) < table.len();
    let mut marked: Vec<(u32, Role)> = table.faulty().take(MAX_FAULTY).map(|node| (node, Role::Faulty)).collect();
    let waiting = selection.waiting.iter().copied().filter(exists).filter(|node| selection.traced != Some(*node));
    marked.extend(waiting.map(|node| (node, Role::Waiting)));
    marked.extend(selection.traced.filter(exists).map(|node| (node, Role::Traced)));
    if let Some(node) = selection.selected.filter(exists) {
        // Neighbours differ, however many there are.
        let roles = [Role::FirstChild, Role::SecondChild].into_iter().cycle();
        marked.extend(table.below(node).zip(roles));
        marked.push((node, Role::Selected));
    }
    if let Some(node) = selection.hovered.filter(exists)
        && selection.selected != Some(node)
    {
        marked.push((node, Role::Hovered));
    }
    marked
}
