//! Which nodes of a table are drawn: those that depth range and filters choose, or the largest of them if they exceed the budget.

use std::collections::BinaryHeap;
use std::ops::Range;

use rayon::prelude::*;

use super::table::{NodeTable, area};
use crate::overlay::node::OverlayNode;
use crate::overlay::selection::Selection;
use crate::overlay::settings::OverlaySettings;
use bvhscope_engine::tree::Node;
use bvhscope_engine::with_tree;

/// The nodes of a table that are drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shown {
    /// Node indices, at most `budget` of them.
    pub nodes: Vec<u32>,
    /// Depth of each node; the root's is 0.
    pub depths: Vec<u32>,
    /// Number of nodes that depth range and filters choose, before the budget cuts them.
    pub wanted: usize,
}

impl NodeTable {
    /// The instance data of the shown nodes, computed in parallel.
    pub fn instances(&self, shown: &Shown, settings: &OverlaySettings) -> Vec<OverlayNode> {
        let nodes = shown.nodes.par_iter().with_min_len(1_024).zip(&shown.depths);
        nodes.map(|(&node, &depth)| self.instance(node, depth, settings)).collect()
    }

    /// The number of nodes that [`NodeTable::shown`] would list, and the number before the budget cuts them. Computed from the
    /// sizes of the levels, without visiting nodes.
    pub fn count(&self, settings: &OverlaySettings, selection: &Selection) -> (usize, usize) {
        if self.is_empty() {
            return (0, 0);
        }
        let (first, [from, last]) = self.depths(settings);
        let hidden = selection.hidden.iter().filter(|&&node| {
            let depth = if (node as usize) < self.len() { self.depth(node) } else { u32::MAX };
            (from..=last).contains(&depth) && (!settings.leaves_only || depth < first || self.is_leaf(node))
        });
        let wanted = self.wanted(settings) - hidden.count();
        (wanted.min(settings.budget as usize), wanted)
    }

    /// Number of nodes that `settings` choose, hidden ones included.
    pub(super) fn wanted(&self, settings: &OverlaySettings) -> usize {
        let (first, [from, last]) = self.depths(settings);
        let in_all = |depth: u32| self.levels.ranges.get(depth as usize).map_or(0, ExactSizeIterator::len);
        // Each interior node has two children on the next level.
        let of_interest = |depth: u32| {
            let interior = if settings.leaves_only && depth >= first { in_all(depth + 1) / 2 } else { 0 };
            in_all(depth) - interior
        };
        (from..=last).map(of_interest).sum()
    }

    /// Whether the budget is so small a part of the `wanted` nodes that a best-first walk from the first depth finds them faster.
    pub(super) fn is_cut_from_the_top(&self, settings: &OverlaySettings, wanted: usize) -> bool {
        let (_, [from, last]) = self.depths(settings);
        let run = self.levels.ranges[last as usize].end - self.levels.ranges[from as usize].start;
        let budget = settings.budget as usize;
        wanted > budget && !settings.leaves_only && budget < run as usize / FEW
    }

    /// The first depth of the range, and the first and last depth drawn (which includes the parents if these are shown).
    pub(super) fn depths(&self, settings: &OverlaySettings) -> (u32, [u32; 2]) {
        let [a, b] = settings.depth.map(|depth| depth.min(self.max_depth()));
        (a.min(b), [if settings.parents { 0 } else { a.min(b) }, a.max(b)])
    }

    /// The nodes that `settings` choose without the hidden ones; if they exceed the budget, the largest, ordered by area. The
    /// selected and hovered nodes are drawn separately, see [`highlighted`](crate::overlay::highlighted).
    pub fn shown(&self, settings: &OverlaySettings, selection: &Selection) -> Shown {
        if self.is_empty() {
            return Shown { nodes: Vec::new(), depths: Vec::new(), wanted: 0 };
        }
        let (_, wanted) = self.count(settings, selection);
        let ranges = &self.levels.ranges;
        let (first, [from, last]) = self.depths(settings);
        // The list is ordered by depth, so a range of depths is one range of slots.
        let run = ranges[from as usize].start..ranges[last as usize].end;
        let budget = settings.budget as usize;
        if self.is_cut_from_the_top(settings, wanted) {
            let [nodes, depths] = self.largest_from_the_top([from, last], selection, budget);
            return Shown { nodes, depths, wanted };
        }
        let nodes = self.by_depth(run.end);
        let chosen = ranges[first as usize].start;
        let kept = |place: &u32| {
            let node = nodes[*place as usize];
            // "Leaves only" applies to the depth range; parents above it are shown for context.
            let leaf = !settings.leaves_only || *place < chosen || self.is_leaf(node);
            leaf && !selection.hidden.contains(&node)
        };
        let places = if wanted > budget {
            self.largest(nodes, run, kept, budget)
        } else if settings.leaves_only || !selection.hidden.is_empty() {
            run.into_par_iter().with_min_len(4_096).filter(kept).collect()
        } else {
            run.collect()
        };
        let depths = places.iter().map(|&place| ranges.partition_point(|range| range.end <= place) as u32).collect();
        Shown { nodes: places.into_iter().map(|place| nodes[place as usize]).collect(), depths, wanted }
    }

    /// Slots of the `budget` largest among the kept `nodes` of `run`: largest first, ties in list order.
    fn largest(
        &self,
        nodes: &[u32],
        run: Range<u32>,
        kept: impl Fn(&u32) -> bool + Send + Sync,
        budget: usize,
    ) -> Vec<u32> {
        let mut keys: Vec<u64> = with_tree!(&self.accel.tree, tree => {
            let keyed = |place: u32| key(area(tree, nodes[place as usize]), place);
            run.into_par_iter().with_min_len(4_096).filter(kept).map(keyed).collect()
        });
        if budget > 0 && budget < keys.len() {
            keys.select_nth_unstable_by(budget, |a, b| b.cmp(a));
        }
        keys.truncate(budget);
        keys.par_sort_unstable_by(|a, b| b.cmp(a));
        keys.into_iter().map(|key| !(key as u32)).collect()
    }

    /// The same by a best-first walk from the first depth: no container is larger than its parent's, so only that level and the
    /// nodes drawn are visited. Returns node indices and depths; ties are ordered by index.
    fn largest_from_the_top(&self, [from, last]: [u32; 2], selection: &Selection, budget: usize) -> [Vec<u32>; 2] {
        with_tree!(&self.accel.tree, tree => {
            let Range { start, end } = self.levels.ranges[from as usize].clone();
            let top = &self.by_depth(end)[start as usize..end as usize];
            let top: Vec<_> = top.par_iter().with_min_len(4_096).map(|&node| (key(area(tree, node), node), from)).collect();
            let mut open = BinaryHeap::from(top);
            let (mut nodes, mut depths) = (Vec::with_capacity(budget), Vec::with_capacity(budget));
            while nodes.len() < budget
                && let Some((found, depth)) = open.pop()
            {
                let node = !(found as u32);
                if !selection.hidden.contains(&node) {
                    nodes.push(node);
                    depths.push(depth);
                }
                let Node { first, .. } = tree.nodes[node as usize];
                if depth < last && !tree.nodes[node as usize].is_leaf() {
                    // Rounding may make a sphere slightly larger than its parent's.
                    let around = f32::from_bits((found >> 32) as u32);
                    open.extend([first, first + 1].map(|child| (key(area(tree, child).min(around), child), depth + 1)));
                }
            }
            [nodes, depths]
        })
    }
}

/// A best-first walk pays off if the budget is at most one in this many of the chosen nodes.
const FEW: usize = 8;

/// Sort key: by area, then lower numbers first. The bits of non-negative floats order like the floats.
fn key(area: f32, number: u32) -> u64 {
    u64::from(area.to_bits()) << 32 | u64::from(!number)
}
