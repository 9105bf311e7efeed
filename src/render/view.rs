//! A scene, its tree and a camera, taken apart once for a whole picture.

use glam::Vec3;

use crate::bvh::traverse::{NoProbe, Probe, Traversal, any_hit, closest_hit};
use crate::bvh::{Container, Tree};
use crate::camera::CameraFrame;
use crate::geometry::{Hit, Ray, Triangle};
use crate::scene::{Material, Scene};

use super::surface;

/// Holes that one ray passes through before the next one counts as solid.
const MAX_HOLES: u32 = 32;

/// The background's linear grey at the upper and the lower edge of the picture.
const BACKGROUND: [Vec3; 2] = [Vec3::new(0.052, 0.055, 0.062), Vec3::new(0.016, 0.017, 0.019)];

/// What shaders look at.
pub(super) struct View<'a, C> {
    pub(super) tree: &'a Tree<C>,
    pub(super) leaf_triangles: &'a [Triangle],
    pub(super) scene: &'a Scene,
    pub(super) camera: CameraFrame,
    /// Height of the picture in wanted pixels.
    pub(super) height_px: f32,
    /// Whether any material has holes.
    has_holes: bool,
    /// Length of the diagonal of the scene's box.
    pub(super) diagonal: f32,
}

impl<'a, C: Container> View<'a, C> {
    pub(super) fn new(
        scene: &'a Scene,
        tree: &'a Tree<C>,
        leaf_triangles: &'a [Triangle],
        camera: CameraFrame,
        height_px: u32,
    ) -> Self {
        Self {
            tree,
            leaf_triangles,
            scene,
            camera,
            height_px: height_px as f32,
            has_holes: scene.materials.iter().any(has_holes),
            diagonal: scene.bounds.extent().length(),
        }
    }

    /// The nearest hit that is not in a hole of its material.
    pub(super) fn closest(&self, ray: &Ray) -> Option<Hit> {
        let hit = self.closest_solid(ray, Traversal::Ordered, &mut NoProbe)?;
        if self.has_holes { self.beyond_holes(ray, hit) } else { Some(hit) }
    }

    /// The nearest hit, taking holes for solid: the ray whose tests are counted.
    pub(super) fn closest_solid<P: Probe>(&self, ray: &Ray, traversal: Traversal, probe: &mut P) -> Option<Hit> {
        closest_hit(self.tree, self.leaf_triangles, ray, traversal, probe)
    }

    /// Whether something solid lies on `ray`.
    pub(super) fn is_blocked(&self, ray: &Ray) -> bool {
        if self.has_holes { self.closest(ray).is_some() } else { any_hit(self.tree, self.leaf_triangles, ray) }
    }

    #[cold]
    fn beyond_holes(&self, ray: &Ray, mut hit: Hit) -> Option<Hit> {
        let mut rest = *ray;
        for _ in 0..MAX_HOLES {
            let material = self.scene.material(hit.primitive_index);
            if !has_holes(material) || surface::alpha(self.scene, material, &hit) >= material.alpha_cutoff {
                break;
            }
            // The same ray finds the same t for the same triangle, so one step further excludes it.
            rest.t_min = hit.t.next_up();
            hit = self.closest_solid(&rest, Traversal::Ordered, &mut NoProbe)?;
        }
        Some(hit)
    }

    /// The ray from just above a surface point towards `direction`, up to `t_max`.
    pub(super) fn ray_from(&self, position: Vec3, geometric_normal: Vec3, direction: Vec3, t_max: f32) -> Ray {
        // Some ten roundings of the largest coordinate that went into the position.
        let offset = 2e-6 * (position.abs().max_element() + self.diagonal);
        let mut ray = Ray::new(position + geometric_normal * offset, direction);
        ray.t_max = t_max;
        ray
    }

    /// Linear colour behind everything, at `y_px` from the upper edge.
    pub(super) fn background(&self, y_px: f32) -> Vec3 {
        background(y_px / self.height_px)
    }
}

/// Linear colour of the background at `y` from 0, the upper edge, to 1.
pub(super) fn background(y: f32) -> Vec3 {
    BACKGROUND[0].lerp(BACKGROUND[1], y.clamp(0.0, 1.0))
}

fn has_holes(material: &Material) -> bool {
    material.alpha_cutoff > 0.0 && material.base_color_texture.is_some()
}
