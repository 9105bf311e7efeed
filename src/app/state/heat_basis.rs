//! What a fixed range of the heat map was fitted to. It means nothing for other counts.

use crate::app::state::wanted::Wanted;
use crate::render::Shading;
use crate::scene::SceneSource;
use bvhscope_engine::tree::traverse::Traversal;

/// Model and counts that a range was fitted to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HeatBasis {
    source: SceneSource,
    shading: Shading,
    traversal: Traversal,
}

/// Gives a fixed range of the heat map up where model, shading or traversal are no longer those it was fixed for. Modes other than
/// heat maps keep it. Returns whether it was given up.
pub(super) fn follow(known: &mut Option<HeatBasis>, wanted: &mut Wanted) -> bool {
    let render = &wanted.render;
    if render.heat_range.is_none() {
        *known = None;
        return false;
    }
    if !matches!(render.shading, Shading::Heat(_)) {
        return false;
    }
    let basis = HeatBasis { source: wanted.source.clone(), shading: render.shading, traversal: render.traversal };
    let is_other = known.as_ref().is_some_and(|known| *known != basis);
    *known = (!is_other).then_some(basis);
    if is_other {
        wanted.render.heat_range = None;
    }
    is_other
}
