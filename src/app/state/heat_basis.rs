//! What a fixed range of the heat map was fitted to. It means nothing for other counts.

use crate::app::state::{AppState, Severity};
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

impl AppState {
    /// Gives a fixed range of the heat map up where model, shading or traversal are no longer those it was fixed for; called once a
    /// UI frame. Modes other than heat maps keep it.
    pub fn follow_heat_range(&mut self) {
        let render = &self.wanted.render;
        if render.heat_range.is_none() {
            self.heat_basis = None;
            return;
        }
        if !matches!(render.shading, Shading::Heat(_)) {
            return;
        }
        let (source, shading, traversal) = (self.wanted.source.clone(), render.shading, render.traversal);
        let basis = HeatBasis { source, shading, traversal };
        if self.heat_basis.as_ref().is_some_and(|known| *known != basis) {
            self.wanted.render.heat_range = None;
            self.heat_basis = None;
            let text =
                "The heat range is fitted to every picture again: the fixed one was for other counts (C fixes it)";
            self.messages.notify(Severity::Info, text);
        } else {
            self.heat_basis = Some(basis);
        }
    }
}
