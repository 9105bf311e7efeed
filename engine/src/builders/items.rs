//! Trees over items of the caller's own, of which builders see nothing but their containers.
//!
//! A builder gets a stand-in for each item: the triangle between two opposite corners of its box, which has that very box. So a tree of
//! boxes over boxes is built as one over triangles, by the same instructions. Spheres and polytopes replace those of the stand-ins
//! where clustering starts, or in the finished tree of builders that do not cluster.

use crate::builders::error::BuildError;
use crate::cancel::{CancelToken, MEDIUM_STEPS};
use crate::geometry::{Aabb, Container as _, Dop14, Sphere, Triangle};

/// The containers of items of the caller's own: curves, points, solids, whole meshes.
#[derive(Debug, Clone, Copy)]
pub enum Items<'a> {
    /// Axis-aligned boxes.
    Boxes(&'a [Aabb]),
    /// Spheres.
    Spheres(&'a [Sphere]),
    /// Polytopes.
    Dops(&'a [Dop14]),
}

impl<'a> From<&'a [Aabb]> for Items<'a> {
    fn from(boxes: &'a [Aabb]) -> Self {
        Self::Boxes(boxes)
    }
}

impl<'a> From<&'a [Sphere]> for Items<'a> {
    fn from(spheres: &'a [Sphere]) -> Self {
        Self::Spheres(spheres)
    }
}

impl<'a> From<&'a [Dop14]> for Items<'a> {
    fn from(dops: &'a [Dop14]) -> Self {
        Self::Dops(dops)
    }
}

impl Items<'_> {
    /// The stand-in of each item.
    ///
    /// # Errors
    ///
    /// [`BuildError::Refused`] for a container that is empty or not finite.
    pub(crate) fn stand_ins(&self, token: &CancelToken) -> Result<Vec<Triangle>, BuildError> {
        match self {
            Self::Boxes(boxes) => stand_ins(boxes, |bounds| *bounds, token),
            Self::Spheres(spheres) => stand_ins(spheres, around, token),
            Self::Dops(dops) => stand_ins(dops, |dop| dop.bounds, token),
        }
    }
}

/// The box around a sphere, outwards of the rounded sums.
fn around(sphere: &Sphere) -> Aabb {
    let Aabb { min, max } = sphere.bounds();
    Aabb { min: min.map(f32::next_down), max: max.map(f32::next_up) }
}

fn stand_ins<C>(items: &[C], bounds: impl Fn(&C) -> Aabb, token: &CancelToken) -> Result<Vec<Triangle>, BuildError> {
    let mut stand_ins = Vec::with_capacity(items.len());
    for (index, item) in items.iter().enumerate() {
        token.check_every(MEDIUM_STEPS, index)?;
        let bounds = bounds(item);
        if !(bounds.min.is_finite() && bounds.max.is_finite() && bounds.min.cmple(bounds.max).all()) {
            return Err(BuildError::Refused(format!(
                "the container of item {index} is empty or not finite; leave the item out"
            )));
        }
        stand_ins.push(Triangle::across(&bounds));
    }
    Ok(stand_ins)
}
