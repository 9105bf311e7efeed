//! A tree by depth: how many nodes there are, how large they are, what they cost, and how often rays visit them.

use std::collections::BTreeMap;

use serde::Serialize;

use super::population::Population;
use crate::accel::Accel;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::tree::node_metrics::{area_share, empty_space, sah_share};
use bvhscope_engine::tree::{Container, Tree};
use bvhscope_engine::with_tree;

/// Nodes between two cancellation checks.
const CHECK_EVERY: usize = 1 << 14;

/// The nodes of one depth. Field names are the JSON names.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Depth {
    /// The depth; the root's is 0.
    pub depth: u32,
    /// Number of nodes, leaves included.
    pub nodes: u32,
    /// Number of leaves.
    pub leaves: u32,
    /// Sum of their surface areas over the root's: the expected visits by a random line that meets the root.
    pub area: f64,
    /// Their part of the SAH cost.
    pub sah_cost: f64,
    /// Empty space of the interior nodes, on average by area; absent where all nodes are leaves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub empty_space: Option<f64>,
    /// Visits by the rays of each population that was asked for.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub visits: BTreeMap<&'static str, u64>,
    /// Part of `area` that interior nodes have.
    #[serde(skip)]
    pub(super) interior_area: f64,
}

impl Depth {
    /// The nodes of both, at the depth of `self`.
    #[must_use]
    pub fn with(mut self, other: &Self) -> Self {
        let weighted = |of: &Self| of.empty_space.map(|empty| empty * of.interior_area);
        let empty = [weighted(&self), weighted(other)].into_iter().flatten().reduce(|a, b| a + b);
        self.interior_area += other.interior_area;
        self.empty_space = empty.map(|empty| mean(empty, self.interior_area));
        self.nodes += other.nodes;
        self.leaves += other.leaves;
        self.area += other.area;
        self.sah_cost += other.sah_cost;
        for (&name, visits) in &other.visits {
            *self.visits.entry(name).or_default() += visits;
        }
        self
    }
}

/// `sum` over `weight`; 0 where there is none.
fn mean(sum: f64, weight: f64) -> f64 {
    if weight > 0.0 { sum / weight } else { 0.0 }
}

/// The nodes of the tree of `accel` at each depth, with their visits by the rays of `populations`.
pub fn by_depth<'a>(
    accel: &Accel,
    populations: impl IntoIterator<Item = (Population, &'a [u32])>,
    token: &CancelToken,
) -> Result<Vec<Depth>, Cancelled> {
    let (mut found, depths) = with_tree!(&accel.tree, tree => {
        let depths = tree.depths(token)?;
        (of_tree(tree, accel, &depths, token)?, depths)
    });
    for (population, visits) in populations {
        for (index, (&depth, &count)) in depths.iter().zip(visits).enumerate() {
            token.check_every(CHECK_EVERY, index)?;
            *found[depth as usize].visits.entry(population.name()).or_default() += u64::from(count);
        }
    }
    Ok(found)
}

fn of_tree<C: Container>(
    tree: &Tree<C>,
    accel: &Accel,
    depths: &[u32],
    token: &CancelToken,
) -> Result<Vec<Depth>, Cancelled> {
    let stats = &accel.report.stats;
    let deepest = depths.iter().max().map_or(0, |depth| depth + 1);
    let mut found: Vec<Depth> = (0..deepest).map(|depth| Depth { depth, ..Depth::default() }).collect();
    for (index, (node, &depth)) in (0_u32..).zip(tree.nodes.iter().zip(depths)) {
        token.check_every(CHECK_EVERY, index as usize)?;
        let of = &mut found[depth as usize];
        let area = f64::from(area_share(tree, index));
        of.nodes += 1;
        of.leaves += u32::from(node.is_leaf());
        of.area += area;
        of.sah_cost += f64::from(sah_share(tree, index, stats)) * f64::from(stats.sah_cost);
        if let Some(empty) = empty_space(tree, index) {
            // A sum until all nodes are known.
            *of.empty_space.get_or_insert_default() += f64::from(empty) * area;
            of.interior_area += area;
        }
    }
    for of in &mut found {
        of.empty_space = of.empty_space.map(|sum| mean(sum, of.interior_area));
    }
    Ok(found)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::lab::sample::teapot;
    use bvhscope_engine::settings::BuildSettings;

    #[test]
    fn depths_sum_to_the_numbers_of_the_tree() {
        let (scene, token) = (teapot(), CancelToken::new());
        let accel = Accel::build(&scene, &BuildSettings::default(), &token).unwrap();
        let visits: Vec<u32> = (0..accel.tree.node_count() as u32).collect();
        let found = by_depth(&accel, [(Population::Random, &visits[..])], &token).unwrap();
        let stats = &accel.report.stats;
        let nodes: Vec<u32> = found.iter().map(|depth| depth.nodes).collect();
        assert_eq!(nodes, stats.nodes_per_depth);
        let all = found[1..].iter().fold(found[0].clone(), Depth::with);
        assert_eq!(all.leaves as usize, stats.leaves);
        assert!(
            (all.sah_cost / f64::from(stats.sah_cost) - 1.0).abs() < 1e-5,
            "{} of {}",
            all.sah_cost,
            stats.sah_cost
        );
        assert_eq!(all.visits[Population::Random.name()], visits.iter().map(|&count| u64::from(count)).sum::<u64>());
        // Of an interior node with two children the empty part is 1 less half of what these fill.
        let interior = all.interior_area;
        let of_children = all.area - found[0].area;
        assert!((all.empty_space.unwrap() - (1.0 - of_children / 2.0 / interior)).abs() < 1e-4, "{all:?}");
        assert!(found.last().unwrap().empty_space.is_none(), "only leaves");
    }
}
