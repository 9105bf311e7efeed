//! Linear BVH: splits by Morton code (Lauterbach, Garland, Sengupta, Luebke, Manocha, *Fast BVH Construction on GPUs*,
//! 2009).

use std::ops::Range;

use crate::aac::ClusterContainer;
use crate::builders::flatten::{ChildPair, finish, pair_node};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::parallel::zeros;
use crate::order::{InputBounds, SortedPrimitives, sort_primitives};
use crate::settings::Curve;
use crate::stage_times::{Stage, StageTimes};
use crate::tree::{Node, Tree};

/// Maximum number of primitives that are built by one thread.
const FORK_ABOVE: usize = 8192;

/// Builds a tree with one triangle per leaf, split where the highest differing bit of the codes flips.
pub fn build<C: ClusterContainer>(
    triangles: &[Triangle],
    bounds: &InputBounds,
    curve: Curve,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let sorted = sort_primitives::<C>(triangles, bounds, curve, token, times)?;
    let stage = Stage::begin("tree", token);
    let mut slots: Vec<ChildPair<C>> = zeros(triangles.len(), token)?;
    let root = split(triangles, &sorted, 0..triangles.len(), &mut slots, 0, token)?;
    finish(root, &slots, |position| sorted.primitive(position), stage, token, times)
}

/// Builds the node over `range`; its children go to the slot of the last primitive of the left side. The depth of the
/// recursion is bounded by the bits of a code and by halving groups of equal codes.
fn split<C: ClusterContainer>(
    triangles: &[Triangle],
    sorted: &SortedPrimitives<C>,
    range: Range<usize>,
    slots: &mut [ChildPair<C>],
    offset: usize,
    token: &CancelToken,
) -> Result<Node<C>, Cancelled> {
    if range.len() == 1 {
        let container = sorted.container(triangles, sorted.primitive(range.start));
        return Ok(Node { container, first: range.start as u32, count: 1 });
    }
    let middle = sorted.make_partition(&range);
    let (left_slots, right_slots) = slots.split_at_mut(middle - offset);
    let children = token.both(
        range.len() > FORK_ABOVE,
        |token| split(triangles, sorted, range.start..middle, left_slots, offset, token),
        |token| split(triangles, sorted, middle..range.end, right_slots, middle, token),
    )?;
    Ok(pair_node(slots, offset, middle - offset, children))
}
