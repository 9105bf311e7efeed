//! Simulated annealing: rounds of reinsertion that may raise the cost at first, each followed by merging of split triangles and
//! optimal treelets, which only lower it. Takes hundreds of times as long as reinsertion alone, and ends at trees that it cannot
//! reach. One thread: every move sees the exact cost of the whole tree after those before it.
//!
//! Annealing of agglomerative trees is our own; its moves are those of Meister and Bittner, *Parallel Reinsertion for Bounding
//! Volume Hierarchy Optimization*, 2018, and the treelets those of Karras and Aila, *Fast Parallel Construction of High-Quality
//! Bounding Volume Hierarchies*, 2013.

mod free_tree;
mod merging;
mod reinsertion;
mod treelets;

use std::time::{Duration, Instant};

use free_tree::FreeTree;
use merging::{References, merging_round};
use reinsertion::reinsertion_round;
use treelets::treelet_round;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;
use crate::tree::Tree;
use crate::tree::statistics::normalized_cost;

/// Temperature of the first round, as a multiple of the average cost of a node. From 10 to 100 scans cost the same within 0.3 %. Were
/// all subtrees allowed the same, Sponza would cost 3 % more; in proportion to their areas, bunny 0.6 % more.
const FIRST_TEMPERATURE: f64 = 40.0;
/// Number of rounds at the end without a temperature.
const COLD_ROUNDS: u32 = 4;
/// Number of equal parts of a build's progress, all but the first of which are annealing.
pub const ANNEALING_PARTS: usize = 50;

/// Anneals `tree` in `rounds` rounds. `source` is the triangle that a primitive is a part of, where some are split. With
/// `collapses`, costs are those of the tree with its best leaves, which are not made. Returns the cost, not normalised, and the
/// normalised cost after each round with the time since the beginning.
pub fn anneal(
    tree: &mut Tree<Aabb>,
    source: Option<&dyn Fn(u32) -> u32>,
    rounds: u32,
    collapses: bool,
    token: &CancelToken,
) -> Result<(f64, Vec<(Duration, f64)>), Cancelled> {
    let start = Instant::now();
    let root_area = f64::from(tree.nodes[0].container.half_area());
    let mut free = FreeTree::new(tree, collapses, token)?;
    let references = source.map(|source| References::new(&free, &tree.primitive_indices, source, token));
    let mut references = references.transpose()?;
    let average_cost = free.cost() / tree.nodes.len() as f64;
    let hot_rounds = rounds.saturating_sub(COLD_ROUNDS);
    let mut random = 0;
    let initial_cost = free.cost();
    let mut convergence = Vec::new();
    let mut report = |cost: f64, finished: f32| {
        let point = (start.elapsed(), normalized_cost(cost, root_area));
        convergence.push(point);
        token.report_cost(point);
        let before = 1.0 / ANNEALING_PARTS as f32;
        token.set_progress(before + (1.0 - before) * finished);
    };
    report(initial_cost, 0.0);
    for round in 0..rounds {
        let mut temperature = 0.0;
        if round < hot_rounds {
            let heat = 1.0 - f64::from(round) / f64::from(hot_rounds);
            temperature = FIRST_TEMPERATURE * average_cost * heat * heat;
        }
        reinsertion_round(&mut free, temperature, &mut random, token)?;
        if let Some(references) = &mut references {
            merging_round(&mut free, references, token)?;
        }
        treelet_round(&mut free, token)?;
        report(free.cost(), (round + 1) as f32 / rounds as f32);
    }
    // Too few rounds to cool down from where the first led.
    if free.cost() > initial_cost {
        return Ok((initial_cost, convergence));
    }
    *tree = free.to_tree(&tree.primitive_indices, token)?;
    Ok((free.cost(), convergence))
}
