//! The tree: a flat list of nodes.

use std::ops::Range;

use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::geometry::{Aabb, Dop14, OrientedBox, Sphere, Triangle, area_scale};
use crate::kernel::parallel::{par_collect, par_tasks, zeros};

use crate::geometry::{Container, ContainerKind};

/// Bit of [`Node::count`] that marks an interior node with another number of children than two.
const OTHER_ARITY: u32 = 1 << 31;

/// A leaf or an interior node:
///
/// - leaf: holds the primitives `first..first + count` of [`Tree::primitive_indices`], at least one;
/// - interior node: its children are neighbours from `first` on. `count` is 0 where they are two, as in every tree that this crate
///   builds; trees of other builders may have 1 to 32, see [`Node::interior`].
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Zeroable)]
#[repr(C)]
pub struct Node<C> {
    /// Bounding volume of everything below.
    pub container: C,
    /// Index of the first primitive of a leaf, of the first child of an interior node.
    pub first: u32,
    /// Number of primitives of a leaf; 0 for an interior node with two children, negative as a signed number for any other.
    pub count: u32,
}

impl<C> Node<C> {
    /// Most children of a node.
    pub const MAX_ARITY: u32 = 32;

    /// An interior node with `arity` children, 1 to [`Node::MAX_ARITY`], from node `first` on.
    pub const fn interior(container: C, first: u32, arity: u32) -> Self {
        debug_assert!(0 < arity && arity <= Self::MAX_ARITY);
        Self { container, first, count: if arity == 2 { 0 } else { OTHER_ARITY | arity } }
    }

    /// Whether the node holds primitives rather than children.
    #[inline(always)]
    pub const fn is_leaf(&self) -> bool {
        self.count as i32 > 0
    }

    /// Number of children; 0 for a leaf.
    #[inline]
    pub const fn arity(&self) -> u32 {
        match self.count {
            0 => 2,
            leaf if leaf < OTHER_ARITY => 0,
            other => other - OTHER_ARITY,
        }
    }

    /// Indices of the children; none for a leaf.
    #[inline]
    pub const fn children(&self) -> Range<u32> {
        // An empty range at 0 slices any list; the slot of a primitive may lie beyond it.
        if self.is_leaf() { 0..0 } else { self.first..self.first + self.arity() }
    }

    /// Range of the primitives in [`Tree::primitive_indices`]; none for an interior node.
    #[inline]
    pub const fn slots(&self) -> Range<usize> {
        // As for the children.
        if self.is_leaf() { self.first as usize..(self.first + self.count) as usize } else { 0..0 }
    }
}

/// A bounding volume hierarchy. Node 0 is the root; children follow their parents; siblings are neighbours. An empty tree has
/// no nodes.
///
/// All builders of this crate make binary trees: each interior node has two children. A tree from elsewhere may have 1 to 32
/// children for each, and everything in [`tree`](crate::tree) takes it as it is; functions that need a binary one document it, and
/// [`binarize`](super::binarize::binarize) makes it.
///
/// Where the root is a leaf there is no container to test: a traversal tests its primitives directly.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree<C> {
    /// All nodes; a parent always comes before its children.
    pub nodes: Vec<Node<C>>,
    /// Index of each primitive in the list that the tree was built from, in leaf order: leaves from left to right, so that the
    /// primitives below any node are contiguous.
    pub primitive_indices: Vec<u32>,
    /// Depth of the deepest node; the root's is 0.
    pub max_depth: u32,
}

/// A tree of boxes, of spheres, of polytopes or of oriented boxes.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyTree {
    /// A tree of boxes.
    Aabb(Tree<Aabb>),
    /// A tree of spheres.
    Sphere(Tree<Sphere>),
    /// A tree of polytopes.
    Dop14(Tree<Dop14>),
    /// A tree of oriented boxes.
    Oriented(Tree<OrientedBox>),
}

/// Evaluates an expression for any kind of tree: `with_tree!(any, tree => expression)`.
///
/// ```
/// use bvhscope_engine::{AnyTree, ContainerKind, with_tree};
/// use bvhscope_engine::tree::Tree;
///
/// let any = AnyTree::Sphere(Tree::EMPTY);
/// assert_eq!(with_tree!(&any, tree => tree.nodes.len()), 0);
/// assert_eq!(any.container_kind(), ContainerKind::Sphere);
/// ```
#[macro_export]
macro_rules! with_tree {
    ($any:expr, $tree:ident => $body:expr) => {
        match $any {
            $crate::tree::AnyTree::Aabb($tree) => $body,
            $crate::tree::AnyTree::Sphere($tree) => $body,
            $crate::tree::AnyTree::Dop14($tree) => $body,
            $crate::tree::AnyTree::Oriented($tree) => $body,
        }
    };
}

/// [`with_tree!`] for what only containers of builders can do; `$oriented` for a tree of oriented boxes.
macro_rules! with_built_tree {
    ($any:expr, $tree:ident => $body:expr, $boxes:ident => $oriented:expr) => {
        match $any {
            $crate::tree::AnyTree::Aabb($tree) => $body,
            $crate::tree::AnyTree::Sphere($tree) => $body,
            $crate::tree::AnyTree::Dop14($tree) => $body,
            $crate::tree::AnyTree::Oriented($boxes) => $oriented,
        }
    };
}

pub(crate) use with_built_tree;

impl From<Tree<Aabb>> for AnyTree {
    fn from(tree: Tree<Aabb>) -> Self {
        Self::Aabb(tree)
    }
}

impl From<Tree<Sphere>> for AnyTree {
    fn from(tree: Tree<Sphere>) -> Self {
        Self::Sphere(tree)
    }
}

impl From<Tree<Dop14>> for AnyTree {
    fn from(tree: Tree<Dop14>) -> Self {
        Self::Dop14(tree)
    }
}

impl From<Tree<OrientedBox>> for AnyTree {
    fn from(tree: Tree<OrientedBox>) -> Self {
        Self::Oriented(tree)
    }
}

impl<C: Container> Tree<C> {
    /// Depth of each node, in the order of [`Tree::nodes`]; the root has 0.
    pub fn depths(&self, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
        let mut depths = zeros::<u32>(self.nodes.len(), token)?;
        for (index, node) in self.nodes.iter().enumerate() {
            token.check_every(LIGHT_STEPS, index)?;
            for child in node.children() {
                depths[child as usize] = depths[index] + 1;
            }
        }
        Ok(depths)
    }

    /// [`Container::relative_area`] of a node, multiplied by the same number for all nodes of the tree: 1 but for trees so small or large
    /// that areas would leave the range of single precision.
    #[inline]
    pub fn area(&self, node: u32) -> f32 {
        self.nodes[node as usize].container.scaled(self.area_scale()).relative_area()
    }

    /// The factor on coordinates, a power of two, that [`Tree::area`] applies.
    #[inline]
    pub(crate) fn area_scale(&self) -> f32 {
        self.nodes.first().map_or(1.0, |root| area_scale(root.container.bounds().extent().max_element()))
    }

    /// Index of each node's parent, in the order of [`Tree::nodes`]; the root has its own.
    pub fn parents(&self, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
        let mut parents = zeros(self.nodes.len(), token)?;
        for (index, node) in self.nodes.iter().enumerate() {
            token.check_every(LIGHT_STEPS, index)?;
            for child in node.children() {
                parents[child as usize] = index as u32;
            }
        }
        Ok(parents)
    }

    /// The triangles in leaf order, one for each slot of [`Tree::primitive_indices`], so that a leaf's range indexes them directly.
    /// `triangles` is the list that the tree was built from.
    pub fn leaf_triangles(&self, triangles: &[Triangle], token: &CancelToken) -> Result<Vec<Triangle>, Cancelled> {
        par_collect(self.primitive_indices.len(), token, |slot| triangles[self.primitive_indices[slot] as usize])
    }

    /// Index of the first primitive below `node`, in leaf order; `None` where there is no such node.
    pub fn first_primitive_below(&self, node: u32) -> Option<u32> {
        let mut node = self.nodes.get(node as usize)?;
        while !node.is_leaf() {
            node = &self.nodes[node.first as usize];
        }
        self.primitive_indices.get(node.first as usize).copied()
    }

    /// The tree below `node`, with `node` as its root; primitives keep their indices in the list that this tree was built from.
    ///
    /// # Errors
    ///
    /// Once `token` is cancelled.
    ///
    /// # Panics
    ///
    /// If there is no such node.
    pub fn below(&self, node: u32, token: &CancelToken) -> Result<Self, Cancelled> {
        let mut nodes = vec![self.nodes[node as usize]];
        let (mut depths, [mut start, mut end]) = (vec![0], [usize::MAX, 0]);
        let mut index = 0;
        while index < nodes.len() {
            token.check_every(LIGHT_STEPS, index)?;
            let (node, first) = (nodes[index], nodes.len() as u32);
            if node.is_leaf() {
                [start, end] = [start.min(node.slots().start), end.max(node.slots().end)];
            } else {
                nodes[index].first = first;
                nodes.extend(node.children().map(|child| self.nodes[child as usize]));
                depths.resize(nodes.len(), depths[index] + 1);
            }
            index += 1;
        }
        for leaf in nodes.iter_mut().filter(|node| node.is_leaf()) {
            leaf.first -= start as u32;
        }
        let max_depth = depths.last().copied().unwrap_or(0);
        Ok(Self { nodes, primitive_indices: self.primitive_indices[start..end].to_vec(), max_depth })
    }

    /// Whether each interior node has two children. Takes a pass over the tree, on all threads.
    pub fn is_binary(&self, token: &CancelToken) -> Result<bool, Cancelled> {
        let bits = par_tasks(self.nodes.chunks(LIGHT_STEPS), token, |nodes, _| {
            // Without branches: leaves have their number of primitives, interior nodes with two children 0.
            Ok(nodes.iter().fold(0, |bits, node| bits | node.count))
        })?;
        Ok(bits.iter().all(|bits| bits & OTHER_ARITY == 0))
    }

    /// Bytes of nodes and primitive indices.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.primitive_indices[..])
    }
}

impl<C> Tree<C> {
    /// The tree without nodes and primitives.
    pub const EMPTY: Self = Self { nodes: Vec::new(), primitive_indices: Vec::new(), max_depth: 0 };
}

impl AnyTree {
    /// Kind of the containers.
    pub fn container_kind(&self) -> ContainerKind {
        match self {
            Self::Aabb(_) => ContainerKind::Aabb,
            Self::Sphere(_) => ContainerKind::Sphere,
            Self::Dop14(_) => ContainerKind::Dop14,
            Self::Oriented(_) => ContainerKind::Oriented,
        }
    }

    /// Number of nodes, leaves included.
    pub fn node_count(&self) -> usize {
        with_tree!(self, tree => tree.nodes.len())
    }

    /// Depth of the deepest node; the root's is 0.
    pub fn max_depth(&self) -> u32 {
        with_tree!(self, tree => tree.max_depth)
    }

    /// Index of each primitive in the list that the tree was built from, in leaf order.
    pub fn primitive_indices(&self) -> &[u32] {
        with_tree!(self, tree => &tree.primitive_indices)
    }

    /// The triangles in leaf order; see [`Tree::leaf_triangles`].
    pub fn leaf_triangles(&self, triangles: &[Triangle], token: &CancelToken) -> Result<Vec<Triangle>, Cancelled> {
        with_tree!(self, tree => tree.leaf_triangles(triangles, token))
    }

    /// Index of the first primitive below `node`; see [`Tree::first_primitive_below`].
    pub fn first_primitive_below(&self, node: u32) -> Option<u32> {
        with_tree!(self, tree => tree.first_primitive_below(node))
    }

    /// Bytes of nodes and primitive indices.
    pub fn bytes(&self) -> usize {
        with_tree!(self, tree => tree.bytes())
    }
}
