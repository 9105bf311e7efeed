//! A tree whose nodes know their parents, so that subtrees can be moved.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::kernel::parallel::par_tasks;
use crate::optimize::move_search::{LinkedNodes, NONE};
use crate::optimize::simd_box::NodeBounds;
use crate::tree::Node;

/// A tree with parent links.
pub struct LinkedTree<'a, B> {
    pub nodes: &'a mut [Node<B>],
    /// For each pair of siblings the parent. Filled by many threads, later changed by one only.
    parents: Vec<AtomicU32>,
}

impl<'a, B: NodeBounds> LinkedTree<'a, B> {
    /// Links the nodes of a tree, which may be in any order with siblings together.
    pub fn new(nodes: &'a mut [Node<B>], token: &CancelToken) -> Result<Self, Cancelled> {
        let parents: Vec<AtomicU32> = (0..nodes.len() / 2).map(|_| AtomicU32::new(NONE)).collect();
        par_tasks(nodes.chunks(LIGHT_STEPS).enumerate(), token, |(chunk, chunk_nodes), _| {
            for (index, node) in (chunk * LIGHT_STEPS..).zip(chunk_nodes) {
                if !node.is_leaf() {
                    parents[node.first as usize / 2].store(index as u32, Ordering::Relaxed);
                }
            }
            Ok(())
        })?;
        Ok(Self { nodes, parents })
    }

    /// Whether `node` is `descendant` or one of its ancestors.
    pub fn is_ancestor_or_self(&self, node: u32, mut descendant: u32) -> bool {
        while descendant != NONE && descendant != node {
            descendant = self.parent(descendant);
        }
        descendant == node
    }

    /// Removes `node` and joins it with `target`, which must be neither its ancestor, descendant nor sibling: the
    /// sibling replaces the parent, and the freed pair takes target and node. Undone if the summed area does not fall.
    /// Returns the reduction of the area.
    pub fn apply(&mut self, node: u32, target: u32, undo: &mut Vec<(u32, B)>) -> Option<f64> {
        let parent = self.parent(node);
        let pair = node.min(sibling(node));
        let slots = [parent, pair, pair + 1, target];
        let old = slots.map(|index| self.nodes[index as usize]);
        let moved = self.nodes[node as usize];
        self.set(parent, self.nodes[sibling(node) as usize]);
        let partner = self.nodes[target as usize];
        self.set(pair, partner);
        self.set(pair + 1, moved);
        let joined = Node { container: partner.container.around(&moved.container), first: pair, count: 0 };
        self.set(target, joined);
        let mut gain = f64::from(old[0].container.mean_half_area()) - f64::from(joined.container.mean_half_area());
        undo.clear();
        gain -= self.refit(self.parent(parent), undo);
        gain -= self.refit(self.parent(target), undo);
        if gain > 0.0 {
            return Some(gain);
        }
        for &(index, container) in undo.iter().rev() {
            self.nodes[index as usize].container = container;
        }
        for (index, node) in slots.into_iter().zip(old) {
            self.set(index, node);
        }
        None
    }

    /// Refits the containers from `node` upwards until one is unchanged. Returns the growth of their areas.
    fn refit(&mut self, mut node: u32, undo: &mut Vec<(u32, B)>) -> f64 {
        let mut growth = 0.0;
        while node != NONE {
            let Node { container, first, .. } = self.nodes[node as usize];
            let [left, right] = [first, first + 1].map(|child| self.nodes[child as usize].container);
            let fitted = left.around(&right);
            if fitted == container {
                break;
            }
            growth += f64::from(fitted.mean_half_area()) - f64::from(container.mean_half_area());
            undo.push((node, container));
            self.nodes[node as usize].container = fitted;
            node = self.parent(node);
        }
        growth
    }

    /// Writes `node` to slot `index`.
    pub fn set(&mut self, index: u32, node: Node<B>) {
        self.nodes[index as usize] = node;
        if !node.is_leaf() {
            *self.parents[node.first as usize / 2].get_mut() = index;
        }
    }
}

impl<B: NodeBounds> LinkedNodes for LinkedTree<'_, B> {
    type Bounds = B::Simd;

    #[inline(always)]
    fn parent(&self, node: u32) -> u32 {
        if node == 0 { NONE } else { self.parents[(node as usize - 1) / 2].load(Ordering::Relaxed) }
    }

    #[inline(always)]
    fn sibling(&self, node: u32) -> u32 {
        sibling(node)
    }

    #[inline(always)]
    fn children(&self, node: u32) -> Option<[u32; 2]> {
        let node = &self.nodes[node as usize];
        (!node.is_leaf()).then(|| [node.first, node.first + 1])
    }

    #[inline(always)]
    fn bounds(&self, node: u32) -> B::Simd {
        self.nodes[node as usize].container.to_simd()
    }
}

/// The other child of the parent: pairs begin at odd indices.
#[inline(always)]
pub fn sibling(node: u32) -> u32 {
    ((node - 1) ^ 1) + 1
}
