//! The icicle: what widths and colours stand for, the node on top, and the layout that was made last.

use std::sync::{Arc, Weak};

use serde::{Deserialize, Serialize};

use crate::accel::node_values::{KnownVisits, NodeValues};
use crate::accel::{Accel, is_same};
use crate::app::state::{Model, Presented, Study, ViewState};
use crate::catalog::metric_scale::MetricScale;
use crate::catalog::metrics::{self, Metric, Source};
use crate::lab::icicle::{Icicle, IcicleWidth};
use crate::overlay::NodeTable;
use bvhscope_engine::layouts::KeptNodes;

/// Inputs of an icicle's widths.
#[derive(Debug, Clone, PartialEq)]
pub struct IcicleInputs {
    /// Meaning of the widths.
    pub width: IcicleWidth,
    /// The measured visits, where widths stand for them.
    pub visits: Option<KnownVisits>,
    /// The layout on show.
    pub layout: Option<KnownLayout>,
}

/// The nodes of a layout as an input: equal where they are the same.
#[derive(Debug, Clone)]
pub struct KnownLayout(pub Arc<KeptNodes>);

impl PartialEq for KnownLayout {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// The icicle of the presented tree.
#[derive(Debug)]
pub struct IcicleView {
    /// Meaning of the widths.
    pub width: IcicleWidth,
    /// Meaning of the colours.
    pub color: &'static Metric,
    /// For each node what the width of all below it is made of.
    pub sums: Study<IcicleInputs, Vec<f32>>,
    tree: Weak<Accel>,
    top: u32,
    /// The topmost node of a pasted state, for its tree.
    pasted_top: u32,
    layout: Option<(LayoutKey, Arc<IcicleLayout>)>,
}

/// The icicle's part of a shared state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SharedIcicle {
    width: IcicleWidth,
    color: &'static Metric,
    topmost: u32,
}

impl Default for SharedIcicle {
    fn default() -> Self {
        IcicleView::default().shared(None)
    }
}

impl ViewState for IcicleView {
    const NAME: &'static str = "Icicle";
    type Shared = SharedIcicle;

    fn shared(&self, tree: Option<&Arc<Accel>>) -> SharedIcicle {
        let Self { width, color, sums: _, tree: _, top: _, pasted_top, layout: _ } = self;
        SharedIcicle { width: *width, color, topmost: tree.map_or(*pasted_top, |tree| self.top_of(tree)) }
    }

    fn show_shared(&mut self, SharedIcicle { width, color, topmost }: SharedIcicle) {
        (self.width, self.color, self.pasted_top) = (width, color, topmost);
    }

    fn show_shared_nodes(&mut self, shown: &Presented) {
        if (self.pasted_top as usize) < shown.table.len() {
            self.zoom_in_tree(&shown.accel, self.pasted_top);
        }
    }

    #[cfg(test)]
    fn changed() -> Self {
        Self { width: IcicleWidth::Visits, color: metrics::DEPTH, pasted_top: 3, ..Self::default() }
    }
}

/// An icicle with its colours.
#[derive(Debug)]
pub struct IcicleLayout {
    /// The cells.
    pub icicle: Icicle,
    /// The place of each cell on the colour scale, 0 to 1; `None` for a node without a value.
    pub positions: Vec<Option<f32>>,
    /// The colour scale.
    pub scale: MetricScale,
}

/// The inputs of a layout.
#[derive(Debug)]
struct LayoutKey {
    sums: Arc<Vec<f32>>,
    /// Identifier of the table.
    table: u64,
    visits: Option<KnownVisits>,
    top: u32,
    color: &'static Metric,
    size: [u32; 2],
    /// Whether depths and counts of primitives are known.
    is_counted: bool,
}

impl PartialEq for LayoutKey {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.sums, &other.sums)
            && (&self.visits, self.table, self.top, self.color, self.size, self.is_counted)
                == (&other.visits, other.table, other.top, other.color, other.size, other.is_counted)
    }
}

impl Default for IcicleView {
    fn default() -> Self {
        Self {
            width: IcicleWidth::Cost,
            color: metrics::OVERLAP,
            sums: Study::default(),
            tree: Weak::new(),
            top: 0,
            pasted_top: 0,
            layout: None,
        }
    }
}

impl IcicleView {
    /// Puts the root on top where the tree is another one than the last time.
    pub fn follow(&mut self, accel: &Arc<Accel>) {
        if !is_same(&self.tree, accel) {
            (self.tree, self.top) = (Arc::downgrade(accel), 0);
        }
    }

    /// Inputs of the widths of `accel`'s icicle; `None` while visits are needed and not known.
    pub(super) fn inputs(&self, model: &Model, accel: &Arc<Accel>) -> Option<IcicleInputs> {
        let width = self.width;
        let visits = model.derived.needed_visits(accel, width == IcicleWidth::Visits).ok()?;
        let layout = model.layout_of(accel).and_then(|table| table.kept()).map(|kept| KnownLayout(Arc::clone(kept)));
        Some(IcicleInputs { width, visits, layout })
    }

    /// Zooms to a node of `accel`, which is presented.
    pub fn zoom_in_tree(&mut self, accel: &Arc<Accel>, node: u32) {
        self.follow(accel);
        self.top = node;
    }

    /// The topmost node.
    pub const fn top(&self) -> u32 {
        self.top
    }

    /// The topmost node of `accel`: the root where another tree was shown.
    pub fn top_of(&self, accel: &Arc<Accel>) -> u32 {
        if is_same(&self.tree, accel) { self.top } else { 0 }
    }

    /// Zooms to `node` and all below it.
    pub const fn zoom_to(&mut self, node: u32) {
        self.top = node;
    }

    /// The layout of `accel` that was made last.
    pub fn last_layout(&self, accel: &Arc<Accel>) -> Option<&Arc<IcicleLayout>> {
        let (_, layout) = self.layout.as_ref()?;
        is_same(&self.tree, accel).then_some(layout)
    }

    /// The sums of the last widths of `table`, which is of `accel`; `None` while they are those of the binary tree or of another layout.
    pub fn sums_of(&self, accel: &Arc<Accel>, table: &NodeTable) -> Option<&Arc<Vec<f32>>> {
        let (inputs, sums) = self.sums.with_parameters(accel)?;
        let is_of =
            inputs.layout.as_ref().map(|layout| &layout.0).zip(table.kept()).is_some_and(|(a, b)| Arc::ptr_eq(a, b));
        (is_of || inputs.layout.is_none() && table.kept().is_none()).then_some(sums)
    }

    /// The icicle of `table` in `size` columns and most levels, recomputed only after a change; `None` while the
    /// widths are not known.
    pub fn layout(
        &mut self,
        accel: &Arc<Accel>,
        table: &NodeTable,
        visits: Option<KnownVisits>,
        size: [u32; 2],
    ) -> Option<Arc<IcicleLayout>> {
        let sums = Arc::clone(self.sums_of(accel, table)?);
        let visits = visits.filter(|_| self.color.source == Source::Visits);
        let is_counted = accel.known_ancestry().is_some();
        let key = LayoutKey { sums, table: table.id, visits, top: self.top, color: self.color, size, is_counted };
        if let Some((known, layout)) = &self.layout
            && *known == key
        {
            return Some(Arc::clone(layout));
        }
        let icicle = Icicle::new(|node| table.below(node), &key.sums, key.top, size[0], size[1]);
        let values = NodeValues { accel, visits: key.visits.as_ref().map(|visits| &*visits.0) };
        let of_cells: Vec<_> = icicle.cells.iter().map(|cell| value(&values, table, key.color, cell.node)).collect();
        let scale = MetricScale::fitting(key.color, &table.stats(), of_cells.iter().flatten().copied());
        let positions = of_cells.iter().map(|value| value.map(|value| scale.position(value))).collect();
        let layout = Arc::new(IcicleLayout { icicle, positions, scale });
        self.layout = Some((key, Arc::clone(&layout)));
        Some(layout)
    }
}

/// A number of a node of `table`: its depth is that in the layout of which this is the table.
pub(super) fn value(values: &NodeValues<'_>, table: &NodeTable, metric: &Metric, node: u32) -> Option<f32> {
    match table.kept() {
        Some(_) => values.at_depth(metric, node, table.depth(node)),
        None => values.get(metric, node),
    }
}
