//! Two levels: copies of meshes, each with a tree of its own, below a tree over the copies.

use std::collections::BinaryHeap;
use std::ops::ControlFlow;
use std::sync::Arc;

use arrayvec::ArrayVec;
use fearless_simd::Level;
use glam::Affine3A;

use crate::builders::BuildError;
use crate::bvh::{Bvh, ItemBvh};
use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS, MEDIUM_STEPS};
use crate::geometry::{Aabb, Placement, Ray, TriangleHit};
use crate::query::{HitList, Listed};
use crate::settings::BuildSettings;
use crate::tree::AnyTree;
use crate::wide::layout::WIDTH;
use crate::wide::trace::{copies, each_hit_of_copy, world_ray};
use crate::wide::{AnyWideTree, Child, WideTree};

/// Copies of meshes in a tree of two levels: one hierarchy for each mesh, however many copies it has, and one over the copies.
///
/// Rays find the very hits that they find in the flat scene whose triangles [`Placement::triangle`] makes, copy by copy: the same
/// triangle, distance and weights, bit for bit. Boxes are tested in the coordinates of the mesh, widened by the derived bound of what
/// rounding moves there (docs/containers.md, "Copies of meshes"), triangles in the world, with the corners that the flat scene has.
///
/// ```
/// use std::sync::Arc;
///
/// use bvhscope_engine::glam::{Affine3A, Vec3};
/// use bvhscope_engine::{BuildSettings, CancelToken, Instances, Placed, Ray, Triangle, build};
///
/// let (settings, token) = (BuildSettings::default(), CancelToken::new());
/// let mesh = [Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y }];
/// let mesh = Arc::new(build(&mesh, &settings, &token)?);
/// let placed = |z: f32| Placed { mesh: 0, transform: Affine3A::from_translation(Vec3::Z * z) };
/// let copies: Vec<Placed> = (0..1000).map(|z| placed(z as f32)).collect();
/// let instances = Instances::build(vec![mesh], &copies, &settings, 1.0, &token)?;
/// let hit = instances.closest_hit(&Ray::new(Vec3::new(0.25, 0.5, 7.5), Vec3::Z)).expect("the ray meets the eighth copy");
/// assert_eq!((hit.instance, hit.primitive_index, hit.t), (8, 0, 0.5));
/// # Ok::<(), bvhscope_engine::BuildError>(())
/// ```
#[derive(Debug)]
pub struct Instances {
    copies: Copies,
    top: ItemBvh,
    /// The items of `top`.
    parts: Vec<Part>,
}

/// Copies and their meshes.
#[derive(Debug)]
struct Copies {
    meshes: Vec<Arc<Bvh>>,
    placed: Vec<PlacedMesh>,
}

/// A copy of a mesh, or of what is below a node of its tree.
#[derive(Debug, Clone, Copy)]
struct Part {
    copy: u32,
    start: Child,
}

/// A copy of a mesh.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    /// Index of the mesh.
    pub mesh: u32,
    /// From the coordinates of the mesh to those of the world.
    pub transform: Affine3A,
}

#[derive(Debug, Clone, Copy)]
struct PlacedMesh {
    mesh: u32,
    place: Placement,
}

/// Where a ray hits a copy of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InstanceHit {
    /// Distance along the ray, in lengths of its direction.
    pub t: f32,
    /// Index of the copy.
    pub instance: u32,
    /// Index of the triangle in the list that the tree of its mesh was built from.
    pub primitive_index: u32,
    /// Barycentric weight of the triangle's second corner.
    pub u: f32,
    /// Barycentric weight of the triangle's third corner.
    pub v: f32,
}

impl Listed for InstanceHit {
    fn t(&self) -> f32 {
        self.t
    }

    fn index(&self) -> impl Ord {
        (self.instance, self.primitive_index)
    }
}

impl Instances {
    /// Builds the tree over `copies` of `meshes` with `settings` in the calling thread's rayon pool; reports progress through `token`.
    /// Copies of meshes without triangles hit nothing.
    ///
    /// Copies that overlap others or fill much of the scene make rays walk many trees for nothing. So the parts of the largest boxes are
    /// *opened*, each replaced by the children of its node, until there are `open` times as many parts as copies: 1 opens none, 2 to 4 is
    /// usual (after Benthin et al., *Improved Two-Level BVHs using Partial Re-Braiding*, 2017). Hits are the same.
    ///
    /// # Errors
    ///
    /// [`BuildError::Cancelled`] once `token` is cancelled. [`BuildError::Refused`] for a copy of a mesh that is not in the list, for
    /// meshes in other containers than boxes, for transforms that [`Placement::new`] refuses, and for settings that [`ItemBvh::build`]
    /// refuses; the text names the copy.
    pub fn build(
        meshes: Vec<Arc<Bvh>>,
        copies: &[Placed],
        settings: &BuildSettings,
        open: f32,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let mut roots = Vec::with_capacity(meshes.len());
        for (index, mesh) in meshes.iter().enumerate() {
            let AnyTree::Aabb(tree) = mesh.tree() else {
                let containers = mesh.tree().container_kind().plural();
                return Err(BuildError::Refused(format!("mesh {index} has {containers}: copies need boxes")));
            };
            roots.push(tree.nodes.first().map_or(Aabb::EMPTY, |root| root.container));
        }
        let mut placed = Vec::with_capacity(copies.len());
        for (index, Placed { mesh, transform }) in copies.iter().enumerate() {
            token.check_every(MEDIUM_STEPS, index)?;
            let refused =
                |why: &str| BuildError::Refused(format!("copy {index} cannot be traced: {why}; leave it out"));
            let root = roots.get(*mesh as usize).ok_or_else(|| refused("there is no such mesh"))?;
            placed.push(PlacedMesh { mesh: *mesh, place: Placement::new(transform, root).map_err(refused)? });
        }
        let copies = Copies { meshes, placed };
        let (parts, boxes) = copies.divide(open, token)?;
        let top = ItemBvh::build(&boxes[..], settings, token)?;
        Ok(Self { copies, top, parts })
    }

    /// The tree over the copies: its items are parts of them, where none are opened those copies, in order, whose meshes have triangles.
    pub fn top(&self) -> &ItemBvh {
        &self.top
    }

    /// Number of copies.
    pub fn len(&self) -> usize {
        self.copies.placed.len()
    }

    /// Whether there are no copies.
    pub fn is_empty(&self) -> bool {
        self.copies.placed.is_empty()
    }

    /// Where a copy stands.
    ///
    /// # Panics
    ///
    /// If there are no more than `instance` copies.
    pub fn place(&self, instance: u32) -> &Placement {
        &self.copies.placed[instance as usize].place
    }

    /// Number of triangles of all copies: those of the flat scene.
    pub fn triangle_count(&self) -> u64 {
        self.copies
            .placed
            .iter()
            .map(|copy| self.copies.meshes[copy.mesh as usize].wide().triangle_count() as u64)
            .sum()
    }

    /// Bytes of the wide trees of the meshes, of the copies, and of both trees over them.
    pub fn bytes(&self) -> usize {
        let meshes =
            self.copies.meshes.iter().map(|mesh| mesh.wide().tree.node_bytes() + mesh.wide().tree.leaf_bytes());
        let top = &self.top.wide().tree;
        meshes.sum::<usize>()
            + size_of_val(&self.copies.placed[..])
            + size_of_val(&self.parts[..])
            + top.node_bytes()
            + top.leaf_bytes()
            + self.top.tree().bytes()
    }

    /// The nearest hit of `ray`; of equal distances that of the lower copy, then that of the lower triangle.
    pub fn closest_hit(&self, ray: &Ray) -> Option<InstanceHit> {
        let mut nearest: Option<InstanceHit> = None;
        self.each_hit(ray, |hit| {
            if nearest.is_none_or(|nearest| hit.t < nearest.t || hit.t == nearest.t && is_lower(&hit, &nearest)) {
                nearest = Some(hit);
            }
            ControlFlow::Continue(hit.t)
        });
        nearest
    }

    /// [`Instances::closest_hit`] of each of `rays`, written to the first elements of `hits`.
    ///
    /// # Panics
    ///
    /// If `hits` is shorter than `rays`.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<InstanceHit>]) {
        assert!(hits.len() >= rays.len(), "{} hits for {} rays", hits.len(), rays.len());
        rays.iter().zip(hits).for_each(|(ray, hit)| *hit = self.closest_hit(ray));
    }

    /// Whether anything lies on `ray` between its `t_min` and `t_max`.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        let mut is_hit = false;
        self.each_hit(ray, |_| {
            is_hit = true;
            ControlFlow::Break(())
        });
        is_hit
    }

    /// For each of `rays` whether anything lies on it, written to the first elements of `blocked`.
    ///
    /// # Panics
    ///
    /// If `blocked` is shorter than `rays`.
    pub fn any_hits(&self, rays: &[Ray], blocked: &mut [bool]) {
        assert!(blocked.len() >= rays.len(), "{} results for {} rays", blocked.len(), rays.len());
        rays.iter().zip(blocked).for_each(|(ray, blocked)| *blocked = self.any_hit(ray));
    }

    /// The hits of `ray` into `hits`: each triangle of each copy once, by distance, at equal distances by copy and triangle, at most the
    /// `max` nearest. Returns whether there are more. Replaces what `hits` held, whose memory is used again.
    pub fn all_hits(&self, ray: &Ray, max: usize, hits: &mut Vec<InstanceHit>) -> bool {
        let mut list = HitList::new(hits, max, ray.t_max);
        self.each_hit(ray, |hit| {
            list.add(hit);
            ControlFlow::Continue(list.t_max())
        });
        list.finish()
    }

    /// Calls `found` with each hit of `ray`, in any order, up to the distance that it returned last.
    fn each_hit(&self, ray: &Ray, mut found: impl FnMut(InstanceHit) -> ControlFlow<(), f32>) {
        let level = Level::new();
        let Some(world) = world_ray(level, ray) else { return };
        self.top.visit(ray, |item, t_max| {
            let Part { copy: instance, start } = self.parts[item as usize];
            let PlacedMesh { mesh, place } = &self.copies.placed[instance as usize];
            let copy = copies::Copy { tree: self.copies.tree_of(*mesh), start, place };
            let mut flow = ControlFlow::Continue(t_max);
            let mut each = |TriangleHit { t, u, v }: TriangleHit, primitive_index| {
                flow = found(InstanceHit { t, instance, primitive_index, u, v });
                flow
            };
            each_hit_of_copy(level, copy, &world, t_max, &mut each);
            flow
        });
    }
}

impl Copies {
    /// The parts of the copies that are the items of the top tree, opened by `open`, with their boxes in the world.
    fn divide(&self, open: f32, token: &CancelToken) -> Result<(Vec<Part>, Vec<Aabb>), Cancelled> {
        let (mut parts, mut boxes) = (Vec::with_capacity(self.placed.len()), Vec::with_capacity(self.placed.len()));
        for (index, copy) in (0..).zip(&self.placed) {
            token.check_every(MEDIUM_STEPS, index as usize)?;
            if let Some(start) = self.tree_of(copy.mesh).root {
                let part = Part { copy: index, start };
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

    /// The parts below the node where `part` begins, with their boxes in the world; where that is a leaf, itself. The boxes of the children
    /// lie closer around a copy that was turned than its own.
    fn children(&self, part: Part) -> impl Iterator<Item = (Part, Aabb)> {
        let PlacedMesh { mesh, place } = &self.placed[part.copy as usize];
        let tree = self.tree_of(*mesh);
        let whole = part.start.is_leaf().then(|| (part, place.bounds(&tree.leaves.bounds(part.start))));
        let node = (!part.start.is_leaf()).then(|| tree.node(part.start));
        let children = tree.children_of(part.start).zip(0..);
        let child = move |(start, lane)| Some((Part { start, ..part }, place.bounds(&node.as_ref()?.load(lane))));
        whole.into_iter().chain(children.filter_map(child))
    }

    fn tree_of(&self, mesh: u32) -> &WideTree<Aabb> {
        match &self.meshes[mesh as usize].wide().tree {
            AnyWideTree::Aabb(tree) => tree,
            _ => unreachable!("others are refused"),
        }
    }
}

/// Whether `hit` comes before `other` in the flat scene.
fn is_lower(hit: &InstanceHit, other: &InstanceHit) -> bool {
    (hit.instance, hit.primitive_index) < (other.instance, other.primitive_index)
}
