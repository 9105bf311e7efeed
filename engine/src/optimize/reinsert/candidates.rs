//! Selection of the subtrees that are worth moving.

use std::collections::VecDeque;

use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::par_tasks;
use crate::optimize::move_search::LinkedNodes;
use crate::optimize::reinsert::linked_tree::LinkedTree;
use crate::optimize::simd_box::{Bounds as _, NodeBounds};

/// Number of nodes that are scored sequentially before the subtrees below are scored in parallel.
const TOP_NODES: usize = 256;
/// Number of scores or areas sampled to estimate the threshold of the best.
const SAMPLES: usize = 4096;

impl<B: NodeBounds> LinkedTree<'_, B> {
    /// The `max_count` nodes with the most inefficient parents, out of those whose parents have an area of at least
    /// `min_area`, and are roughly among the `max_count` largest.
    pub fn eligible(&self, max_count: usize, min_area: f32, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
        let min_area = min_area.max(self.area_of_rank(max_count));
        // The root's children could only move below each other.
        let root = &self.nodes[0];
        let mut queue = VecDeque::from(if root.is_leaf() { Vec::new() } else { vec![root.first, root.first + 1] });
        let mut scored: Vec<(f32, u32)> = Vec::new();
        // A few nodes at the top sequentially, then everything below in parallel.
        for _ in 0..TOP_NODES {
            let Some(index) = queue.pop_front() else { break };
            queue.extend(self.score(index, min_area, &mut scored).into_iter().flatten());
        }
        let mut lists = par_tasks(queue, token, |top, _| {
            // Breadth first, so that loads do not depend on one another.
            let (mut scored, mut queue, mut next) = (Vec::new(), vec![top], 0);
            while let Some(&index) = queue.get(next) {
                queue.extend(self.score(index, min_area, &mut scored).into_iter().flatten());
                next += 1;
            }
            Ok(scored)
        })?;
        token.check()?;
        lists.push(scored);
        Ok(best(prefilter(&lists, max_count), max_count))
    }

    /// The positions in `eligible` of the `max_count` nodes whose parents are the most inefficient now, times `weights`.
    pub fn candidates(&self, eligible: &[u32], weights: &[f32], max_count: usize) -> Vec<u32> {
        let scored = eligible.par_iter().zip(weights).zip(0..eligible.len() as u32);
        let scored = scored.map(|((&node, weight), at)| (self.inefficiency(self.parent(node)) * weight, at)).collect();
        best(scored, max_count)
    }

    /// The area of the interior node that `rank` others exceed, estimated from a sample; 0 if there are fewer.
    fn area_of_rank(&self, rank: usize) -> f32 {
        let step = (self.nodes.len() / SAMPLES).max(1);
        let interior = self.nodes.iter().step_by(step).filter(|node| !node.is_leaf());
        let mut areas: Vec<f32> = interior.map(|node| node.container.mean_half_area()).collect();
        let rank = rank / step;
        if rank >= areas.len() {
            return 0.0;
        }
        *areas.select_nth_unstable_by(rank, |a, b| b.total_cmp(a)).1
    }

    /// Scores the children of node `index`, if its area is large enough, and returns them.
    #[inline(always)]
    fn score(&self, index: u32, min_area: f32, scored: &mut Vec<(f32, u32)>) -> Option<[u32; 2]> {
        let node = &self.nodes[index as usize];
        if node.is_leaf() || node.container.mean_half_area() < min_area {
            return None;
        }
        let pair = [node.first, node.first + 1];
        let inefficiency = self.inefficiency(index);
        if inefficiency > 0.0 {
            scored.extend(pair.map(|child| (inefficiency, child)));
        }
        Some(pair)
    }

    /// Inefficiency of the interior node `index`: the product of its area and the ratios of its area to the mean and to
    /// the smallest area of its children, up to a constant factor (Bittner, Hapala, Havran, *Fast Insertion-Based
    /// Optimization of Bounding Volume Hierarchies*, 2013).
    #[inline(always)]
    fn inefficiency(&self, index: u32) -> f32 {
        let area = self.bounds(index).half_area();
        let first = self.nodes[index as usize].first;
        let [left, right] = [first, first + 1].map(|child| self.bounds(child).half_area());
        // Avoids division by zero for flat containers.
        area * (area / (left + right + 1e-6 * area)) * (area / (left.min(right) + 1e-3 * area))
    }
}

/// The `max_count` elements of `lists` with the largest scores, and few others; all if there are no more.
fn prefilter(lists: &[Vec<(f32, u32)>], max_count: usize) -> Vec<(f32, u32)> {
    let len: usize = lists.iter().map(Vec::len).sum();
    // Estimate the threshold from a sample.
    let step = (len / SAMPLES).max(1);
    let mut sample: Vec<f32> = lists.iter().flatten().step_by(step).map(|candidate| candidate.0).collect();
    let rank = max_count * 5 / 4 / step + SAMPLES / 64;
    if rank < sample.len() {
        let (_, &mut threshold, _) = sample.select_nth_unstable_by(rank, |a, b| b.total_cmp(a));
        let large: Vec<Vec<(f32, u32)>> = lists
            .par_iter()
            .map(|list| list.iter().filter(|candidate| candidate.0 >= threshold).copied().collect())
            .collect();
        if large.iter().map(Vec::len).sum::<usize>() >= max_count {
            return large.concat();
        }
    }
    lists.concat()
}

/// The nodes, or positions, with the `max_count` largest scores, sorted, because neighbours search the same nodes.
fn best(mut scored: Vec<(f32, u32)>, max_count: usize) -> Vec<u32> {
    if scored.len() > max_count {
        scored.select_nth_unstable_by(max_count, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        scored.truncate(max_count);
    }
    let mut nodes: Vec<u32> = scored.into_iter().map(|candidate| candidate.1).collect();
    nodes.sort_unstable();
    nodes
}
