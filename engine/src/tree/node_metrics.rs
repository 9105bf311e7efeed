//! Metrics of single nodes: shares of area and of SAH cost, empty space, overlap of the children.

use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::kernel::parallel::{par_collect, zeros};

use super::node::{Node, Tree};
use super::statistics::{INTERSECTION_COST, TreeStats};
use crate::geometry::Container;

/// Surface area of the container of `node` over the root's, 0 to 1: how likely a random line that meets the root meets the node
/// (Goldsmith and Salmon: *Automatic Creation of Object Hierarchies*, 1987). 1 where the root has no area.
pub fn area_share<C: Container>(tree: &Tree<C>, node: u32) -> f32 {
    let [part, whole] = [node, 0].map(|node| tree.area(node));
    if whole > 0.0 { ratio(part, whole) } else { 1.0 }
}

/// SAH cost of `node` itself, without the nodes below it, over that of the tree, 0 to 1. Its cost is
/// area·[`traversal_cost`](crate::tree::ContainerKind::traversal_cost), that of a leaf area·primitives·[`INTERSECTION_COST`]; see
/// [`TreeStats::sah_cost`]. `stats` are those of `tree`. 0 where the tree has no cost.
pub fn sah_share<C: Container>(tree: &Tree<C>, node: u32, stats: &TreeStats) -> f32 {
    ratio((own_cost(tree, node) / f64::from(tree.area(0))) as f32, stats.sah_cost)
}

/// SAH cost of each node with all nodes below it over that of the tree, 0 to 1, in the order of [`Tree::nodes`]; the root has 1. All
/// 0 where the tree has no cost. Takes a pass over the tree.
pub fn subtree_sah_shares<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<Vec<f32>, Cancelled> {
    let mut costs = zeros::<f64>(tree.nodes.len(), token)?;
    // Backwards, so that children are done before their parents.
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        token.check_every(LIGHT_STEPS, index)?;
        let below: f64 = node.children().map(|child| costs[child as usize]).sum();
        costs[index] = own_cost(tree, index as u32) + below;
    }
    let whole = costs.first().copied().unwrap_or(0.0);
    par_collect(costs.len(), token, |node| if whole > 0.0 { ratio((costs[node] / whole) as f32, 1.0) } else { 0.0 })
}

/// Part of the container of `node` that its children leave empty, measured by surface: 1 − Σ area(child) / (k · area(node)) for
/// k children, clamped to 0 to 1. `None` for a leaf; 0 for a node without area.
///
/// For a random line that meets the node it is the expected share of its k container tests that miss. 0 where all children are
/// as large as the node; 1 where they have no surface.
pub fn empty_space<C: Container>(tree: &Tree<C>, node: u32) -> Option<f32> {
    let children = tree.nodes[node as usize].children();
    if children.is_empty() {
        return None;
    }
    let whole = children.len() as f32 * tree.area(node);
    let filled = children.fold(0.0, |sum, child| sum + tree.area(child));
    Some(if whole > 0.0 { 1.0 - ratio(filled, whole) } else { 0.0 })
}

/// Overlap of the children of `node`: Σ area(a ∩ b) / area(node) over all pairs of children, each clamped to 0 to 1. It is the
/// expected number of pairs that a random line that meets the node meets in common: of two children the probability that it
/// must visit both there, of k children 0 to k·(k − 1)/2. `None` for a leaf; 0 for a node without area.
pub fn overlap<C: Container>(tree: &Tree<C>, node: u32) -> Option<f32> {
    let (whole, scale) = (tree.area(node), tree.area_scale());
    let of_pair = |(a, b): (&C, &C)| ratio(a.scaled(scale).intersection_area(&b.scaled(scale)), whole);
    Some(pairs(children(tree, node)?).map(of_pair).fold(0.0, |sum, share| sum + share))
}

/// For each pair of children of `node` that have a point in common, the smallest container around their intersection: for boxes and
/// polytopes the intersection itself. In the order of the children; none for a leaf. The exact shape is that of
/// [`Sphere::lens`](crate::geometry::Sphere::lens) for spheres and of
/// [`OrientedBox::intersection_faces`](crate::geometry::OrientedBox::intersection_faces) for oriented boxes.
pub fn intersections_of_children<C: Container>(tree: &Tree<C>, node: u32) -> impl Iterator<Item = C> {
    let common = pairs_of_children(tree, node).map(|(a, b)| a.intersection_bounds(b));
    common.filter(|common| *common != C::EMPTY)
}

/// The containers of each two children of `node`, in the order of the children; none for a leaf.
pub fn pairs_of_children<C: Container>(tree: &Tree<C>, node: u32) -> impl Iterator<Item = (&C, &C)> {
    pairs(children(tree, node).unwrap_or_default())
}

/// The children; `None` for a leaf.
fn children<C: Container>(tree: &Tree<C>, node: u32) -> Option<&[Node<C>]> {
    let node = &tree.nodes[node as usize];
    (!node.is_leaf()).then(|| &tree.nodes[node.first as usize..][..node.arity() as usize])
}

/// The containers of each two of `nodes`.
fn pairs<C>(nodes: &[Node<C>]) -> impl Iterator<Item = (&C, &C)> {
    let with_later = |(at, a)| nodes[at + 1..].iter().map(move |b: &Node<C>| (a, &b.container));
    nodes.iter().map(|node| &node.container).enumerate().flat_map(with_later)
}

/// Cost of the tests that visiting `node` causes, times [`Tree::area`].
pub(crate) fn own_cost<C: Container>(tree: &Tree<C>, node: u32) -> f64 {
    f64::from(tree.area(node)) * visit_cost(&tree.nodes[node as usize])
}

/// Cost of the tests that one visit of `node` causes: [`traversal_cost`](crate::tree::ContainerKind::traversal_cost), or
/// [`INTERSECTION_COST`] for each primitive of a leaf.
pub(crate) fn visit_cost<C: Container>(node: &Node<C>) -> f64 {
    if node.is_leaf() {
        f64::from(INTERSECTION_COST) * f64::from(node.count)
    } else {
        f64::from(C::KIND.traversal_cost())
    }
}

/// `part / whole`, clamped to 0 to 1; 0 where that is no number.
fn ratio(part: f32, whole: f32) -> f32 {
    let ratio = part / whole;
    if ratio.is_nan() { 0.0 } else { ratio.clamp(0.0, 1.0) }
}
