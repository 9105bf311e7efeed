//! Predicted against measured visits, node by node, as a scatter of a size that can be drawn whatever the size of the tree.

use std::sync::Arc;

use bvhscope_engine::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use bvhscope_engine::tree::largest::largest_nodes;
use bvhscope_engine::with_tree;

use crate::accel::Accel;
use crate::accel::node_values::{KnownVisits, NodeValues};
use crate::catalog::metrics::{self, LEAST_PREDICTED_VISITS};
use crate::lab::plot::{Axis, Scale};
use crate::lab::population::MeasuredRays;

/// Cells across and up.
const CELLS: [usize; 2] = [192, 128];
/// Fewest predicted visits of a node in the scatter: of nodes with less, chance decides which are visited at all.
pub const LEAST_SHOWN: f64 = 1.0;
/// Most nodes that are marked as the worst.
const WORST: usize = 12;
/// Measured over predicted visits from which a node is bad.
const BAD: f32 = 1.5;
/// Part of the height for the nodes that no ray visits.
const NEVER_SHARE: f64 = 0.1;

/// A node in the scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScatterNode {
    /// The node.
    pub node: u32,
    /// Visits that its area predicts.
    pub predicted: f64,
    /// Visits that were counted.
    pub measured: u32,
}

/// The nodes of a cell of the scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScatterCell {
    /// Column from the left, row from below.
    pub place: [u16; 2],
    /// Number of nodes.
    pub count: u32,
    /// The first of them.
    pub first: ScatterNode,
}

/// The nodes of a tree by predicted and by measured visits, both logarithmic and from 1 to the visits of the root.
#[derive(Debug, Clone, PartialEq)]
pub struct VisitScatter {
    /// The rays.
    pub sums: MeasuredRays,
    /// The axes of predicted and of measured visits. Nodes that are never visited are in a band below 1.
    pub axes: [Axis; 2],
    /// Cells with nodes, in the order of their first ones.
    pub cells: Vec<ScatterCell>,
    /// The nodes with the most visits for each predicted one, the worst first.
    pub worst: Vec<ScatterNode>,
    /// Number of nodes in the scatter.
    pub shown: usize,
    /// Number of those that no ray visits.
    pub never: usize,
    /// Number of nodes of fewer than [`LEAST_SHOWN`] predicted visits.
    pub left_out: usize,
    /// For each cell, row by row from below, its index in `cells` and 1 more; 0 for none.
    index: Vec<u32>,
}

impl VisitScatter {
    /// The scatter of `visits` in `accel`, whose sums are `sums`. Takes some passes over the tree.
    pub fn new(
        accel: &Arc<Accel>,
        sums: MeasuredRays,
        visits: &KnownVisits,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let values = NodeValues { accel, visits: Some(&visits.0) };
        let high = f64::from(sums.root_hits).max(LEAST_SHOWN * 10.0);
        let mut scatter = Self {
            sums,
            axes: [Axis { low: LEAST_SHOWN, high, scale: Scale::Log }, Axis::of_counts(high, NEVER_SHARE)],
            cells: Vec::new(),
            worst: Vec::new(),
            shown: 0,
            never: 0,
            left_out: 0,
            index: vec![0; CELLS[0] * CELLS[1]],
        };
        let count = accel.tree.node_count();
        for first in (0..count).step_by(LIGHT_STEPS) {
            token.check()?;
            let nodes = first as u32..(first + LIGHT_STEPS).min(count) as u32;
            with_tree!(&accel.tree, tree => for node in nodes {
                let (predicted, measured) = (visits.0.predicted(tree, node), visits.0.counts[node as usize]);
                scatter.add(ScatterNode { node, predicted, measured });
            });
        }
        let ratio = |node| values.get(metrics::VISIT_RATIO, node).filter(|&ratio| ratio >= BAD).unwrap_or(f32::NAN);
        let worst = largest_nodes(count, WORST, ratio, token)?;
        scatter.worst = worst.into_iter().filter_map(|(node, _)| node_in(&values, node)).collect();
        Ok(scatter)
    }

    fn add(&mut self, node: ScatterNode) {
        if node.predicted < LEAST_SHOWN {
            self.left_out += 1;
            return;
        }
        self.shown += 1;
        self.never += usize::from(node.measured == 0);
        let [x, y] = self.position(&node);
        let cell = |position: f64, cells: usize| ((position * cells as f64) as usize).min(cells - 1);
        let [column, row] = [cell(x, CELLS[0]), cell(y, CELLS[1])];
        let index = &mut self.index[row * CELLS[0] + column];
        if *index == 0 {
            self.cells.push(ScatterCell { place: [column as u16, row as u16], count: 0, first: node });
            *index = self.cells.len() as u32;
        }
        self.cells[*index as usize - 1].count += 1;
    }

    /// Where a node is from the left and from below, each 0 to 1; `None` where it is left out.
    pub fn place(&self, node: &ScatterNode) -> Option<[f64; 2]> {
        (node.predicted >= LEAST_SHOWN).then(|| self.position(node))
    }

    fn position(&self, node: &ScatterNode) -> [f64; 2] {
        [self.axes[0].at(node.predicted), self.axes[1].at(f64::from(node.measured))].map(|at| at.clamp(0.0, 1.0))
    }

    /// The middle of a cell, from the left and from below, each 0 to 1.
    pub fn center(cell: &ScatterCell) -> [f64; 2] {
        [0, 1].map(|axis| (f64::from(cell.place[axis]) + 0.5) / CELLS[axis] as f64)
    }

    /// Width and height of a cell, each 0 to 1.
    pub fn cell_size() -> [f64; 2] {
        CELLS.map(|cells| 1.0 / cells as f64)
    }

    /// The nearest cell with nodes to a place from the left and from below, each 0 to 1, no more than `reach` away on either axis.
    pub fn nearest(&self, place: [f64; 2], reach: [f64; 2]) -> Option<&ScatterCell> {
        let range = |axis: usize| {
            let [low, high] = [-1.0, 1.0].map(|side| (place[axis] + side * reach[axis]) * CELLS[axis] as f64);
            low.floor().max(0.0) as usize..(high.ceil().max(0.0) as usize).min(CELLS[axis])
        };
        let columns = range(0);
        let cells = range(1).flat_map(|row| columns.clone().map(move |column| row * CELLS[0] + column));
        let cells = cells.filter_map(|at| self.cells.get((self.index[at] as usize).checked_sub(1)?));
        let distance = |cell: &ScatterCell| {
            let center = Self::center(cell);
            let of = |axis: usize| (center[axis] - place[axis]) / reach[axis];
            of(0).powi(2) + of(1).powi(2)
        };
        let near = cells.map(|cell| (distance(cell), cell)).filter(|(distance, _)| *distance <= 1.0);
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, cell)| cell)
    }
}

/// A node with its visits, where they are known.
pub fn node_in(values: &NodeValues<'_>, node: u32) -> Option<ScatterNode> {
    values.visits(node).map(|(measured, predicted)| ScatterNode { node, predicted, measured })
}

/// Whether measured over predicted visits of a node say more than chance.
pub fn is_telling(node: &ScatterNode) -> bool {
    node.predicted >= LEAST_PREDICTED_VISITS
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::lab::population::{Population, ViewRays};
    use crate::lab::sample::teapot;
    use crate::render::RenderSettings;
    use bvhscope_engine::settings::BuildSettings;

    fn scatter(size_px: [u32; 2]) -> (Arc<Accel>, KnownVisits, VisitScatter) {
        let (scene, token) = (teapot(), CancelToken::new());
        let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &token).unwrap());
        let camera = Camera::framing(&scene.bounds, scene.up);
        let rays = ViewRays::new(Population::Primary, camera, size_px, &RenderSettings::default());
        let measured = rays.measure(&accel, &token).unwrap();
        let visits = KnownVisits(measured.visits);
        let scatter = VisitScatter::new(&accel, measured.sums, &visits, &token).unwrap();
        (accel, visits, scatter)
    }

    #[test]
    fn each_node_is_in_the_cell_of_its_visits_or_left_out() {
        let (accel, visits, scatter) = scatter([40, 40]);
        let values = NodeValues { accel: &accel, visits: Some(&visits.0) };
        let mut counts = vec![0; scatter.cells.len()];
        let mut left_out = 0;
        for node in 0..accel.tree.node_count() as u32 {
            let node = node_in(&values, node).unwrap();
            let Some(place) = scatter.place(&node) else {
                left_out += 1;
                continue;
            };
            let size = VisitScatter::cell_size();
            let is_in = |cell: &ScatterCell| {
                let center = VisitScatter::center(cell);
                (0..2).all(|axis| (center[axis] - place[axis]).abs() <= size[axis] * 0.5 + 1e-9)
            };
            counts[scatter.cells.iter().position(is_in).unwrap()] += 1;
        }
        assert_eq!(counts.iter().sum::<u32>() as usize, scatter.shown);
        assert!(scatter.cells.iter().zip(&counts).all(|(cell, &count)| cell.count == count));
        assert_eq!(left_out, scatter.left_out);
        let all = (0..accel.tree.node_count() as u32).filter_map(|node| node_in(&values, node));
        let never: Vec<_> = all.filter(|node| node.measured == 0).filter_map(|node| scatter.place(&node)).collect();
        assert!(never.len() == scatter.never && !never.is_empty());
        assert!(never.iter().all(|place| place[1] == scatter.axes[1].at(0.0)), "on the line labelled so");
        assert!(scatter.shown > 100 && left_out > 100, "{} {left_out}", scatter.shown);
        assert_eq!(scatter.place(&node_in(&values, 0).unwrap()), Some([1.0, 1.0]), "the root is where both are most");
    }

    #[test]
    fn the_worst_have_the_most_visits_for_each_predicted_one() {
        let (accel, visits, scatter) = scatter([300, 200]);
        let values = NodeValues { accel: &accel, visits: Some(&visits.0) };
        let ratio = |node: &ScatterNode| f64::from(node.measured) / node.predicted;
        assert!(!scatter.worst.is_empty() && scatter.worst.is_sorted_by(|a, b| ratio(a) >= ratio(b)));
        let all = (0..accel.tree.node_count() as u32).filter_map(|node| node_in(&values, node)).filter(is_telling);
        let worst = all.map(|node| ratio(&node)).fold(0.0, f64::max);
        assert!((ratio(&scatter.worst[0]) - worst).abs() < 1e-9);
    }

    #[test]
    fn a_place_finds_the_nearest_cell_within_reach() {
        let (.., scatter) = scatter([300, 200]);
        let size = VisitScatter::cell_size();
        for cell in &scatter.cells {
            let center = VisitScatter::center(cell);
            assert_eq!(scatter.nearest(center, size), Some(cell));
        }
        assert_eq!(scatter.nearest([0.01, 0.99], [0.002, 0.002]), None, "nothing is visited so much more often");
        assert_eq!(scatter.nearest([-3.0, 7.0], size), None);
    }
}
