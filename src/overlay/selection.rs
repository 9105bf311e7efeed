//! Which nodes are selected, hovered and hidden.

use std::collections::HashSet;

/// The selected, hovered and hidden nodes of one tree, by node index.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Selection {
    /// The selected node, drawn with thick lines in the warm colour, its children in two tints of it.
    pub selected: Option<u32>,
    /// The hovered node, drawn white.
    pub hovered: Option<u32>,
    /// Nodes that are left out with everything below them.
    pub hidden: HashSet<u32>,
    /// The node outside of whose subtree everything is left out.
    pub isolated: Option<u32>,
}

impl Selection {
    /// Whether anything is left out.
    pub fn hides_any(&self) -> bool {
        !self.hidden.is_empty() || self.isolated.is_some()
    }
}
