//! Copies of meshes, and the parts of them that a tree over them is built of.

use std::collections::BinaryHeap;
use std::sync::Arc;

use arrayvec::ArrayVec;
use glam::Affine3A;

use crate::builders::BuildError;
use crate::bvh::Bvh;
use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS, MEDIUM_STEPS};
use crate::geometry::{Aabb, Placement};
use crate::tree::{AnyTree, Tree};
use crate::wide::layout::WIDTH;
use crate::wide::{AnyWideTree, Child, WideTree};

/// A copy of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// Index of the mesh.
    pub mesh: u32,
    /// From the coordinates of the mesh to those of the world.
    pub transform: Affine3A,
}

/// Where copies of meshes stand.
#[derive(Debug, PartialEq)]
pub struct Copies(Vec<PlacedMesh>);

/// A copy and its mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlacedMesh {
    pub(super) mesh: u32,
    pub(super) place: Placement,
}

/// Copies of meshes: one hierarchy for each mesh, however many copies it has.
#[derive(Debug)]
pub struct MeshCopies {
    meshes: Vec<Arc<Bvh>>,
    copies: Arc<Copies>,
    /// Depth of the deepest binary tree of a mesh.
    depth: u32,
}

/// A copy of a mesh, or of what is below a node of its tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    pub(super) copy: u32,
    pub(super) start: Child,
}

impl Copies {
    /// Copies of meshes that lie within `bounds`, a box each; empty for a mesh without triangles.
    ///
    /// # Errors
    ///
    /// [`BuildError::Cancelled`] once `token` is cancelled. [`BuildError::Refused`] for a copy of a mesh that is not in the list, and for
    /// transforms that [`Placement::new`] refuses; the text names the copy.
    pub fn new(bounds: &[Aabb], placed: &[Placed], token: &CancelToken) -> Result<Self, BuildError> {
        let mut copies = Vec::with_capacity(placed.len());
        for (index, Placed { mesh, transform }) in placed.iter().enumerate() {
            token.check_every(MEDIUM_STEPS, index)?;
            let refused =
                |why: &str| BuildError::Refused(format!("copy {index} cannot be placed: {why}; leave it out"));
            let bounds = bounds.get(*mesh as usize).ok_or_else(|| refused("there is no such mesh"))?;
            copies.push(PlacedMesh { mesh: *mesh, place: Placement::new(transform, bounds).map_err(refused)? });
        }
        Ok(Self(copies))
    }

    /// Copies of meshes by their indices, at places that were made before.
    pub fn at(copies: impl IntoIterator<Item = (u32, Placement)>) -> Self {
        Self(copies.into_iter().map(|(mesh, place)| PlacedMesh { mesh, place }).collect())
    }

    /// Number of copies.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// True if there are no copies.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.0[..])
    }

    /// Index of the mesh of a copy.
    ///
    /// # Panics
    ///
    /// If there is no such copy.
    pub fn mesh(&self, copy: u32) -> u32 {
        self.0[copy as usize].mesh
    }

    /// Where a copy stands.
    ///
    /// # Panics
    ///
    /// If there is no such copy.
    pub fn place(&self, copy: u32) -> &Placement {
        &self.0[copy as usize].place
    }
}

impl MeshCopies {
    /// `copies` of `meshes`. Those of meshes without triangles hit nothing.
    ///
    /// # Errors
    ///
    /// [`BuildError::Refused`] for meshes in other containers than boxes, and for copies of meshes that are not in the list.
    pub fn new(meshes: Vec<Arc<Bvh>>, copies: Arc<Copies>) -> Result<Self, BuildError> {
        if let Some((index, mesh)) =
            meshes.iter().enumerate().find(|(_, mesh)| !matches!(mesh.tree(), AnyTree::Aabb(_)))
        {
            let containers = mesh.tree().container_kind().plural();
            return Err(BuildError::Refused(format!("mesh {index} has {containers}: copies need boxes")));
        }
        if copies.0.iter().any(|copy| copy.mesh as usize >= meshes.len()) {
            return Err(BuildError::Refused(format!("there are copies of more than {} meshes", meshes.len())));
        }
        let depth = meshes.iter().map(|mesh| mesh.tree().max_depth()).max().unwrap_or(0);
        Ok(Self { meshes, copies, depth })
    }

    /// The meshes with their trees.
    pub fn meshes(&self) -> &[Arc<Bvh>] {
        &self.meshes
    }

    /// Where the copies stand.
    pub fn copies(&self) -> &Arc<Copies> {
        &self.copies
    }

    /// Number of triangles of all copies: those of the flat scene.
    pub fn triangle_count(&self) -> u64 {
        self.copies.0.iter().map(|copy| self.meshes[copy.mesh as usize].wide().triangle_count() as u64).sum()
    }

    /// Bytes of the wide trees of the meshes, and of the copies.
    pub fn bytes(&self) -> usize {
        let meshes = self.meshes.iter().map(|mesh| mesh.wide().tree.node_bytes() + mesh.wide().tree.leaf_bytes());
        meshes.sum::<usize>() + self.copies.bytes()
    }

    /// Boxes in the world around the copies whose meshes have triangles, in order; opened by `open`, see
    /// [`Instances::build`](super::Instances::build), around parts of them.
    pub fn boxes(&self, open: f32, token: &CancelToken) -> Result<Vec<Aabb>, Cancelled> {
        self.divide(open, token).map(|(_, boxes)| boxes)
    }

    /// The parts of the copies that are the items of a tree over them, opened by `open`, with their boxes in the world.
    pub(super) fn divide(&self, open: f32, token: &CancelToken) -> Result<(Vec<Part>, Vec<Aabb>), Cancelled> {
        let (mut parts, mut boxes) = (Vec::with_capacity(self.copies.len()), Vec::with_capacity(self.copies.len()));
        for index in 0..self.copies.len() as u32 {
            token.check_every(MEDIUM_STEPS, index as usize)?;
            if let Some(part) = self.whole(index) {
                boxes.push(self.children(part).fold(Aabb::EMPTY, |all, (_, bounds)| all.union(&bounds)));
                parts.push(part);
            }
        }
        let budget = (parts.len() as f64 * f64::from(open)) as usize;
        let area = |bounds: &Aabb| bounds.half_area().to_bits();
        // By area: as numbers that are not negative, floats are ordered by their bits.
        let mut largest: BinaryHeap<(u32, usize)> =
            if budget > parts.len() { boxes.iter().map(area).zip(0..).collect() } else { BinaryHeap::new() };
        while let Some((_, at)) = largest.pop() {
            token.check_every(LIGHT_STEPS, parts.len())?;
            let part = parts[at];
            let children: ArrayVec<(Part, Aabb), WIDTH> = self.children(part).collect();
            // A leaf has itself alone.
            let [(first, bounds), others @ ..] = &children[..] else { continue };
            if first.start == part.start {
                continue;
            }
            if parts.len() + others.len() > budget {
                break;
            }
            (parts[at], boxes[at]) = (*first, *bounds);
            largest.push((area(bounds), at));
            for (part, bounds) in others {
                largest.push((area(bounds), parts.len()));
                parts.push(*part);
                boxes.push(*bounds);
            }
        }
        Ok((parts, boxes))
    }

    /// All of a copy; `None` where its mesh has no triangles.
    pub(super) fn whole(&self, copy: u32) -> Option<Part> {
        let start = self.wide_tree(self.copies.mesh(copy)).root?;
        Some(Part { copy, start })
    }

    /// The parts below the node where `part` begins, with their boxes in the world; where that is a leaf, itself. The boxes of the children
    /// lie closer around a copy that was turned than its own.
    fn children(&self, part: Part) -> impl Iterator<Item = (Part, Aabb)> {
        let PlacedMesh { mesh, place } = self.placed(part.copy);
        let tree = self.wide_tree(*mesh);
        let whole = part.start.is_leaf().then(|| (part, place.bounds(&tree.leaves.bounds(part.start))));
        let node = (!part.start.is_leaf()).then(|| tree.node(part.start));
        let children = tree.children_of(part.start).zip(0..);
        let child = move |(start, lane)| Some((Part { start, ..part }, place.bounds(&node.as_ref()?.load(lane))));
        whole.into_iter().chain(children.filter_map(child))
    }

    pub(super) fn depth(&self) -> u32 {
        self.depth
    }

    pub(super) fn placed(&self, copy: u32) -> &PlacedMesh {
        &self.copies.0[copy as usize]
    }

    pub(super) fn wide_tree(&self, mesh: u32) -> &WideTree<Aabb> {
        match &self.meshes[mesh as usize].wide().tree {
            AnyWideTree::Aabb(tree) => tree,
            _ => unreachable!("others are refused"),
        }
    }

    pub(super) fn binary_tree(&self, mesh: u32) -> &Tree<Aabb> {
        match self.meshes[mesh as usize].tree() {
            AnyTree::Aabb(tree) => tree,
            _ => unreachable!("others are refused"),
        }
    }
}
