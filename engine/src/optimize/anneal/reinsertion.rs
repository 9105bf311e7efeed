//! One round of reinsertion: every subtree, by falling area, to its best position, even where that costs a little more.

use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::kernel::mix::next_unit;
use crate::optimize::anneal::free_tree::FreeTree;
use crate::optimize::move_search::{LinkedNodes, Move, NONE, find_move};
use crate::order::radix_sort;

/// Maximum number of nodes that one search visits.
const MAX_VISITS: u32 = 1 << 12;
/// Smallest gain that is worth a move without a temperature, as a fraction of the subtree's area: less is rounding.
const MIN_GAIN: f32 = 1e-7;
/// The mean of a geometric number of steps and a uniform part of one is 3/2.
const MEAN_STEP: f64 = 2.0 / 3.0;
/// Poll for cancellation every 256 subtrees.
const SUBTREES_BETWEEN_CHECKS: usize = 256;

/// Moves subtrees of `tree`. With each move the cost may rise by a random amount of the mean `temperature`, times the fourth root
/// of the subtree's area over that of the average one; at temperature 0 it falls. `random` is the state of the generator.
pub fn reinsertion_round(
    tree: &mut FreeTree,
    temperature: f64,
    random: &mut u64,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let (order, average_area) = by_falling_area(tree, token)?;
    let mut stack = Vec::new();
    for (at, &node) in order.iter().enumerate() {
        token.check_every(SUBTREES_BETWEEN_CHECKS, at)?;
        // An earlier move may have put it below the root.
        if !tree.is_movable(node) {
            continue;
        }
        let area = tree.bounds(node).half_area();
        let allowance = if temperature > 0.0 {
            temperature * (f64::from(area) / average_area).sqrt().sqrt() * exponential(random)
        } else {
            0.0
        };
        let min_gain = if allowance > 0.0 { -allowance as f32 } else { MIN_GAIN * area };
        if let Some(best) = find_move(tree, node, min_gain, MAX_VISITS, &mut stack) {
            apply(tree, &best, allowance);
        }
    }
    Ok(())
}

/// The nodes that can be moved, by falling area, and their average area.
fn by_falling_area(tree: &FreeTree, token: &CancelToken) -> Result<(Vec<u32>, f64), Cancelled> {
    let (mut keys, mut sum) = (Vec::with_capacity(tree.nodes.len()), 0.0);
    for index in 0..tree.nodes.len() as u32 {
        token.check_every(LIGHT_STEPS, index as usize)?;
        if tree.is_movable(index) {
            let area = tree.bounds(index).half_area();
            sum += f64::from(area);
            // The bits of positive numbers are in their order.
            keys.push(u64::from(!area.to_bits()) << 32 | u64::from(index));
        }
    }
    radix_sort(&mut keys, u64::BITS, token)?;
    let average = sum / keys.len() as f64;
    let mut order = Vec::with_capacity(keys.len());
    for keys in keys.chunks(LIGHT_STEPS) {
        token.check()?;
        order.extend(keys.iter().map(|&key| key as u32));
    }
    Ok((order, average))
}

/// Moves the node, unless the cost of the tree would rise by `allowance` or more.
#[inline(always)]
fn apply(tree: &mut FreeTree, &Move { node, target, above, .. }: &Move, allowance: f64) {
    let before = tree.cost();
    let old = tree.detach(node);
    tree.attach(&old, target);
    // Where the target is below the old sibling, its ancestors include all that changed.
    let end = if above == old.parent { old.above } else { above };
    tree.refit_up(old.above, end);
    tree.refit_up(old.parent, NONE);
    if tree.cost() < before + allowance {
        return;
    }
    let new = tree.detach(node);
    tree.attach(&old, old.sibling);
    let end = if above == old.parent { old.parent } else { above };
    tree.refit_up(new.above, end);
    tree.refit_up(old.parent, NONE);
}

/// A random number of mean 1, nearly exponentially distributed: its density halves with every step. Not by a logarithm, which
/// differs between machines.
fn exponential(random: &mut u64) -> f64 {
    let mut steps = 0.0;
    loop {
        let number = next_unit(random);
        if number < 0.5 {
            // Uniform within the step.
            return (steps + 2.0 * number) * MEAN_STEP;
        }
        steps += 1.0;
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::builders::build_binary;
    use crate::geometry::Triangle;
    use crate::optimize::anneal::free_tree::FreeNode;
    use crate::settings::BuildSettings;
    use crate::tree::AnyTree;

    fn random_tree() -> FreeTree {
        let mut random = 3;
        let mut point = |size: f32| Vec3::from_array([(); 3].map(|()| next_unit(&mut random) as f32 * size));
        let triangles: Vec<Triangle> = (0..500)
            .map(|_| {
                let a = point(5.0);
                Triangle { a, b: a + point(1.0), c: a + point(1.0) }
            })
            .collect();
        let token = CancelToken::new();
        let Ok((AnyTree::Aabb(tree), _)) = build_binary(&triangles, &BuildSettings::default(), &token) else {
            panic!("nothing to refuse")
        };
        let Ok(free) = FreeTree::new(&tree, true, &token) else { panic!("never cancelled") };
        free
    }

    /// The nodes with their children in order, which costs nothing.
    fn sorted(tree: &FreeTree) -> Vec<FreeNode> {
        let mut nodes = tree.nodes.clone();
        for node in nodes.iter_mut().filter(|node| node.children[0] != NONE) {
            node.children.sort_unstable();
        }
        nodes
    }

    #[test]
    fn a_move_that_costs_too_much_leaves_no_trace() {
        let mut tree = random_tree();
        let before = sorted(&tree);
        let mut moves = 0;
        for node in 1..tree.nodes.len() as u32 {
            // Anywhere but where it is.
            let best = tree.is_movable(node).then(|| find_move(&tree, node, f32::NEG_INFINITY, 64, &mut Vec::new()));
            if let Some(best) = best.flatten() {
                apply(&mut tree, &best, f64::NEG_INFINITY);
                moves += 1;
            }
        }
        assert!(moves > 900, "{moves}");
        for (node, old) in sorted(&tree).iter().zip(&before) {
            assert!((node.cost - old.cost).abs() <= 1e-9 * old.cost);
            assert_eq!(FreeNode { cost: old.cost, ..*node }, *old);
        }
    }

    #[test]
    fn what_a_round_leaves_is_a_tree_with_the_cost_that_it_says() {
        for temperature in [0.0, 1.0, 1e3] {
            let mut tree = random_tree();
            let before = tree.cost();
            let mut random = 1;
            for _ in 0..3 {
                assert!(reinsertion_round(&mut tree, temperature, &mut random, &CancelToken::new()).is_ok());
            }
            assert!(temperature > 0.0 || tree.cost() < 0.98 * before, "{before} to {}", tree.cost());
            let Ok(order) = tree.bottom_up(&CancelToken::new()) else { panic!("never cancelled") };
            assert_eq!(order.len(), tree.nodes.len(), "each node is reached once");
            let nodes = tree.nodes.clone();
            for index in order {
                tree.refit(index);
            }
            for (index, (new, old)) in (0..).zip(tree.nodes.iter().zip(&nodes)) {
                assert_eq!(new, old, "node {index} was fitted");
                for child in tree.children(index).into_iter().flatten() {
                    assert_eq!(tree.parent(child), index);
                }
            }
        }
    }

    #[test]
    fn allowances_have_the_mean_1_and_a_long_tail() {
        let mut random = 5;
        let numbers: Vec<f64> = (0..100_000).map(|_| exponential(&mut random)).collect();
        let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
        assert!((mean - 1.0).abs() < 0.02, "{mean}");
        // Of an exponential distribution 5 % are above 3.
        let above = numbers.iter().filter(|&&number| number > 3.0).count();
        assert!((3_000..7_000).contains(&above), "{above}");
        assert!(numbers.iter().all(|&number| number >= 0.0));
    }
}
