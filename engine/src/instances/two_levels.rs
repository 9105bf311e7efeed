//! A tree over copies of meshes, and the queries through both levels.

use std::ops::ControlFlow;
use std::sync::Arc;

use fearless_simd::Level;

use super::copies::{Copies, MeshCopies, Part, Placed, PlacedMesh};
use super::hit::InstanceHit;
use crate::builders::BuildError;
use crate::bvh::{Bvh, ItemBvh, WideBvh};
use crate::cancel::CancelToken;
use crate::geometry::{Aabb, Ray, TriangleHit};
use crate::query::HitList;
use crate::settings::BuildSettings;
use crate::tree::Container;
use crate::tree::traverse::Probe;
use crate::wide::AnyWideTree;
use crate::wide::trace::{
    copies as walk, each_hit_of_copy, each_hit_of_copy_with, nearest_of_copies, packet, packet_copies, stream_copies,
    world_ray,
};
use crate::with_tree;

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
///
/// [`Placement::triangle`]: crate::geometry::Placement::triangle
#[derive(Debug)]
pub struct Instances {
    copies: Arc<MeshCopies>,
    top: Arc<WideBvh>,
    /// The items of `top`; none where those are the copies.
    parts: Vec<Part>,
}

impl Instances {
    /// Builds the tree over `copies` of `meshes` with `settings` in the calling thread's rayon pool; reports progress through `token`.
    ///
    /// Copies that overlap others or fill much of the scene make rays walk many trees for nothing. So the parts of the largest boxes are
    /// *opened*, each replaced by the children of its node, until there are `open` times as many parts as copies: 1 opens none, 2 to 4 is
    /// usual (after Benthin et al., *Improved Two-Level BVHs using Partial Re-Braiding*, 2017). Hits are the same.
    ///
    /// # Errors
    ///
    /// Those of [`Copies::new`] and [`MeshCopies::new`], and [`BuildError::Refused`] for settings that [`ItemBvh::build`] refuses.
    pub fn build(
        meshes: Vec<Arc<Bvh>>,
        copies: &[Placed],
        settings: &BuildSettings,
        open: f32,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let bounds =
            |mesh: &Arc<Bvh>| with_tree!(mesh.tree(), tree => tree.nodes.first().map(|root| root.container.bounds()));
        let bounds: Vec<Aabb> = meshes.iter().map(|mesh| bounds(mesh).unwrap_or(Aabb::EMPTY)).collect();
        let copies = Arc::new(Copies::new(&bounds, copies, token)?);
        Self::of(Arc::new(MeshCopies::new(meshes, copies)?), settings, open, token)
    }

    /// Builds the tree over `copies`, opened by `open`, as [`Instances::build`] does.
    ///
    /// # Errors
    ///
    /// [`BuildError::Cancelled`] once `token` is cancelled, and [`BuildError::Refused`] for settings that [`ItemBvh::build`] refuses.
    pub fn of(
        copies: Arc<MeshCopies>,
        settings: &BuildSettings,
        open: f32,
        token: &CancelToken,
    ) -> Result<Self, BuildError> {
        let (parts, boxes) = copies.divide(open, token)?;
        let top = Arc::new(ItemBvh::build(&boxes[..], settings, token)?.into_wide());
        Ok(Self { copies, top, parts })
    }

    /// `copies` below a tree over their boxes that was built elsewhere, as an [`ItemBvh`] of one box a copy, in order, within which that
    /// copy lies.
    ///
    /// # Panics
    ///
    /// If `top` has another number of items than there are copies.
    pub fn over(copies: Arc<MeshCopies>, top: Arc<WideBvh>) -> Self {
        assert_eq!(top.triangle_count(), copies.copies().len(), "a tree of as many items as there are copies");
        Self { copies, top, parts: Vec::new() }
    }

    /// The copies and their meshes.
    pub fn copies(&self) -> &Arc<MeshCopies> {
        &self.copies
    }

    /// The tree over the copies: its items are parts of them, where none are opened those copies, in order, whose meshes have triangles.
    pub fn top(&self) -> &WideBvh {
        &self.top
    }

    /// Bytes of the wide trees of the meshes, of the copies, and of the tree over them.
    pub fn bytes(&self) -> usize {
        let top = &self.top.tree;
        self.copies.bytes() + size_of_val(&self.parts[..]) + top.node_bytes() + top.leaf_bytes()
    }

    /// The nearest hit of `ray`; of equal distances that of the lower copy, then that of the lower triangle.
    pub fn closest_hit(&self, ray: &Ray) -> Option<InstanceHit> {
        if let Some(nearest) = self.nearest::<false>(ray) {
            return nearest.hit().map(|(instance, hit)| InstanceHit::new(instance, hit));
        }
        let mut nearest: Option<InstanceHit> = None;
        self.each_hit(ray, |hit| {
            nearest = Some(hit.nearer(nearest));
            ControlFlow::Continue(hit.t)
        });
        nearest
    }

    /// [`Instances::closest_hit`] observed: by `top` in the tree over the copies, whose items are no primitives to it, and below it by the
    /// one of `meshes` that belongs to the mesh. As in other wide trees a test is that of all children of a node, or of a block of triangles.
    ///
    /// # Panics
    ///
    /// If there are fewer probes than meshes.
    pub fn closest_hit_with<P: Probe>(&self, ray: &Ray, top: &mut P, meshes: &mut [P]) -> Option<InstanceHit> {
        let mut nearest: Option<InstanceHit> = None;
        self.each_hit_with(ray, top, meshes, &mut |hit| {
            nearest = Some(hit.nearer(nearest));
            ControlFlow::Continue(nearest.map_or(hit.t, |hit| hit.t))
        });
        nearest
    }

    /// [`Instances::any_hit`] observed as in [`Instances::closest_hit_with`].
    ///
    /// # Panics
    ///
    /// If there are fewer probes than meshes.
    pub fn any_hit_with<P: Probe>(&self, ray: &Ray, top: &mut P, meshes: &mut [P]) -> bool {
        let mut is_hit = false;
        self.each_hit_with(ray, top, meshes, &mut |_| {
            is_hit = true;
            ControlFlow::Break(())
        });
        is_hit
    }

    /// Calls `found` with each hit of `ray`, as [`Instances::each_hit`] does, observed.
    fn each_hit_with<P: Probe>(
        &self,
        ray: &Ray,
        top: &mut P,
        meshes: &mut [P],
        found: &mut dyn FnMut(InstanceHit) -> ControlFlow<(), f32>,
    ) {
        let Some(world) = world_ray(Level::baseline(), ray) else { return };
        self.top.tree.visit_items_with(ray, top, &mut |item, t_max| {
            let Some((instance, copy)) = self.copy(item) else { return ControlFlow::Continue(t_max) };
            let probe = &mut meshes[self.copies.copies().mesh(instance) as usize];
            probe.carried(instance);
            let mut flow = ControlFlow::Continue(t_max);
            each_hit_of_copy_with(copy, &world, t_max, probe, &mut |hit, primitive_index| {
                flow = found(InstanceHit::new(instance, hit.of(primitive_index)));
                flow
            });
            flow
        });
    }

    /// [`Instances::closest_hit`] of each of `rays`, written to the first elements of `hits`. Fastest if the rays come from one point in
    /// similar directions and each sixteen consecutive rays are neighbours; correct for any rays.
    ///
    /// # Panics
    ///
    /// If `hits` is shorter than `rays`.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<InstanceHit>]) {
        assert!(hits.len() >= rays.len(), "{} hits for {} rays", hits.len(), rays.len());
        let hits = &mut hits[..rays.len()];
        let AnyWideTree::Aabb(top) = &self.top.tree else {
            return rays.iter().zip(hits).for_each(|(ray, hit)| *hit = self.closest_hit(ray));
        };
        for (rays, hits) in rays.chunks(packet::MAX_RAYS).zip(hits.chunks_mut(packet::MAX_RAYS)) {
            hits.fill(None);
            let copy_of = |item| self.copy(item);
            let is_packet = rays.len() >= packet::FEW
                && packet_copies::closest_hits(Level::new(), top, &copy_of, rays, &mut |index, instance, hit| {
                    hits[index] = Some(InstanceHit::new(instance, hit));
                });
            if !is_packet {
                let left_out = stream_copies::closest_hits(Level::new(), top, &copy_of, rays, &mut |index, hit| {
                    hits[index] = hit.map(|(instance, hit)| InstanceHit::new(instance, hit));
                });
                for index in left_out {
                    hits[index] = self.closest_hit(&rays[index]);
                }
            }
        }
    }

    /// Tells if anything lies on `ray` between its `t_min` and `t_max`.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        if let Some(nearest) = self.nearest::<true>(ray) {
            return nearest.found();
        }
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
        let AnyWideTree::Aabb(top) = &self.top.tree else {
            return rays.iter().zip(blocked).for_each(|(ray, blocked)| *blocked = self.any_hit(ray));
        };
        let left_out = stream_copies::any_hits(Level::new(), top, &|item| self.copy(item), rays, blocked);
        for index in left_out {
            blocked[index] = self.any_hit(&rays[index]);
        }
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

    /// The nearest hit of `ray`, with `ANY` the first one found; `None` for the few rays that [`Instances::each_hit`] has to trace.
    fn nearest<const ANY: bool>(&self, ray: &Ray) -> Option<walk::HitOfCopy> {
        let AnyWideTree::Aabb(top) = &self.top.tree else { return None };
        nearest_of_copies::<ANY>(Level::new(), top, |item| self.copy(item), ray)
    }

    /// Calls `found` with each hit of `ray`, in any order, up to the distance that it returned last.
    fn each_hit(&self, ray: &Ray, mut found: impl FnMut(InstanceHit) -> ControlFlow<(), f32>) {
        let level = Level::new();
        let Some(world) = world_ray(level, ray) else { return };
        self.top.visit_items(ray, |item, t_max| {
            let Some((instance, copy)) = self.copy(item) else { return ControlFlow::Continue(t_max) };
            let mut flow = ControlFlow::Continue(t_max);
            let mut each = |hit: TriangleHit, primitive_index| {
                flow = found(InstanceHit::new(instance, hit.of(primitive_index)));
                flow
            };
            each_hit_of_copy(level, copy, &world, t_max, &mut each);
            flow
        });
    }

    /// The copy that an item of the tree above is, or is part of, with its index; `None` where that has no triangles.
    fn copy(&self, item: u32) -> Option<(u32, walk::Copy<'_>)> {
        let part = if self.parts.is_empty() { self.copies.whole(item)? } else { self.parts[item as usize] };
        let PlacedMesh { mesh, place } = self.copies.placed(part.copy);
        Some((part.copy, walk::Copy { tree: self.copies.wide_tree(*mesh), start: part.start, place }))
    }
}
