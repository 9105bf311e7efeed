//! Faults of a tree that can be shown all the same.

use super::arrays::{Arrays, Rows};
use super::bounds::{FileContainer, is_usable};
use super::cuts;
use super::error::TreeFileError;
use super::found::{Found, in_chunks};
use super::links::{Links, Set, Steps};
use super::which_tree::WhichTree;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Triangle};
use crate::kernel::parallel::par_collect;
use crate::order::radix_sort;
use crate::tree::Tree;
use crate::tree::validate::containment_slack;

/// A kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FaultKind {
    /// Nodes that stick out of their parents: a ray that misses the parent misses what is there.
    NodeOutside,
    /// Leaves out of which a triangle sticks: one that is in this leaf alone, or in several that do not enclose it together; or a triangle of
    /// an instance.
    LeafOutside,
    /// Nodes whose planes cut off triangles below them, which rays do not find: oriented boxes above the leaves.
    NodeCuts,
    /// Nodes that were not compared with the triangles below them, because there are too many levels: oriented boxes.
    NodeUnchecked,
    /// Triangles in no leaf, which no ray hits.
    TriangleMissing,
    /// Triangles with other corners in the file than in the mesh: the tree is of another mesh, or its triangles are in another
    /// order.
    TriangleMoved,
    /// Instances in no leaf, which no ray hits.
    InstanceMissing,
    /// Instances with other places in the file than in the model, where rays find them.
    InstanceMoved,
    /// Nodes that the root does not reach; no part of the tree.
    NodeUnreached,
}

impl FaultKind {
    /// Every kind, the worst first.
    pub const ALL: [Self; 9] = [
        Self::NodeOutside,
        Self::LeafOutside,
        Self::NodeCuts,
        Self::NodeUnchecked,
        Self::TriangleMissing,
        Self::TriangleMoved,
        Self::InstanceMissing,
        Self::InstanceMoved,
        Self::NodeUnreached,
    ];

    /// Name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NodeOutside => "node-outside",
            Self::LeafOutside => "leaf-outside",
            Self::NodeCuts => "node-cuts",
            Self::NodeUnchecked => "node-unchecked",
            Self::TriangleMissing => "triangle-missing",
            Self::TriangleMoved => "triangle-moved",
            Self::InstanceMissing => "instance-missing",
            Self::InstanceMoved => "instance-moved",
            Self::NodeUnreached => "node-unreached",
        }
    }
}

/// All faults of one kind. Its text is a sentence without full stop: "3 nodes stick out of their parents by up to 0.25, first
/// node 7", in two levels "first node 7 of mesh 2".
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// The kind.
    pub kind: FaultKind,
    /// The tree of the first of them: the other level has faults of its own, other meshes have not.
    pub tree: WhichTree,
    /// Number of nodes, or of triangles or instances for the kinds that are about these.
    pub count: u64,
    /// The first of them as the file numbers it, within its tree.
    pub first: u32,
    /// Largest distance by which something sticks out or places differ, in world units, in a mesh in its own; 0 for the other kinds.
    pub excess: f32,
    /// The nodes as the tree numbers them, in ascending order; empty for kinds that are about triangles, instances or nodes that are
    /// no part of the tree, and for meshes in two levels.
    pub nodes: Vec<u32>,
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { kind, tree, count, first, excess, .. } = self;
        let one = *count == 1;
        // To three digits: 0.25 and 1.2e-7.
        let excess: f32 = format!("{excess:.2e}").parse().unwrap_or(*excess);
        let pick = |of_one: &'static str, of_many: &'static str| if one { of_one } else { of_many };
        write!(f, "{count} ")?;
        match kind {
            FaultKind::NodeOutside => {
                let what = pick("node sticks out of its parent", "nodes stick out of their parents");
                write!(f, "{what} by up to {excess:?}")
            }
            FaultKind::LeafOutside => {
                let what = match tree {
                    WhichTree::Instances => {
                        pick("leaf does not enclose its instances", "leaves do not enclose their instances")
                    }
                    _ => pick("leaf does not enclose its triangles", "leaves do not enclose their triangles"),
                };
                write!(f, "{what}, which stick out by up to {excess:?}")
            }
            FaultKind::NodeCuts => {
                let what = pick("node cuts off triangles below it", "nodes cut off triangles below them");
                write!(f, "{what}, which stick out by up to {excess:?}")
            }
            FaultKind::NodeUnchecked => {
                f.write_str(pick("node was", "nodes were"))?;
                f.write_str(" not compared with the triangles below, as there are too many levels")
            }
            FaultKind::TriangleMissing => f.write_str(pick("triangle is in no leaf", "triangles are in no leaf")),
            FaultKind::TriangleMoved => {
                let what = pick("triangle has other corners in the file", "triangles have other corners in the file");
                write!(f, "{what} than in the model, by up to {excess:?}")
            }
            FaultKind::InstanceMissing => f.write_str(pick("instance is in no leaf", "instances are in no leaf")),
            FaultKind::InstanceMoved => {
                let what = pick("instance stands elsewhere in the file", "instances stand elsewhere in the file");
                write!(f, "{what} than in the model, by up to {excess:?}")
            }
            FaultKind::NodeUnreached => f.write_str(pick("node is not reached", "nodes are not reached")),
        }?;
        let one = match kind {
            FaultKind::TriangleMissing | FaultKind::TriangleMoved => "triangle",
            FaultKind::InstanceMissing | FaultKind::InstanceMoved => return write!(f, ", first instance {first}"),
            _ => "node",
        };
        write!(f, ", first {one} {first}")?;
        if *tree == WhichTree::Only { Ok(()) } else { write!(f, " of {tree}") }
    }
}

impl Fault {
    /// A fault that is not about nodes of the tree, in the only one of a file.
    pub(super) fn new(kind: FaultKind, count: u64, first: u32, excess: f32) -> Self {
        Self { kind, tree: WhichTree::Only, count, first, excess, nodes: Vec::new() }
    }
}

impl Found {
    /// The fault, where there is one. `numbers` are those of the file.
    pub(super) fn fault(self, kind: FaultKind, numbers: Option<&[u32]>) -> Option<Fault> {
        let number = |&node: &u32| numbers.map_or(node, |numbers| numbers.get(node as usize).copied().unwrap_or(node));
        let first = self.nodes.iter().map(number).min()?;
        let fault = Fault::new(kind, self.nodes.len() as u64, first, self.excess as f32);
        Some(Fault { nodes: self.nodes, ..fault })
    }
}

/// The faults of `tree`, which `arrays` and `links` gave, over `triangles`, where these are known.
pub(super) fn find<C: FileContainer>(
    tree: &Tree<C>,
    numbers: Option<&[u32]>,
    arrays: &Arrays<'_>,
    links: &Links,
    triangles: Option<&[Triangle]>,
    token: &CancelToken,
) -> Result<Vec<Fault>, TreeFileError> {
    let slack = f64::from(containment_slack(tree));
    let mut faults = Vec::new();
    faults.extend(outside_parents(tree, slack, &token.part(0, 4))?.fault(FaultKind::NodeOutside, numbers));
    // A number of triangles that nothing bears out is not trusted with memory.
    let uses = if triangles.is_some() {
        Uses::count(&tree.primitive_indices, arrays.items, &token.part(1, 4))?
    } else {
        Uses::count_sorted(&tree.primitive_indices, arrays.items, &token.part(1, 4))?
    };
    if let Some(triangles) = triangles {
        let outside = outside_leaves(tree, triangles, &uses, slack, &token.part(2, 4))?;
        faults.extend(outside.fault(FaultKind::LeafOutside, numbers));
    }
    if let Some(triangles) = triangles.filter(|_| cuts::concerns::<C>()) {
        let cuts = cuts::find(tree, triangles, uses.has_several, &token.part(3, 4))?;
        faults.extend(cuts.found.fault(FaultKind::NodeCuts, numbers));
        faults.extend(cuts.unchecked.fault(FaultKind::NodeUnchecked, numbers));
    }
    if let Some((first, count)) = uses.missing {
        faults.push(Fault::new(FaultKind::TriangleMissing, u64::from(count), first, 0.0));
    }
    if let Some((first, count, excess)) = moved(arrays, triangles, token)? {
        faults.push(Fault::new(FaultKind::TriangleMoved, count, first, excess));
    }
    if let Some((first, count)) = links.unreached {
        faults.push(Fault::new(FaultKind::NodeUnreached, u64::from(count), first, 0.0));
    }
    Ok(faults)
}

/// The nodes that stick out of their parents by more than `slack`.
pub(super) fn outside_parents<C: FileContainer>(
    tree: &Tree<C>,
    slack: f64,
    token: &CancelToken,
) -> Result<Found, Cancelled> {
    let mut outside = in_chunks(tree, token, |number, found, _| {
        let node = &tree.nodes[number as usize];
        for child in node.children() {
            let excess = node.container.excess_of(&tree.nodes[child as usize].container);
            if excess > slack {
                found.add(child, excess);
            }
        }
        Ok(())
    })?;
    outside.nodes.sort_unstable();
    Ok(outside)
}

/// How often triangles or instances are in leaves.
pub(super) struct Uses {
    /// Those in several leaves.
    pub several: Set,
    /// Whether there are any.
    pub has_several: bool,
    /// The first one in no leaf, and the number of them.
    pub missing: Option<(u32, u32)>,
}

impl Uses {
    pub fn count(primitives: &[u32], triangles: u32, token: &CancelToken) -> Result<Self, Cancelled> {
        let (mut once, mut several) = (Set::new(triangles, token)?, Set::new(triangles, token)?);
        let (mut has_several, mut used) = (false, 0_u32);
        let mut steps = Steps::new(token, primitives.len() as u64);
        for &triangle in primitives {
            steps.step()?;
            if once.insert(triangle) {
                several.insert(triangle);
                has_several = true;
            } else {
                used = used.saturating_add(1);
            }
        }
        let mut missing = None;
        if let Some(count) = triangles.checked_sub(used).filter(|&count| count > 0) {
            for triangle in 0..triangles {
                steps.step()?;
                if !once.contains(triangle) {
                    missing = Some((triangle, count));
                    break;
                }
            }
        }
        Ok(Self { several, has_several, missing })
    }

    /// [`Uses::count`] of the missing triangles alone, in memory that depends on the number of primitives.
    fn count_sorted(primitives: &[u32], triangles: u32, token: &CancelToken) -> Result<Self, Cancelled> {
        let mut indices = par_collect(primitives.len(), token, |slot| u64::from(primitives[slot]))?;
        radix_sort(&mut indices, u32::BITS, token)?;
        let (mut used, mut first) = (0_u32, None);
        let mut steps = Steps::silent(token);
        let mut before = None;
        for index in indices.into_iter().map(|index| index as u32) {
            steps.step()?;
            if before != Some(index) {
                if first.is_none() && index != used {
                    first = Some(used);
                }
                used = used.saturating_add(1);
                before = Some(index);
            }
        }
        let missing = triangles.checked_sub(used).filter(|&count| count > 0);
        let missing = missing.map(|count| (first.unwrap_or(used), count));
        Ok(Self { several: Set::new(0, token)?, has_several: false, missing })
    }
}

/// The leaves that do not enclose their triangles.
fn outside_leaves<C: FileContainer>(
    tree: &Tree<C>,
    triangles: &[Triangle],
    uses: &Uses,
    slack: f64,
    token: &CancelToken,
) -> Result<Found, Cancelled> {
    // Of each triangle in several leaves the box around these.
    let mut around = Vec::new();
    if uses.has_several {
        around = par_collect(triangles.len(), token, |_| Aabb::EMPTY)?;
        let mut steps = Steps::silent(token);
        for leaf in tree.nodes.iter().filter(|node| node.is_leaf()) {
            steps.step()?;
            let bounds = leaf.container.bounds();
            for &triangle in &tree.primitive_indices[leaf.slots()] {
                steps.step()?;
                let around = &mut around[triangle as usize];
                *around = around.union(&bounds);
            }
        }
    }
    in_chunks(tree, token, |number, found, steps| {
        let node = &tree.nodes[number as usize];
        if !node.is_leaf() {
            return Ok(());
        }
        for &primitive in &tree.primitive_indices[node.slots()] {
            steps.step()?;
            let triangle = &triangles[primitive as usize];
            let excess = if uses.several.contains(primitive) {
                around[primitive as usize].excess_of_triangle(triangle)
            } else {
                node.container.excess_of_triangle(triangle)
            };
            if excess > slack {
                found.add(number, excess);
            }
        }
        Ok(())
    })
}

/// The first triangle whose corners in the file are not those of the mesh, the number of them, and the largest difference of a
/// coordinate.
fn moved(
    arrays: &Arrays<'_>,
    triangles: Option<&[Triangle]>,
    token: &CancelToken,
) -> Result<Option<(u32, u64, f32)>, TreeFileError> {
    let (Some(corners), Some(triangles)) = (arrays.corners, triangles) else { return Ok(None) };
    let (mut first, mut count, mut largest) = (None, 0_u64, 0.0_f32);
    let mut steps = Steps::silent(token);
    for (number, triangle) in (0..).zip(triangles) {
        steps.step()?;
        let written = corners_of(corners, number)?;
        let coordinates: &[f32; 9] = bytemuck::cast_ref(triangle);
        if written != *coordinates {
            first = first.or(Some(number));
            count = count.saturating_add(1);
            let differences = written.iter().zip(coordinates).map(|(a, b)| (a - b).abs());
            largest = differences.fold(largest, f32::max);
        }
    }
    Ok(first.map(|first| (first, count, largest)))
}

/// The corners of a triangle, where all their coordinates are usable.
pub(super) fn corners_of(corners: Rows<'_>, triangle: u32) -> Result<[f32; 9], TreeFileError> {
    let numbers: [f32; 9] = corners.floats(triangle);
    let unusable = numbers.iter().find(|number| !is_usable(**number));
    unusable.map_or(Ok(numbers), |&number| Err(TreeFileError::Corner { triangle, number }))
}

/// Peak of finding faults for each triangle, where all are in several leaves.
pub(super) const BYTES_PER_TRIANGLE: u64 = size_of::<Aabb>() as u64;
/// The same for each primitive, where the triangles are not known.
pub(super) const BYTES_PER_INDEX: u64 = 2 * size_of::<u64>() as u64;
/// The same for each node: lists of nodes, twice while they are joined.
pub(super) const BYTES_PER_NODE: u64 = 16;
