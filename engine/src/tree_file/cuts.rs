//! Nodes whose planes cut off triangles below them. Oriented boxes are fitted to their triangles alone and need not lie in those
//! of their parents, so that the leaves say nothing of the nodes above.

use super::bounds::FileContainer;
use super::found::{Found, in_chunks};
use super::links::Steps;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::kernel::parallel::zeros;
use crate::tree::{ContainerKind, Tree};

/// Nodes above a triangle, on average, up to which every node is compared with every triangle below it. Trees of builders have
/// fewer; in a list of a million nodes there are half a million.
const MAX_COMPARED_DEPTH: u64 = 128;
/// Comparisons that are made in trees of any size.
const MIN_COMPARISONS: u64 = 1 << 26;

/// Nodes and the triangles below them.
pub(super) struct Cuts {
    /// Nodes that cut off triangles.
    pub found: Found,
    /// Nodes that were not compared: those with the most triangles below them, where comparing all would take too long.
    pub unchecked: Found,
}

/// Compares the interior nodes of `tree` with all triangles below them. A triangle that is in leaves elsewhere too is left out, as
/// a node holds a part of it.
pub(super) fn find<C: FileContainer>(
    tree: &Tree<C>,
    triangles: &[Triangle],
    is_split: bool,
    token: &CancelToken,
) -> Result<Cuts, Cancelled> {
    let ranges = slots_below(tree, token)?;
    let places = if is_split { Some(places_of(tree, triangles.len(), token)?) } else { None };
    let allowed = (triangles.len() as u64).saturating_mul(MAX_COMPARED_DEPTH).max(MIN_COMPARISONS);
    let largest = largest_compared(tree, &ranges, allowed, token)?;
    let found = in_chunks(tree, token, |number, found, steps| {
        let [first, end] = ranges[number as usize];
        if tree.nodes[number as usize].is_leaf() || end.saturating_sub(first) > largest {
            return Ok(());
        }
        let is_whole = |triangle: u32| {
            let place = places.as_ref().and_then(|places| places.get(triangle as usize));
            place.is_none_or(|&[low, high]| first <= low && high < end)
        };
        let excess = excess_below(tree, number, triangles, is_whole, steps)?;
        if excess > 0.0 {
            found.add(number, excess);
        }
        Ok(())
    })?;
    let unchecked = in_chunks(tree, token, |number, found, _| {
        let [first, end] = ranges[number as usize];
        if !tree.nodes[number as usize].is_leaf() && end.saturating_sub(first) > largest {
            found.add(number, 0.0);
        }
        Ok(())
    })?;
    Ok(Cuts { found, unchecked })
}

/// By how much a triangle below `node` sticks out of it, at most; negative or 0 where none does. Subtrees whose boxes lie inside are
/// passed over.
fn excess_below<C: FileContainer>(
    tree: &Tree<C>,
    node: u32,
    triangles: &[Triangle],
    is_whole: impl Fn(u32) -> bool,
    steps: &mut Steps<'_>,
) -> Result<f64, Cancelled> {
    let container = &tree.nodes[node as usize].container;
    let mut excess = 0.0_f64;
    let mut open: Vec<u32> = tree.nodes[node as usize].children().collect();
    while let Some(at) = open.pop() {
        steps.step()?;
        let below = &tree.nodes[at as usize];
        if container.excess_of_bounds(&below.container.bounds()) <= 0.0 {
            continue;
        }
        open.extend(below.children());
        for &primitive in &tree.primitive_indices[below.slots()] {
            steps.step()?;
            if is_whole(primitive) {
                excess = excess.max(container.excess_of_triangle(&triangles[primitive as usize]));
            }
        }
    }
    Ok(excess)
}

/// The first slot below each node and the one after the last: the leaves of a tree that was read are in the order of their slots.
fn slots_below<C: FileContainer>(tree: &Tree<C>, token: &CancelToken) -> Result<Vec<[u32; 2]>, Cancelled> {
    let mut ranges: Vec<[u32; 2]> = zeros(tree.nodes.len(), token)?;
    let mut steps = Steps::silent(token);
    for (number, node) in tree.nodes.iter().enumerate().rev() {
        steps.step()?;
        ranges[number] = if node.is_leaf() {
            [node.first, node.first.saturating_add(node.count)]
        } else {
            let last = node.children().last().unwrap_or(node.first);
            [ranges[node.first as usize][0], ranges[last as usize][1]]
        };
    }
    Ok(ranges)
}

/// The first and the last slot of each triangle.
fn places_of<C>(tree: &Tree<C>, triangles: usize, token: &CancelToken) -> Result<Vec<[u32; 2]>, Cancelled> {
    let mut places: Vec<[u32; 2]> = zeros(triangles, token)?;
    let mut steps = Steps::silent(token);
    for slot in (0..tree.primitive_indices.len() as u32).rev() {
        steps.step()?;
        let [first, last] = &mut places[tree.primitive_indices[slot as usize] as usize];
        // The last slot comes first.
        *last = (*last).max(slot);
        *first = slot;
    }
    Ok(places)
}

/// Most triangles below a node that is compared, so that there are at most `allowed` comparisons.
fn largest_compared<C: FileContainer>(
    tree: &Tree<C>,
    ranges: &[[u32; 2]],
    allowed: u64,
    token: &CancelToken,
) -> Result<u32, Cancelled> {
    // Comparisons with nodes of up to 2^at triangles.
    let mut sums = [0_u64; 33];
    let mut steps = Steps::silent(token);
    for (node, [first, end]) in tree.nodes.iter().zip(ranges) {
        steps.step()?;
        if !node.is_leaf() {
            let count = end.saturating_sub(*first);
            let at = u32::BITS.saturating_sub(count.saturating_sub(1).leading_zeros()) as usize;
            sums[at] = sums[at].saturating_add(u64::from(count));
        }
    }
    let mut sum = 0_u64;
    let fits = sums.iter().take_while(|&&of_size| {
        sum = sum.saturating_add(of_size);
        sum <= allowed
    });
    Ok(match fits.count().checked_sub(1) {
        None => 0,
        Some(at) => 1_u32.checked_shl(at as u32).unwrap_or(u32::MAX),
    })
}

/// Peak of these lists for each node.
pub(super) const BYTES_PER_NODE: u64 = size_of::<[u32; 2]>() as u64;
/// The same for each triangle.
pub(super) const BYTES_PER_TRIANGLE: u64 = size_of::<[u32; 2]>() as u64;

/// Whether nodes with containers of this kind have to be compared with the triangles below them: others that enclose the containers
/// of their children enclose all that is in these.
pub(super) const fn concerns<C: FileContainer>() -> bool {
    matches!(C::KIND, ContainerKind::Oriented)
}
