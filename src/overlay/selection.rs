//! Which nodes are selected, hovered, traced and hidden.

use std::collections::HashSet;
use std::sync::Arc;

use crate::visibility::TriangleSet;

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
    /// The container that the present step of a recorded ray is about.
    pub traced: Option<u32>,
    /// The containers on that ray's stack.
    pub waiting: Vec<u32>,
    /// Triangles all others of which are left out, with the nodes that hold none of them.
    pub only: Option<Arc<TriangleSet>>,
}

impl Selection {
    /// True if a recorded ray marks nodes.
    pub fn has_ray(&self) -> bool {
        self.traced.is_some() || !self.waiting.is_empty()
    }

    /// True if anything is left out.
    pub fn hides_any(&self) -> bool {
        !self.hidden.is_empty() || self.isolated.is_some() || self.only.is_some()
    }
}
