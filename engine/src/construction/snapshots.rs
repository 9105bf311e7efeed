//! The largest clusters at any step without a pass over the tree: every [`STEPS_BETWEEN`] steps, the largest active clusters are
//! stored. Those of a step in between are among the stored ones and those made since.

use crate::cancel::{CancelToken, Cancelled, HEAVY_STEPS};
use crate::kernel::parallel::{par_collect, zeros};
use crate::order::radix_sort;

/// Maximum number of clusters that are asked for.
pub const MAX_LARGEST: usize = 4096;
/// Number of steps between two snapshots: with as many as are asked for, snapshots take 12 bytes per primitive and a query reads at most
/// four times as many clusters as it returns.
const STEPS_BETWEEN: usize = MAX_LARGEST;
/// Number of clusters per snapshot: each step up to the next takes two of them away, or of splits one.
const CAPACITY: usize = MAX_LARGEST + 2 * STEPS_BETWEEN;
/// Bits of a number that is not negative, which are in the order of the numbers.
pub fn ordered_bits(area: f32) -> u32 {
    area.max(0.0).to_bits()
}

/// The largest clusters at every [`STEPS_BETWEEN`]th step.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshots {
    /// Area of each node's container, relative to others of its kind.
    areas: Vec<f32>,
    /// The largest clusters, largest first, then by index; all of them where there are fewer than [`CAPACITY`].
    largest: Vec<Vec<u32>>,
}

impl Snapshots {
    /// Snapshots of nodes with these `areas`, active from `births` until `deaths`.
    pub fn new(areas: Vec<f32>, births: &[u32], deaths: &[u32], token: &CancelToken) -> Result<Self, Cancelled> {
        // There are about half as many merges as nodes.
        let count = areas.len() / 2 / STEPS_BETWEEN + 1;
        let mut largest: Vec<Vec<u32>> = vec![Vec::new(); count];
        let mut open = OpenSnapshots::new(count, token)?;
        let mut keys =
            par_collect(areas.len(), token, |node| u64::from(!ordered_bits(areas[node])) << 32 | node as u64)?;
        radix_sort(&mut keys, u64::BITS, token)?;
        // The largest first: a snapshot that is full takes no more.
        for (at, key) in keys.into_iter().enumerate() {
            token.check_every(HEAVY_STEPS, at)?;
            let node = key as u32;
            let first = (births[node as usize] as usize).div_ceil(STEPS_BETWEEN);
            let end = (deaths[node as usize] as usize).div_ceil(STEPS_BETWEEN).min(count);
            let mut snapshot = open.next(first);
            while snapshot < end {
                largest[snapshot].push(node);
                if largest[snapshot].len() == CAPACITY {
                    open.close(snapshot);
                }
                snapshot = open.next(snapshot + 1);
            }
        }
        Ok(Self { areas, largest })
    }

    /// The `count` largest clusters at `step`, at most [`MAX_LARGEST`]; `made_since` are the nodes made after a step up to this one.
    pub fn largest_at(
        &self,
        step: u32,
        count: usize,
        deaths: &[u32],
        made_since: &dyn Fn(u32) -> Vec<u32>,
    ) -> Vec<u32> {
        let count = count.min(MAX_LARGEST);
        let snapshot = step as usize / STEPS_BETWEEN;
        let Some(stored) = self.largest.get(snapshot).filter(|_| !self.areas.is_empty()) else { return Vec::new() };
        let stands = |node: &&u32| deaths[**node as usize] > step;
        let before = |node: u32| (!ordered_bits(self.areas[node as usize]), node);
        let mut nodes: Vec<u32> = stored.iter().filter(stands).take(count).copied().collect();
        nodes.extend(made_since((snapshot * STEPS_BETWEEN) as u32).iter().filter(stands));
        nodes.sort_unstable_by_key(|&node| before(node));
        nodes.truncate(count);
        nodes
    }
}

/// The snapshots that still take clusters; finds the next of them by ever shorter paths (Tarjan, 1975).
struct OpenSnapshots {
    /// Of an open snapshot its own index, otherwise that of a later one.
    next: Vec<u32>,
}

impl OpenSnapshots {
    fn new(count: usize, token: &CancelToken) -> Result<Self, Cancelled> {
        let mut next = zeros::<u32>(count + 1, token)?;
        next.iter_mut().zip(0..).for_each(|(next, index)| *next = index);
        Ok(Self { next })
    }

    /// The first open snapshot from `index` on; one behind the last if there is none.
    fn next(&mut self, index: usize) -> usize {
        let mut index = index.min(self.next.len() - 1);
        while self.next[index] as usize != index {
            let next = self.next[index] as usize;
            self.next[index] = self.next[next];
            index = next;
        }
        index
    }

    fn close(&mut self, index: usize) {
        self.next[index] = index as u32 + 1;
    }
}
