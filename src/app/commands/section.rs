//! Commands of the section plane.

use glam::Vec3;

use crate::app::state::AppState;
use crate::app::state::action::SectionStep;
use crate::section::SectionPlane;

/// Changes the section plane of the presented model.
pub(super) fn perform(state: &mut AppState, step: SectionStep) {
    let Some(bounds) = state.model.bounds() else { return };
    let forward = state.wanted.camera.forward();
    let section = &mut state.wanted.render.section;
    // The half towards the viewer goes, so that the cut is seen.
    let across = |normal: Vec3| {
        let plane = SectionPlane::through(&bounds, normal);
        SectionPlane { flipped: plane.normal.dot(forward) > 0.0, ..plane }
    };
    *section = match (step, *section) {
        (SectionStep::Toggle, Some(_)) | (SectionStep::Snap | SectionStep::Flip, None) => None,
        (SectionStep::Toggle | SectionStep::X, _) => Some(across(Vec3::X)),
        (SectionStep::Y, _) => Some(across(Vec3::Y)),
        (SectionStep::Z, _) => Some(across(Vec3::Z)),
        (SectionStep::Facing, _) => Some(across(-forward)),
        (SectionStep::Snap, Some(plane)) => Some(plane.snapped(&bounds)),
        (SectionStep::Flip, Some(plane)) => Some(SectionPlane { flipped: !plane.flipped, ..plane }),
    };
    // The cut is seen in the picture.
    state.preferences.show_geometry |= state.wanted.render.section.is_some();
}

/// The step can be performed now.
pub(super) fn is_enabled(state: &AppState, step: SectionStep) -> bool {
    let section = state.wanted.render.section;
    match step {
        SectionStep::Snap => section.is_some_and(|plane| plane.axis().is_none()),
        SectionStep::Flip => section.is_some(),
        _ => state.model.presented.is_some(),
    }
}

/// State of a switch or choice; `None` for other steps.
pub(super) fn is_on(state: &AppState, step: SectionStep) -> Option<bool> {
    let axis = state.wanted.render.section.map(|plane| plane.axis());
    match step {
        SectionStep::Toggle => Some(axis.is_some()),
        SectionStep::X => Some(axis == Some(Some(0))),
        SectionStep::Y => Some(axis == Some(Some(1))),
        SectionStep::Z => Some(axis == Some(Some(2))),
        SectionStep::Facing => Some(axis == Some(None)),
        SectionStep::Snap | SectionStep::Flip => None,
    }
}
