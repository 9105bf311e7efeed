//! Splits by Morton code (Lauterbach, Garland, Sengupta, Luebke, Manocha, *Fast BVH Construction on GPUs*, 2009).

use std::ops::Range;
use std::time::Instant;

use crate::aac::ClusterContainer;
use crate::builders::flatten::{Pair, flatten};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::par_collect::zeros;
use crate::order::{InputBounds, SortedPrimitives, sort_primitives};
use crate::settings::Curve;
use crate::stage_times::StageTimes;
use crate::tree::{Node, Tree};

/// Subtrees up to this size are built by one thread.
const FORK_ABOVE: usize = 8192;

/// A tree of single primitives, split where the highest bit of their codes flips.
pub fn build<C: ClusterContainer>(
    triangles: &[Triangle],
    bounds: &InputBounds,
    curve: Curve,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let input = sort_primitives::<C>(triangles, bounds, curve, token, times)?;
    let start = Instant::now();
    let mut slots: Vec<Pair<C>> = zeros(triangles.len(), token)?;
    let root = split(triangles, &input, 0..triangles.len(), &mut slots, 0, token)?;
    times.stages.push(("tree", start.elapsed()));
    token.check()?;
    let start = Instant::now();
    let tree = flatten(root, &slots, |position| input.primitive(position), token)?;
    times.stages.push(("flatten", start.elapsed()));
    token.set_progress(1.0);
    Ok(tree)
}

/// The node over `range`; its pair goes to the slot of the last primitive of its first half. Recurses no deeper than a
/// code has bits and a group of equal codes halves.
fn split<C: ClusterContainer>(
    triangles: &[Triangle],
    input: &SortedPrimitives<C>,
    range: Range<usize>,
    slots: &mut [Pair<C>],
    offset: usize,
    token: &CancelToken,
) -> Result<Node<C>, Cancelled> {
    if range.len() == 1 {
        let container = input.container(triangles, input.primitive(range.start));
        return Ok(Node { container, first: range.start as u32, count: 1 });
    }
    let middle = input.make_partition(&range);
    let (left_slots, right_slots) = slots.split_at_mut(middle - offset);
    let (left, right) = if range.len() > FORK_ABOVE {
        token.check()?;
        rayon::join(
            || split(triangles, input, range.start..middle, left_slots, offset, token),
            || split(triangles, input, middle..range.end, right_slots, middle, token),
        )
    } else {
        (
            split(triangles, input, range.start..middle, left_slots, offset, token),
            split(triangles, input, middle..range.end, right_slots, middle, token),
        )
    };
    let (left, right) = (left?, right?);
    // Splits between two neighbours happen once: this slot is nobody else's.
    let slot = middle - 1;
    slots[slot - offset] = [left, right];
    Ok(Node { container: left.container.union(&right.container), first: slot as u32, count: left.count + right.count })
}
