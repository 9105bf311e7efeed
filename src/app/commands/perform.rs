//! Effects of the actions: edits of plain values, and requests for everything else.

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;

use super::action::{Action, RankingStep};
use super::command_line::command_line;
use super::share::shared_state;
use super::statistics_text::{node_text, statistics_text};
use super::{camera, compare, lesson, section, walk};
use crate::app::state::bookmarks;
use crate::app::state::dock::DockView;
use crate::app::state::{AppState, HelpPage, Navigation, Request, Side, TreeSide, Wanted};
use crate::app::viewport::ZOOM_STEP;
use crate::camera::Projection;
use crate::overlay::OverlaySettings;
use crate::render::{Exposure, RenderSettings, Shading};
use crate::scene::{BUILTIN_SCENES, SceneSource};
use crate::view::NamedView;

impl Action {
    /// Performs the action.
    pub fn perform(self, state: &mut AppState) {
        match self {
            Self::Open => state.requests.push(Request::OpenDialog),
            Self::OpenRecent(index) => {
                if let Some(path) = state.preferences.recent.get(index) {
                    state.requests.push(Request::Open(SceneSource::File(path.clone())));
                }
            }
            Self::OpenBuiltin(index) => {
                if let Some(scene) = BUILTIN_SCENES.get(index) {
                    let source = SceneSource::Builtin { name: scene.name.to_owned(), size: None };
                    state.requests.push(Request::Open(source));
                }
            }
            Self::OpenTree => state.requests.push(Request::OpenTreeDialog(state.edited_side())),
            Self::OpenRecentTree(index) => {
                if let Some(path) = state.preferences.recent_trees.get(index) {
                    state.requests.push(Request::OpenTree(state.edited_side(), path.clone()));
                }
            }
            Self::BuildTree => state.wanted.set_tree_file(state.edited_side(), None),
            Self::SaveTree => state.requests.push(Request::SaveTree),
            Self::Reload => state.requests.push(Request::Reload),
            Self::Screenshot => state.requests.push(Request::Screenshot),
            Self::StartPage => state.layout.start_page_open = !state.layout.start_page_open,
            Self::CopyCommandLine => copy(state, command_line(state), "The render command"),
            Self::CopyState => copy(state, shared_state(state).line(), "The state"),
            Self::CopyStatistics => {
                if let Some(text) = statistics_text(state) {
                    copy(state, text, "All numbers");
                }
            }
            Self::Quit => state.requests.push(Request::Quit),
            Self::View(direction) => camera::view_from(state, direction),
            Self::ToggleOrthographic => {
                let projection = &mut state.wanted.camera.projection;
                *projection = match projection {
                    Projection::Perspective => Projection::Orthographic,
                    Projection::Orthographic => Projection::Perspective,
                };
            }
            Self::ToggleUpAxis => camera::toggle_up(state),
            Self::ToggleFly => {
                let navigation = &mut state.preferences.navigation;
                *navigation = match navigation {
                    Navigation::Orbit => Navigation::Fly,
                    Navigation::Fly => Navigation::Orbit,
                };
            }
            Self::ResetView => camera::reset(state, NamedView::Default),
            Self::ViewOutside => camera::reset(state, NamedView::Outside),
            Self::AddBookmark => camera::add_bookmark(state),
            Self::NextBookmark => {
                let Wanted { source, camera, .. } = &state.wanted;
                if let Some(index) = bookmarks::next(&state.preferences.bookmarks, source, camera) {
                    camera::go_to_bookmark(state, index);
                }
            }
            Self::GoToBookmark(index) => camera::go_to_bookmark(state, index),
            Self::RemoveBookmark => camera::remove_bookmark(state),
            Self::FrameSelection => camera::frame_selection(state),
            Self::Orbit(step) => camera::orbit_step(state, step),
            Self::ZoomIn => camera::zoom(state, ZOOM_STEP),
            Self::ZoomOut => camera::zoom(state, 1.0 / ZOOM_STEP),
            Self::ToggleContainers => flip(&mut state.preferences.show_containers),
            Self::ToggleGeometry => flip(&mut state.preferences.show_geometry),
            Self::ToggleMeshEdges => {
                flip(&mut state.wanted.render.mesh_edges);
                // Edges are drawn into the picture, so it must be shown.
                state.preferences.show_geometry |= state.wanted.render.mesh_edges;
            }
            Self::ToggleGround => flip(&mut state.wanted.render.ground),
            Self::LockExposure => lock_exposure(state),
            Self::FitHeatRange => fit_heat_range(state),
            Self::Shade(shading) => state.wanted.render.shading = shading,
            Self::ToggleLeftPanel => state.toggle_panel(Side::Left),
            Self::ToggleRightPanel => state.toggle_panel(Side::Right),
            Self::Theme(theme) => state.preferences.theme = theme,
            Self::Preset(preset) => {
                let build = state.edited_build_mut();
                *build = BuildSettings::preset(preset, build.container);
            }
            Self::Builder(builder) => state.edited_build_mut().builder = builder,
            Self::Container(container) => state.edited_build_mut().container = container,
            Self::Compare(step) => compare::perform(state, step),
            Self::RaiseThreshold => step_threshold(state, 1),
            Self::LowerThreshold => step_threshold(state, -1),
            Self::Deeper => step_depth(state, 1),
            Self::Shallower => step_depth(state, -1),
            Self::AutomaticDepths => state.wanted.overlay.depth = None,
            Self::ToggleLeavesOnly => flip(&mut state.wanted.overlay.leaves_only),
            Self::ToggleParents => flip(&mut state.wanted.overlay.parents),
            Self::SelectParent
            | Self::SelectChild
            | Self::SelectSecondChild
            | Self::SelectNextSibling
            | Self::SelectPreviousSibling => {
                if let Some(node) = walk::target(self, state) {
                    let selection = &mut state.selection;
                    match selection.side {
                        TreeSide::A => selection.nodes.selected = Some(node),
                        TreeSide::B => selection.second.selected = Some(node),
                    }
                }
            }
            Self::HideSelected => hide_selected(state),
            Self::IsolateSelected => {
                let nodes = &mut state.selection.nodes;
                nodes.isolated = nodes.selected;
                nodes.hidden.clear();
                nodes.only = None;
            }
            Self::ShowAll => state.selection.show_all(),
            Self::ToggleHideTriangles => flip(&mut state.wanted.overlay.hide_triangles),
            Self::ToggleFaces => flip(&mut state.wanted.overlay.faces),
            Self::ToggleOverlap => flip(&mut state.wanted.overlay.overlap),
            Self::CopyNode => {
                if let Some(text) = node_text(state) {
                    copy(state, text, "The node");
                }
            }
            Self::Section(step) => section::perform(state, step),
            Self::ToggleDock(view) => state.preferences.dock.toggle(view),
            Self::StepRanking(step) => step_ranking(state, step),
            Self::Measure(experiment) => {
                state.preferences.paper.choose(experiment);
                state.preferences.dock.open = Some(DockView::Paper);
                state.requests.push(Request::Measure);
            }
            Self::SaveRows(format) => state.requests.push(Request::SaveRows(format)),
            Self::ResetSettings => {
                state.wanted.build = BuildSettings::default();
                state.wanted.threads = 0;
                state.wanted.render = RenderSettings::default();
                state.wanted.overlay = OverlaySettings::default();
                state.wanted.second = None;
                state.wanted.tree_files = [None, None];
            }
            Self::Cancel => cancel(state),
            Self::Undo => {
                state.undo();
            }
            Self::Redo => {
                state.redo();
            }
            Self::Palette => {
                state.layout.palette = if state.layout.palette.is_some() { None } else { Some(String::new()) }
            }
            Self::Shortcuts => state.layout.toggle_help(HelpPage::Shortcuts),
            Self::ToggleCurve => flip(&mut state.lab.curve.shown),
            Self::Lesson(index) => lesson::begin(state, index),
            Self::LessonNext => lesson::next(state),
            Self::LessonBack => lesson::back(state),
            Self::LeaveLesson => lesson::leave(state),
            Self::Tour => {
                state.layout.close_dialogs();
                state.layout.tour = Some(0);
            }
            Self::Glossary => state.layout.toggle_help(HelpPage::Glossary),
            Self::About => flip(&mut state.layout.about_open),
            Self::Messages => flip(&mut state.layout.messages_open),
        }
    }
}

/// Hides the subtree of the selected node, which is then no longer selected.
fn hide_selected(state: &mut AppState) {
    state.selection.nodes.hidden.extend(state.selection.nodes.selected.take());
    state.selection.picked = None;
}

/// Selects and frames another of the worst nodes. Opens their list where nothing is ranked yet.
fn step_ranking(state: &mut AppState, step: RankingStep) {
    let Some(accel) = state.model.presented.as_ref().map(|shown| &shown.accel) else { return };
    if state.lab.nodes.ranking.of_tree(accel).is_none() {
        state.preferences.dock.open = Some(DockView::Nodes);
        return;
    }
    let step = match step {
        RankingStep::Next => 1,
        RankingStep::Previous => -1,
    };
    if let Some(node) = state.lab.nodes.neighbour(accel, state.selection.nodes.selected, step) {
        state.select_node(node);
        camera::frame_selection(state);
    }
}

/// Inverts a switch.
fn flip(value: &mut bool) {
    *value = !*value;
}

/// Copies `text` to the clipboard and posts a message about it.
fn copy(state: &mut AppState, text: String, what: &str) {
    state.copy(text, &format!("{what} copied"));
}

/// Closes open dialogs, else cancels running jobs, else clears the selection. Refinement of the picture is cancelled last, because
/// it runs after every change.
fn cancel(state: &mut AppState) {
    if state.layout.palette.take().is_some() || state.layout.node_menu.take().is_some() {
        return;
    }
    if state.layout.has_dialog() {
        state.layout.close_dialogs();
    } else if state.layout.tour.take().is_some() {
        // Shown once more from the menu only.
    } else if state.activity.load.is_some() || state.activity.build.is_some() {
        state.requests.push(Request::CancelJobs);
    } else if state.activity.measure.is_some() {
        state.requests.push(Request::CancelMeasuring);
    } else if state.lab.job().is_some() {
        state.lab.stop();
    } else if state.selection.is_some() {
        state.selection.clear();
    } else if state.selection.nodes.isolated.is_some() || state.selection.nodes.only.is_some() {
        state.selection.nodes.isolated = None;
        state.selection.nodes.only = None;
    } else if state.activity.render.is_some() {
        state.requests.push(Request::CancelJobs);
    }
}

/// Sets the heat map's range to the one that fits the presented picture.
fn fit_heat_range(state: &mut AppState) {
    let Some(shown) = &state.model.presented else { return };
    if matches!(state.wanted.render.shading, Shading::Heat(_)) && !shown.frame.values.is_empty() {
        state.wanted.render.heat_range = shown.frame.fitted_range(&CancelToken::new()).ok();
    }
}

/// Fixes the exposure at that of the presented picture, or lets it be metered again.
fn lock_exposure(state: &mut AppState) {
    let shown = state.model.presented.as_ref().map_or(0.0, |shown| shown.frame.exposure_stops);
    let exposure = &mut state.wanted.render.exposure;
    *exposure = match exposure {
        // Rounded, as the slider and the command line show it.
        Exposure::Auto => Exposure::Fixed((shown * 100.0).round() / 100.0),
        Exposure::Fixed(_) => Exposure::Auto,
    };
}

/// Changes the threshold by `step` within its limits.
fn step_threshold(state: &mut AppState, step: i32) {
    let build = state.edited_build_mut();
    build.threshold =
        build.threshold.saturating_add_signed(step).clamp(BuildSettings::MIN_THRESHOLD, BuildSettings::MAX_THRESHOLD);
}

/// Moves the range of drawn depths by `step` within the tree, keeping its length.
fn step_depth(state: &mut AppState, step: i32) {
    let max_depth = state.model.presented.as_ref().map_or(64, |shown| shown.accel.tree.max_depth());
    let [from, to] = state.drawn_depths();
    let fits = if step > 0 { to < max_depth } else { from > 0 };
    if fits {
        state.wanted.overlay.depth = Some([from.saturating_add_signed(step), to.saturating_add_signed(step)]);
    }
}
