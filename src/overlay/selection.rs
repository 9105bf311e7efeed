//! Which nodes are selected, hovered and hidden.

use std::collections::HashSet;

/// Nodes that stand out.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Selection {
    /// The selected node of the tree, drawn thick and warm with its children in two tints.
    pub selected: Option<u32>,
    /// The hovered node, drawn white.
    pub hovered: Option<u32>,
    /// Nodes that are not drawn.
    pub hidden: HashSet<u32>,
}
