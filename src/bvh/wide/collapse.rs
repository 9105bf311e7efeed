//! From the binary tree to the wide one.
//!
//! Bottom-up, each subtree becomes a leaf where that is cheaper by the surface area heuristic; top-down, each wide node takes
//! a binary node and opens the largest of its children until it has eight (Wald, Benthin, Boulos: *Getting Rid of Packets*,
//! 2008). The work is shared out by subtrees, the same ones for any number of threads.

use std::collections::{HashMap, VecDeque};

use rayon::prelude::*;

use super::block::BLOCK;
use super::{Child, TriangleBlock, WIDTH, WideContainer, WideNode, WideTree};
use crate::bvh::{Node, Tree};
use crate::geometry::Triangle;

/// Cost of one binary node's part in a wide node, in the unit of testing a block.
const NODE_COST: f32 = 0.4;
/// Primitives that a wide leaf holds at most, unless a binary leaf holds more.
const MAX_LEAF: u32 = 16;
/// Binary nodes that one task gets on average, and how many tasks there are at most.
const TASK_NODES: usize = 4096;
const MAX_TASKS: usize = 1024;

/// A node of the part of the binary tree that one task looks at, in depth-first order.
struct Entry {
    node: u32,
    /// The position of the second child; the first one follows its parent. 0 for what is not opened.
    second: u32,
    /// Primitives below.
    primitives: u32,
    area: f32,
    /// Surface area times cost, summed over everything below.
    cost: f32,
    is_leaf: bool,
}

/// A part of the wide tree, with indices of its own.
struct Part<B> {
    nodes: Vec<WideNode<B>>,
    /// For each block the slots of its triangles in leaf order and whether it is its leaf's last.
    blocks: Vec<([u32; BLOCK], bool)>,
    root: Option<Child>,
}

/// What the top of the tree puts in place of a part until its place is known.
#[derive(Clone, Copy)]
struct Hole {
    node: usize,
    lane: usize,
    part: usize,
}

/// The wide tree of a binary one, whose triangles are given in leaf order. Any number of threads gives the same tree.
pub fn collapse<C: WideContainer>(tree: &Tree<C>, leaf_triangles: &[Triangle]) -> WideTree<C> {
    if tree.nodes.is_empty() {
        return WideTree { root: None, nodes: Vec::new(), blocks: Vec::new() };
    }
    let (top, tasks) = share_out(tree);
    let parts: Vec<Part<C::Bounds>> = tasks.par_iter().map(|&root| Builder::of_subtree(tree, root).part()).collect();
    let (mut nodes, holes) = top_nodes(tree, &top, &tasks);

    // Each part's nodes and blocks follow those of the part before.
    let (mut node_count, mut block_count) = (nodes.len(), 0);
    let mut places = Vec::with_capacity(parts.len());
    for part in &parts {
        places.push((node_count, block_count));
        node_count += part.nodes.len();
        block_count += part.blocks.len();
    }
    let moved = |child: Child, (node, block): (usize, usize)| {
        if child.is_leaf() { Child::leaf(child.index() + block) } else { Child::node(child.index() + node) }
    };
    let root_of = |part: usize| parts[part].root.map_or(Child::node(0), |root| moved(root, places[part]));
    for hole in holes {
        nodes[hole.node].children[hole.lane] = root_of(hole.part);
    }
    let root = if nodes.is_empty() { root_of(0) } else { Child::node(0) };

    // Zeroed memory is first touched, and so handed out, by the tasks.
    let top_nodes = nodes;
    let mut nodes: Vec<WideNode<C::Bounds>> = bytemuck::zeroed_vec(node_count);
    nodes[..top_nodes.len()].copy_from_slice(&top_nodes);
    let mut blocks: Vec<TriangleBlock> = bytemuck::zeroed_vec(block_count);
    let (mut rest_nodes, mut rest_blocks) = (&mut nodes[top_nodes.len()..], &mut blocks[..]);
    let mut work = Vec::with_capacity(parts.len());
    for (part, place) in parts.iter().zip(&places) {
        let (part_nodes, others) = rest_nodes.split_at_mut(part.nodes.len());
        let (part_blocks, other_blocks) = rest_blocks.split_at_mut(part.blocks.len());
        (rest_nodes, rest_blocks) = (others, other_blocks);
        work.push((part, *place, part_nodes, part_blocks));
    }
    work.into_par_iter().for_each(|(part, place, nodes, blocks)| {
        for (to, from) in nodes.iter_mut().zip(&part.nodes) {
            *to = WideNode { bounds: from.bounds, children: from.children.map(|child| moved(child, place)) };
        }
        for (to, &(slots, is_last)) in blocks.iter_mut().zip(&part.blocks) {
            let slots = slots.map(|slot| slot as usize);
            *to = TriangleBlock::new(
                slots.map(|slot| &leaf_triangles[slot]),
                slots.map(|slot| tree.primitive_indices[slot]),
                is_last,
            );
        }
    });
    WideTree { root: Some(root), nodes, blocks }
}

/// The nodes at the top, breadth first, that no task looks at, and the roots of the tasks.
fn share_out<C: WideContainer>(tree: &Tree<C>) -> (Vec<u32>, Vec<u32>) {
    let top_nodes = (tree.nodes.len() / TASK_NODES).min(MAX_TASKS);
    let (mut top, mut tasks) = (Vec::new(), Vec::new());
    let mut open = VecDeque::from([0]);
    while let Some(index) = open.pop_front() {
        let node: &Node<C> = &tree.nodes[index as usize];
        if top.len() < top_nodes && !node.is_leaf() {
            top.push(index);
            open.extend([node.first, node.first + 1]);
        } else {
            tasks.push(index);
        }
    }
    (top, tasks)
}

/// The wide nodes over the tasks' roots, with holes where those belong.
fn top_nodes<C: WideContainer>(tree: &Tree<C>, top: &[u32], tasks: &[u32]) -> (Vec<WideNode<C::Bounds>>, Vec<Hole>) {
    let (mut nodes, mut holes) = (Vec::new(), Vec::new());
    if top.is_empty() {
        return (nodes, holes);
    }
    // Where the top's nodes and the tasks' roots are in their lists.
    let part_of: HashMap<u32, usize> = tasks.iter().enumerate().map(|(part, &root)| (root, part)).collect();
    let mut open = vec![(0_u32, None::<(usize, usize)>)];
    while let Some((index, parent)) = open.pop() {
        let at = nodes.len();
        if let Some((node, lane)) = parent {
            let parent: &mut WideNode<C::Bounds> = &mut nodes[node];
            parent.children[lane] = Child::node(at);
        }
        let (lanes, count) = open_largest(
            index,
            |index| tree.nodes[index as usize].container.relative_area(),
            |index| {
                let first = tree.nodes[index as usize].first;
                (!part_of.contains_key(&index)).then_some([first, first + 1])
            },
        );
        let mut node = WideNode { bounds: C::NOTHING, children: [Child::node(0); WIDTH] };
        for (lane, &child) in lanes[..count].iter().enumerate() {
            tree.nodes[child as usize].container.store(&mut node.bounds, lane);
            match part_of.get(&child) {
                Some(&part) => holes.push(Hole { node: at, lane, part }),
                None => open.push((child, Some((at, lane)))),
            }
        }
        nodes.push(node);
    }
    (nodes, holes)
}

/// The children of a wide node: those of `root`, the largest opened as long as there is room.
fn open_largest(
    root: u32,
    area: impl Fn(u32) -> f32,
    children: impl Fn(u32) -> Option<[u32; 2]>,
) -> ([u32; WIDTH], usize) {
    let mut lanes = [0; WIDTH];
    // Negative where there is nothing to open.
    let mut areas = [-1.0_f32; WIDTH];
    let mut count = 0;
    let mut opened = children(root);
    let mut lane = 0;
    while let Some(pair) = opened {
        for (at, child) in [lane, count.max(1)].into_iter().zip(pair) {
            lanes[at] = child;
            areas[at] = if children(child).is_some() { area(child) } else { -1.0 };
        }
        count = count.max(1) + 1;
        if count == WIDTH {
            break;
        }
        lane = 0;
        for other in 1..count {
            if areas[other] > areas[lane] {
                lane = other;
            }
        }
        opened = if areas[lane] >= 0.0 { children(lanes[lane]) } else { None };
    }
    (lanes, count)
}

/// One task: a subtree in depth-first order, the first child right after its parent.
struct Builder<'a, C> {
    tree: &'a Tree<C>,
    entries: Vec<Entry>,
}

impl<'a, C: WideContainer> Builder<'a, C> {
    fn of_subtree(tree: &'a Tree<C>, root: u32) -> Self {
        let mut entries: Vec<Entry> = Vec::with_capacity(2 * TASK_NODES);
        // Nodes, second children with the position of their parent.
        let mut open = vec![(root, None)];
        while let Some((index, parent)) = open.pop() {
            let at = entries.len() as u32;
            if let Some(parent) = parent {
                let parent: &mut Entry = &mut entries[parent as usize];
                parent.second = at;
            }
            let node = &tree.nodes[index as usize];
            let (area, is_leaf) = (node.container.relative_area(), node.is_leaf());
            entries.push(Entry { node: index, second: 0, primitives: node.count, area, cost: 0.0, is_leaf });
            if !is_leaf {
                open.extend([(node.first + 1, Some(at)), (node.first, None)]);
            }
        }
        for at in (0..entries.len()).rev() {
            let Entry { second, mut primitives, area, is_leaf, .. } = entries[at];
            let mut split = f32::INFINITY;
            if !is_leaf {
                let children = [&entries[at + 1], &entries[second as usize]];
                primitives = children[0].primitives + children[1].primitives;
                split = area * NODE_COST + children[0].cost + children[1].cost;
            }
            let whole = area * (primitives as usize).div_ceil(BLOCK) as f32;
            let entry = &mut entries[at];
            entry.primitives = primitives;
            entry.is_leaf = is_leaf || primitives <= MAX_LEAF && whole <= split;
            entry.cost = whole.min(split);
        }
        Self { tree, entries }
    }

    fn part(&self) -> Part<C::Bounds> {
        let room = self.entries.len();
        let mut part = Part {
            nodes: Vec::with_capacity(room / 16),
            blocks: Vec::with_capacity(room / 5),
            root: Some(Child::node(0)),
        };
        if self.entries[0].is_leaf {
            part.root = Some(self.leaf(0, &mut part.blocks));
            return part;
        }
        let mut open = vec![(0, None::<(usize, usize)>)];
        while let Some((at, parent)) = open.pop() {
            let index = part.nodes.len();
            if let Some((node, lane)) = parent {
                part.nodes[node].children[lane] = Child::node(index);
            }
            let (lanes, count) = open_largest(
                at,
                |at| self.entries[at as usize].area,
                |at| {
                    let entry = &self.entries[at as usize];
                    (!entry.is_leaf).then_some([at + 1, entry.second])
                },
            );
            let mut node = WideNode { bounds: C::NOTHING, children: [Child::node(0); WIDTH] };
            for (lane, &child) in lanes[..count].iter().enumerate() {
                let entry = &self.entries[child as usize];
                self.tree.nodes[entry.node as usize].container.store(&mut node.bounds, lane);
                if entry.is_leaf {
                    node.children[lane] = self.leaf(child as usize, &mut part.blocks);
                }
            }
            let interior = (0..count).rev().filter(|&lane| !self.entries[lanes[lane] as usize].is_leaf);
            open.extend(interior.map(|lane| (lanes[lane], Some((index, lane)))));
            part.nodes.push(node);
        }
        part
    }

    /// Writes the blocks of the leaf at a position.
    fn leaf(&self, at: usize, blocks: &mut Vec<([u32; BLOCK], bool)>) -> Child {
        let leaf = Child::leaf(blocks.len());
        let mut missing = self.entries[at].primitives;
        let (mut block, mut filled) = ([0; BLOCK], 0);
        for entry in &self.entries[at..] {
            let node = &self.tree.nodes[entry.node as usize];
            for slot in node.first..node.first + node.count {
                // The last slot so far fills the lanes that follow.
                block[filled..].fill(slot);
                filled += 1;
                missing -= 1;
                if filled == BLOCK || missing == 0 {
                    blocks.push((block, missing == 0));
                    filled = 0;
                }
            }
            if missing == 0 {
                break;
            }
        }
        leaf
    }
}
