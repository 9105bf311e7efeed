//! A tree with the triangles in its slots: their areas, their leaves, and how much of one lies in a subtree.

use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::Triangle;
use crate::kernel::parallel::{par_collect, zeros};
use crate::tree::node::Tree;
use crate::tree::node_metrics::visit_cost;

use super::clip::Clip;

/// A tree and the surface in its leaves.
pub(super) struct Surface<'a, C> {
    pub(super) tree: &'a Tree<C>,
    triangles: &'a [Triangle],
    /// Area of the triangle in each slot of the leaf order; 0 in all but the first slot of a triangle.
    pub(super) areas: Vec<f64>,
    /// Sum of the areas.
    pub(super) total: f64,
    /// Number of triangles with an area.
    pub(super) with_area: usize,
    /// The leaf of each slot.
    pub(super) leaves: Vec<u32>,
    /// Index of each node's parent.
    pub(super) parents: Vec<u32>,
    /// The further slots of triangles that have several, in ascending order.
    pub(super) further: Vec<FurtherSlot>,
}

/// A slot of a triangle that has an earlier one.
#[derive(Clone, Copy)]
pub(super) struct FurtherSlot {
    pub(super) slot: u32,
    /// The triangle's last slot before.
    before: u32,
}

impl<'a, C: Clip> Surface<'a, C> {
    pub(super) fn new(tree: &'a Tree<C>, triangles: &'a [Triangle], token: &CancelToken) -> Result<Self, Cancelled> {
        let slots = tree.primitive_indices.len();
        let areas = par_collect(slots, token, |slot| triangles[tree.primitive_indices[slot] as usize].area())?;
        let mut leaves = zeros::<u32>(slots, token)?;
        for (index, node) in tree.nodes.iter().enumerate() {
            token.check_every(MEDIUM_STEPS, index)?;
            leaves[node.slots()].fill(index as u32);
        }
        let parents = tree.parents(token)?;
        let mut surface =
            Self { tree, triangles, areas, total: 0.0, with_area: 0, leaves, parents, further: Vec::new() };
        if slots > triangles.len() {
            surface.find_further_slots(token)?;
        }
        for batch in surface.areas.chunks(MEDIUM_STEPS) {
            token.check()?;
            surface.total = batch.iter().fold(surface.total, |sum, area| sum + area);
            surface.with_area += batch.iter().filter(|area| **area > 0.0).count();
        }
        Ok(surface)
    }

    /// Lists the further slots of triangles that have several, and sets their areas to 0.
    fn find_further_slots(&mut self, token: &CancelToken) -> Result<(), Cancelled> {
        const NONE: u32 = u32::MAX;
        let mut last = vec![NONE; self.triangles.len()];
        for (slot, &index) in self.tree.primitive_indices.iter().enumerate() {
            token.check_every(MEDIUM_STEPS, slot)?;
            let before = std::mem::replace(&mut last[index as usize], slot as u32);
            if before != NONE {
                self.areas[slot] = 0.0;
                self.further.push(FurtherSlot { slot: slot as u32, before });
            }
        }
        Ok(())
    }

    /// The triangle in a slot.
    pub(super) fn triangle(&self, slot: usize) -> &'a Triangle {
        &self.triangles[self.tree.primitive_indices[slot] as usize]
    }

    /// Σ cost · area of the triangle in `slot` inside the node, over `root` and the nodes below it. A node counts only where the one
    /// above it is met. `visit` is called once for each node that is looked at; `stack` is memory for the walk.
    pub(super) fn cost_below<E>(
        &self,
        slot: usize,
        root: u32,
        stack: &mut Vec<u32>,
        mut visit: impl FnMut() -> Result<(), E>,
    ) -> Result<f64, E> {
        let triangle = self.triangle(slot);
        let bounds = triangle.bounds();
        let mut cost = 0.0;
        stack.clear();
        stack.push(root);
        while let Some(index) = stack.pop() {
            visit()?;
            let node = &self.tree.nodes[index as usize];
            let area = node.container.clipped_area(triangle, &bounds);
            if area > 0.0 {
                cost += area * visit_cost(node);
                stack.extend(node.children());
            }
        }
        Ok(cost)
    }

    /// Σ cost · area of a triangle inside the node, over the nodes that hold it through a further slot and through none of its
    /// earlier ones. As slots are in leaf order, these are the nodes from its leaf to below the lowest one that also holds the slot
    /// before.
    pub(super) fn cost_held<E>(
        &self,
        further: FurtherSlot,
        mut visit: impl FnMut() -> Result<(), E>,
    ) -> Result<f64, E> {
        let triangle = self.triangle(further.slot as usize);
        let bounds = triangle.bounds();
        let mut cost = 0.0;
        let [mut node, mut other] = [further.slot, further.before].map(|slot| self.leaves[slot as usize]);
        // Parents have lower indices than their children.
        while node != other {
            visit()?;
            if node > other {
                let held = &self.tree.nodes[node as usize];
                cost += held.container.clipped_area(triangle, &bounds) * visit_cost(held);
                node = self.parents[node as usize];
            } else {
                other = self.parents[other as usize];
            }
        }
        Ok(cost)
    }
}
