//! What lies below each node of a tree whose nodes may stand in any order.

use crate::bvh::stats::{INTERSECTION_COST, TRAVERSAL_COST};
use crate::bvh::{Container, Node};

/// What lies below a node.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Below {
    /// SAH cost of the node and everything below, not normalised; that of one leaf where it is cheaper.
    pub cost: f32,
    /// Number of primitives.
    pub primitives: u32,
}

impl Below {
    /// Of a leaf.
    pub fn leaf(area: f32, primitives: u32) -> Self {
        Self { cost: area * primitives as f32 * INTERSECTION_COST, primitives }
    }

    /// Of a node with the area `area` over two others.
    pub fn joined(area: f32, left: Self, right: Self) -> Self {
        let leaf = Self::leaf(area, left.primitives + right.primitives);
        Self { cost: leaf.cost.min(area * TRAVERSAL_COST + left.cost + right.cost), ..leaf }
    }

    /// Whether one leaf is as cheap as the subtree of a node with the area `area`.
    pub fn is_best_as_leaf(self, area: f32) -> bool {
        self.cost == Self::leaf(area, self.primitives).cost
    }
}

/// Of every node.
pub fn below<C: Container>(nodes: &[Node<C>]) -> Vec<Below> {
    let mut all = vec![Below::default(); nodes.len()];
    for &at in preorder(nodes).iter().rev() {
        all[at as usize] = of(nodes, &all, at as usize);
    }
    all
}

/// Of the node `at`, whose children's are known.
pub fn of<C: Container>(nodes: &[Node<C>], all: &[Below], at: usize) -> Below {
    let node = &nodes[at];
    let area = node.container.relative_area();
    if node.is_leaf() {
        return Below::leaf(area, node.count);
    }
    let first = node.first as usize;
    Below::joined(area, all[first], all[first + 1])
}

/// Every node, each before those below it.
fn preorder<C: Container>(nodes: &[Node<C>]) -> Vec<u32> {
    let mut order = Vec::with_capacity(nodes.len());
    let mut open = vec![0_u32];
    while let Some(at) = open.pop() {
        order.push(at);
        let node = &nodes[at as usize];
        if !node.is_leaf() {
            open.extend([node.first + 1, node.first]);
        }
    }
    order
}
