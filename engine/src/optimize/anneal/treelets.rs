//! One round of treelet restructuring: the best of all topologies over the few largest subtrees below each node, bottom-up
//! (Karras, Aila, *Fast Parallel Construction of High-Quality Bounding Volume Hierarchies*, 2013, section 3).

use crate::cancel::{CancelToken, Cancelled};
use crate::optimize::anneal::free_tree::FreeTree;
use crate::optimize::divisions::cheapest_division;
use crate::optimize::move_search::LinkedNodes;
use crate::optimize::simd_box::SimdBox;

/// Maximum number of subtrees that a treelet joins; the work grows threefold with each.
const TREELET_LEAVES: usize = 8;
/// Number of sets of them.
const SUBSETS: usize = 1 << TREELET_LEAVES;
/// Minimum gain of a topology, as a fraction of the cost: less is rounding.
const MIN_GAIN: f64 = 1e-5;
/// Poll for cancellation every 256 treelets.
const TREELETS_BETWEEN_CHECKS: usize = 256;

/// The best subtree over a set of a treelet's leaves.
#[derive(Clone, Copy)]
struct Best {
    bounds: SimdBox,
    cost: f32,
    count: u32,
    /// One of the two sets that it divides into.
    part: usize,
}

/// Replaces treelets of `tree` by their best topologies where that lowers the cost.
pub fn treelet_round(tree: &mut FreeTree, token: &CancelToken) -> Result<(), Cancelled> {
    let mut best = [Best { bounds: SimdBox::EMPTY, cost: 0.0, count: 0, part: 0 }; SUBSETS];
    for (at, &root) in tree.bottom_up(token)?.iter().enumerate() {
        token.check_every(TREELETS_BETWEEN_CHECKS, at)?;
        // Those below may have changed.
        tree.refit(root);
        restructure(tree, root, &mut best);
    }
    Ok(())
}

/// Gives the treelet under `root` its best topology.
fn restructure(tree: &mut FreeTree, root: u32, best: &mut [Best; SUBSETS]) {
    let Some(pair) = tree.children(root) else { return };
    let (mut leaves, mut interior) = (pair.to_vec(), Vec::new());
    while leaves.len() < TREELET_LEAVES {
        let expandable = (0..leaves.len()).filter(|&at| !tree.is_leaf(leaves[at]));
        let area = |at: usize| tree.bounds(leaves[at]).half_area();
        let Some(largest) = expandable.max_by(|&a, &b| area(a).total_cmp(&area(b)).then(b.cmp(&a))) else { break };
        let expanded = leaves.swap_remove(largest);
        leaves.extend(tree.nodes[expanded as usize].children);
        interior.push(expanded);
    }
    if leaves.len() < 3 {
        return;
    }
    let all = (1 << leaves.len()) - 1;
    for set in 1..=all {
        best[set] = best_of(tree, &leaves, set, best);
    }
    if f64::from(best[all].cost) >= tree.nodes[root as usize].cost * (1.0 - MIN_GAIN) {
        return;
    }
    // A treelet of n leaves has n − 1 interior nodes in any topology.
    let (mut stack, mut order, mut used) = (vec![(all, root)], Vec::new(), 0);
    while let Some((set, node)) = stack.pop() {
        order.push(node);
        let parts = [best[set].part, set & !best[set].part];
        let children = parts.map(|part| {
            if part.is_power_of_two() {
                return leaves[part.trailing_zeros() as usize];
            }
            let node = interior[used];
            used += 1;
            stack.push((part, node));
            node
        });
        tree.link(node, children);
    }
    for &node in order.iter().rev() {
        tree.refit(node);
    }
}

/// The best subtree over the `leaves` in `set`, from those over its subsets.
#[inline(always)]
fn best_of(tree: &FreeTree, leaves: &[u32], set: usize, best: &[Best; SUBSETS]) -> Best {
    let first = &tree.nodes[leaves[set.trailing_zeros() as usize] as usize];
    // All but the first.
    let rest = set & (set - 1);
    if rest == 0 {
        return Best { bounds: first.bounds, cost: first.cost as f32, count: first.count, part: 0 };
    }
    let bounds = best[rest].bounds.union(&first.bounds);
    let count = best[rest].count + first.count;
    let (least, part) = cheapest_division(set, |part| best[part].cost);
    Best { bounds, cost: tree.subtree_cost(&bounds, count, f64::from(least)) as f32, count, part }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::cancel::CancelToken;
    use crate::geometry::Aabb;
    use crate::kernel::mix::next_unit;
    use crate::tree::{Node, Tree};

    /// A list of `count` random boxes: each node has one as its first child.
    fn list(count: u32, random: &mut u64) -> Tree<Aabb> {
        let mut point = || Vec3::from_array([(); 3].map(|()| next_unit(random) as f32));
        let boxes: Vec<Aabb> = (0..count)
            .map(|_| {
                let (corner, size) = (point() * 4.0, point());
                Aabb { min: corner, max: corner + size }
            })
            .collect();
        let mut nodes = Vec::new();
        for at in 0..count as usize - 1 {
            let rest = boxes[at..].iter().fold(Aabb::EMPTY, |all, container| all.union(container));
            let inner = Node { container: rest, first: 2 * at as u32 + 1, count: 0 };
            match nodes.last_mut() {
                Some(last) => *last = inner,
                None => nodes.push(inner),
            }
            let leaf = |at: usize| Node { container: boxes[at], first: at as u32, count: 1 };
            nodes.extend([leaf(at), leaf(at + 1)]);
        }
        Tree { nodes, primitive_indices: (0..count).collect(), max_depth: count - 1 }
    }

    /// The least cost of all trees over `boxes`, by trying each.
    fn least(boxes: &[SimdBox]) -> f64 {
        let all = boxes.iter().fold(SimdBox::EMPTY, |all, one| all.union(one));
        if boxes.len() == 1 {
            return f64::from(all.half_area());
        }
        let divisions = 1..(1_usize << (boxes.len() - 1));
        let cost_of = |set: usize| {
            let part = |of: usize| -> Vec<SimdBox> {
                (0..boxes.len()).filter(|at| set >> at & 1 == of).map(|at| boxes[at]).collect()
            };
            least(&part(0)) + least(&part(1))
        };
        f64::from(all.half_area()) + divisions.map(cost_of).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn a_treelet_becomes_the_best_of_all_its_topologies() -> Result<(), Cancelled> {
        let mut random = 7;
        for count in [3, 4, 5, 6, 7] {
            for _ in 0..10 {
                let tree = list(count, &mut random);
                let leaves: Vec<SimdBox> =
                    tree.nodes.iter().filter(|node| node.is_leaf()).map(|node| SimdBox::new(&node.container)).collect();
                assert_eq!(leaves.len(), count as usize);
                let mut free = FreeTree::new(&tree, false, &CancelToken::new())?;
                treelet_round(&mut free, &CancelToken::new())?;
                let (found, best) = (free.cost(), least(&leaves));
                assert!((found - best).abs() <= 2.0 * MIN_GAIN * best, "{count} leaves: {found} instead of {best}");
            }
        }
        Ok(())
    }
}
