//! The tree over copies with trees of meshes unfolded below it: both levels as one tree, to be looked at.

use std::ops::Range;

use glam::Vec3;

use super::copies::{MeshCopies, PlacedMesh};
use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::geometry::{Aabb, OrientedBox, Placement};
use crate::tree::{Node, Tree};

/// A node of the tree over copies, or of the tree of a mesh below one of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LevelNode {
    /// Of the tree over the copies.
    Above {
        /// Its index there.
        node: u32,
    },
    /// Of a mesh.
    Below {
        /// The copy below which it is.
        copy: u32,
        /// Its index in the tree of the mesh.
        node: u32,
    },
}

/// A copy whose mesh is unfolded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnfoldedCopy {
    /// The copy.
    pub copy: u32,
    /// The primitive that the first triangle of its mesh becomes; the others follow in order.
    pub first: u32,
}

/// The tree over copies, below whose leaves the trees of some copies' meshes go on. Primitives are the copies that are not unfolded, by their
/// indices, and the triangles of the others.
///
/// The boxes of a mesh are turned and skewed as the copy is, which has them tested in the mesh's own coordinates. A leaf of the tree over
/// the copies becomes the parent of the roots of the meshes that are unfolded in it, and of a leaf of the copies that are not.
#[derive(Debug)]
pub struct Unfolded {
    /// The node that each of its nodes stands for; of the leaf of the copies that are not unfolded, in a leaf where others are, that leaf.
    pub origins: Vec<LevelNode>,
    copies: Vec<UnfoldedCopy>,
    /// The node that each of the tree over the copies became.
    above: Vec<u32>,
    /// Those of the trees of the meshes, copy by copy.
    below: Vec<u32>,
    /// Where those of each copy begin, and behind them the end.
    begins: Vec<usize>,
}

/// The numbers of the nodes of a mesh and of its triangles in an [`Unfolded`] tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Numbers<'a> {
    pub(super) nodes: &'a [u32],
    pub(super) first: u32,
}

impl Unfolded {
    /// The tree in which `copies`, in ascending order, are unfolded below `top`, a tree over boxes of all copies, in order, and what its nodes are.
    /// Those of meshes without triangles stay as they are.
    ///
    /// # Errors
    ///
    /// Once `token` is cancelled.
    pub fn new(
        meshes: &MeshCopies,
        top: &Tree<Aabb>,
        copies: &[UnfoldedCopy],
        token: &CancelToken,
    ) -> Result<(Tree<OrientedBox>, Self), Cancelled> {
        let copies: Vec<UnfoldedCopy> =
            copies.iter().copied().filter(|unfolded| meshes.whole(unfolded.copy).is_some()).collect();
        let mut begins = vec![0];
        for unfolded in &copies {
            let nodes = meshes.binary_tree(meshes.copies().mesh(unfolded.copy)).nodes.len();
            begins.push(begins.last().copied().unwrap_or_default() + nodes);
        }
        let below = vec![0; begins.last().copied().unwrap_or_default()];
        let tree = Tree { nodes: Vec::new(), primitive_indices: Vec::new(), max_depth: 0 };
        let unfolded = Self { origins: Vec::new(), copies, above: vec![0; top.nodes.len()], below, begins };
        Unfolding { meshes, top, tree, unfolded, open: Vec::new() }.finish(token)
    }

    /// The copies that are unfolded, in ascending order.
    pub fn copies(&self) -> &[UnfoldedCopy] {
        &self.copies
    }

    /// The node that the root of a copy's mesh became; `None` where the copy is not unfolded.
    pub fn root_of(&self, copy: u32) -> Option<u32> {
        self.below(copy)?.nodes.first().copied()
    }

    /// The nodes that those of the tree over the copies became.
    pub fn above(&self) -> &[u32] {
        &self.above
    }

    /// The numbers of what is below a copy; `None` where it is not unfolded.
    pub(super) fn below(&self, copy: u32) -> Option<Numbers<'_>> {
        let at = self.find(copy)?;
        Some(Numbers { nodes: &self.below[self.range(at)], first: self.copies[at].first })
    }

    fn find(&self, copy: u32) -> Option<usize> {
        self.copies.binary_search_by_key(&copy, |unfolded| unfolded.copy).ok()
    }

    fn range(&self, at: usize) -> Range<usize> {
        self.begins[at]..self.begins[at + 1]
    }
}

/// A node whose children are to be added.
struct Open {
    index: u32,
    depth: u32,
    /// Of a node of a mesh, where its copy stands among those that are unfolded.
    at: Option<usize>,
}

struct Unfolding<'a> {
    meshes: &'a MeshCopies,
    top: &'a Tree<Aabb>,
    tree: Tree<OrientedBox>,
    unfolded: Unfolded,
    open: Vec<Open>,
}

impl Unfolding<'_> {
    fn finish(mut self, token: &CancelToken) -> Result<(Tree<OrientedBox>, Unfolded), Cancelled> {
        if let Some(root) = self.top.nodes.first() {
            self.add(OrientedBox::plain(root.container), LevelNode::Above { node: 0 }, None, 0);
        }
        // Depth first, so that primitives are in the order of the leaves.
        while let Some(open) = self.open.pop() {
            token.check_every(LIGHT_STEPS, self.tree.nodes.len())?;
            let before = self.open.len();
            match (self.unfolded.origins[open.index as usize], open.at) {
                (LevelNode::Below { node, .. }, Some(at)) => self.go_on_below(&open, at, node),
                (LevelNode::Above { node } | LevelNode::Below { node, .. }, _) => self.go_on_above(&open, node),
            }
            self.open[before..].reverse();
        }
        Ok((self.tree, self.unfolded))
    }

    /// Adds a node whose children follow, of the copy `at` or of the tree above.
    fn add(&mut self, container: OrientedBox, origin: LevelNode, at: Option<usize>, depth: u32) {
        let index = self.tree.nodes.len() as u32;
        match (origin, at) {
            (LevelNode::Below { node, .. }, Some(at)) => {
                let begin = self.unfolded.begins[at];
                self.unfolded.below[begin + node as usize] = index;
            }
            (LevelNode::Above { node } | LevelNode::Below { node, .. }, _) => {
                self.unfolded.above[node as usize] = index;
            }
        }
        self.tree.nodes.push(Node { container, first: 0, count: 0 });
        self.tree.max_depth = self.tree.max_depth.max(depth);
        self.unfolded.origins.push(origin);
        self.open.push(Open { index, depth, at });
    }

    /// Makes the node an interior one, whose children are added next.
    fn make_parent(&mut self, index: u32, arity: u32) {
        let first = self.tree.nodes.len() as u32;
        let node = &mut self.tree.nodes[index as usize];
        *node = Node::interior(node.container, first, arity);
    }

    /// Makes the node a leaf.
    fn make_leaf(&mut self, index: u32, primitives: impl Iterator<Item = u32>) {
        let tree = &mut self.tree;
        let first = tree.primitive_indices.len();
        tree.primitive_indices.extend(primitives);
        let node = &mut tree.nodes[index as usize];
        (node.first, node.count) = (first as u32, (tree.primitive_indices.len() - first) as u32);
    }

    fn go_on_above(&mut self, open: &Open, node: u32) {
        let top = self.top;
        let node = &top.nodes[node as usize];
        if !node.is_leaf() {
            self.make_parent(open.index, node.arity());
            for child in node.children() {
                let container = OrientedBox::plain(top.nodes[child as usize].container);
                self.add(container, LevelNode::Above { node: child }, None, open.depth + 1);
            }
            return;
        }
        let copies = &top.primitive_indices[node.slots()];
        let is_folded = |copy: &&u32| self.unfolded.find(**copy).is_none();
        let folded: Vec<u32> = copies.iter().filter(is_folded).copied().collect();
        if folded.len() == copies.len() {
            self.make_leaf(open.index, folded.into_iter());
            return;
        }
        self.make_parent(open.index, (copies.len() - folded.len()) as u32 + u32::from(!folded.is_empty()));
        if !folded.is_empty() {
            self.add_folded(open, &folded, &node.container);
        }
        for &copy in copies {
            let Some(at) = self.unfolded.find(copy) else { continue };
            let PlacedMesh { mesh, place } = self.meshes.placed(copy);
            let root = &self.meshes.binary_tree(*mesh).nodes[0];
            let container = placed(place, &root.container, &node.container);
            self.add(container, LevelNode::Below { copy, node: 0 }, Some(at), open.depth + 1);
        }
    }

    /// The leaf of the copies that are not unfolded, in a leaf within `bounds` where others are.
    fn add_folded(&mut self, open: &Open, folded: &[u32], bounds: &Aabb) {
        let around = folded.iter().fold(Aabb::EMPTY, |all, &copy| {
            let PlacedMesh { mesh, place } = self.meshes.placed(copy);
            let root = self.meshes.binary_tree(*mesh).nodes.first();
            all.union(&root.map_or(Aabb::EMPTY, |root| place.bounds(&root.container)))
        });
        let container = OrientedBox::plain(around.intersection(bounds));
        let tree = &mut self.tree;
        let index = tree.nodes.len() as u32;
        tree.nodes.push(Node { container, first: 0, count: 0 });
        tree.max_depth = tree.max_depth.max(open.depth + 1);
        let origin = self.unfolded.origins[open.index as usize];
        self.unfolded.origins.push(origin);
        self.make_leaf(index, folded.iter().copied());
    }

    fn go_on_below(&mut self, open: &Open, at: usize, node: u32) {
        let UnfoldedCopy { copy, first } = self.unfolded.copies[at];
        let PlacedMesh { mesh, place } = self.meshes.placed(copy);
        let tree = self.meshes.binary_tree(*mesh);
        let node = &tree.nodes[node as usize];
        if node.is_leaf() {
            let triangles = &tree.primitive_indices[node.slots()];
            self.make_leaf(open.index, triangles.iter().map(|triangle| first + triangle));
            return;
        }
        let within = self.tree.nodes[open.index as usize].container.bounds;
        self.make_parent(open.index, node.arity());
        for child in node.children() {
            let container = placed(place, &tree.nodes[child as usize].container, &within);
            self.add(container, LevelNode::Below { copy, node: child }, Some(at), open.depth + 1);
        }
    }
}

/// The box `bounds` of a mesh in the world, turned and skewed as the copy is; what it encloses is known to lie `within`.
fn placed(place: &Placement, bounds: &Aabb, within: &Aabb) -> OrientedBox {
    let around = place.bounds(bounds).intersection(within);
    if place.is_singular() {
        return OrientedBox::plain(around);
    }
    let (planes, intervals) = place.planes(bounds);
    OrientedBox::between(around, planes.map(Vec3::from_array), intervals)
}
