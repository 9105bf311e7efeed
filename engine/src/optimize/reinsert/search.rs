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

/// Maximum number of nodes that one search visits: where containers coincide, nothing else bounds a
/// search. On architecture, from median splits, the longest visits some hundred.
const MAX_VISITS: u32 = 1 << 10;

impl LinkedTree<'_> {
    /// The best new position of `node`, if any is better than the present one: branch and bound over the siblings of
    /// its ancestors and everything below them, up to [`MAX_VISITS`] nodes.
    pub fn find_move(&self, node: u32, stack: &mut Vec<(f32, u32)>) -> Option<Move> {
        let (best, _) = self.search(node, stack);
        (best.target != NONE).then_some(best)
    }

    /// The best move of `node`, to [`NONE`] if there is none, and the number of nodes visited.
    fn search(&self, node: u32, stack: &mut Vec<(f32, u32)>) -> (Move, u32) {
        let bounds = self.bounds(node);
        let area = bounds.half_area();
        let parent = self.parent(node);
        let mut best = Move { gain: 0.0, node, target: NONE };
        // Gain of removing the node: its parent vanishes, and all ancestors shrink.
        let mut freed = self.bounds(parent).half_area();
        let mut remaining = SimdBox::EMPTY;
        let (mut pivot, mut pivot_child) = (parent, node);
        let mut visited = 0;
        while pivot != NONE && visited < MAX_VISITS {
            let other = sibling(pivot_child);
            stack.push((freed, other));
            // Gain before the cost of the new parent, on the way down to a node.
            while let Some((freed_below, index)) = stack.pop() {
                // The new parent is at least as large as the node.
                if freed_below - area <= best.gain || visited == MAX_VISITS {
                    continue;
                }
                visited += 1;
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
        (best, visited)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::cancel::CancelToken;
    use crate::geometry::Aabb;
    use crate::tree::Node;

    /// A balanced tree over `1 << depth` boxes of many sizes around one point.
    fn boxes_around_one_point(depth: u32) -> Vec<Node<Aabb>> {
        let first_leaf = (1 << depth) - 1;
        let mut nodes: Vec<Node<Aabb>> = (0..first_leaf + (1 << depth))
            .map(|index: u32| {
                let number = |factor: u32| 1.0 + (index.wrapping_mul(factor) >> 16) as f32 / 65536.0;
                let half = Vec3::new(number(2_654_435_761), number(2_246_822_519), number(3_266_489_917));
                let is_leaf = index >= first_leaf;
                let first = if is_leaf { index - first_leaf } else { 2 * index + 1 };
                Node { container: Aabb { min: -half, max: half }, first, count: u32::from(is_leaf) }
            })
            .collect();
        for index in (0..first_leaf as usize).rev() {
            nodes[index].container = nodes[2 * index + 1].container.union(&nodes[2 * index + 2].container);
        }
        nodes
    }

    #[test]
    fn a_search_among_containers_at_one_place_is_bounded() {
        let mut nodes = boxes_around_one_point(13);
        let count = nodes.len() as u32;
        let Ok(tree) = LinkedTree::new(&mut nodes, &CancelToken::new()) else { panic!("never cancelled") };
        let searches: Vec<(Move, u32)> =
            (1..count).step_by(61).map(|node| tree.search(node, &mut Vec::new())).collect();
        let longest = searches.iter().map(|(_, visited)| *visited).max();
        assert_eq!(longest, Some(MAX_VISITS), "without a limit, some would visit most of {count} nodes");
        assert!(searches.iter().any(|(best, visited)| *visited == MAX_VISITS && best.target != NONE));
    }
}
