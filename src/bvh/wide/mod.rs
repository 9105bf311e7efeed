//! The tree that pictures are traced with: up to eight children a node and four triangles a block, tested side by side. Made
//! from the binary tree, whose hits it gives exactly.

/// The three values of an expression in an axis, corner or part. A macro, because closures need not become part of the
/// function around them and then lose its vector instructions.
macro_rules! each {
    ($part:ident => $value:expr) => {
        [
            {
                let $part = 0_usize;
                $value
            },
            {
                let $part = 1_usize;
                $value
            },
            {
                let $part = 2_usize;
                $value
            },
        ]
    };
}

mod beam;
pub mod block;
pub mod bounds;
mod choice;
mod collapse;
mod cost;
mod opening;
mod packed;
pub mod packet;
pub(super) mod prefetch;
pub mod single;
mod stack;
mod stream;
mod weigh;

use bytemuck::{Pod, Zeroable};
use fearless_simd::{Level, dispatch};

pub use block::TriangleBlock;
pub use bounds::WideContainer;
pub use collapse::collapse;

use super::traverse::{NoProbe, Probe};
use crate::geometry::{Aabb, Hit, Ray, Sphere};

/// Children of a node.
pub const WIDTH: usize = 8;

/// Where a child is: another node, or the first block of a leaf.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Child(u32);

impl Child {
    /// Marks leaves.
    const LEAF: u32 = 1 << 31;
    /// The first node.
    const ROOT: Self = Self(0);

    fn node(index: usize) -> Self {
        Self(index as u32)
    }

    fn leaf(first_block: usize) -> Self {
        Self(first_block as u32 | Self::LEAF)
    }

    /// Whether it is a leaf.
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// The index of the node or of the leaf's first block.
    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & !Self::LEAF) as usize
    }
}

/// A node: the containers of its children, lane by lane, and where they are. Lanes without child hold a container that
/// nothing enters.
#[derive(Debug, Clone, Copy, PartialEq, Zeroable)]
#[repr(C, align(32))]
pub struct WideNode<B> {
    /// The children's containers.
    pub bounds: B,
    /// The children.
    pub children: [Child; WIDTH],
}

/// A hierarchy of wide nodes over triangle blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct WideTree<C: WideContainer> {
    /// Where rays begin; `None` for a tree without primitives.
    pub root: Option<Child>,
    /// All nodes; a parent comes before its children.
    pub nodes: Vec<WideNode<C::Bounds>>,
    /// The triangles, leaf by leaf.
    pub blocks: Vec<TriangleBlock>,
}

impl<C: WideContainer> WideTree<C> {
    /// Has a child fetched, which need not exist.
    #[inline(always)]
    fn prefetch(&self, child: Child) {
        if child.is_leaf() {
            prefetch::prefetch(&self.blocks, child.index());
        } else {
            prefetch::prefetch(&self.nodes, child.index());
        }
    }

    /// [`WideTree::prefetch`] without a branch.
    #[inline(always)]
    fn prefetch_any(&self, child: Child) {
        let list = usize::from(child.is_leaf());
        let address = [self.nodes.as_ptr().cast::<u8>(), self.blocks.as_ptr().cast()][list];
        let size = [size_of::<WideNode<C::Bounds>>(), size_of::<TriangleBlock>()][list];
        prefetch::prefetch_four_lines(address.wrapping_add(child.index() * size), size);
    }

    /// Bytes of nodes.
    pub fn node_bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
    }

    /// Bytes of triangles.
    pub fn block_bytes(&self) -> usize {
        size_of_val(&self.blocks[..])
    }
}

/// A wide tree of either container.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyWideTree {
    /// Of boxes.
    Aabb(WideTree<Aabb>),
    /// Of spheres.
    Sphere(WideTree<Sphere>),
}

/// Runs the same code for either kind of wide tree: `with_wide_tree!(any, tree => expression)`.
#[macro_export]
macro_rules! with_wide_tree {
    ($any:expr, $tree:ident => $body:expr) => {
        match $any {
            $crate::bvh::wide::AnyWideTree::Aabb($tree) => $body,
            $crate::bvh::wide::AnyWideTree::Sphere($tree) => $body,
        }
    };
}

impl From<WideTree<Aabb>> for AnyWideTree {
    fn from(tree: WideTree<Aabb>) -> Self {
        Self::Aabb(tree)
    }
}

impl From<WideTree<Sphere>> for AnyWideTree {
    fn from(tree: WideTree<Sphere>) -> Self {
        Self::Sphere(tree)
    }
}

impl AnyWideTree {
    /// The nearest hit of one ray: exactly what the binary tree gives.
    #[inline]
    pub fn closest_hit(&self, level: Level, ray: &Ray) -> Option<Hit> {
        self.closest_hit_with(level, ray, &mut NoProbe)
    }

    /// [`AnyWideTree::closest_hit`], watched by `probe`: nodes are counted as containers, blocks as primitives.
    #[inline]
    pub fn closest_hit_with<P: Probe>(&self, level: Level, ray: &Ray, probe: &mut P) -> Option<Hit> {
        with_wide_tree!(self, tree => dispatch!(level, simd => single::closest_hit(simd, tree, ray, probe)))
    }

    /// Whether anything lies on `ray` between its `t_min` and `t_max`.
    #[inline]
    pub fn any_hit(&self, level: Level, ray: &Ray) -> bool {
        self.any_hit_with(level, ray, &mut NoProbe)
    }

    /// [`AnyWideTree::any_hit`], watched by `probe`: nodes are counted as containers, blocks as primitives.
    #[inline]
    pub fn any_hit_with<P: Probe>(&self, level: Level, ray: &Ray, probe: &mut P) -> bool {
        with_wide_tree!(self, tree => dispatch!(level, simd => single::any_hit(simd, tree, ray, probe)))
    }

    /// Whether anything lies on each of `rays`, into the first elements of `blocked`: faster than ray by ray, the more so the
    /// larger the tree is.
    ///
    /// # Panics
    ///
    /// Where `blocked` is shorter than `rays`.
    pub fn any_hits(&self, level: Level, rays: &[Ray], blocked: &mut [bool]) {
        assert!(blocked.len() >= rays.len(), "{} answers for {} rays", blocked.len(), rays.len());
        with_wide_tree!(self, tree => dispatch!(level, simd => stream::any_hits(simd, tree, rays, blocked)));
    }

    /// The nearest hits of `rays`, into the first elements of `hits`; see [`packet::closest_hits`].
    pub fn closest_hits(&self, level: Level, rays: &[Ray], hits: &mut [Option<Hit>]) {
        with_wide_tree!(self, tree => packet::closest_hits(level, tree, rays, hits));
    }

    /// Bytes of nodes.
    pub fn node_bytes(&self) -> usize {
        with_wide_tree!(self, tree => tree.node_bytes())
    }

    /// Bytes of triangles.
    pub fn triangle_bytes(&self) -> usize {
        with_wide_tree!(self, tree => tree.block_bytes())
    }
}
