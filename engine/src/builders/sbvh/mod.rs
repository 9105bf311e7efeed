//! Top-down construction with spatial splits (Stich, Friedrich, Dietrich, *Spatial Splits in Bounding Volume Hierarchies*, 2009).
//! A node is divided either by its list of references or by a plane, whichever costs less. A plane cuts references in two, so that
//! several leaves hold the same triangle, each within a smaller box; a reference for which that does not pay goes to one side as a whole.
//!
//! The references of a node are the first part of its range, in the order of their triangles; the rest of the range is spare room for
//! those that planes add below it, and is shared out with them:
//!
//! ```text
//! node     r r r r r r . . . . . .
//! sides    r r r r . . . | r r r . .      one reference cut, both sides have their share of what is spare
//! ```
//!
//! So the tree depends on the triangles only, whatever the number of threads, and there are never more references than the bound.

mod references;
mod sides;

mod by_list;
mod by_plane;

use bytemuck::Zeroable;

use crate::builders::clip::overlap_within;
use crate::builders::flatten::{ChildPair, finish, pair_node};
use crate::builders::prepared::MAX_PRIMITIVES;
use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::geometry::{Aabb, Triangle};
use crate::kernel::parallel::{par_collect, zeros};
use crate::stage_times::{Stage, StageTimes};
use crate::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};
use crate::tree::{Node, Tree};

use by_list::best_list_split;
use by_plane::{best_plane_split, divide_by_plane};
use references::{FORK_ABOVE, Reference, Scene, around};
use sides::{Sides, divide_by_list};

/// Area that both sides of a node have in common from which planes are tried, as a fraction of the root's: the paper's α.
const ALPHA: f32 = 1e-5;
/// Greatest number of additional references, as a fraction of the number of triangles.
const MAX_EXTRA: f64 = 1.0;
/// Number of references of a node from which on it polls for cancellation.
const POLL_FROM: usize = 512;
/// Depth from which on references are halved without searching for a split, which bounds the recursion.
const MAX_SPLIT_DEPTH: u32 = 96;

/// Builds a tree with one reference per leaf: at most twice as many as triangles, and as many as those unless `may_cut`.
pub fn build(
    triangles: &[Triangle],
    may_cut: bool,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<Aabb>, Cancelled> {
    let stage = Stage::begin("tree", token);
    let count = triangles.len();
    let extra = if may_cut { (count as f64 * MAX_EXTRA) as usize } else { 0 };
    let capacity = (count + extra).min(MAX_PRIMITIVES - 1);
    let mut references = par_collect(capacity, token, |index| match triangles.get(index) {
        Some(triangle) => Reference { bounds: triangle.bounds(), triangle: index as u32 },
        None => Reference::zeroed(),
    })?;
    let mut bounds = Aabb::EMPTY;
    for batch in references[..count].chunks(LIGHT_STEPS) {
        token.check()?;
        bounds = bounds.union(&around(batch));
    }
    let scene = Scene { triangles, overlap: overlap_within(&bounds), min_common_area: ALPHA * bounds.half_area() };
    let mut slots: Vec<ChildPair<Aabb>> = zeros(capacity, token)?;
    let root = split(&scene, &mut references, count, &mut slots, 0, 0, token)?;
    finish(root, &slots, |position| references[position].triangle, stage, token, times)
}

/// Builds the node over the first `count` of `references`, the others of which are spare; the first has the index `offset` in the
/// whole list.
fn split(
    scene: &Scene<'_>,
    references: &mut [Reference],
    count: usize,
    slots: &mut [ChildPair<Aabb>],
    offset: usize,
    depth: u32,
    token: &CancelToken,
) -> Result<Node<Aabb>, Cancelled> {
    if count >= POLL_FROM {
        token.check()?;
    }
    if count == 1 {
        return Ok(Node { container: references[0].bounds, first: offset as u32, count: 1 });
    }
    let Sides { counts: [left, right], middle } = divide(scene, references, count, depth, token)?;
    let (left_references, right_references) = references.split_at_mut(middle);
    let (left_slots, right_slots) = slots.split_at_mut(middle);
    let children = token.both(
        count > FORK_ABOVE,
        |token| split(scene, left_references, left, left_slots, offset, depth + 1, token),
        |token| split(scene, right_references, right, right_slots, offset + middle, depth + 1, token),
    )?;
    Ok(pair_node(slots, offset, middle, children))
}

/// Divides the first `count` of `references`, of at least two, by the cheaper of both kinds of splits. A plane must also cost less than a
/// leaf: below what the paper makes a leaf, references would be cut for hardly any gain.
fn divide(
    scene: &Scene<'_>,
    references: &mut [Reference],
    count: usize,
    depth: u32,
    token: &CancelToken,
) -> Result<Sides, Cancelled> {
    if depth >= MAX_SPLIT_DEPTH {
        return divide_by_list(references, count, |at| at < count / 2, token);
    }
    let by_list = best_list_split(&references[..count], token)?;
    let [left, right] = &by_list.sides;
    let spare = references.len() - count;
    if spare > 0 && left.intersection(right).half_area() > scene.min_common_area {
        let bounds = left.union(right);
        let [leaf_cost, node_cost] =
            [INTERSECTION_COST * count as f32, TRAVERSAL_COST].map(|cost| f64::from(cost * bounds.half_area()));
        let most = by_list.cost.min(leaf_cost - node_cost);
        let plane = best_plane_split(scene, &references[..count], &bounds, spare, token)?;
        if let Some(plane) = plane.filter(|plane| plane.cost < most)
            && let Some(sides) = divide_by_plane(scene, references, count, plane, token)?
        {
            return Ok(sides);
        }
    }
    divide_by_list(references, count, |at| by_list.is_left[at], token)
}
