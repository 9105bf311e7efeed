//! The hierarchy of a layout, with its place in memory.

use super::grid::quantise;
use super::layout::{Layout, TRIANGLE_BYTES};
use super::plan::Plan;
use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::Aabb;
use crate::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};
use crate::tree::{Container, Node, Tree};
use crate::wide::layout::{BLOCK, WIDTH};
use crate::wide::{Child, NodeRef, WideContainer, WideNode, WideTree};

/// A wide tree as its layout lays it out: a hierarchy of the boxes that rays are tested against, and the records of its nodes in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct LaidTree {
    /// The hierarchy, with up to as many children as the layout allows. Boxes are those that the stored planes stand for; that of the root
    /// is stored nowhere and never tested.
    pub tree: Tree<Aabb>,
    /// For each node its [`Child::bits`]: for a node of children the form and the number of its record, for a leaf its slots. At equal
    /// distances the smaller one is visited first.
    pub(super) references: Vec<u32>,
    /// Bytes of a record of either form; described layouts have the first alone.
    pub(super) node_bytes: [usize; 2],
    /// Number of records of either form.
    pub(super) records: [usize; 2],
    /// Most children of a node.
    pub(super) children: usize,
    /// Triangles that are tested at once.
    pub(super) block: usize,
}

/// Numbers of a laid tree that do not depend on rays.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LaidNumbers {
    /// Number of nodes with children.
    pub nodes: usize,
    /// Number of leaves.
    pub leaves: usize,
    /// Children over the number that all nodes have room for; 0 without nodes.
    pub fullness: f64,
    /// Mean number of triangles of a leaf.
    pub leaf_size: f64,
    /// Bytes of the nodes.
    pub node_bytes: usize,
    /// Bytes of the triangles of all leaves.
    pub triangle_bytes: usize,
    /// Cost by the surface area heuristic, as [`sah_cost`](crate::TreeStats::sah_cost), of the boxes as they are stored.
    pub sah_cost: f64,
    /// Memory SAH: bytes of the nodes and of the triangles of the leaves that a random line through the root's box enters, on average, over
    /// the boxes as they are stored: Σ area · bytes over the root's area.
    pub msah_bytes: f64,
}

impl LaidTree {
    /// Peak of the memory, in bytes, of laying a binary tree of so many nodes out with up to `children` children: the decisions, of which
    /// those of an interior node have five bytes for each child, and the hierarchy, whose lists may have twice the room that they need.
    pub const fn peak_bytes(nodes: usize, children: u32) -> u64 {
        let of_plan = 21 + children as u64 * 5 / 2;
        let of_tree = 2 * (size_of::<Node<Aabb>>() + size_of::<u32>()) as u64 + 2;
        nodes as u64 * (of_plan + of_tree)
    }

    /// The tree that `layout` makes of a binary one, see [`Tree::is_binary`]. `visits` are those of its nodes, for
    /// [`Collapse::Visits`](super::layout::Collapse::Visits). Nodes lie in memory depth first, triangles in leaf order.
    pub fn new(
        binary: &Tree<Aabb>,
        layout: Layout,
        visits: Option<&[u32]>,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let mut laid = Self {
            tree: Tree { nodes: Vec::new(), primitive_indices: binary.primitive_indices.clone(), max_depth: 0 },
            references: Vec::new(),
            node_bytes: [layout.node_bytes(); 2],
            records: [0; 2],
            children: layout.children as usize,
            block: 1,
        };
        let Some(root) = binary.nodes.first() else { return Ok(laid) };
        let plan = Plan::new(binary, layout, visits, token)?;
        laid.push(root.container);
        // Stack of binary nodes, each with its number here and its depth.
        let mut open = vec![(0, 0_usize, 0_u32)];
        let (mut children, mut boxes) = (Vec::new(), Vec::new());
        let mut steps = 0;
        while let Some((node, at, depth)) = open.pop() {
            steps += 1;
            token.check_every(MEDIUM_STEPS, steps)?;
            laid.tree.max_depth = laid.tree.max_depth.max(depth);
            let container = laid.tree.nodes[at].container;
            if let Some([first, count]) = plan.leaf(node) {
                laid.tree.nodes[at] = Node { container, first, count };
                // Any order of leaves behind nodes will do.
                laid.references[at] = Child::LEAF | at as u32;
                continue;
            }
            plan.children_of(node, &mut children);
            boxes.clear();
            boxes.extend(children.iter().map(|child| binary.nodes[*child as usize].container));
            if let Some(bits) = layout.planes.bits() {
                quantise(&mut boxes, bits);
            }
            let first = laid.tree.nodes.len();
            for container in &boxes {
                laid.push(*container);
            }
            laid.tree.nodes[at] = Node::interior(container, first as u32, children.len() as u32);
            laid.references[at] = Child::node(laid.records[0], false).bits();
            laid.records[0] += 1;
            open.extend(
                children.iter().zip(first..first + children.len()).rev().map(|(&child, at)| (child, at, depth + 1)),
            );
        }
        Ok(laid)
    }

    /// The engine's own wide tree as a laid tree, node for node. `binary` is the tree that it was made from.
    pub fn of_wide(wide: &WideTree<Aabb>, binary: &Tree<Aabb>, token: &CancelToken) -> Result<Self, Cancelled> {
        let mut laid = Self {
            tree: Tree { nodes: Vec::new(), primitive_indices: binary.primitive_indices.clone(), max_depth: 0 },
            references: Vec::new(),
            node_bytes: [
                size_of::<WideNode<<Aabb as WideContainer>::Bounds>>(),
                size_of::<WideNode<<Aabb as WideContainer>::Compact>>(),
            ],
            records: [wide.nodes.len(), wide.compact_nodes.len()],
            children: WIDTH,
            block: BLOCK,
        };
        let (Some(first), Some(root)) = (wide.root, binary.nodes.first()) else { return Ok(laid) };
        laid.push(root.container);
        let mut open = vec![(first, 0, 0_u32)];
        let mut steps = 0;
        while let Some((child, at, depth)) = open.pop() {
            steps += 1;
            token.check_every(MEDIUM_STEPS, steps)?;
            laid.tree.max_depth = laid.tree.max_depth.max(depth);
            laid.references[at] = child.bits();
            let container = laid.tree.nodes[at].container;
            if child.is_leaf() {
                let range = wide.leaves.range(child);
                laid.tree.nodes[at] = Node { container, first: range.first, count: range.count };
                continue;
            }
            let node: NodeRef<'_, Aabb> = wide.node(child);
            let numbers = laid.tree.nodes.len()..;
            let children = wide.children_of(child).zip(numbers.clone());
            let before = open.len();
            open.extend(children.map(|(child, at)| (child, at, depth + 1)));
            let count = open.len() - before;
            open[before..].reverse();
            (0..count).for_each(|lane| laid.push(node.load(lane)));
            laid.tree.nodes[at] = Node::interior(container, numbers.start as u32, count as u32);
        }
        Ok(laid)
    }

    /// Appends a node that is not yet set.
    fn push(&mut self, container: Aabb) {
        self.tree.nodes.push(Node { container, first: 0, count: 0 });
        self.references.push(0);
    }

    /// Form and number of the record of a node that has children.
    #[inline]
    pub(super) fn record(&self, node: usize) -> (usize, usize) {
        let child = Child::from_bits(self.references[node]);
        (usize::from(child.is_compact()), child.index())
    }

    /// Numbers of the tree.
    pub fn numbers(&self, token: &CancelToken) -> Result<LaidNumbers, Cancelled> {
        let nodes: usize = self.records.iter().sum();
        let mut numbers = LaidNumbers {
            nodes,
            node_bytes: self.records.iter().zip(self.node_bytes).map(|(records, bytes)| records * bytes).sum(),
            triangle_bytes: self.tree.primitive_indices.len() * TRIANGLE_BYTES,
            ..LaidNumbers::default()
        };
        let Some(root) = self.tree.nodes.first() else { return Ok(numbers) };
        let scale = self.tree.area_scale();
        let area = |node: &Node<Aabb>| f64::from(node.container.scaled(scale).relative_area());
        let (mut children, mut triangles) = (0, 0);
        for (at, node) in self.tree.nodes.iter().enumerate() {
            token.check_every(MEDIUM_STEPS, at)?;
            let (cost, bytes) = if node.is_leaf() {
                numbers.leaves += 1;
                triangles += node.count as usize;
                let count = f64::from(node.count);
                (count * f64::from(INTERSECTION_COST), count * TRIANGLE_BYTES as f64)
            } else {
                children += node.arity() as usize;
                (f64::from(TRAVERSAL_COST), self.node_bytes[self.record(at).0] as f64)
            };
            numbers.sah_cost += area(node) * cost;
            numbers.msah_bytes += area(node) * bytes;
        }
        let root_area = area(root);
        for sum in [&mut numbers.sah_cost, &mut numbers.msah_bytes] {
            *sum = if root_area > 0.0 { *sum / root_area } else { 0.0 };
        }
        numbers.fullness = if nodes > 0 { children as f64 / (nodes * self.children) as f64 } else { 0.0 };
        numbers.leaf_size = triangles as f64 / numbers.leaves as f64;
        Ok(numbers)
    }
}
