//! Everything that rays of one picture share: scene, tree, camera and tracer.

use glam::Vec3;

use crate::accel::Accel;
use crate::accel::laid::CountedLayout;
use crate::accel::tracer::{CountedQuery, Counting, Tracer};
use crate::camera::CameraFrame;
use crate::scene::{Material, Scene};
use crate::vectors::length;
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::tree::traverse::{TestCounts, Traversal};

use super::request::RenderRequest;
use super::section::Section;
use super::settings::Background;
use super::surface::{self, Normals, Orientation};
use super::visible::Visible;

/// Maximum number of alpha cut-outs that a ray passes through before the next counts as solid.
const MAX_HOLES: u32 = 32;
/// Part of the rays that pass through clear thin glass; the others show its surface with its reflections, as panes reflect some 8 %
/// of the light that falls on them straight and more at an angle.
const THROUGH_GLASS: f32 = 0.88;

/// Tree, scene, camera and rays for the shading modes.
pub(super) struct TraceContext<'a> {
    tracer: Box<dyn Tracer + 'a>,
    accel: &'a Accel,
    /// The layout that is counted in place of the trees.
    layout: Option<&'a CountedLayout>,
    pub(super) scene: &'a Scene,
    pub(super) camera: CameraFrame,
    background: Background,
    /// Height of the picture in requested pixels.
    pub(super) height_px: f32,
    normals: Normals,
    /// Some material has alpha cut-outs.
    has_holes: bool,
    visible: Visible<'a>,
    section: Option<Section>,
    /// Length of the diagonal of the scene's bounding box in world units.
    pub(super) diagonal: f32,
}

impl<'a> TraceContext<'a> {
    /// Traces through the wide tree if it has been made, see [`Accel::widen`], otherwise through the binary one.
    pub(super) fn new(request: &'a RenderRequest, normals: Normals) -> Self {
        let accel = &*request.accel;
        let camera = request.camera.for_size(request.width_px, request.height_px);
        let scene = &*accel.scene;
        Self {
            tracer: accel.tracer(request.settings.simd),
            accel,
            layout: request.counted_layout(),
            scene,
            normals,
            camera,
            height_px: request.height_px.max(1) as f32,
            background: request.settings.background,
            has_holes: scene.materials.iter().any(has_holes),
            visible: request.visible(),
            section: request.settings.section.map(|plane| Section::new(plane, scene)),
            diagonal: length(scene.bounds.extent()),
        }
    }

    /// The surface normals at a hit.
    pub(super) fn orientation(&self, ray: &Ray, hit: &Hit) -> Orientation {
        surface::orientation(self.scene, &self.normals, ray, hit)
    }

    /// Rays pass through some triangles.
    fn has_gaps(&self) -> bool {
        self.has_holes || self.visible.hidden.is_some()
    }

    /// The closest hits of `rays` that are neither hidden, cut off nor in alpha cut-outs, into the first elements of `hits`.
    pub(super) fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let rays = &*self.visible.cut_all(rays);
        self.tracer.nearest(rays, hits);
        if self.has_gaps() {
            self.trace_beyond_gaps(rays, hits);
        }
    }

    /// Replaces each of `hits` that is hidden or in a cut-out by the first behind it that is not.
    fn trace_beyond_gaps(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        // The same ray finds the same t on the same triangle again, so the next larger t excludes it.
        let beyond = |ray: &Ray, hit: &Hit| Ray { t_min: hit.t.next_up(), ..*ray };
        let mut open: Vec<(usize, u32)> = Vec::new();
        let mut rest: Vec<Ray> = Vec::new();
        for (index, (ray, hit)) in rays.iter().zip(&*hits).enumerate() {
            if let Some((hit, holes)) = hit.and_then(|hit| Some((hit, self.gap(&hit, 0)?))) {
                open.push((index, holes));
                rest.push(beyond(ray, &hit));
            }
        }
        let mut found = Vec::new();
        while !open.is_empty() {
            found.clear();
            found.resize(open.len(), None);
            self.tracer.nearest(&rest, &mut found);
            let mut kept = 0;
            for (slot, found) in found.iter().enumerate() {
                let (index, holes) = open[slot];
                hits[index] = *found;
                if let Some((hit, holes)) = found.and_then(|hit| Some((hit, self.gap(&hit, holes)?))) {
                    (open[kept], rest[kept]) = ((index, holes), beyond(&rest[slot], &hit));
                    kept += 1;
                }
            }
            open.truncate(kept);
            rest.truncate(kept);
        }
    }

    /// The number of cut-outs that a ray has passed behind the triangle at a hit, if it passes through; it passed `holes` before.
    fn gap(&self, hit: &Hit, holes: u32) -> Option<u32> {
        if self.visible.is_hidden(hit.primitive_index) {
            return Some(holes);
        }
        let material = self.scene.material(hit.primitive_index);
        let is_cut_out = || surface::alpha(self.scene, material, hit) < material.alpha_cutoff;
        let is_hole = has_holes(material) && (is_cut_out() || chance(hit) < material.transmission * THROUGH_GLASS);
        (is_hole && holes < MAX_HOLES).then_some(holes + 1)
    }

    /// The cut surface at the hit of a primary ray, as its linear colour; `None` where the ray did not enter solid matter at the
    /// section plane. Recognised by the back of a triangle behind it, so triangles must face outwards.
    pub(super) fn cut_surface(&self, ray: &Ray, hit: &Hit) -> Option<Vec3> {
        let section = self.section.as_ref()?;
        let entry = section.plane.entry(ray)?;
        let normal = self.scene.triangle(hit.primitive_index).scaled_normal();
        (normal.dot(ray.direction) * section.outward > 0.0).then(|| section.hatch(ray.at(entry), self.diagonal))
    }

    /// The closest hits of `rays` with what `counting` counts of each, into the first elements of `found`; cut-outs are solid. Behind a
    /// hidden triangle a ray is traced again, and the work of that counts too.
    pub(super) fn counted(
        &self,
        rays: &[Ray],
        (counting, traversal): (Counting, Traversal),
        found: &mut [(Option<Hit>, TestCounts)],
    ) {
        let passes = &|primitive_index| self.visible.is_hidden(primitive_index);
        let (rays, query) = (&*self.visible.cut_all(rays), CountedQuery { counting, traversal, passes });
        match self.layout {
            Some(layout) => layout.counted(self.accel.leaf_triangles(), rays, query, found),
            None => self.tracer.counted(rays, query, found),
        }
    }

    /// All hits of the whole `ray`, whatever is cut off, without those on hidden triangles. Returns whether there are more than `max`.
    pub(super) fn all_hits(&self, ray: &Ray, max: usize, hits: &mut Vec<Hit>) -> bool {
        let has_more = self.tracer.all_hits(ray, max, hits);
        hits.retain(|hit| !self.visible.is_hidden(hit.primitive_index));
        has_more
    }

    /// The tests of a query for them.
    pub(super) fn all_hits_tests(&self, ray: &Ray) -> TestCounts {
        self.tracer.all_hits_tests(ray)
    }

    /// Distance of a point from the surface in world units, whatever is hidden or cut off; `None` without triangles.
    pub(super) fn distance_to_surface(&self, point: Vec3) -> Option<f32> {
        self.tracer.closest_point(point).map(|closest| closest.distance as f32)
    }

    /// The tests of a query for it.
    pub(super) fn closest_point_tests(&self, point: Vec3) -> TestCounts {
        self.tracer.closest_point_tests(point)
    }

    /// Any-hit query for each ray, into the first elements of `blocked`; cut-outs let rays pass.
    pub(super) fn are_blocked(&self, rays: &[Ray], blocked: &mut [bool]) {
        if self.has_gaps() {
            let mut hits = vec![None; rays.len()];
            self.closest_hits(rays, &mut hits);
            for (blocked, hit) in blocked.iter_mut().zip(hits) {
                *blocked = hit.is_some();
            }
        } else {
            self.tracer.blocked(&self.visible.cut_all(rays), blocked);
        }
    }

    /// A secondary ray towards `direction` up to `t_max`, with its origin offset from the surface.
    pub(super) fn ray_from(&self, position: Vec3, geometric_normal: Vec3, direction: Vec3, t_max: f32) -> Ray {
        // About ten times the rounding error of the largest coordinate of the position.
        let offset = 2e-6 * (position.abs().max_element() + self.diagonal);
        let mut ray = Ray::new(position + geometric_normal * offset, direction);
        ray.t_max = t_max;
        ray
    }

    /// A shadow ray to a light at this distance.
    pub(super) fn ray_to(&self, position: Vec3, geometric_normal: Vec3, direction: Vec3, distance: f32) -> Ray {
        self.ray_from(position, geometric_normal, direction, distance * (1.0 - 1e-4))
    }

    /// Samples that hit nothing leave their pixel clear.
    pub(super) fn is_clear(&self) -> bool {
        self.background == Background::Transparent
    }

    /// Linear background colour at `y_px` from the upper edge.
    pub(super) fn background(&self, y_px: f32) -> Vec3 {
        self.background.color(y_px / self.height_px)
    }
}

fn has_holes(material: &Material) -> bool {
    material.alpha_cutoff > 0.0 || material.transmission > 0.0
}

/// A number from 0 to 1 that is another one for each hit, and the same for the same hit.
pub(super) fn chance(hit: &Hit) -> f32 {
    // Mixed by the finaliser of MurmurHash3 (public domain).
    let mut hash = hit.primitive_index;
    for bits in [hit.u.to_bits(), hit.v.to_bits()] {
        hash = (hash.rotate_left(13) ^ bits).wrapping_mul(0x85eb_ca6b);
        hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
        hash ^= hash >> 16;
    }
    (hash >> 8) as f32 / (1_u32 << 24) as f32
}
