//! Shows where a finding of the diagnosis is.

use std::sync::Arc;

use super::action::Action;
use crate::app::state::AppState;
use crate::app::viewport::{orbit, picking};
use crate::lab::diagnose::{Finding, Place};
use crate::scene::Scene;
use crate::visibility::TriangleSet;
use bvhscope_engine::geometry::Aabb;

/// Selects what `finding` is about, hides the rest and looks at it.
pub fn show_finding(state: &mut AppState, finding: &Finding) {
    match &finding.place {
        Place::Scene => {}
        Place::Node(node) => {
            state.select_node(*node);
            Action::IsolateSelected.perform(state);
            state.wanted.overlay.hide_triangles = true;
            Action::FrameSelection.perform(state);
        }
        Place::Triangles(triangles) => {
            let Some(scene) = state.model.presented.as_ref().map(|shown| shown.accel.scene.clone()) else { return };
            picking::pick(state, triangles.iter().next());
            state.selection.show_all();
            state.selection.nodes.only = Some(Arc::clone(triangles));
            state.wanted.overlay.hide_triangles = true;
            if let Some(bounds) = bounds_of(&scene, triangles) {
                orbit::frame_all(&mut state.wanted.camera, &bounds);
            }
        }
    }
}

/// The box around `triangles`; `None` where there are none.
fn bounds_of(scene: &Scene, triangles: &TriangleSet) -> Option<Aabb> {
    let boxes = triangles.iter().filter_map(|triangle| Some(scene.triangles.get(triangle as usize)?.bounds()));
    boxes.reduce(|all, next| all.union(&next))
}
