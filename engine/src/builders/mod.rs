//! The builders, behind one function. A new one is a module of its own, a [`BuilderKind`] and an arm in `build_kind`.
//!
//! AAC lives in a room of its own. Builders know triangles and settings, and neither the wide tree nor what traces it.

pub(crate) mod binned_sah;
pub(crate) mod exact;
mod lbvh;
mod none;
pub(crate) mod ploc;
mod sweep;

pub(crate) mod hploc;

mod clip;
mod sbvh;

pub mod depth_limit;
mod error;
mod flatten;

pub(crate) mod clustered;

mod items;
pub(crate) mod prepared;
mod presplit;
mod scale;

use std::time::Instant;

use crate::aac::build_cache::BuildCache;
use crate::aac::{ClusterContainer, build_bvh};
use crate::builders::depth_limit::limit_depth;
use crate::builders::prepared::{MAX_PRIMITIVES, PreparedInput};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Dop14, Sphere, Triangle};
use crate::optimize::{ANNEALING_PARTS, optimize, orient};
use crate::order::input_bounds;
use crate::settings::{BuildSettings, BuilderKind, Pass, Passes};
use crate::stage_times::Stage;
pub use crate::stage_times::StageTimes;
use crate::tree::statistics::stats_of;
use crate::tree::{AnyTree, ContainerKind, Tree};
pub use error::BuildError;
pub use items::Items;

/// Builds a binary tree over `triangles`, all of whose coordinates must be finite, in the rayon pool of the calling thread.
/// Returns it with the duration of each stage. Reports progress through `token`. Without triangles the tree has no nodes.
pub fn build_binary(
    triangles: &[Triangle],
    settings: &BuildSettings,
    token: &CancelToken,
) -> Result<(AnyTree, StageTimes), BuildError> {
    build_binary_with_cache(triangles, settings, None, token)
}

/// [`build_binary`] that reuses and updates a `cache` from earlier builds of the very same triangles.
pub fn build_binary_with_cache(
    triangles: &[Triangle],
    settings: &BuildSettings,
    cache: Option<&mut BuildCache>,
    token: &CancelToken,
) -> Result<(AnyTree, StageTimes), BuildError> {
    check_size(triangles.len(), settings)?;
    let mut times = StageTimes::default();
    let mut tree: AnyTree = match settings.container {
        ContainerKind::Aabb => build_container::<Aabb>(triangles, None, settings, cache, token, &mut times)?.into(),
        ContainerKind::Sphere => build_container::<Sphere>(triangles, None, settings, cache, token, &mut times)?.into(),
        ContainerKind::Dop14 => build_container::<Dop14>(triangles, None, settings, cache, token, &mut times)?.into(),
        ContainerKind::Oriented => unreachable!("refused above"),
    };
    if settings.passes().contains(Pass::Orient) {
        let start = Instant::now();
        tree = orient(&tree, triangles, token)?;
        times.stages.push((Pass::Orient.name(), start.elapsed()));
    }
    Ok((tree, times))
}

/// Refuses settings that cannot build a tree over `count` triangles.
pub(crate) fn check_size(count: usize, settings: &BuildSettings) -> Result<(), BuildError> {
    settings.refusal(count).or_else(|| too_many(count)).map_or(Ok(()), |refusal| Err(BuildError::Refused(refusal)))
}

/// Why `count` triangles are too many to index; `None` where they are not.
fn too_many(count: usize) -> Option<String> {
    (count >= MAX_PRIMITIVES)
        .then(|| format!("a tree holds fewer than {MAX_PRIMITIVES} triangles, this scene has {count}; leave some out"))
}

/// Builds a tree with containers `C`, whatever `settings` say of containers and of [`Pass::Orient`].
///
/// # Errors
///
/// As [`build_binary`].
pub(crate) fn build_tree<C: ClusterContainer>(
    triangles: &[Triangle],
    settings: &BuildSettings,
    token: &CancelToken,
) -> Result<Tree<C>, BuildError> {
    check_size(triangles.len(), settings)?;
    build_container(triangles, None, settings, None, token, &mut StageTimes::default())
}

/// Builds a binary tree over `items` with their containers, whatever `settings` say of containers; `stand_ins` are theirs.
///
/// # Errors
///
/// [`BuildError::Cancelled`] once `token` is cancelled; [`BuildError::Refused`] for passes and builders that need triangles, and as
/// [`build_binary`].
pub(crate) fn build_over_items(
    items: &Items,
    stand_ins: &[Triangle],
    settings: &BuildSettings,
    token: &CancelToken,
) -> Result<(AnyTree, StageTimes), BuildError> {
    if let Some(pass) = [Pass::Split, Pass::Orient].into_iter().find(|pass| settings.optimize.contains(*pass)) {
        return Err(BuildError::Refused(format!("the pass '{}' needs triangles: build items without it", pass.name())));
    }
    if settings.builder.needs_triangles() {
        let name = settings.builder.name();
        return Err(BuildError::Refused(format!("the builder '{name}' needs triangles: build items by another")));
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

/// Builds a tree with containers `C`, over scaled coordinates where the areas of the given ones would overflow or vanish. `items` are
/// the containers of the triangles where these are stand-ins for them.
fn build_container<C: ClusterContainer>(
    triangles: &[Triangle],
    items: Option<&[C]>,
    settings: &BuildSettings,
    mut cache: Option<&mut BuildCache>,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, BuildError> {
    if let Some(cache) = &mut cache {
        cache.take_stats();
    }
    if triangles.is_empty() {
        return Ok(Tree::EMPTY);
    }
    let bounds = if let Some(bounds) = cache.as_deref().and_then(BuildCache::input_bounds) {
        times.reused.push("bounds");
        bounds
    } else {
        let stage = Stage::begin("bounds", token);
        let bounds = input_bounds(triangles, token)?;
        stage.end(times);
        bounds
    };
    if let Some(cache) = &mut cache {
        cache.store_input_bounds(bounds);
    }
    let input = PreparedInput::new(triangles, bounds, settings, token, times)?;
    let cache = if input.is_unchanged() { cache } else { None };
    // Scaled ones come back with the tree.
    let mut tree = build_kind::<C>(&input, items.filter(|_| input.is_unchanged()), settings, cache, token, times)?;
    let container = |index: u32| match items {
        Some(items) => items[index as usize],
        None => C::of_triangle(&triangles[index as usize]),
    };
    input.restore(&mut tree, container, token, times)?;
    Ok(tree)
}

/// Builds with the chosen builder and runs the chosen passes over the tree.
fn build_kind<C: ClusterContainer>(
    input: &PreparedInput,
    items: Option<&[C]>,
    settings: &BuildSettings,
    mut cache: Option<&mut BuildCache>,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    token.check()?;
    let anneals = settings.passes().contains(Pass::Anneal);
    // Beside annealing, nothing else takes long.
    let building = if anneals { token.part(0, ANNEALING_PARTS) } else { token.clone() };
    let mut tree = build_plain(input, items, settings, cache.as_deref_mut(), &building, times)?;
    if let Some(items) = items
        && !settings.builder.is_aac()
    {
        scale::refit(&mut tree, |index| items[index as usize], token)?;
    }
    let source = |primitive| input.source_index(primitive);
    let is_split = input.sources().is_some() || tree.primitive_indices.len() > input.triangles.len();
    let mut tree = optimize(tree, settings, is_split.then_some(&source), token, times)?;
    let clusters = settings.builder.is_aac()
        || matches!(settings.builder, BuilderKind::Ploc | BuilderKind::Hploc | BuilderKind::Exact);
    let may_degenerate = anneals || clusters;
    let limited = may_degenerate && limit_depth(&mut tree, token)?;
    if let Some(cache) = cache
        && (limited || settings.passes() != Passes::NONE)
    {
        // The cached statistics describe the tree before these passes.
        cache.take_stats();
    }
    if limited && let Some((_, cost)) = times.costs.last_mut() {
        *cost = f64::from(stats_of(&tree, token)?.sah_cost);
    }
    Ok(tree)
}

/// Builds with the chosen builder.
fn build_plain<C: ClusterContainer>(
    input: &PreparedInput,
    items: Option<&[C]>,
    settings: &BuildSettings,
    cache: Option<&mut BuildCache>,
    token: &CancelToken,
    times: &mut StageTimes,
) -> Result<Tree<C>, Cancelled> {
    let (triangles, bounds, curve) = (&*input.triangles, &input.bounds, settings.curve);
    match settings.builder {
        BuilderKind::Aac | BuilderKind::Swift => build_bvh(triangles, items, bounds, settings, cache, token, times),
        BuilderKind::Lbvh => lbvh::build(triangles, bounds, curve, token, times),
        BuilderKind::Ploc => ploc::build(triangles, bounds, curve, token, times),
        BuilderKind::Hploc => hploc::build(triangles, bounds, curve, token, times),
        BuilderKind::BinnedSah => binned_sah::build(triangles, token, times),
        BuilderKind::Sweep => sweep::build(triangles, token, times),
        BuilderKind::Sbvh => {
            let mut tree = Tree::EMPTY;
            let boxes = C::boxes_of(&mut tree).unwrap_or_else(|| unreachable!("other containers are refused"));
            // Leaves of scaled triangles are refitted to whole ones.
            *boxes = sbvh::build(triangles, input.is_unchanged(), token, times)?;
            Ok(tree)
        }
        BuilderKind::Exact => exact::build(triangles, token, times),
        BuilderKind::None => none::build(triangles, token, times),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_many_triangles_are_refused() {
        assert!(too_many(MAX_PRIMITIVES).is_some_and(|text| text.contains("2147483648")));
        // 32 bits index all nodes of the largest tree.
        assert_eq!(too_many(MAX_PRIMITIVES - 1), None);
        assert!(u32::try_from(2 * (MAX_PRIMITIVES as u64 - 1) - 1).is_ok());
    }
}
