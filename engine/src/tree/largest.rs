//! The nodes with the largest values of a metric.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::par_tasks;

/// Nodes per task and between two polls for cancellation.
const NODES_PER_TASK: usize = 1 << 14;

/// The `count` nodes with the largest `value` among the first `node_count` nodes, with their values: largest first, equal values in
/// the order of nodes. NaN is left out. The same on any number of threads; in a fraction of the time of sorting all nodes where
/// `count` is much smaller.
///
/// ```
/// use bvhscope_engine::CancelToken;
/// use bvhscope_engine::tree::largest::largest_nodes;
///
/// let values = [0.5, 2.0, f32::NAN, 0.5];
/// let largest = largest_nodes(values.len(), 2, |node| values[node as usize], &CancelToken::new())?;
/// assert_eq!(largest, [(1, 2.0), (0, 0.5)]);
/// # Ok::<(), bvhscope_engine::Cancelled>(())
/// ```
pub fn largest_nodes(
    node_count: usize,
    count: usize,
    value: impl Fn(u32) -> f32 + Sync,
    token: &CancelToken,
) -> Result<Vec<(u32, f32)>, Cancelled> {
    if count == 0 {
        return Ok(Vec::new());
    }
    // Keys below this one are not among the largest: some task has found `count` larger ones.
    let threshold = AtomicU64::new(0);
    let tasks = node_count.div_ceil(NODES_PER_TASK);
    let parts: Vec<Vec<u64>> = par_tasks(0..tasks, token, |task, _| {
        let nodes = task * NODES_PER_TASK..node_count.min((task + 1) * NODES_PER_TASK);
        let least = threshold.load(Ordering::Relaxed);
        let keyed = nodes.map(|node| (node as u32, value(node as u32))).filter(|(_, value)| !value.is_nan());
        let mut keys: Vec<u64> = keyed.map(|(node, value)| key(value, node)).filter(|&key| key >= least).collect();
        keep_largest(&mut keys, count);
        if keys.len() == count {
            threshold.fetch_max(keys.iter().copied().min().unwrap_or(0), Ordering::Relaxed);
        }
        Ok(keys)
    })?;
    token.check()?;
    let least = threshold.into_inner();
    let mut keys: Vec<u64> = parts.into_iter().flatten().filter(|&key| key >= least).collect();
    keep_largest(&mut keys, count);
    keys.sort_unstable_by(|a, b| b.cmp(a));
    Ok(keys.into_iter().map(node_and_value).collect())
}

/// Truncates `keys` to the `count` largest, in any order.
fn keep_largest(keys: &mut Vec<u64>, count: usize) {
    if count < keys.len() {
        keys.select_nth_unstable_by(count, |a, b| b.cmp(a));
        keys.truncate(count);
    }
}

/// Sort key: by value, then lower nodes first. Flipping all bits of negative floats and the sign of others makes them sort as
/// integers.
fn key(value: f32, node: u32) -> u64 {
    // No difference between the zeros.
    let bits = (value + 0.0).to_bits();
    let ordered = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
    u64::from(ordered) << 32 | u64::from(!node)
}

/// The node and value of a [`key`].
fn node_and_value(key: u64) -> (u32, f32) {
    let ordered = (key >> 32) as u32;
    let bits = if ordered >> 31 == 1 { ordered & !(1 << 31) } else { !ordered };
    (!(key as u32), f32::from_bits(bits))
}
