//! Commands of the section plane.

use glam::Vec3;

use super::action::SectionStep;
use crate::app::state::AppState;
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
