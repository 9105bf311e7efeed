//! Everything that rays of one picture share: scene, tree, camera and tracer.

use std::borrow::Cow;

use glam::Vec3;

use fearless_simd::Level;

use crate::accel::Accel;
use crate::camera::CameraFrame;
use crate::scene::{Material, Scene};
use crate::visibility::TriangleSet;
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::tree::traverse::{IndexedTriangles, NoProbe, Probe, Traversal, any_hit, closest_hit};
use bvhscope_engine::tree::{Container, Tree};
use bvhscope_engine::wide::tree::AnyWideTree;

use super::request::RenderRequest;
use super::section::Section;
use super::settings::Background;
use super::surface::{self, Normals, Orientation};

/// Maximum number of alpha cut-outs that a ray passes through before the next counts as solid.
const MAX_HOLES: u32 = 32;

/// The tree that uncounted rays are traced through. Both give the same hits.
enum Tracer<'a> {
    /// The wide tree.
    Wide(&'a AnyWideTree),
    /// The binary tree, for a first coarse picture that does not wait for the wide one.
    Binary(IndexedTriangles<'a>),
}

/// What shading modes may use.
pub(super) struct TraceContext<'a, C> {
    pub(super) tree: &'a Tree<C>,
    accel: &'a Accel,
    tracer: Tracer<'a>,
    level: Level,
    pub(super) scene: &'a Scene,
    pub(super) camera: CameraFrame,
    background: Background,
    /// Height of the picture in requested pixels.
    pub(super) height_px: f32,
    normals: Normals,
    /// Whether any material has alpha cut-outs.
    has_holes: bool,
    /// Triangles that rays pass through.
    hidden: Option<&'a TriangleSet>,
    section: Option<Section>,
    /// Length of the diagonal of the scene's bounding box in world units.
    pub(super) diagonal: f32,
}

impl<'a, C: Container> TraceContext<'a, C> {
    /// Traces through the wide tree if it has been made, see [`Accel::widen`], otherwise through the binary one.
    pub(super) fn new(request: &'a RenderRequest, tree: &'a Tree<C>, normals: Normals) -> Self {
        let accel = &*request.accel;
        let camera = request.camera.for_size(request.width_px, request.height_px);
        let scene = &*accel.scene;
        let tracer = match accel.known_wide() {
            Some(wide) => Tracer::Wide(&wide.tree),
            None => Tracer::Binary(IndexedTriangles { triangles: &scene.triangles, indices: &tree.primitive_indices }),
        };
        Self {
            tree,
            accel,
            tracer,
            level: request.settings.simd.level(),
            scene,
            normals,
            camera,
            height_px: request.height_px.max(1) as f32,
            background: request.settings.background,
            has_holes: scene.materials.iter().any(has_holes),
            hidden: request.hidden.as_deref().filter(|hidden| !hidden.is_empty()),
            section: request.settings.section.map(|plane| Section::new(plane, scene)),
            diagonal: scene.bounds.extent().length(),
        }
    }

    /// The surface normals at a hit.
    pub(super) fn orientation(&self, ray: &Ray, hit: &Hit) -> Orientation {
        surface::orientation(self.scene, &self.normals, ray, hit)
    }

    /// Whether rays pass through some triangles.
    fn has_gaps(&self) -> bool {
        self.has_holes || self.hidden.is_some()
    }

    /// The part of a ray that the section plane leaves.
    fn cut(&self, ray: &Ray) -> Ray {
        self.section.as_ref().map_or(*ray, |section| section.plane.clip(ray))
    }

    /// The parts of rays that the section plane leaves, copied only where there is one.
    fn cut_all<'r>(&self, rays: &'r [Ray]) -> Cow<'r, [Ray]> {
        match &self.section {
            Some(section) => rays.iter().map(|ray| section.plane.clip(ray)).collect(),
            None => Cow::Borrowed(rays),
        }
    }

    /// The closest hit that is neither hidden, cut off nor in an alpha cut-out.
    pub(super) fn closest(&self, ray: &Ray) -> Option<Hit> {
        let ray = &self.cut(ray);
        let hit = self.closest_or_hole(ray)?;
        if self.has_gaps() { self.beyond_gaps(ray, hit) } else { Some(hit) }
    }

    /// The closest hits of the rays of a tile that are neither hidden, cut off nor in alpha cut-outs.
    pub(super) fn closest_of_tile(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let rays = &*self.cut_all(rays);
        match self.tracer {
            Tracer::Wide(wide) => wide.closest_hits(self.level, rays, hits),
            Tracer::Binary(_) => hits.iter_mut().zip(rays).for_each(|(hit, ray)| *hit = self.closest_or_hole(ray)),
        }
        if self.has_gaps() {
            for (ray, hit) in rays.iter().zip(hits) {
                *hit = hit.and_then(|hit| self.beyond_gaps(ray, hit));
            }
        }
    }

    /// The cut surface at the hit of a primary ray, as its linear colour; `None` where the ray did not enter solid matter at the
    /// section plane. That it did is told by the back of a triangle behind it, so it needs triangles that face outwards.
    pub(super) fn cut_surface(&self, ray: &Ray, hit: &Hit) -> Option<Vec3> {
        let section = self.section.as_ref()?;
        let entry = section.plane.entry(ray)?;
        let normal = self.scene.triangles[hit.primitive_index as usize].scaled_normal();
        (normal.dot(ray.direction) * section.outward > 0.0).then(|| section.hatch(ray.at(entry), self.diagonal))
    }

    /// The closest hit with cut-outs as solid.
    fn closest_or_hole(&self, ray: &Ray) -> Option<Hit> {
        match self.tracer {
            Tracer::Wide(wide) => wide.closest_hit(self.level, ray),
            Tracer::Binary(triangles) => closest_hit(self.tree, triangles, ray, Traversal::Ordered, &mut NoProbe),
        }
    }

    /// The closest hit through the wide tree with its steps counted; cut-outs are solid. Behind a hidden triangle the ray is
    /// traced again, and those steps count too.
    pub(super) fn closest_in_steps<P: Probe>(&self, ray: &Ray, probe: &mut P) -> Option<Hit> {
        let wide = &self.accel.wide().tree;
        self.first_visible(ray, |ray| wide.closest_hit_with(self.level, ray, probe))
    }

    /// The closest hit through the binary tree with its tests counted; cut-outs are solid. Behind a hidden triangle the ray is
    /// traced again, and those tests count too.
    pub(super) fn closest_solid<P: Probe>(&self, ray: &Ray, traversal: Traversal, probe: &mut P) -> Option<Hit> {
        let triangles = self.accel.leaf_triangles();
        self.first_visible(ray, |ray| closest_hit(self.tree, triangles, ray, traversal, probe))
    }

    /// The first hit of `closest` that is not hidden, in the part of the ray that the section plane leaves.
    fn first_visible(&self, ray: &Ray, mut closest: impl FnMut(&Ray) -> Option<Hit>) -> Option<Hit> {
        let mut rest = self.cut(ray);
        loop {
            let hit = closest(&rest)?;
            if !self.hidden.is_some_and(|hidden| hidden.contains(hit.primitive_index)) {
                return Some(hit);
            }
            rest.t_min = hit.t.next_up();
        }
    }

    /// Any-hit query for each ray, into the first elements of `blocked`; cut-outs let rays pass.
    pub(super) fn are_blocked(&self, rays: &[Ray], blocked: &mut [bool]) {
        if self.has_gaps() {
            for (blocked, ray) in blocked.iter_mut().zip(rays) {
                *blocked = self.closest(ray).is_some();
            }
        } else {
            let rays = &*self.cut_all(rays);
            match self.tracer {
                Tracer::Wide(wide) => wide.any_hits(self.level, rays, blocked),
                Tracer::Binary(triangles) => {
                    blocked
                        .iter_mut()
                        .zip(rays)
                        .for_each(|(blocked, ray)| *blocked = any_hit(self.tree, triangles, ray));
                }
            }
        }
    }

    /// Whether anything but cut-outs lies on a ray.
    pub(super) fn is_blocked(&self, ray: &Ray) -> bool {
        let mut blocked = [false];
        self.are_blocked(std::slice::from_ref(ray), &mut blocked);
        blocked[0]
    }

    /// The first hit from `hit` on that is neither hidden nor in a cut-out.
    #[cold]
    fn beyond_gaps(&self, ray: &Ray, mut hit: Hit) -> Option<Hit> {
        let mut rest = *ray;
        let mut holes = 0;
        loop {
            if !self.hidden.is_some_and(|hidden| hidden.contains(hit.primitive_index)) {
                let material = self.scene.material(hit.primitive_index);
                let is_hole = has_holes(material) && surface::alpha(self.scene, material, &hit) < material.alpha_cutoff;
                if !is_hole || holes == MAX_HOLES {
                    return Some(hit);
                }
                holes += 1;
            }
            // The same ray finds the same t on the same triangle again, so the next larger t excludes it.
            rest.t_min = hit.t.next_up();
            hit = self.closest_or_hole(&rest)?;
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

    /// Linear background colour at `y_px` from the upper edge.
    pub(super) fn background(&self, y_px: f32) -> Vec3 {
        self.background.color(y_px / self.height_px)
    }
}

fn has_holes(material: &Material) -> bool {
    material.alpha_cutoff > 0.0 && material.base_color_texture.is_some()
}
