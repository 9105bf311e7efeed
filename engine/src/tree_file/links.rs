//! Follows the links from the root: refuses what cannot be a tree, finds what is empty and what is not reached.

use super::arrays::Arrays;
use super::error::TreeFileError;
use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::{par_collect, zeros};

/// Steps between two polls for cancellation: nodes and indices of leaves.
pub(super) const STEPS_BETWEEN_CHECKS: u32 = 1 << 15;

/// The parent of a node that was not reached.
const NONE: u32 = u32::MAX;

/// A set of numbers below a bound.
pub(super) struct Set(Vec<u64>);

impl Set {
    /// The empty set of numbers below `bound`.
    pub fn new(bound: u32, token: &CancelToken) -> Result<Self, Cancelled> {
        zeros((bound as usize).div_ceil(64), token).map(Self)
    }

    /// Whether it contains `number`.
    #[inline(always)]
    pub fn contains(&self, number: u32) -> bool {
        self.0.get(number as usize / 64).is_some_and(|word| word >> (number % 64) & 1 == 1)
    }

    /// Adds `number`; whether it was there before.
    #[inline(always)]
    pub fn insert(&mut self, number: u32) -> bool {
        let Some(word) = self.0.get_mut(number as usize / 64) else { return false };
        let before = *word >> (number % 64) & 1 == 1;
        *word |= 1 << (number % 64);
        before
    }
}

/// Counts steps, and polls for cancellation every [`STEPS_BETWEEN_CHECKS`] of them.
pub(super) struct Steps<'a> {
    token: &'a CancelToken,
    since: u32,
    done: u64,
    /// Number of all steps, where progress is reported.
    all: Option<u64>,
}

impl<'a> Steps<'a> {
    /// No step of `all` done; reports progress.
    pub fn new(token: &'a CancelToken, all: u64) -> Self {
        Self { token, since: STEPS_BETWEEN_CHECKS, done: 0, all: Some(all.max(1)) }
    }

    /// Steps that report no progress.
    pub fn silent(token: &'a CancelToken) -> Self {
        Self { token, since: STEPS_BETWEEN_CHECKS, done: 0, all: None }
    }

    /// One more step.
    #[inline(always)]
    pub fn step(&mut self) -> Result<(), Cancelled> {
        self.since = self.since.saturating_add(1);
        if self.since >= STEPS_BETWEEN_CHECKS { self.poll() } else { Ok(()) }
    }

    #[cold]
    fn poll(&mut self) -> Result<(), Cancelled> {
        self.token.check()?;
        if let Some(all) = self.all {
            self.token.set_progress((self.done as f64 / all as f64) as f32);
        }
        self.done = self.done.saturating_add(u64::from(STEPS_BETWEEN_CHECKS));
        self.since = 0;
        Ok(())
    }
}

/// Order and parents that follow from the links. Numbers of nodes are those of the file.
pub(super) struct Links {
    /// The nodes that the root reaches, in depth-first order.
    pub order: Vec<u32>,
    /// The nodes of `order` that have a leaf at or below them.
    pub kept: Set,
    /// Number of the others of `order`.
    pub empty: u32,
    /// A node that the root does not reach, and the number of them.
    pub unreached: Option<(u32, u32)>,
}

impl Links {
    /// Follows the links of `arrays`. Iterative: trees may be as deep as they have nodes.
    pub fn follow(arrays: &Arrays<'_>, token: &CancelToken) -> Result<Self, TreeFileError> {
        let nodes = arrays.nodes;
        let mut parents = par_collect(nodes as usize, token, |_| NONE)?;
        let mut slots = Set::new(arrays.indices, token)?;
        let mut order: Vec<u32> = Vec::with_capacity(nodes as usize);
        let mut steps = Steps::new(token, u64::from(nodes).saturating_add(u64::from(arrays.indices)));
        let mut stack = Vec::new();
        if let Some(parent) = parents.first_mut() {
            *parent = 0;
            stack.push(0);
        }
        while let Some(node) = stack.pop() {
            steps.step()?;
            order.push(node);
            let [first, count] = arrays.leaf(node);
            if count > 0 {
                check_leaf(arrays, node, [first, count], &mut slots, &mut steps)?;
                continue;
            }
            let before = stack.len();
            for child in arrays.children(node) {
                match parents.get_mut(child as usize) {
                    None => return Err(TreeFileError::Child { node, child, nodes }),
                    Some(parent) if *parent != NONE => return Err(reached_twice(&parents, child, node)),
                    Some(parent) => *parent = node,
                }
                stack.push(child);
            }
            if let Some(children) = stack.get_mut(before..) {
                children.reverse();
            }
        }
        let (kept, kept_count) = kept(arrays, &parents, &order, token)?;
        let reached = order.len() as u32;
        let unreached = nodes.checked_sub(reached).filter(|&count| count > 0).and_then(|count| {
            let first = parents.iter().position(|&parent| parent == NONE)?;
            Some((first as u32, count))
        });
        token.check()?;
        Ok(Self { order, kept, empty: reached.saturating_sub(kept_count), unreached })
    }
}

/// Checks that the indices of a leaf exist, that no other leaf has them and that their triangles exist.
fn check_leaf(
    arrays: &Arrays<'_>,
    node: u32,
    [first, count]: [u32; 2],
    slots: &mut Set,
    steps: &mut Steps<'_>,
) -> Result<(), TreeFileError> {
    let indices = arrays.indices;
    let end = first.checked_add(count).filter(|&end| end <= indices);
    let end = end.ok_or(TreeFileError::LeafEnd { node, first, count, indices })?;
    if count > i32::MAX as u32 {
        return Err(TreeFileError::LeafSize { node, count });
    }
    for index in first..end {
        steps.step()?;
        if slots.insert(index) {
            return Err(TreeFileError::LeafOverlap { node, index });
        }
        let (item, items) = (arrays.item_at(index), arrays.items);
        if item >= items {
            return Err(TreeFileError::Index { node, index, item, items, of: arrays.kind });
        }
    }
    Ok(())
}

/// The error for a `node` that was reached before and is a child of `parent` too.
#[cold]
fn reached_twice(parents: &[u32], node: u32, parent: u32) -> TreeFileError {
    let parent_of = |node: u32| parents.get(node as usize).copied().unwrap_or(0);
    let mut above = parent;
    while above != node && above != 0 {
        above = parent_of(above);
    }
    if above == node {
        return TreeFileError::Cycle { node, parent };
    }
    TreeFileError::TwoParents { node, parents: [parent_of(node), parent] }
}

/// The nodes with a leaf at or below them, and their number.
fn kept(arrays: &Arrays<'_>, parents: &[u32], order: &[u32], token: &CancelToken) -> Result<(Set, u32), TreeFileError> {
    let mut kept = Set::new(arrays.nodes, token)?;
    let mut count = 0_u32;
    let mut steps = Steps::silent(token);
    // Backwards, so that children come before their parents.
    for &node in order.iter().rev() {
        steps.step()?;
        let [_, primitives] = arrays.leaf(node);
        if primitives > 0 {
            kept.insert(node);
        }
        if kept.contains(node) {
            count = count.saturating_add(1);
            if let Some(&parent) = parents.get(node as usize) {
                kept.insert(parent);
            }
        }
    }
    Ok((kept, count))
}
