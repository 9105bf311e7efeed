//! Where copies of meshes stand in their motion, which may press them flat.

use glam::Affine3A;

use bvhscope_engine::geometry::{Aabb, Placement};
use bvhscope_engine::{Copies, Placed};

/// Where copies of meshes within `bounds` stand, be it in their motion.
pub(super) fn moving_places(placed: &[Placed], bounds: &[Aabb]) -> Copies {
    Copies::at(placed.iter().map(|copy| (copy.mesh, moving(&copy.transform, &bounds[copy.mesh as usize]).0)))
}

/// The place of a copy that moves, of a mesh within `bounds`, and whether it is nowhere: where its coordinates are not numbers or too large it
/// is a point, where its origin is or that of the world, which no ray hits.
pub(super) fn moving(transform: &Affine3A, bounds: &Aabb) -> (Placement, bool) {
    let place = Placement::moving(transform, bounds);
    let origin = Affine3A { translation: transform.translation, ..Affine3A::ZERO };
    let point = |at: &Affine3A| Placement::moving(at, &Aabb::EMPTY);
    match place.or_else(|_| point(&origin)).or_else(|_| point(&Affine3A::ZERO)) {
        Ok(point) => (point, place.is_err()),
        Err(why) => unreachable!("a point is within range: {why}"),
    }
}
