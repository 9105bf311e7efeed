//! Top-down construction with the best split of all by the surface area heuristic: each node is swept along each axis in the order
//! of its primitives' centres (Wald, *On fast Construction of SAH-based Bounding Volume Hierarchies*, 2007: the full
//! sweep that bins approximate). Primitives are sorted once along each axis; a split divides the three lists and keeps their order.

use glam::Vec3;

use crate::aac::ClusterContainer;
use crate::builders::flatten::{ChildPair, finish, pair_node};
use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::Triangle;
use crate::kernel::parallel::{par_collect, tasks_if, zeros};
use crate::order::radix_sort;
use crate::stage_times::{Stage, StageTimes};
use crate::tree::{Node, Tree};

/// Maximum number of primitives that are built by one thread.
const FORK_ABOVE: usize = 4096;
/// Depth from which on primitives are halved without searching for a split, which bounds the recursion.
const MAX_SPLIT_DEPTH: u32 = 96;

/// Containers and centres of the primitives, in input order.
struct Primitives<C> {
    containers: Vec<C>,
    centres: Vec<Vec3>,
}

/// A range of the three sorted lists, with memory of the same length for each.
struct Range<'a> {
    /// Indices of the same primitives in the order of their centres along each axis, of equal ones by index.
    orders: [&'a mut [u32]; 3],
    scratch: [&'a mut [u32]; 3],
}

impl Range<'_> {
    fn len(&self) -> usize {
        self.orders[0].len()
    }

    /// The first `middle` primitives of each list, and the others.
    fn split_at(&mut self, middle: usize) -> [Range<'_>; 2] {
        let [x, y, z] = self.orders.each_mut().map(|list| list.split_at_mut(middle));
        let [u, v, w] = self.scratch.each_mut().map(|list| list.split_at_mut(middle));
        [
            Range { orders: [x.0, y.0, z.0], scratch: [u.0, v.0, w.0] },
            Range { orders: [x.1, y.1, z.1], scratch: [u.1, v.1, w.1] },
        ]
    }
}

/// A split of a range: its first `left` primitives along `axis` from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Split {
    /// Areas times numbers of primitives, summed over both sides. Exact where areas are equal, so that ties are found.
    pub cost: f64,
    /// The axis of the order.
    pub axis: usize,
    /// Number of primitives on the first side.
    pub left: usize,
    /// Difference between the numbers of primitives of both sides.
    pub imbalance: usize,
}

impl Split {
    /// Of two equally expensive splits the more even one is better: equal primitives make a balanced tree, not a list.
    pub fn is_better_than(&self, other: &Self) -> bool {
        self.cost < other.cost || self.cost == other.cost && self.imbalance < other.imbalance
    }
}

/// Builds a tree with one triangle per leaf.
pub fn build<C: ClusterContainer>(
    triangles: &[Triangle],
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let count = triangles.len();
    let stage = Stage::begin("sort", token);
    let containers: Vec<C> = par_collect(count, token, |index| C::of_triangle(&triangles[index]))?;
    // Adding zero makes negative zeros positive, so that their bits are equal, too.
    let centres = par_collect(count, token, |index| containers[index].centroid() + Vec3::ZERO)?;
    let primitives = Primitives { containers, centres };
    let mut orders = [const { Vec::new() }; 3];
    for (axis, order) in orders.iter_mut().enumerate() {
        *order = sorted_along(axis, &primitives.centres, token)?;
    }
    stage.end(times);

    let stage = Stage::begin("tree", token);
    let mut scratch = [const { Vec::new() }; 3];
    for list in &mut scratch {
        *list = zeros(count, token)?;
    }
    let mut slots: Vec<ChildPair<C>> = zeros(count, token)?;
    let range =
        Range { orders: orders.each_mut().map(Vec::as_mut_slice), scratch: scratch.each_mut().map(Vec::as_mut_slice) };
    let root = split(&primitives, range, &mut slots, 0, 0, token)?;
    drop((scratch, primitives));
    finish(root, &slots, |position| orders[0][position], stage, token, times)
}

/// Indices of the primitives in the order of their centres along `axis`, of equal ones by index.
fn sorted_along(axis: usize, centres: &[Vec3], token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
    let key = |index: usize| u64::from(ordered_bits(centres[index][axis])) << 32 | index as u64;
    let mut keys = par_collect(centres.len(), token, key)?;
    radix_sort(&mut keys, u64::BITS, token)?;
    par_collect(keys.len(), token, |position| keys[position] as u32)
}

/// Bits in the order of the numbers: the sign inverted, of negative ones all.
pub const fn ordered_bits(number: f32) -> u32 {
    let bits = number.to_bits();
    bits ^ ((bits as i32 >> 31) as u32 | 1 << 31)
}

/// Builds the node over `range`, whose lists begin at `offset` in the whole ones.
fn split<C: ClusterContainer>(
    primitives: &Primitives<C>,
    mut range: Range<'_>,
    slots: &mut [ChildPair<C>],
    offset: usize,
    depth: u32,
    token: &CancelToken,
) -> Result<Node<C>, Cancelled> {
    if let [primitive] = range.orders[0] {
        return Ok(Node { container: primitives.containers[*primitive as usize], first: offset as u32, count: 1 });
    }
    let halved = Split { cost: f64::INFINITY, axis: 0, left: range.len() / 2, imbalance: 0 };
    // Two primitives have one split, whatever the axis.
    let best =
        if depth < MAX_SPLIT_DEPTH && range.len() > 2 { best_split(primitives, &mut range, token)? } else { halved };
    divide(&primitives.centres, &mut range, &best, token)?;
    let middle = best.left;
    let forks = range.len() > FORK_ABOVE;
    let (left_slots, right_slots) = slots.split_at_mut(middle);
    let [left, right] = range.split_at(middle);
    let children = token.both(
        forks,
        |token| split(primitives, left, left_slots, offset, depth + 1, token),
        |token| split(primitives, right, right_slots, offset + middle, depth + 1, token),
    )?;
    Ok(pair_node(slots, offset, middle, children))
}

/// The best split of `range`, of at least two primitives, along any axis; of equal ones that along the first axis.
fn best_split<C: ClusterContainer>(
    primitives: &Primitives<C>,
    range: &mut Range<'_>,
    token: &CancelToken,
) -> Result<Split, Cancelled> {
    let forks = range.len() > FORK_ABOVE;
    let Range { orders, scratch } = range;
    let axes = scratch.each_mut().into_iter().zip(orders).enumerate();
    let axes = axes.map(|(axis, (areas, order))| (axis, &**order, &mut **areas));
    let sweep = |(axis, order, areas): (usize, &[u32], &mut [u32]), token: &CancelToken| {
        best_split_in_order(order.len(), |at| &primitives.containers[order[at] as usize], areas, axis, token)
    };
    Ok(tasks_if(forks, axes, token, sweep)?
        .into_iter()
        .reduce(|best, split| if split.is_better_than(&best) { split } else { best })
        .unwrap_or_else(|| unreachable!("there are three axes")))
}

/// The best split of `count` primitives, of two at least, whose containers are in the order along `axis`. `areas` is memory for as many
/// numbers.
pub fn best_split_in_order<'a, C: ClusterContainer>(
    count: usize,
    container: impl Fn(usize) -> &'a C,
    areas: &mut [u32],
    axis: usize,
    token: &CancelToken,
) -> Result<Split, Cancelled> {
    // Areas of all primitives from each one on.
    let mut right = C::EMPTY;
    for at in (1..count).rev() {
        if at % MEDIUM_STEPS == 0 {
            token.check()?;
        }
        right = right.union(container(at));
        areas[at] = right.relative_area().to_bits();
    }
    let mut left = C::EMPTY;
    let mut best = Split { cost: f64::INFINITY, axis, left: count / 2, imbalance: usize::MAX };
    for (at, right_area) in areas.iter().enumerate().skip(1) {
        if at % MEDIUM_STEPS == 0 {
            token.check()?;
        }
        left = left.union(container(at - 1));
        let cost =
            f64::from(left.relative_area()) * at as f64 + f64::from(f32::from_bits(*right_area)) * (count - at) as f64;
        let split = Split { cost, axis, left: at, imbalance: count.abs_diff(2 * at) };
        if split.is_better_than(&best) {
            best = split;
        }
    }
    Ok(best)
}

/// Divides the lists of the other axes as `split` divides that of its own; each side keeps its order.
fn divide(centres: &[Vec3], range: &mut Range<'_>, split: &Split, token: &CancelToken) -> Result<(), Cancelled> {
    let first_right = range.orders[split.axis][split.left];
    let bound = centres[first_right as usize][split.axis];
    let is_left = |primitive: u32| {
        let centre = centres[primitive as usize][split.axis];
        centre < bound || centre == bound && primitive < first_right
    };
    let forks = range.len() > FORK_ABOVE;
    let Range { orders, scratch } = range;
    let lists = orders.each_mut().into_iter().zip(scratch).enumerate();
    let others = lists.filter(|(axis, _)| *axis != split.axis);
    let others = others.map(|(_, (order, scratch))| (&mut **order, &mut **scratch));
    let partition = |(order, scratch): (&mut [u32], &mut [u32]), token: &CancelToken| {
        partition_stable(order, scratch, split.left, is_left, token)
    };
    tasks_if(forks, others, token, partition).map(drop)
}

/// Moves those of `list` that are left, `left` of them, to its front. Both sides keep their order.
fn partition_stable(
    list: &mut [u32],
    scratch: &mut [u32],
    left: usize,
    is_left: impl Fn(u32) -> bool,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let (mut next_left, mut next_right) = (0, left);
    for batch in list.chunks(MEDIUM_STEPS) {
        if batch.len() == MEDIUM_STEPS {
            token.check()?;
        }
        for &primitive in batch {
            let next = if is_left(primitive) { &mut next_left } else { &mut next_right };
            scratch[*next] = primitive;
            *next += 1;
        }
    }
    list.copy_from_slice(scratch);
    Ok(())
}
