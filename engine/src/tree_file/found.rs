//! Nodes with a fault, looked for in parallel.

use super::bounds::FileContainer;
use super::links::{STEPS_BETWEEN_CHECKS, Steps};
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::par_tasks;
use crate::tree::Tree;

/// Nodes of a kind of fault, with the largest excess.
#[derive(Default)]
pub(super) struct Found {
    pub nodes: Vec<u32>,
    pub excess: f64,
}

impl Found {
    pub fn add(&mut self, node: u32, excess: f64) {
        if self.nodes.last() != Some(&node) {
            self.nodes.push(node);
        }
        self.excess = self.excess.max(excess);
    }
}

/// Looks at each node, in parallel; the same on any number of threads. `look` polls for each primitive that it looks at.
pub(super) fn in_chunks<C: FileContainer>(
    tree: &Tree<C>,
    token: &CancelToken,
    look: impl Fn(u32, &mut Found, &mut Steps<'_>) -> Result<(), Cancelled> + Sync,
) -> Result<Found, Cancelled> {
    let count = tree.nodes.len() as u32;
    let chunks = count.div_ceil(STEPS_BETWEEN_CHECKS);
    let parts = par_tasks(0..chunks, token, |chunk, token| {
        let (mut found, mut steps) = (Found::default(), Steps::silent(token));
        let first = chunk.saturating_mul(STEPS_BETWEEN_CHECKS);
        (first..first.saturating_add(STEPS_BETWEEN_CHECKS).min(count))
            .try_for_each(|node| look(node, &mut found, &mut steps))?;
        Ok(found)
    })?;
    let mut all = Found::default();
    for part in parts {
        token.check()?;
        all.nodes.extend(part.nodes);
        all.excess = all.excess.max(part.excess);
    }
    token.set_progress(1.0);
    Ok(all)
}
