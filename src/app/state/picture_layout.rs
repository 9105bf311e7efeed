//! The layout on show: containers, depths and icicle are those of its wide tree in place of the binary one.

use std::sync::Arc;

use crate::accel::Accel;
use crate::app::state::derived::Derived;
use crate::app::state::model::Model;
use crate::app::state::study::Study;
use crate::lab::layouts::{LayoutChoice, NamedLayout};
use crate::lab::population::ViewRays;
use crate::overlay::NodeTable;
use bvhscope_engine::layouts::{Collapse, KeptNodes};

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
    table: Option<Arc<NodeTable>>,
}

impl PictureLayout {
    /// The chosen layout needs measured visits.
    pub fn is_by_visits(&self) -> bool {
        matches!(self.chosen, Some(LayoutChoice::Described(layout)) if layout.collapse == Collapse::Visits)
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

impl Model {
    /// Makes the table of the layout on show, once its nodes are known of the presented tree; called once a UI frame.
    pub fn follow_layout(&mut self) {
        let kept = self.presented.as_ref().and_then(|shown| {
            let inputs = self.layout.inputs(&self.derived, &shown.accel)?;
            let kept = self.layout.kept.get(&shown.accel, &inputs)?;
            Some((&shown.accel, kept.as_ref().as_ref().ok()?))
        });
        let table = kept.map(|(accel, kept)| {
            let is_same = |table: &&Arc<NodeTable>| {
                Arc::ptr_eq(table.accel(), accel) && table.kept().is_some_and(|own| Arc::ptr_eq(own, kept))
            };
            let known = self.layout.table.as_ref().filter(is_same).cloned();
            known.unwrap_or_else(|| Arc::new(NodeTable::of_layout(accel, kept)))
        });
        self.layout.table = table;
    }

    /// The table of the layout on show, of this tree; `None` where the binary tree is shown.
    pub fn layout_of(&self, accel: &Arc<Accel>) -> Option<&Arc<NodeTable>> {
        self.layout.table.as_ref().filter(|table| Arc::ptr_eq(table.accel(), accel))
    }

    /// The table of the presented tree, or of the layout of it that is on show.
    pub fn table(&self) -> Option<&Arc<NodeTable>> {
        let shown = self.presented.as_ref()?;
        Some(self.layout_of(&shown.accel).unwrap_or(&shown.table))
    }

    /// Name of the layout on show.
    pub fn layout_name(&self) -> Option<String> {
        self.table()?.kept()?;
        self.layout.chosen.map(|layout| NamedLayout::from(layout).name())
    }

    /// Why the chosen layout is not shown.
    pub fn layout_fault(&self) -> Option<&str> {
        let shown = self.presented.as_ref()?;
        let inputs = self.layout.inputs(&self.derived, &shown.accel)?;
        self.layout.kept.get(&shown.accel, &inputs)?.as_ref().as_ref().err().map(String::as_str)
    }
}
