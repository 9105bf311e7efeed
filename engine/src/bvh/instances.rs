//! Two levels: copies of meshes, each with a tree of its own, below a tree over the copies.

use std::ops::ControlFlow;
use std::sync::Arc;

use fearless_simd::Level;
use glam::Affine3A;

use crate::builders::BuildError;
use crate::bvh::Bvh;
use crate::bvh::items::ItemBvh;
use crate::cancel::{CancelToken, MEDIUM_STEPS};
use crate::geometry::{Aabb, Placement, Ray, TriangleHit};
use crate::query::{HitList, Listed};
use crate::settings::BuildSettings;
use crate::tree::AnyTree;
use crate::wide::trace::{copies, each_hit_of_copy, world_ray};
use crate::wide::{AnyWideTree, WideTree};

/// Copies of meshes in a tree of two levels: one hierarchy for each mesh, however many copies it has, and one over the copies.
///
/// Rays find the very hits that they find in the flat scene whose triangles [`Placement::triangle`] makes, copy by copy: the same
/// triangle, distance and weights, bit for bit. Boxes are tested in the coordinates of the mesh, widened by the derived bound of what
/// rounding moves there (see `Placement::carry`), triangles in the world, with the corners that the flat scene has.
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
/// let instances = Instances::build(vec![mesh], &copies, &settings, &token)?;
/// let hit = instances.closest_hit(&Ray::new(Vec3::new(0.25, 0.5, 7.5), Vec3::Z)).expect("the ray meets the eighth copy");
/// assert_eq!((hit.instance, hit.primitive_index, hit.t), (8, 0, 0.5));
/// # Ok::<(), bvhscope_engine::BuildError>(())
/// ```
#[derive(Debug)]
pub struct Instances {
    meshes: Vec<Arc<Bvh>>,
    copies: Vec<PlacedMesh>,
    /// Over the boxes of the copies that have triangles.
    top: ItemBvh,
    /// Index of the copy of each item of `top`.
    of_item: Vec<u32>,
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
    /// # Errors
    ///
    /// [`BuildError::Cancelled`] once `token` is cancelled. [`BuildError::Refused`] for a copy of a mesh that is not in the list, for
    /// meshes in other containers than boxes, for transforms that [`Placement::new`] refuses, and for settings that [`ItemBvh::build`]
    /// refuses; the text names the copy.
    pub fn build(
        meshes: Vec<Arc<Bvh>>,
        copies: &[Placed],
        settings: &BuildSettings,
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
        let (mut boxes, mut of_item) = (Vec::with_capacity(copies.len()), Vec::with_capacity(copies.len()));
        for (index, Placed { mesh, transform }) in copies.iter().enumerate() {
            token.check_every(MEDIUM_STEPS, index)?;
            let refused =
                |why: &str| BuildError::Refused(format!("copy {index} cannot be traced: {why}; leave it out"));
            let root = roots.get(*mesh as usize).ok_or_else(|| refused("there is no such mesh"))?;
            let place = Placement::new(transform, root).map_err(refused)?;
            if !root.is_empty() {
                boxes.push(place.bounds(root));
                of_item.push(index as u32);
            }
            placed.push(PlacedMesh { mesh: *mesh, place });
        }
        let top = ItemBvh::build(&boxes[..], settings, token)?;
        Ok(Self { meshes, copies: placed, top, of_item })
    }

    /// The tree over the copies: its items are those copies, in order, whose meshes have triangles.
    pub fn top(&self) -> &ItemBvh {
        &self.top
    }

    /// Number of copies.
    pub fn len(&self) -> usize {
        self.copies.len()
    }

    /// Whether there are no copies.
    pub fn is_empty(&self) -> bool {
        self.copies.is_empty()
    }

    /// Where a copy stands.
    ///
    /// # Panics
    ///
    /// If there are no more than `instance` copies.
    pub fn place(&self, instance: u32) -> &Placement {
        &self.copies[instance as usize].place
    }

    /// Number of triangles of all copies: those of the flat scene.
    pub fn triangle_count(&self) -> u64 {
        self.copies.iter().map(|copy| self.meshes[copy.mesh as usize].wide().triangle_count() as u64).sum()
    }

    /// Bytes of the wide trees of the meshes, of the copies, and of both trees over them.
    pub fn bytes(&self) -> usize {
        let meshes = self.meshes.iter().map(|mesh| mesh.wide().tree.node_bytes() + mesh.wide().tree.leaf_bytes());
        let top = &self.top.wide().tree;
        meshes.sum::<usize>()
            + size_of_val(&self.copies[..])
            + size_of_val(&self.of_item[..])
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
            let instance = self.of_item[item as usize];
            let PlacedMesh { mesh, place } = &self.copies[instance as usize];
            let copy = copies::Copy { tree: self.tree_of(*mesh), place };
            let mut flow = ControlFlow::Continue(t_max);
            let mut each = |TriangleHit { t, u, v }: TriangleHit, primitive_index| {
                flow = found(InstanceHit { t, instance, primitive_index, u, v });
                flow
            };
            each_hit_of_copy(level, copy, &world, t_max, &mut each);
            flow
        });
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
