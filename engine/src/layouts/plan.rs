//! Which nodes of a binary tree become the children of each wide node, and which become leaves.

use super::layout::{Collapse, Layout, MAX_CHILDREN, TRIANGLE_BYTES};
use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::Aabb;
use crate::kernel::parallel::zeros;
use crate::tree::{Container, Tree};

/// Costs of visiting a node and of testing a triangle by the surface area heuristic: those of Ylitie, Karras and Laine 2017, section 5.1.
const SAH_COSTS: [f32; 2] = [1.0, 0.3];
/// Number of the row of a binary node that is a leaf.
const LEAF: u32 = u32::MAX;

/// The decisions for a binary tree.
pub(super) struct Plan<'a> {
    tree: &'a Tree<Aabb>,
    layout: Layout,
    /// Expected or measured visits of each binary node.
    weights: Vec<f32>,
    /// Slots below each binary node: the first, and their number.
    slots: Vec<[u32; 2]>,
    /// Whether a binary node that takes one lane becomes a leaf.
    is_leaf: Vec<bool>,
    /// Number of each interior binary node, [`LEAF`] for leaves.
    rows: Vec<u32>,
    /// For each interior binary node, for each number of lanes from 1 on that it may take, those of its left child, 0 where it takes one
    /// lane itself. The last of a row is for a node that is opened. Empty for [`Collapse::Greedy`].
    left_lanes: Vec<u8>,
}

impl<'a> Plan<'a> {
    /// The plan for `layout` of a binary tree that is not empty. `visits` are those of the binary nodes, for [`Collapse::Visits`].
    pub(super) fn new(
        tree: &'a Tree<Aabb>,
        layout: Layout,
        visits: Option<&[u32]>,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let count = tree.nodes.len();
        let scale = tree.area_scale();
        let mut weights: Vec<f32> = zeros(count, token)?;
        for (at, weight) in weights.iter_mut().enumerate() {
            token.check_every(MEDIUM_STEPS, at)?;
            *weight = match visits.filter(|_| layout.collapse == Collapse::Visits) {
                Some(visits) => visits[at] as f32,
                None => tree.nodes[at].container.scaled(scale).relative_area(),
            };
        }
        let mut plan = Self {
            tree,
            layout,
            weights,
            slots: zeros(count, token)?,
            is_leaf: vec![false; count],
            rows: zeros(count, token)?,
            left_lanes: Vec::new(),
        };
        match layout.collapse {
            Collapse::Greedy => plan.decide_leaves(token)?,
            Collapse::Optimal | Collapse::Visits => plan.decide(SAH_COSTS, token)?,
            Collapse::Memory => plan.decide([layout.node_bytes() as f32, TRIANGLE_BYTES as f32], token)?,
        }
        Ok(plan)
    }

    /// Sets the slots below a node, whose children are known, and returns their number.
    fn count_slots(&mut self, at: usize) -> u32 {
        let node = &self.tree.nodes[at];
        self.slots[at] = if node.is_leaf() {
            [node.first, node.count]
        } else {
            let [[first, left], [_, right]] = [0, 1].map(|side| self.slots[node.first as usize + side]);
            [first, left + right]
        };
        self.slots[at][1]
    }

    /// Cost of a node as a leaf; infinite where it has too many triangles.
    fn leaf_cost(&self, at: usize, count: u32, triangle_cost: f32) -> f32 {
        if count <= self.layout.leaf_size || self.tree.nodes[at].is_leaf() {
            self.weights[at] * triangle_cost * count as f32
        } else {
            f32::INFINITY
        }
    }

    /// Bottom-up, makes leaves of the nodes that cost no more as such than as interior nodes of the binary tree.
    fn decide_leaves(&mut self, token: &CancelToken) -> Result<(), Cancelled> {
        let [node_cost, triangle_cost] = SAH_COSTS;
        let mut costs: Vec<f32> = zeros(self.tree.nodes.len(), token)?;
        for at in (0..self.tree.nodes.len()).rev() {
            token.check_every(MEDIUM_STEPS, at)?;
            let count = self.count_slots(at);
            let leaf = self.leaf_cost(at, count, triangle_cost);
            let node = &self.tree.nodes[at];
            let split = if node.is_leaf() {
                f32::INFINITY
            } else {
                let first = node.first as usize;
                self.weights[at] * node_cost + (costs[first] + costs[first + 1])
            };
            self.is_leaf[at] = node.is_leaf() || count <= self.layout.leaf_size && leaf <= split;
            costs[at] = if self.is_leaf[at] { leaf } else { split };
        }
        Ok(())
    }

    /// Bottom-up, the least cost of each node with at most so many lanes, and how these are divided among its children: of a single lane
    /// the cheaper of a leaf and a wide node, of several the cheapest division unless one lane less costs as little.
    fn decide(&mut self, [node_cost, triangle_cost]: [f32; 2], token: &CancelToken) -> Result<(), Cancelled> {
        let lanes = self.layout.children as usize;
        let mut interior = 0;
        for (at, row) in self.rows.iter_mut().enumerate() {
            token.check_every(MEDIUM_STEPS, at)?;
            let is_leaf = self.tree.nodes[at].is_leaf();
            *row = if is_leaf { LEAF } else { interior };
            interior += u32::from(!is_leaf);
        }
        // Cost with one lane, and for interior nodes with one lane more than the place in the row.
        let mut single: Vec<f32> = zeros(self.tree.nodes.len(), token)?;
        let mut costs: Vec<f32> = zeros(interior as usize * lanes, token)?;
        self.left_lanes = zeros(interior as usize * lanes, token)?;
        for at in (0..self.tree.nodes.len()).rev() {
            token.check_every(MEDIUM_STEPS, at)?;
            let count = self.count_slots(at);
            let leaf = self.leaf_cost(at, count, triangle_cost);
            let node = &self.tree.nodes[at];
            if node.is_leaf() {
                (single[at], self.is_leaf[at]) = (leaf, true);
                continue;
            }
            let row = |node: usize| match self.rows[node] {
                LEAF => [single[node]; MAX_CHILDREN as usize],
                row => {
                    let mut all = [0.0; MAX_CHILDREN as usize];
                    all[..lanes].copy_from_slice(&costs[row as usize * lanes..][..lanes]);
                    all
                }
            };
            let first = node.first as usize;
            let [left, right] = [row(first), row(first + 1)];
            let divided = |lanes: usize| {
                // One lane for the left child unless another number is cheaper: areas may add up to infinity.
                let cost = |of_left: usize| left[of_left - 1] + right[lanes - of_left - 1];
                (2..lanes).fold((cost(1), 1_u8), |best, of_left| {
                    let cost = cost(of_left);
                    if cost < best.0 { (cost, of_left as u8) } else { best }
                })
            };
            let (opened, of_left) = divided(lanes);
            let as_node = self.weights[at] * node_cost + opened;
            self.is_leaf[at] = count <= self.layout.leaf_size && leaf <= as_node;
            single[at] = if self.is_leaf[at] { leaf } else { as_node };
            let start = self.rows[at] as usize * lanes;
            let (mut least, mut choice) = (single[at], 0);
            for lanes in 1..lanes {
                let (cost, of_left) = if lanes > 1 { divided(lanes) } else { (f32::INFINITY, 0) };
                if cost < least {
                    (least, choice) = (cost, of_left);
                }
                costs[start + lanes - 1] = least;
                self.left_lanes[start + lanes - 1] = choice;
            }
            self.left_lanes[start + lanes - 1] = of_left;
            costs[start + lanes - 1] = least.min(opened);
        }
        Ok(())
    }

    /// The slots of the leaf that a binary node becomes: the first, and their number. `None` where it becomes a wide node.
    pub(super) fn leaf(&self, node: u32) -> Option<[u32; 2]> {
        self.is_leaf[node as usize].then(|| self.slots[node as usize])
    }

    /// Replaces `children` by the children of the wide node that a binary node becomes, from left to right.
    pub(super) fn children_of(&self, node: u32, children: &mut Vec<u32>) {
        children.clear();
        if self.layout.collapse == Collapse::Greedy {
            self.open_largest(node, children);
        } else {
            self.divide(node, self.layout.children, true, children);
        }
    }

    /// Appends the nodes that share `lanes` below a node: that node itself, unless it `is_opened` or dividing is cheaper.
    fn divide(&self, node: u32, lanes: u32, is_opened: bool, children: &mut Vec<u32>) {
        let row = self.rows[node as usize];
        let of_left = if row == LEAF || lanes == 1 {
            0
        } else {
            let row = row as usize * self.layout.children as usize;
            let of_left = self.left_lanes[row + lanes as usize - 1];
            debug_assert!(!is_opened || of_left > 0, "an opened node divides its lanes");
            u32::from(of_left)
        };
        if of_left == 0 {
            children.push(node);
            return;
        }
        let first = self.tree.nodes[node as usize].first;
        self.divide(first, of_left, false, children);
        self.divide(first + 1, lanes - of_left, false, children);
    }

    /// Appends the two children of a node, and while there are lanes left replaces the one of the largest surface area by its own.
    fn open_largest(&self, node: u32, children: &mut Vec<u32>) {
        let first = self.tree.nodes[node as usize].first;
        children.extend([first, first + 1]);
        while children.len() < self.layout.children as usize {
            let can_open = children.iter().enumerate().filter(|(_, child)| !self.is_leaf[**child as usize]);
            // The first of several that are equally large.
            let largest = can_open.reduce(|best, other| {
                let [largest, area] = [best, other].map(|(_, child)| self.weights[*child as usize]);
                if area > largest { other } else { best }
            });
            let Some((at, &child)) = largest else { return };
            let first = self.tree.nodes[child as usize].first;
            children.splice(at..=at, [first, first + 1]);
        }
    }
}
