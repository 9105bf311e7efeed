//! The layout on show: containers, depths and icicle are those of its wide tree in place of the binary one.

use std::sync::Arc;

use crate::accel::Accel;
use crate::app::state::derived::Derived;
use crate::app::state::study::Study;
use crate::catalog::layouts::LayoutChoice;
use crate::lab::population::ViewRays;
use crate::overlay::NodeTable;
use bvhscope_engine::layouts::KeptNodes;

/// Inputs of the nodes that a layout keeps.
#[derive(Debug, Clone, PartialEq)]
pub struct LayoutOf {
    /// The layout.
    pub layout: LayoutChoice,
    /// The rays by whose visits its children are chosen; `None` where they are not.
    pub rays: Option<ViewRays>,
}

/// The chosen layout, and its nodes.
#[derive(Debug, Default)]
pub struct PictureLayout {
    /// The layout; `None` for the binary tree.
    pub chosen: Option<LayoutChoice>,
    /// The nodes that it keeps of the presented tree, or why there are none.
    pub kept: Study<LayoutOf, Result<Arc<KeptNodes>, String>>,
    /// The table of these nodes.
    pub(super) table: Option<Arc<NodeTable>>,
}

impl PictureLayout {
    /// The chosen layout needs measured visits.
    pub fn is_by_visits(&self) -> bool {
        self.chosen.is_some_and(LayoutChoice::is_by_visits)
    }

    /// Inputs of the nodes that the chosen layout keeps of `accel`; `None` where none is chosen, and while its rays are not known.
    pub fn inputs(&self, derived: &Derived, accel: &Arc<Accel>) -> Option<LayoutOf> {
        let rays = if self.is_by_visits() { Some(derived.rays(&accel.scene)?) } else { None };
        Some(LayoutOf { layout: self.chosen?, rays })
    }

    /// Shows a layout, or the binary tree where it is on show.
    pub fn toggle(&mut self, layout: LayoutChoice) {
        self.chosen = if self.chosen == Some(layout) { None } else { Some(layout) };
    }
}
