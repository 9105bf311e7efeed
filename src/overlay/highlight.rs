//! The nodes that are drawn over all others: selection and hover.

use crate::overlay::node::Role;
use crate::overlay::node_table::NodeTable;
use crate::overlay::selection::Selection;

/// Highlighted nodes with their roles, in drawing order: the children of the selected node, the selected node, the hovered
/// node. They are drawn even where depth range or budget leave them out.
pub fn highlighted(table: &NodeTable, selection: &Selection) -> Vec<(u32, Role)> {
    let exists = |node: &u32| (*node as usize) < table.len();
    let mut marked = Vec::new();
    if let Some(node) = selection.selected.filter(exists) {
        if let Some([first, second]) = table.children(node) {
            marked.push((first, Role::FirstChild));
            marked.push((second, Role::SecondChild));
        }
        marked.push((node, Role::Selected));
    }
    if let Some(node) = selection.hovered.filter(exists)
        && selection.selected != Some(node)
    {
        marked.push((node, Role::Hovered));
    }
    marked
}
