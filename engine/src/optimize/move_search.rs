//! Search for the best new position of a subtree (Meister, Bittner, *Parallel Reinsertion for Bounding Volume Hierarchy
//! Optimization*, 2018).
//!
//! The subtree `C` leaves its parent `P1`, which vanishes: its sibling `B1` takes the place of `P1`. Then `C` and a target `T`
//! become the children of a new node `N`, which takes the place of `T`. The ancestors of `C` are the *pivots* `P1`, `P2`, …
//!
//! ```text
//!               R                              R
//!              / \                            / \
//!            P3   B3        C to T          P3   B3
//!           /  \            ─────▶         /  \
//!         P2    A                        P2    A'
//!        /  \  / \                      /  \  / \
//!      P1   B2 T  D                    B1  B2 N  D
//!     /  \                                   / \
//!    C    B1                                T   C
//! ```
//!
//! Areas change in three ways, which add up to the gain of a move (`+` shrinks the tree, `−` enlarges it), here below `P3`:
//!
//! ```text
//! + area(P1)                        P1 vanishes
//! + area(P2) − area(B1 ∪ B2)        each pivot below P3 no longer holds C
//! − (area(A ∪ C) − area(A))         each node from below P3 down to T's parent grows around C
//! − area(T ∪ C)                     N is new
//! ```
//!
//! `P3` and all above it hold `C` before and after, and keep their areas. The search therefore climbs from pivot to pivot with the
//! first two lines, and from each descends into the other child with the last two. It turns back where even a new node of the
//! area of `C` alone, the smallest there can be, would cost more than the best move gains.

use crate::optimize::simd_box::Bounds;

/// No node.
pub const NONE: u32 = u32::MAX;

/// A binary tree of boxes, the nodes of which know their parents.
pub trait LinkedNodes {
    /// The container of a node.
    type Bounds: Bounds;

    /// The parent of `node`; [`NONE`] for the root.
    fn parent(&self, node: u32) -> u32;
    /// The other child of the parent of `node`, which is not the root.
    fn sibling(&self, node: u32) -> u32;
    /// The children of `node`; `None` for a leaf.
    fn children(&self, node: u32) -> Option<[u32; 2]>;
    fn bounds(&self, node: u32) -> Self::Bounds;
}

/// A subtree and its new position.
#[derive(Debug, Clone, Copy)]
pub struct Move {
    /// Reduction of the summed area of interior nodes.
    pub gain: f32,
    /// Index of the root of the subtree.
    pub node: u32,
    /// The new sibling.
    pub target: u32,
    /// The lowest node above both the old and the new position; the old parent where the target is below it.
    pub above: u32,
}

/// The best new position of `node` in `tree`, if any gains more than `min_gain`, which may be negative: branch and bound over the
/// siblings of its ancestors and everything below them, up to `max_visits` nodes, since nothing else bounds a search where
/// containers coincide. `node` must be neither the root nor a child of it.
#[inline(always)]
pub fn find_move(
    tree: &impl LinkedNodes,
    node: u32,
    min_gain: f32,
    max_visits: u32,
    stack: &mut Vec<(f32, u32)>,
) -> Option<Move> {
    let (best, _) = search(tree, node, min_gain, max_visits, stack);
    (best.target != NONE).then_some(best)
}

/// The best move of `node`, to [`NONE`] if there is none, and the number of nodes visited.
#[inline(always)]
fn search<T: LinkedNodes>(
    tree: &T,
    node: u32,
    min_gain: f32,
    max_visits: u32,
    stack: &mut Vec<(f32, u32)>,
) -> (Move, u32) {
    let bounds = tree.bounds(node);
    let area = bounds.half_area();
    let parent = tree.parent(node);
    let mut best = Move { gain: min_gain, node, target: NONE, above: NONE };
    // Gain of removing the node: its parent vanishes, and all ancestors shrink.
    let mut freed = tree.bounds(parent).half_area();
    let mut remaining = T::Bounds::EMPTY;
    let (mut pivot, mut pivot_child) = (parent, node);
    let mut visited = 0;
    while pivot != NONE && visited < max_visits {
        let other = tree.sibling(pivot_child);
        stack.push((freed, other));
        // Gain before the cost of the new parent, on the way down to a node.
        while let Some((freed_below, index)) = stack.pop() {
            // The new parent is at least as large as the node.
            if freed_below - area <= best.gain || visited == max_visits {
                continue;
            }
            visited += 1;
            let target_bounds = tree.bounds(index);
            let gain = freed_below - target_bounds.union(&bounds).half_area();
            let is_current_position = pivot_child == node && index == other;
            if gain > best.gain && !is_current_position {
                best = Move { gain, node, target: index, above: pivot };
            }
            // Further down, the target grows around the node.
            let freed_below = gain + target_bounds.half_area();
            if freed_below - area > best.gain
                && let Some([left, right]) = tree.children(index)
            {
                stack.extend([(freed_below, right), (freed_below, left)]);
            }
        }
        if pivot == parent {
            remaining = tree.bounds(other);
        } else {
            remaining = remaining.union(&tree.bounds(other));
            freed += tree.bounds(pivot).half_area() - remaining.half_area();
        }
        pivot_child = pivot;
        pivot = tree.parent(pivot);
    }
    (best, visited)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::Aabb;
    use crate::optimize::simd_box::SimdBox;

    /// A balanced tree in the order of a heap.
    struct Heap(Vec<Aabb>);

    impl LinkedNodes for Heap {
        type Bounds = SimdBox;

        fn parent(&self, node: u32) -> u32 {
            if node == 0 { NONE } else { (node - 1) / 2 }
        }

        fn sibling(&self, node: u32) -> u32 {
            ((node - 1) ^ 1) + 1
        }

        fn children(&self, node: u32) -> Option<[u32; 2]> {
            Some([2 * node + 1, 2 * node + 2]).filter(|pair| (pair[1] as usize) < self.0.len())
        }

        fn bounds(&self, node: u32) -> SimdBox {
            SimdBox::new(&self.0[node as usize])
        }
    }

    /// A tree over `1 << depth` boxes of many sizes around one point.
    fn boxes_around_one_point(depth: u32) -> Heap {
        let first_leaf = (1 << depth) - 1;
        let mut boxes: Vec<Aabb> = (0..first_leaf + (1 << depth))
            .map(|index: u32| {
                let number = |factor: u32| 1.0 + (index.wrapping_mul(factor) >> 16) as f32 / 65536.0;
                let half = Vec3::new(number(2_654_435_761), number(2_246_822_519), number(3_266_489_917));
                Aabb { min: -half, max: half }
            })
            .collect();
        for index in (0..first_leaf as usize).rev() {
            boxes[index] = boxes[2 * index + 1].union(&boxes[2 * index + 2]);
        }
        Heap(boxes)
    }

    #[test]
    fn a_search_among_containers_at_one_place_is_bounded() {
        const MAX_VISITS: u32 = 1 << 10;
        let tree = boxes_around_one_point(13);
        let count = tree.0.len() as u32;
        let searches: Vec<(Move, u32)> =
            (3..count).step_by(61).map(|node| search(&tree, node, 0.0, MAX_VISITS, &mut Vec::new())).collect();
        let longest = searches.iter().map(|(_, visited)| *visited).max();
        assert_eq!(longest, Some(MAX_VISITS), "without a limit, some would visit most of {count} nodes");
        assert!(searches.iter().any(|(best, visited)| *visited == MAX_VISITS && best.target != NONE));
    }
}
