//! Whether an action can be performed now, and whether it is switched on.

use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Preset};

use super::action::{Action, SectionStep};
use super::{camera, compare, walk};
use crate::app::state::bookmarks;
use crate::app::state::paper::RowFormat;
use crate::app::state::{AppState, Navigation, Side};
use crate::camera::Projection;
use crate::render::{Exposure, Shading};

impl Action {
    /// Whether the action can be performed now.
    pub fn is_enabled(self, state: &AppState) -> bool {
        let selected = state.selection.nodes.selected.is_some();
        let section = state.wanted.render.section;
        match self {
            Self::SelectParent
            | Self::SelectChild
            | Self::SelectSecondChild
            | Self::SelectNextSibling
            | Self::SelectPreviousSibling => walk::target(self, state).is_some(),
            // Only AAC has a threshold.
            Self::RaiseThreshold | Self::LowerThreshold => state.edited_build().builder == BuilderKind::Aac,
            Self::Compare(step) => compare::is_enabled(state, step),
            Self::HideSelected | Self::IsolateSelected => selected,
            Self::CopyNode => state.selected().is_some(),
            Self::ShowAll => state.selection.nodes.hides_any() || !state.selection.hidden.is_empty(),
            Self::Section(step) => match step {
                SectionStep::Snap => section.is_some_and(|plane| plane.axis().is_none()),
                SectionStep::Flip => section.is_some(),
                _ => state.model.presented.is_some(),
            },
            Self::ToggleGround | Self::LockExposure => state.wanted.render.shading == Shading::Lit,
            Self::FitHeatRange => state.model.presented.as_ref().is_some_and(|shown| !shown.frame.values.is_empty()),
            Self::StepRanking(_)
            | Self::FrameSelection
            | Self::ResetView
            | Self::Screenshot
            | Self::CopyStatistics
            | Self::SaveTree => state.model.presented.is_some(),
            Self::LessonNext | Self::LeaveLesson => state.lesson.is_some(),
            Self::LessonBack => state.lesson.as_ref().is_some_and(|reading| reading.step > 0),
            Self::Undo => state.undo.can_undo(),
            Self::Redo => state.undo.can_redo(),
            Self::Cancel => {
                state.activity.has_jobs()
                    || state.lab.job().is_some()
                    || state.selection.is_some()
                    || state.selection.nodes.isolated.is_some()
                    || state.selection.nodes.only.is_some()
            }
            Self::Measure(_) | Self::OpenTree => state.model.loaded.is_some(),
            Self::SaveRows(format) => {
                state.activity.measured.get(&state.preferences.paper.experiment).is_some_and(|result| match format {
                    RowFormat::Csv | RowFormat::Json => !result.rows.is_empty(),
                    RowFormat::Png | RowFormat::Svg => !result.panels.is_empty(),
                })
            }
            Self::NextBookmark => bookmarks::own(&state.preferences.bookmarks, &state.wanted.source).next().is_some(),
            Self::RemoveBookmark => camera::bookmark_here(state).is_some(),
            Self::OpenRecentTree(index) => state.model.loaded.is_some() && index < state.preferences.recent_trees.len(),
            Self::BuildTree => state.wanted.tree_file(state.edited_side()).is_some(),
            Self::OpenRecent(index) => index < state.preferences.recent.len(),
            Self::Builder(builder) => {
                let build = BuildSettings { builder, ..*state.edited_build() };
                build.refusal(state.model.loaded.as_ref().map_or(0, |scene| scene.triangles.len())).is_none()
            }
            Self::Container(container) => {
                let build = BuildSettings { container, ..*state.edited_build() };
                build.refusal(0).is_none()
            }
            _ => true,
        }
    }

    /// Whether a switch or choice is on; `None` for other actions.
    pub fn is_on(self, state: &AppState) -> Option<bool> {
        let (wanted, preferences) = (&state.wanted, &state.preferences);
        Some(match self {
            Self::ToggleOrthographic => wanted.camera.projection == Projection::Orthographic,
            Self::GoToBookmark(index) => camera::bookmark_here(state) == Some(index),
            Self::ToggleFly => preferences.navigation == Navigation::Fly,
            Self::ToggleContainers => preferences.show_containers,
            Self::ToggleGeometry => preferences.show_geometry,
            Self::ToggleMeshEdges => wanted.render.mesh_edges,
            Self::ToggleGround => wanted.render.ground,
            Self::LockExposure => wanted.render.exposure != Exposure::Auto,
            Self::ToggleLeftPanel => state.shows_panel(Side::Left),
            Self::ToggleRightPanel => state.shows_panel(Side::Right),
            Self::ToggleDock(view) => preferences.dock.open == Some(view),
            Self::ToggleCurve => state.lab.curve.shown,
            Self::AutomaticDepths => wanted.overlay.depth.is_none(),
            Self::ToggleLeavesOnly => wanted.overlay.leaves_only,
            Self::ToggleParents => wanted.overlay.parents,
            Self::ToggleFaces => wanted.overlay.faces,
            Self::ToggleOverlap => wanted.overlay.overlap,
            Self::ToggleHideTriangles => wanted.overlay.hide_triangles,
            Self::Section(step) => {
                let axis = wanted.render.section.map(|plane| plane.axis());
                match step {
                    SectionStep::Toggle => axis.is_some(),
                    SectionStep::X => axis == Some(Some(0)),
                    SectionStep::Y => axis == Some(Some(1)),
                    SectionStep::Z => axis == Some(Some(2)),
                    SectionStep::Facing => axis == Some(None),
                    SectionStep::Snap | SectionStep::Flip => return None,
                }
            }
            Self::Shade(shading) => wanted.render.shading == shading,
            Self::Theme(theme) => preferences.theme == theme,
            Self::Compare(step) => return compare::is_on(state, step),
            Self::Builder(builder) => is_built(state) && state.edited_build().builder == builder,
            Self::Container(container) => is_built(state) && state.edited_build().container == container,
            Self::Preset(preset) => is_preset(state, preset),
            _ => return None,
        })
    }
}

/// Whether the tree whose settings are shown is built, not read from a file.
fn is_built(state: &AppState) -> bool {
    state.wanted.tree_file(state.edited_side()).is_none()
}

/// Whether builder, threshold, ε, curve, passes and rounds are those of `preset`.
pub fn is_preset(state: &AppState, preset: Preset) -> bool {
    let (threshold, epsilon) = preset.parameters();
    let build = state.edited_build();
    is_built(state)
        && build.builder == BuilderKind::Aac
        && build.threshold == threshold
        && (build.epsilon - epsilon).abs() < 1e-4
        && build.curve == Curve::Morton
        && build.optimize == preset.passes()
        && (!preset.is_slow() || build.rounds == BuildSettings::DEFAULT_ROUNDS)
}
