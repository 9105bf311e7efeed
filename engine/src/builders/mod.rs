//! Every way to build a tree, behind one function.

mod binned_sah;
mod exact;
mod lbvh;
mod none;

pub mod depth_limit;
mod flatten;
mod presplit;

use std::time::Instant;

use crate::aac::build_cache::BuildCache;
use crate::aac::{ClusterContainer, build_bvh};
use crate::builders::depth_limit::limit_depth;
use crate::builders::presplit::{Presplit, fragments};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Sphere, Triangle};
use crate::optimize::optimize;
use crate::order::{InputBounds, input_bounds};
use crate::settings::{BuildSettings, BuilderKind, Pass, Passes};
pub use crate::stage_times::StageTimes;
use crate::tree::statistics::stats_of;
use crate::tree::{AnyTree, Container, ContainerKind, Tree};

/// Why there is no tree.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BuildError {
    /// Nobody wanted it any more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// These settings cannot build these primitives; the text says why and what to do.
    #[error("{0}")]
    Refused(String),
}

/// Most primitives in a tree: twice as many nodes must have 32-bit numbers.
const MAX_PRIMITIVES: usize = 1 << 31;

/// Builds a binary tree over `triangles` (all coordinates finite) in the calling thread's rayon pool. Reports progress through
/// `token`. No triangles give a tree without nodes.
pub fn build_binary(
    triangles: &[Triangle],
    settings: &BuildSettings,
    token: &CancelToken,
) -> Result<(AnyTree, StageTimes), BuildError> {
    build_binary_with_cache(triangles, settings, None, token)
}

/// [`build_binary`] with what earlier builds of the very same triangles left in `cache`, which it updates.
pub fn build_binary_with_cache(
    triangles: &[Triangle],
    settings: &BuildSettings,
    cache: Option<&mut BuildCache>,
    token: &CancelToken,
) -> Result<(AnyTree, StageTimes), BuildError> {
    if let Some(refusal) = settings.refusal(triangles.len()) {
        return Err(BuildError::Refused(refusal));
    }
    if let Some(refusal) = too_many(triangles.len()) {
        return Err(BuildError::Refused(refusal));
    }
    match settings.container {
        ContainerKind::Aabb => build_scaled::<Aabb>(triangles, settings, cache, token),
        ContainerKind::Sphere => build_scaled::<Sphere>(triangles, settings, cache, token),
    }
}

/// Why so many triangles cannot be numbered.
fn too_many(count: usize) -> Option<String> {
    (count >= MAX_PRIMITIVES)
        .then(|| format!("a tree holds fewer than {MAX_PRIMITIVES} triangles, this scene has {count}; leave some out"))
}

/// Coordinates beyond which areas leave the range of `f32`.
const LARGEST_COORDINATE: f32 = 1e15;
/// Size of a scene below which the areas of its triangles vanish.
const SMALLEST_EXTENT: f32 = 1e-10;

/// Binary logarithm of the size that a scene is scaled to. That far up, beside a lone triangle a great way off, the areas of all
/// the others are numbers of full precision, with which processors calculate ten times as fast as with denormal ones.
const SCALED_TO: f32 = 40.0;
/// Triangles or nodes between two looks at the token.
const BATCH: usize = 1 << 14;

/// Builds over coordinates scaled by a power of two where the areas of the given ones would overflow or vanish.
fn build_scaled<C: ClusterContainer>(
    triangles: &[Triangle],
    settings: &BuildSettings,
    mut cache: Option<&mut BuildCache>,
    token: &CancelToken,
) -> Result<(AnyTree, StageTimes), BuildError>
where
    AnyTree: From<Tree<C>>,
{
    let mut times = StageTimes::default();
    if let Some(cache) = &mut cache {
        cache.take_stats();
    }
    if triangles.is_empty() {
        let tree = Tree::<C> { nodes: Vec::new(), primitive_indices: Vec::new(), max_depth: 0 };
        return Ok((tree.into(), times));
    }
    let bounds = match &mut cache {
        Some(cache) => cache.input_bounds(triangles, token)?,
        None => input_bounds(triangles, token)?,
    };
    let largest = bounds.max_coordinate;
    if (SMALLEST_EXTENT..=LARGEST_COORDINATE).contains(&largest) || largest == 0.0 {
        let tree = if settings.passes().contains(Pass::Split) {
            build_split(triangles, &bounds, settings, token, &mut times)?
        } else {
            build_kind::<C>(triangles, &bounds, settings, cache, token, &mut times)?
        };
        return Ok((tree.into(), times));
    }
    // Scaling by a power of two is exact, and so is the shape of the tree; the containers come from the original.
    let scale = (SCALED_TO - largest.log2()).floor().clamp(-126.0, 126.0).exp2();
    let mut scaled = Vec::with_capacity(triangles.len());
    for batch in triangles.chunks(BATCH) {
        token.check()?;
        scaled.extend(batch.iter().map(|t| Triangle { a: t.a * scale, b: t.b * scale, c: t.c * scale }));
    }
    // Whole triangles: their boxes are made anew below.
    let whole = BuildSettings { optimize: settings.optimize.without(Pass::Split), ..*settings };
    let mut tree = build_kind::<C>(&scaled, &input_bounds(&scaled, token)?, &whole, None, token, &mut times)?;
    for at in (0..tree.nodes.len()).rev() {
        if at.is_multiple_of(BATCH) {
            token.check()?;
        }
        let node = tree.nodes[at];
        let first = node.first as usize;
        tree.nodes[at].container = if node.is_leaf() {
            container_of(&tree.primitive_indices[first..first + node.count as usize], triangles, token)?
        } else {
            tree.nodes[first].container.union(&tree.nodes[first + 1].container)
        };
    }
    Ok((tree.into(), times))
}

/// The container of all these triangles.
fn container_of<C: Container>(indices: &[u32], triangles: &[Triangle], token: &CancelToken) -> Result<C, Cancelled> {
    let mut container = C::EMPTY;
    for batch in indices.chunks(BATCH) {
        // A leaf of usual size needs no look of its own.
        if batch.len() == BATCH {
            token.check()?;
        }
        let containers = batch.iter().map(|&primitive| C::of_triangle(&triangles[primitive as usize]));
        container = containers.fold(container, |all, one| all.union(&one));
    }
    Ok(container)
}

/// [`build_kind`] of the fragments of `triangles`.
fn build_split<C: ClusterContainer>(
    triangles: &[Triangle],
    bounds: &InputBounds,
    settings: &BuildSettings,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let start = Instant::now();
    let fragments = fragments(triangles, token)?;
    times.stages.push((Pass::Split.name(), start.elapsed()));
    let Some(Presplit { proxy_triangles, of }) = fragments.filter(|fragments| fragments.of.len() < MAX_PRIMITIVES)
    else {
        return build_kind(triangles, bounds, settings, None, token, times);
    };
    let mut tree = build_kind(&proxy_triangles, &input_bounds(&proxy_triangles, token)?, settings, None, token, times)?;
    for batch in tree.primitive_indices.chunks_mut(BATCH) {
        token.check()?;
        for index in batch {
            *index = of[*index as usize];
        }
    }
    Ok(tree)
}

/// Builds with the chosen algorithm and runs the chosen passes over the result.
fn build_kind<C: ClusterContainer>(
    triangles: &[Triangle],
    bounds: &InputBounds,
    settings: &BuildSettings,
    mut cache: Option<&mut BuildCache>,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    token.check()?;
    let tree = match settings.builder {
        BuilderKind::Aac => build_bvh(triangles, bounds, settings, cache.as_deref_mut(), token, times),
        BuilderKind::Lbvh => lbvh::build(triangles, bounds, settings.curve, token, times),
        BuilderKind::BinnedSah => binned_sah::build(triangles, token, times),
        BuilderKind::Exact => exact::build(triangles, token, times),
        BuilderKind::None => none::build(triangles, token, times),
    }?;
    let mut tree = optimize(tree, settings.passes(), token, times)?;
    let limited = matches!(settings.builder, BuilderKind::Aac | BuilderKind::Exact) && limit_depth(&mut tree, token)?;
    if let Some(cache) = cache
        && (limited || settings.passes() != Passes::NONE)
    {
        // They were another tree's.
        cache.take_stats();
    }
    if limited && let Some((_, cost)) = times.costs.last_mut() {
        *cost = f64::from(stats_of(&tree, token)?.sah_cost);
    }
    Ok(tree)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_triangles_than_numbers_are_refused() {
        assert!(too_many(MAX_PRIMITIVES).is_some_and(|text| text.contains("2147483648")));
        // The most that are taken have nodes that 32 bits number.
        assert_eq!(too_many(MAX_PRIMITIVES - 1), None);
        assert!(u32::try_from(2 * (MAX_PRIMITIVES as u64 - 1) - 1).is_ok());
    }
}
