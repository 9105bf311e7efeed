//! Rotations of a tree while it is fitted (Kopta, Ize, Spjut, Brunvand, Davis, Kensler, *Fast, Effective BVH Updates for Animated
//! Scenes*, 2012).

use std::sync::atomic::{AtomicUsize, Ordering};

use super::bottom_up::{FitInterior, ToChildren, fit};
use crate::aac::ClusterContainer;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::optimize::write_in_order;
use crate::tree::{Container, Node, Tree};

/// Part of a node's area that a rotation must gain: less is rounding, and each rotation takes the nodes out of order.
const MIN_GAIN: f32 = 1e-4;

/// Two nodes that change places.
#[derive(Clone, Copy)]
struct Exchange {
    /// Reduction of the summed area of both children.
    gain: f32,
    nodes: [usize; 2],
}

/// Fits and rotates a tree, and returns the number of rotations.
pub(super) fn rotate<C: ClusterContainer>(
    tree: &mut Tree<C>,
    triangles: &[Triangle],
    token: &CancelToken,
) -> Result<usize, Cancelled> {
    assert!(tree.is_binary(token)?, "rotations need a binary tree");
    let rotations = Rotations::default();
    fit(tree, triangles, |_, fitted| fitted, &rotations, token)?;
    let count = rotations.0.into_inner();
    if count > 0 {
        write_in_order(tree, token)?;
    }
    Ok(count)
}

/// Fits nodes and rotates them. Counts the rotations.
#[derive(Default)]
struct Rotations(AtomicUsize);

impl<C: ClusterContainer> FitInterior<C> for Rotations {
    fn fit(&self, nodes: &mut [Node<C>], offset: usize, index: usize) {
        ToChildren.fit(nodes, offset, index);
        if let Some(Exchange { nodes: [a, b], .. }) = best_exchange(nodes, offset, index) {
            nodes.swap(a, b);
            let first = nodes[index].first as usize - offset;
            for child in [first, first + 1] {
                if !nodes[child].is_leaf() {
                    ToChildren.fit(nodes, offset, child);
                }
            }
            // A sphere around two depends on what these were made of.
            ToChildren.fit(nodes, offset, index);
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// The exchange below a node that reduces the areas of its children most; `None` where none does.
#[inline]
fn best_exchange<C: Container>(nodes: &[Node<C>], offset: usize, index: usize) -> Option<Exchange> {
    let first = nodes[index].first as usize - offset;
    let pair = [first, first + 1];
    let area = |node: usize| nodes[node].container.relative_area();
    let of_both = |a: usize, b: usize| nodes[a].container.union(&nodes[b].container).relative_area();
    let grandchildren = pair.map(|child| (!nodes[child].is_leaf()).then(|| nodes[child].first as usize - offset));
    let mut best = Exchange { gain: MIN_GAIN * area(index), nodes: [0; 2] };
    let mut offer = |gain: f32, nodes: [usize; 2]| {
        if gain > best.gain {
            best = Exchange { gain, nodes };
        }
    };
    // A child and a child of its sibling.
    for (child, own, sibling) in [(pair[0], grandchildren[0], pair[1]), (pair[1], grandchildren[1], pair[0])] {
        let Some(own) = own else { continue };
        for (leaves, stays) in [(own, own + 1), (own + 1, own)] {
            offer(area(child) - of_both(stays, sibling), [leaves, sibling]);
        }
    }
    // A grandchild on either side.
    if let [Some(left), Some(right)] = grandchildren {
        for (goes, stays) in [(right, right + 1), (right + 1, right)] {
            let after = of_both(left, goes) + of_both(left + 1, stays);
            offer(area(pair[0]) + area(pair[1]) - after, [left + 1, goes]);
        }
    }
    (best.nodes != [0; 2]).then_some(best)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::Aabb;

    fn leaf(x: f32, slot: u32) -> Node<Aabb> {
        let container = Aabb { min: Vec3::new(x, 0.0, 0.0), max: Vec3::new(x + 1.0, 1.0, 1.0) };
        Node { container, first: slot, count: 1 }
    }

    /// ((a b) (c d)) with leaves at these places along x.
    fn tree(places: [f32; 4]) -> Vec<Node<Aabb>> {
        let leaves = [0, 1, 2, 3].map(|slot| leaf(places[slot as usize], slot));
        let interior = |first| Node { container: Aabb::EMPTY, first, count: 0 };
        let mut nodes = vec![interior(1), interior(3), interior(5)];
        nodes.extend(leaves);
        for index in [2, 1, 0] {
            ToChildren.fit(&mut nodes, 0, index);
        }
        nodes
    }

    #[test]
    fn the_best_of_six_exchanges_is_found() {
        assert!(best_exchange(&tree([0.0, 1.0, 8.0, 9.0]), 0, 0).is_none(), "both pairs stand together");
        // Boxes of 1 by 1 by length have a half area of 1 + 2 · length.
        let crossed = best_exchange(&tree([0.0, 8.0, 1.0, 9.0]), 0, 0).map(|best| (best.gain, best.nodes));
        // Two of length 9, then two of length 2.
        assert_eq!(crossed, Some((28.0, [4, 5])));
        let crossed = best_exchange(&tree([0.0, 9.0, 8.0, 1.0]), 0, 0).map(|best| (best.gain, best.nodes));
        // Of length 10 and 8, then two of length 2.
        assert_eq!(crossed, Some((28.0, [4, 6])));
        // ((a b) c) with c beside a: b takes its place.
        let mut nodes = tree([0.0, 9.0, 1.0, 2.0]);
        nodes[2] = leaf(1.0, 2);
        ToChildren.fit(&mut nodes, 0, 0);
        let lifted = best_exchange(&nodes, 0, 0).map(|best| (best.gain, best.nodes));
        // Of length 10 before, of length 2 after.
        assert_eq!(lifted, Some((16.0, [4, 2])));
    }
}
