//! The icicle of a tree: the root on top, below each node its children, each as wide as its share (Kruskal and Landwehr: *Icicle
//! Plots: Better Displays for Hierarchical Clustering*, 1983).

use std::collections::HashMap;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use bvhscope_engine::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use bvhscope_engine::layouts::KeptNodes;
use bvhscope_engine::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};
use bvhscope_engine::tree::{Container, Tree, node_metrics};
use bvhscope_engine::with_tree;

use crate::accel::Accel;
use crate::accel::node_values::KnownVisits;

/// Meaning of a node's width: the sum of a number over it and all nodes below it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum IcicleWidth {
    /// SAH cost.
    Cost,
    /// Measured visits.
    Visits,
    /// Surface area: visits as the area predicts them.
    Area,
    /// Primitives.
    Primitives,
}

impl IcicleWidth {
    /// All, in the order of menus.
    pub const ALL: [Self; 4] = [Self::Cost, Self::Visits, Self::Area, Self::Primitives];

    /// The name in the window.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Cost => "SAH cost",
            Self::Visits => "Measured visits",
            Self::Area => "Predicted visits",
            Self::Primitives => "Triangles",
        }
    }

    /// Its meaning, in one sentence.
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Cost => "SAH cost of the node and all nodes below it: where the tree is expensive",
            Self::Visits => "Visits of the node and all nodes below it by the chosen rays: where they spend time",
            Self::Area => {
                "Surface area of the node and all nodes below it, in proportion to which rays should visit them"
            }
            Self::Primitives => "Triangles below the node",
        }
    }
}

/// For each node of `accel` the sum of what `width` stands for over it and all nodes below it; in a layout that keeps some of them, over
/// those of the wide tree. `visits` are those of this tree; all sums of visits are 0 without. Takes a pass over the tree.
pub fn subtree_sums(
    accel: &Accel,
    width: IcicleWidth,
    visits: Option<&KnownVisits>,
    kept: Option<&KeptNodes>,
    token: &CancelToken,
) -> Result<Vec<f32>, Cancelled> {
    if let Some(kept) = kept {
        return sums_of_layout(accel, width, visits, kept, token);
    }
    with_tree!(&accel.tree, tree => match width {
        IcicleWidth::Cost => node_metrics::subtree_sah_shares(tree, token),
        IcicleWidth::Area => sums(tree, |node| f64::from(node_metrics::area_share(tree, node as u32)), token),
        IcicleWidth::Primitives => sums(tree, |node| tree.nodes[node].slots().len() as f64, token),
        IcicleWidth::Visits => {
            let counts = visits.map_or(&[][..], |visits| &visits.0.counts);
            sums(tree, |node| f64::from(counts.get(node).copied().unwrap_or(0)), token)
        }
    })
}

/// [`subtree_sums`] of a layout; 0 for nodes that it does not keep.
fn sums_of_layout(
    accel: &Accel,
    width: IcicleWidth,
    visits: Option<&KnownVisits>,
    kept: &KeptNodes,
    token: &CancelToken,
) -> Result<Vec<f32>, Cancelled> {
    let mut sums = vec![0.0_f64; accel.tree.node_count()];
    let own = |node: u32| match width {
        IcicleWidth::Primitives => f64::from(kept.leaf_size(node)),
        IcicleWidth::Visits => f64::from(visits.map_or(0, |visits| visits.0.counts[node as usize])),
        IcicleWidth::Area | IcicleWidth::Cost => {
            let area = with_tree!(&accel.tree, tree => f64::from(node_metrics::area_share(tree, node)));
            let cost = match kept.leaf_size(node) {
                0 => TRAVERSAL_COST,
                triangles => INTERSECTION_COST * triangles as f32,
            };
            if width == IcicleWidth::Area { area } else { area * f64::from(cost) }
        }
    };
    for (index, &node) in kept.nodes().iter().enumerate().rev() {
        token.check_every(LIGHT_STEPS, index)?;
        let below: f64 = kept.children(node).iter().map(|&child| sums[child as usize]).sum();
        sums[node as usize] = own(node) + below;
    }
    Ok(sums.into_iter().map(|sum| sum as f32).collect())
}

fn sums<C: Container>(tree: &Tree<C>, own: impl Fn(usize) -> f64, token: &CancelToken) -> Result<Vec<f32>, Cancelled> {
    let mut sums = vec![0.0_f64; tree.nodes.len()];
    // Backwards, so that children are done before their parents.
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        token.check_every(LIGHT_STEPS, index)?;
        sums[index] = node.children().fold(own(index), |sum, child| sum + sums[child as usize]);
    }
    Ok(sums.into_iter().map(|sum| sum as f32).collect())
}

/// A node in an icicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IcicleCell {
    /// The node.
    pub node: u32,
    /// Levels below the topmost node.
    pub level: u32,
    /// First pixel column.
    pub left_px: u32,
    /// Pixel column after the last.
    pub right_px: u32,
    /// It is narrower than a pixel, which it shares with neighbours that are not drawn.
    pub is_narrow: bool,
}

/// The icicle of a node and all below it, in whole pixel columns.
///
/// A column shows the node that lies at its centre, so the cells of a level never overlap, are never more than the icicle has
/// columns, and each lies below its parent.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Icicle {
    /// By level, in a level from left to right.
    pub cells: Vec<IcicleCell>,
    levels: Vec<Range<usize>>,
    by_node: HashMap<u32, usize>,
}

impl Icicle {
    /// Lays out `top` and at most `max_levels` levels in all, `width_px` columns wide. `children` gives the children of a node and
    /// `sums` the sums of [`subtree_sums`]; what the children leave of their parent's width is its own and stays free on the right.
    pub fn new<I: Iterator<Item = u32>>(
        children: impl Fn(u32) -> I,
        sums: &[f32],
        top: u32,
        width_px: u32,
        max_levels: u32,
    ) -> Self {
        let mut icicle = Self::default();
        let mut level = vec![PlacedNode { node: top, left: 0.0, right: f64::from(width_px), columns: 0..width_px }];
        for depth in 0..max_levels {
            level.retain(|span| !span.columns.is_empty());
            if level.is_empty() {
                break;
            }
            let first = icicle.cells.len();
            icicle.cells.extend(level.iter().map(|span| span.cell(depth)));
            icicle.levels.push(first..icicle.cells.len());
            level = level.iter().flat_map(|span| span.split(children(span.node), sums)).collect();
        }
        icicle.by_node = icicle.cells.iter().enumerate().map(|(index, cell)| (cell.node, index)).collect();
        icicle
    }

    /// Number of levels.
    pub const fn level_count(&self) -> usize {
        self.levels.len()
    }

    /// The cell at a level and pixel column.
    pub fn at(&self, level: u32, column: u32) -> Option<&IcicleCell> {
        let cells = self.cells.get(self.levels.get(level as usize)?.clone())?;
        let after = cells.partition_point(|cell| cell.right_px <= column);
        cells.get(after).filter(|cell| cell.left_px <= column)
    }

    /// The cell of a node, if it has one.
    pub fn cell_of(&self, node: u32) -> Option<&IcicleCell> {
        self.cells.get(*self.by_node.get(&node)?)
    }
}

/// A node with its exact place.
struct PlacedNode {
    node: u32,
    left: f64,
    right: f64,
    /// The columns whose centres it covers.
    columns: Range<u32>,
}

impl PlacedNode {
    fn cell(&self, level: u32) -> IcicleCell {
        let is_narrow = self.right - self.left < 1.0;
        let Range { start: left_px, end: right_px } = self.columns;
        IcicleCell { node: self.node, level, left_px, right_px, is_narrow }
    }

    /// The children from left to right, within the node.
    fn split(&self, children: impl Iterator<Item = u32>, sums: &[f32]) -> impl Iterator<Item = Self> {
        let sum = |node: u32| f64::from(sums.get(node as usize).copied().unwrap_or(0.0));
        let whole = sum(self.node);
        let (mut left, mut first, end) = (self.left, self.columns.start, self.columns.end);
        children.filter(move |_| whole > 0.0).map(move |node| {
            let right = (left + (self.right - self.left) * sum(node) / whole).min(self.right);
            let last = ((right - 0.5).ceil().max(0.0) as u32).clamp(first, end);
            let span = Self { node, left, right, columns: first..last };
            (left, first) = (right, last);
            span
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use std::sync::Arc;

    use crate::camera::Camera;
    use crate::lab::population::{Population, ViewRays};
    use crate::lab::sample::teapot;
    use crate::render::RenderSettings;
    use bvhscope_engine::settings::BuildSettings;

    /// Node 1 has a quarter, node 2 half, the root itself a quarter; below node 2 are two equal leaves.
    fn small() -> (impl Fn(u32) -> Range<u32>, [f32; 5]) {
        let children = |node: u32| match node {
            0 => 1..3,
            2 => 3..5,
            _ => 0..0,
        };
        (children, [4.0, 1.0, 2.0, 1.0, 1.0])
    }

    #[test]
    fn children_take_their_share_and_leave_the_rest_to_the_node_itself() {
        let (children, sums) = small();
        let icicle = Icicle::new(children, &sums, 0, 16, 9);
        let places: Vec<_> =
            icicle.cells.iter().map(|cell| (cell.node, cell.level, cell.left_px, cell.right_px)).collect();
        assert_eq!(places, [(0, 0, 0, 16), (1, 1, 0, 4), (2, 1, 4, 12), (3, 2, 4, 8), (4, 2, 8, 12)]);
        let at = |level, column| icicle.at(level, column).map(|cell| cell.node);
        assert_eq!(
            [at(0, 15), at(1, 3), at(1, 4), at(1, 12), at(2, 0), at(2, 11)],
            [Some(0), Some(1), Some(2), None, None, Some(4)]
        );
        assert_eq!((at(3, 5), at(0, 16)), (None, None));
        let (children, sums) = small();
        assert_eq!(Icicle::new(children, &sums, 2, 16, 2).cells.len(), 3, "zoomed to node 2");
        let (children, sums) = small();
        assert_eq!(Icicle::new(children, &sums, 0, 16, 1).level_count(), 1);
        let (children, _) = small();
        assert_eq!(Icicle::new(children, &[0.0; 5], 0, 16, 9).cells.len(), 1, "nothing to share");
    }

    #[test]
    fn what_is_narrower_than_a_pixel_is_drawn_where_it_covers_the_centre() {
        let (children, sums) = small();
        let icicle = Icicle::new(children, &sums, 0, 1, 9);
        let nodes: Vec<_> = icicle.cells.iter().map(|cell| (cell.node, cell.is_narrow)).collect();
        assert_eq!(nodes, [(0, false), (2, true), (4, true)], "0.5 lies in node 2, where node 4 begins");
    }

    /// Of a real tree and every width: the children of a node fill it but for its own part, and each level has at most one cell for
    /// each column, below the cell of its parent.
    #[test]
    fn widths_add_up_and_cells_never_outnumber_columns() {
        let token = CancelToken::new();
        let scene = teapot();
        let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &token).unwrap());
        let camera = Camera::framing(&scene.bounds, scene.up);
        let visits = ViewRays::new(Population::Primary, camera, [64, 64], &RenderSettings::default());
        let visits = KnownVisits(visits.measure(&accel, &token).unwrap().visits);
        let children = |node: u32| with_tree!(&accel.tree, tree => tree.nodes[node as usize].children());
        for width in IcicleWidth::ALL {
            let sums = subtree_sums(&accel, width, Some(&visits), None, &token).unwrap();
            let own = |node: u32| {
                with_tree!(&accel.tree, tree => match width {
                    IcicleWidth::Cost => node_metrics::sah_share(tree, node, &accel.report.stats),
                    IcicleWidth::Area => node_metrics::area_share(tree, node),
                    IcicleWidth::Primitives => tree.nodes[node as usize].slots().len() as f32,
                    IcicleWidth::Visits => visits.0.counts[node as usize] as f32,
                })
            };
            for node in 0..accel.tree.node_count() as u32 {
                let below = children(node).map(|child| sums[child as usize]).sum::<f32>();
                let (whole, parts) = (sums[node as usize], own(node) + below);
                assert!((whole - parts).abs() <= 1e-4 * whole, "{width:?} {node}: {whole} {parts}");
            }
            for width_px in [1, 7, 640] {
                let icicle = Icicle::new(children, &sums, 0, width_px, 99);
                for level in 0..icicle.level_count() as u32 {
                    let cells: Vec<_> = icicle.cells.iter().filter(|cell| cell.level == level).collect();
                    assert!(cells.len() <= width_px as usize);
                    assert!(cells.is_sorted_by(|a, b| a.right_px <= b.left_px), "{width:?}: cells overlap");
                    for cell in cells {
                        assert!(cell.left_px < cell.right_px && cell.right_px <= width_px);
                        assert_eq!(icicle.cell_of(cell.node), Some(cell));
                        let above = level.checked_sub(1).and_then(|above| icicle.at(above, cell.left_px));
                        let parent = above.is_none_or(|above| {
                            children(above.node).contains(&cell.node) && cell.right_px <= above.right_px
                        });
                        assert!(parent, "{width:?}: {cell:?} is not below its parent");
                    }
                }
            }
        }
    }
}
