//! Search for the best new position of a subtree (Meister, Bittner, 2018).

use crate::optimize::reinsert::linked_tree::{LinkedTree, NONE, SimdBox, sibling};

/// A subtree and its new position.
#[derive(Debug, Clone, Copy)]
pub struct Move {
    /// Reduction of the summed area of interior nodes.
    pub gain: f32,
    /// Index of the root of the subtree.
    pub node: u32,
    /// The new sibling.
    pub target: u32,
}

impl LinkedTree<'_> {
    /// The best new position of `node`, if any is better than the present one: branch and bound over the siblings of
    /// its ancestors and everything below them.
    pub fn find_move(&self, node: u32, stack: &mut Vec<(f32, u32)>) -> Option<Move> {
        let bounds = self.bounds(node);
        let area = bounds.half_area();
        let parent = self.parent(node);
        let mut best = Move { gain: 0.0, node, target: NONE };
        // Gain of removing the node: its parent vanishes, and all ancestors shrink.
        let mut freed = self.bounds(parent).half_area();
        let mut remaining = SimdBox::EMPTY;
        let (mut pivot, mut pivot_child) = (parent, node);
        while pivot != NONE {
            let other = sibling(pivot_child);
            stack.push((freed, other));
            // Gain before the cost of the new parent, on the way down to a node.
            while let Some((freed_below, index)) = stack.pop() {
                // The new parent is at least as large as the node.
                if freed_below - area <= best.gain {
                    continue;
                }
                let target = &self.nodes[index as usize];
                let target_bounds = SimdBox::new(&target.container);
                let gain = freed_below - target_bounds.union(&bounds).half_area();
                let is_current_position = pivot_child == node && index == other;
                if gain > best.gain && !is_current_position {
                    (best.gain, best.target) = (gain, index);
                }
                // Further down, the target grows around the node.
                let freed_below = gain + target_bounds.half_area();
                if !target.is_leaf() && freed_below - area > best.gain {
                    stack.extend([(freed_below, target.first + 1), (freed_below, target.first)]);
                }
            }
            if pivot == parent {
                remaining = self.bounds(other);
            } else {
                remaining = remaining.union(&self.bounds(other));
                freed += self.bounds(pivot).half_area() - remaining.half_area();
            }
            pivot_child = pivot;
            pivot = self.parent(pivot);
        }
        (best.target != NONE).then_some(best)
    }
}
