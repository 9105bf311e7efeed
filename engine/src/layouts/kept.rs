//! The nodes of a binary tree that a layout keeps, as the wide tree that they form.

use super::lay::LaidTree;
use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::geometry::Aabb;
use crate::kernel::parallel::zeros;
use crate::tree::levels::Levels;
use crate::tree::{Node, Tree};

/// Place of a binary node that is not kept.
const INSIDE: u32 = u32::MAX;

/// The wide tree of a layout by the numbers of the binary tree that was laid out. Nodes of that tree which lie inside of a wide node, or
/// below one of its leaves, are not kept.
#[derive(Debug)]
pub struct KeptNodes {
    laid: LaidTree,
    /// Of each node of [`LaidTree::tree`] its binary node, parent and depth.
    binary: Vec<u32>,
    parents: Vec<u32>,
    depths: Vec<u32>,
    /// Place of each binary node in it, or [`INSIDE`].
    places: Vec<u32>,
    first_leaf_depth: Option<u32>,
}

impl KeptNodes {
    /// The nodes that `laid` keeps of the binary tree that it was made of.
    pub fn new(laid: LaidTree, binary: &Tree<Aabb>, token: &CancelToken) -> Result<Self, Cancelled> {
        let nodes = &laid.tree.nodes;
        let (wanted, slots) = (slots_below(nodes, token)?, slots_below(&binary.nodes, token)?);
        let mut kept = Self {
            binary: zeros(nodes.len(), token)?,
            parents: zeros(nodes.len(), token)?,
            depths: zeros(nodes.len(), token)?,
            places: vec![INSIDE; binary.nodes.len()],
            first_leaf_depth: None,
            laid,
        };
        for (at, wanted) in wanted.into_iter().enumerate() {
            token.check_every(LIGHT_STEPS, at)?;
            // Parents come first, so the descent starts at the node of the parent.
            let mut node = kept.binary[kept.parents[at] as usize];
            while slots[node as usize] != wanted {
                debug_assert!(!binary.nodes[node as usize].is_leaf(), "leaves are not divided");
                let [left, right] = [0, 1].map(|side| binary.nodes[node as usize].first + side);
                node = if wanted[0] < slots[right as usize][0] { left } else { right };
            }
            (kept.binary[at], kept.places[node as usize]) = (node, at as u32);
            let own = kept.laid.tree.nodes[at];
            if own.is_leaf() {
                let depth = kept.depths[at];
                kept.first_leaf_depth = Some(kept.first_leaf_depth.map_or(depth, |first| first.min(depth)));
            }
            let children = own.children();
            let (children, depth) = (children.start as usize..children.end as usize, kept.depths[at] + 1);
            kept.parents[children.clone()].fill(at as u32);
            kept.depths[children].fill(depth);
        }
        Ok(kept)
    }

    /// The wide tree itself.
    pub fn laid(&self) -> &LaidTree {
        &self.laid
    }

    /// Number of nodes of the wide tree, leaves included.
    pub fn len(&self) -> usize {
        self.laid.tree.nodes.len()
    }

    /// The tree has no nodes.
    pub fn is_empty(&self) -> bool {
        self.laid.tree.nodes.is_empty()
    }

    fn place(&self, node: u32) -> Option<usize> {
        self.places.get(node as usize).filter(|place| **place != INSIDE).map(|place| *place as usize)
    }

    /// `node` is a node or a leaf of the wide tree.
    pub fn keeps(&self, node: u32) -> bool {
        self.place(node).is_some()
    }

    /// The children of a kept node in the wide tree; none for a leaf of it, and for a node that is not kept.
    pub fn children(&self, node: u32) -> &[u32] {
        let children = self.place(node).map_or(0..0, |place| self.laid.tree.nodes[place].children());
        &self.binary[children.start as usize..children.end as usize]
    }

    /// The parent of a kept node in the wide tree; `None` for the root and for a node that is not kept.
    pub fn parent(&self, node: u32) -> Option<u32> {
        let place = self.place(node).filter(|place| *place > 0)?;
        Some(self.binary[self.parents[place] as usize])
    }

    /// Depth of a kept node in the wide tree, root 0.
    pub fn depth(&self, node: u32) -> Option<u32> {
        self.place(node).map(|place| self.depths[place])
    }

    /// Depth of the highest leaf in the wide tree; `None` without nodes.
    pub fn first_leaf_depth(&self) -> Option<u32> {
        self.first_leaf_depth
    }

    /// Number of triangles of a leaf of the wide tree; 0 for other nodes.
    pub fn leaf_size(&self, node: u32) -> u32 {
        self.place(node).map_or(0, |place| self.laid.tree.nodes[place].slots().len() as u32)
    }

    /// The box of a kept node as its parent stores it; that of the root as it is.
    pub fn stored_box(&self, node: u32) -> Option<Aabb> {
        self.place(node).map(|place| self.laid.tree.nodes[place].container)
    }

    /// The kept nodes, children behind their parents.
    pub fn nodes(&self) -> &[u32] {
        &self.binary
    }

    /// The kept nodes by their depth in the wide tree.
    pub fn levels(&self) -> Levels {
        let deepest = self.depths.iter().max().map_or(0, |deepest| *deepest as usize + 1);
        let mut by_depth: Vec<Vec<u32>> = vec![Vec::new(); deepest];
        for (&node, &depth) in self.binary.iter().zip(&self.depths) {
            by_depth[depth as usize].push(node);
        }
        for nodes in &mut by_depth {
            nodes.sort_unstable();
        }
        Levels::of(by_depth)
    }
}

/// The first slot and the number of slots below each node.
fn slots_below(nodes: &[Node<Aabb>], token: &CancelToken) -> Result<Vec<[u32; 2]>, Cancelled> {
    let mut slots: Vec<[u32; 2]> = zeros(nodes.len(), token)?;
    for (at, node) in nodes.iter().enumerate().rev() {
        token.check_every(LIGHT_STEPS, at)?;
        slots[at] = if node.is_leaf() {
            [node.first, node.count]
        } else {
            let children = node.children().map(|child| slots[child as usize]);
            // The engine's own nodes have their children in the order of visits.
            children.fold([u32::MAX, 0], |[first, all], [start, count]| [first.min(start), all + count])
        };
    }
    Ok(slots)
}
