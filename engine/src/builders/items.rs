//! Trees over items of the caller's own, of which builders see nothing but their containers.
//!
//! A builder gets a stand-in for each item: the triangle between two opposite corners of its box, which has that very box. So a tree of
//! boxes over boxes is built as one over triangles, by the same instructions. Spheres and polytopes replace those of the stand-ins
//! where clustering starts, or in the finished tree of builders that do not cluster.

use crate::aac::ClusterContainer;
use crate::builders::{BuildError, build_container, check_size};
use crate::cancel::{CancelToken, MEDIUM_STEPS};
use crate::geometry::{Aabb, Dop14, Sphere, Triangle};
use crate::settings::{BuildSettings, Pass};
use crate::stage_times::StageTimes;
use crate::tree::{AnyTree, Tree};

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
        let Aabb { min, max } = bounds(item);
        if !(min.is_finite() && max.is_finite() && min.cmple(max).all()) {
            return Err(BuildError::Refused(format!(
                "the container of item {index} is empty or not finite; leave the item out"
            )));
        }
        stand_ins.push(Triangle { a: min, b: max, c: min });
    }
    Ok(stand_ins)
}

/// Builds a binary tree over `items` with their containers, whatever `settings` say of containers; `stand_ins` are theirs.
///
/// # Errors
///
/// [`BuildError::Cancelled`] once `token` is cancelled; [`BuildError::Refused`] for passes that need triangles, and as
/// [`build_binary`](super::build_binary).
pub(crate) fn build_over_items(
    items: &Items,
    stand_ins: &[Triangle],
    settings: &BuildSettings,
    token: &CancelToken,
) -> Result<(AnyTree, StageTimes), BuildError> {
    if let Some(pass) = [Pass::Split, Pass::Orient].into_iter().find(|pass| settings.optimize.contains(*pass)) {
        return Err(BuildError::Refused(format!("the pass '{}' needs triangles: build items without it", pass.name())));
    }
    let mut times = StageTimes::default();
    let tree = match items {
        Items::Boxes(_) => with_kind::<Aabb>(stand_ins, None, settings, token, &mut times)?.into(),
        Items::Spheres(spheres) => with_kind(stand_ins, Some(spheres), settings, token, &mut times)?.into(),
        Items::Dops(dops) => with_kind(stand_ins, Some(dops), settings, token, &mut times)?.into(),
    };
    Ok((tree, times))
}

fn with_kind<C: ClusterContainer>(
    stand_ins: &[Triangle],
    items: Option<&[C]>,
    settings: &BuildSettings,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, BuildError> {
    let settings = BuildSettings { container: C::KIND, ..*settings };
    check_size(stand_ins.len(), &settings)?;
    build_container(stand_ins, items, &settings, None, token, times)
}
