//! Which nodes of a tree another tree has as well: those that hold the same set of primitives.

use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::kernel::mix::mix64;
use crate::kernel::parallel::{par_collect_in_chunks, zeros};

use super::node::Tree;
use crate::geometry::Container;

/// Stands for no node.
const NO_NODE: u32 = u32::MAX;

/// The nodes of a tree that survive in another.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Survival {
    /// For each node the one of the other tree with the same set, or [`NO_NODE`].
    partners: Vec<u32>,
    /// Number of nodes that survive, leaves included.
    pub nodes: usize,
    /// Number of interior nodes that survive. Leaves of one primitive do so in nearly every tree and tell little.
    pub interior: usize,
    /// Number of nodes that survive at each depth, from that of the root on.
    pub nodes_per_depth: Vec<u32>,
}

impl Survival {
    /// Whether `node` of the first tree survives in the second; `false` for indices beyond the tree.
    pub fn survives(&self, node: u32) -> bool {
        self.partner(node).is_some()
    }

    /// The node of the second tree with the same set of primitives, of several one of them; `None` where there is none.
    pub fn partner(&self, node: u32) -> Option<u32> {
        self.partners.get(node as usize).copied().filter(|&partner| partner != NO_NODE)
    }
}

/// The nodes of `tree` for which `other` has a node with the same set of primitives below, whatever the shape of the subtree and
/// the kind of container. Both trees are of the same list of triangles. Where splitting put a primitive into several leaves, it
/// counts once in each node above: sets are compared, not lists.
///
/// Sets are compared by the sum of a 64-bit mix of their primitive indices and by their size, so that two different sets are taken
/// for the same with a probability of about nodes² / 2⁶⁴. Time is linear in the nodes of both trees, plus for each primitive in
/// several leaves the climb to the nodes above these leaves.
pub fn surviving_nodes<A: Container, B: Container>(
    tree: &Tree<A>,
    other: &Tree<B>,
    token: &CancelToken,
) -> Result<Survival, Cancelled> {
    let partners = partners(&primitive_sets(tree, token)?, primitive_sets(other, token)?, token)?;
    let mut survival = Survival { partners, ..Survival::default() };
    let mut depths = zeros::<u32>(tree.nodes.len(), token)?;
    let mut work = 0;
    for (index, node) in tree.nodes.iter().enumerate() {
        work += 1 + node.arity() as usize;
        if work >= MEDIUM_STEPS {
            work = 0;
            token.check()?;
        }
        let depth = depths[index];
        // A parent has a lower index than its children.
        node.children().for_each(|child| depths[child as usize] = depth + 1);
        let survives = survival.survives(index as u32);
        survival.nodes += usize::from(survives);
        survival.interior += usize::from(survives && !node.is_leaf());
        if survival.nodes_per_depth.len() <= depth as usize {
            survival.nodes_per_depth.resize(depth as usize + 1, 0);
        }
        survival.nodes_per_depth[depth as usize] += u32::from(survives);
    }
    Ok(survival)
}

/// For each of `sets` the index of the same one among `others`, or [`NO_NODE`].
fn partners(sets: &[PrimitiveSet], others: Vec<PrimitiveSet>, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
    let others = SetTable::new(others, token)?;
    let partners =
        par_collect_in_chunks(sets.len(), MEDIUM_STEPS, token, |node| others.find(sets[node]).unwrap_or(NO_NODE))?;
    others.free(token)?;
    Ok(partners)
}

/// A set of primitives by its hash and its size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Zeroable)]
struct PrimitiveSet {
    /// Wrapping sum of [`mix64`] of the primitive indices.
    hash: u64,
    /// Number of primitives.
    count: u32,
}

impl PrimitiveSet {
    fn of(primitive: u32) -> Self {
        Self { hash: mix64(u64::from(primitive)), count: 1 }
    }

    fn plus(self, other: Self) -> Self {
        Self { hash: self.hash.wrapping_add(other.hash), count: self.count.wrapping_add(other.count) }
    }

    fn minus(self, other: Self) -> Self {
        Self { hash: self.hash.wrapping_sub(other.hash), count: self.count.wrapping_sub(other.count) }
    }
}

/// The set of the primitives below each node, in the order of [`Tree::nodes`].
fn primitive_sets<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<Vec<PrimitiveSet>, Cancelled> {
    let mut sets = zeros::<PrimitiveSet>(tree.nodes.len(), token)?;
    subtract_repetitions(tree, &mut sets, token)?;
    let mut work = 0;
    // Backwards, so that children are done before their parents.
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        work += 1 + node.slots().len().max(node.arity() as usize);
        if work >= MEDIUM_STEPS {
            work = 0;
            token.check()?;
        }
        let own = &tree.primitive_indices[node.slots()];
        let set = own.iter().fold(sets[index], |set, &primitive| set.plus(PrimitiveSet::of(primitive)));
        sets[index] = node.children().fold(set, |set, child| set.plus(sets[child as usize]));
    }
    Ok(sets)
}

/// Subtracts, for each two neighbouring occurrences of a primitive in leaf order, the primitive once at the lowest node above both.
/// So the sum over any subtree has each of its primitives once: it has one such pair less than occurrences.
fn subtract_repetitions<C: Container>(
    tree: &Tree<C>,
    sets: &mut [PrimitiveSet],
    token: &CancelToken,
) -> Result<(), Cancelled> {
    const NONE: u32 = u32::MAX;
    let slots = &tree.primitive_indices;
    let mut last_slot: Vec<u32> = Vec::new();
    // Made only for trees with repetitions.
    let mut parents_and_leaves: Option<(Vec<u32>, Vec<u32>)> = None;
    let mut steps = 0_usize;
    for (slot, &primitive) in slots.iter().enumerate() {
        token.check_every(MEDIUM_STEPS, slot)?;
        if primitive as usize >= last_slot.len() {
            last_slot.resize((primitive as usize + 1).max(slots.len().min(2 * last_slot.len())), NONE);
        }
        let previous = std::mem::replace(&mut last_slot[primitive as usize], slot as u32);
        if previous == NONE {
            continue;
        }
        let (parents, leaves) = match &mut parents_and_leaves {
            Some(known) => known,
            unknown => unknown.insert((tree.parents(token)?, leaf_of_slots(tree, token)?)),
        };
        // A parent has a lower index than its children, so the larger of two indices is never that of a node above the other.
        let [mut a, mut b] = [previous as usize, slot].map(|slot| leaves[slot]);
        while a != b {
            steps += 1;
            token.check_every(MEDIUM_STEPS, steps)?;
            if a > b {
                a = parents[a as usize];
            } else {
                b = parents[b as usize];
            }
        }
        sets[a as usize] = sets[a as usize].minus(PrimitiveSet::of(primitive));
    }
    Ok(())
}

/// Index of the leaf of each slot of [`Tree::primitive_indices`].
fn leaf_of_slots<C: Container>(tree: &Tree<C>, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
    let mut leaves = zeros::<u32>(tree.primitive_indices.len(), token)?;
    for (index, node) in tree.nodes.iter().enumerate() {
        token.check_every(MEDIUM_STEPS, index)?;
        leaves[node.slots()].fill(index as u32);
    }
    Ok(leaves)
}

/// Slots of a [`SetTable`] that are allocated together: giving megabytes back at once takes milliseconds without a check.
const SLOTS_PER_PART: usize = 1 << 14;

/// The set of a node.
#[derive(Debug, Clone, Copy, bytemuck::Zeroable)]
struct NodeSet {
    set: PrimitiveSet,
    node: u32,
}

/// A hash table of sets with open addressing.
struct SetTable {
    /// The slots in parts of [`SLOTS_PER_PART`]. Empty ones hold the empty set, which no node has.
    parts: Vec<Vec<NodeSet>>,
}

impl SetTable {
    fn new(sets: Vec<PrimitiveSet>, token: &CancelToken) -> Result<Self, Cancelled> {
        let slots = (2 * sets.len()).next_power_of_two().max(SLOTS_PER_PART);
        let part = |_| zeros(SLOTS_PER_PART, token);
        let mut table = Self { parts: (0..slots / SLOTS_PER_PART).map(part).collect::<Result<_, _>>()? };
        for (index, set) in sets.into_iter().enumerate() {
            token.check_every(MEDIUM_STEPS, index)?;
            let slot = table.slot_of(set);
            table.parts[slot / SLOTS_PER_PART][slot % SLOTS_PER_PART] = NodeSet { set, node: index as u32 };
        }
        Ok(table)
    }

    /// Gives its memory back.
    fn free(self, token: &CancelToken) -> Result<(), Cancelled> {
        for part in self.parts {
            token.check()?;
            drop(part);
        }
        Ok(())
    }

    fn at(&self, slot: usize) -> NodeSet {
        self.parts[slot / SLOTS_PER_PART][slot % SLOTS_PER_PART]
    }

    /// A node of this set.
    fn find(&self, set: PrimitiveSet) -> Option<u32> {
        let found = self.at(self.slot_of(set));
        (found.set == set).then_some(found.node)
    }

    /// The slot that holds `set`, or the empty one where it belongs.
    fn slot_of(&self, set: PrimitiveSet) -> usize {
        let mask = self.parts.len() * SLOTS_PER_PART - 1;
        let mut slot = set.hash as usize & mask;
        while self.at(slot).set.count != 0 && self.at(slot).set != set {
            slot = (slot + 1) & mask;
        }
        slot
    }
}
