//! Requests of the user: every action, and the effects that panels and commands ask the shell for.

use std::path::PathBuf;

use crate::app::state::paper::{Experiment, RowFormat};
use crate::app::state::preferences::Theme;
use crate::app::state::second_tree::{CompareView, TreeSide};
use crate::lab::plot::Figure;
use crate::overlay::ColorBy;
use crate::render::Shading;
use crate::scene::{Instancing, SceneSource};
use crate::view::CameraChoice;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::settings::{BuilderKind, Pass, Preset};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::traverse::Traversal;

/// An action of the user, by menu, key, command palette or button.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Open a model file chosen in a dialog.
    Open,
    /// Open a row of numbered files, of which one is chosen in a dialog, as frames.
    OpenSequence,
    /// Open the recent file with this index, newest 0.
    OpenRecent(usize),
    /// Show the scene of the model's file with this index.
    ShowSceneOfFile(usize),
    /// Load copies of meshes in this form.
    ShowCopies(Instancing),
    /// Open the scene of [`crate::scene::BUILTIN_SCENES`] with this index.
    OpenBuiltin(usize),
    /// Read the model again.
    Reload,
    /// Read the tree from a tree file chosen in a dialog.
    OpenTree,
    /// Read the tree from the recent tree file with this index, newest 0.
    OpenRecentTree(usize),
    /// Build the tree instead of reading it.
    BuildTree,
    /// Save the tree as a tree file.
    SaveTree,
    /// Save the viewport as a PNG.
    Screenshot,
    /// Show or hide the start page.
    StartPage,
    /// Copy the command line that renders the same picture.
    CopyCommandLine,
    /// Copy the whole state as a line that shows it in another window.
    CopyState,
    /// Copy all statistics as text.
    CopyStatistics,
    /// End the program.
    Quit,
    /// View the model along an axis.
    View(ViewDirection),
    /// Switch between perspective and orthographic projection.
    ToggleOrthographic,
    /// Switch the up axis between y and z.
    ToggleUpAxis,
    /// Switch between orbiting and flying.
    ToggleFly,
    /// Go back to the default view: from inside where the model encloses its centre.
    ResetView,
    /// View the whole model from outside.
    ViewOutside,
    /// Keep the camera as a bookmark.
    AddBookmark,
    /// Go to the next bookmark of the model.
    NextBookmark,
    /// Go to the bookmark with this index.
    GoToBookmark(usize),
    /// Look through the camera of the model's file with this index.
    GoToCameraOfFile(usize),
    /// Remove the bookmark that the camera is at.
    RemoveBookmark,
    /// Go to the camera before.
    CameraBack,
    /// Go to the camera that was left by going back.
    CameraForward,
    /// Fill the picture with the selected node, or with the model where none is selected.
    FrameSelection,
    /// Orbit around the target by a step.
    Orbit(OrbitStep),
    /// Zoom in on the point under the pointer.
    ZoomIn,
    /// Zoom out from the point under the pointer.
    ZoomOut,
    /// Play the clip of a model that moves, or pause.
    PlayClip,
    /// Go to the next frame of the clip, or to the one before where the flag is not set.
    StepFrame(bool),
    /// Begin again after the end of the clip, or stop there.
    LoopClip,
    /// Show a model that moves in the pose of its file.
    FilePose,
    /// Show or hide the containers.
    ToggleContainers,
    /// Show or hide the traced picture.
    ToggleGeometry,
    /// Show or hide the triangles' edges.
    ToggleMeshEdges,
    /// Show or hide the shadow on the ground.
    ToggleGround,
    /// Keep the metered exposure, or meter it again.
    LockExposure,
    /// Fit the heat map's range to the picture.
    FitHeatRange,
    /// Choose the shading mode.
    Shade(Shading),
    /// Show or hide the left panel.
    ToggleLeftPanel,
    /// Show or hide the right panel.
    ToggleRightPanel,
    /// Choose the colours of the window.
    Theme(Theme),
    /// Choose threshold, ε, curve and passes of a preset.
    Preset(Preset),
    /// Choose the builder.
    Builder(BuilderKind),
    /// Choose boxes or spheres.
    Container(ContainerKind),
    /// Add a pass over the tree, or remove it.
    Pass(Pass),
    /// Draw a kind of containers, or not.
    ShowKind(ContainerKind),
    /// Choose what the colour of a container means.
    ColorBy(ColorBy),
    /// Choose what becomes of the tree while the model moves.
    Policy(Policy),
    /// Choose the number of samples per pixel.
    Samples(u32),
    /// Choose how rays visit nodes while tests are counted.
    Traversal(Traversal),
    /// Raise the threshold by one.
    RaiseThreshold,
    /// Lower the threshold by one.
    LowerThreshold,
    /// Change the second tree or how it is shown.
    Compare(CompareStep),
    /// Move the range of drawn depths one level down.
    Deeper,
    /// Move the range of drawn depths one level up.
    Shallower,
    /// Draw the range of depths that suits the tree.
    AutomaticDepths,
    /// Draw only leaves, or all nodes.
    ToggleLeavesOnly,
    /// Draw or omit the levels above the drawn depths.
    ToggleParents,
    /// Select the parent of the selected node.
    SelectParent,
    /// Select the first child of the selected node, or the root where none is selected.
    SelectChild,
    /// Select the second child of the selected node.
    SelectSecondChild,
    /// Select the next sibling of the selected node, after the last the first.
    SelectNextSibling,
    /// Select the previous sibling of the selected node, before the first the last.
    SelectPreviousSibling,
    /// Show or hide the field for the number of a node or triangle.
    GoTo,
    /// Hide the selected node with everything below it.
    HideSelected,
    /// Hide everything but the selected node and what is below it.
    IsolateSelected,
    /// Show all hidden nodes.
    ShowAll,
    /// Leave the triangles below hidden nodes out of the picture, or keep them.
    ToggleHideTriangles,
    /// Fill the sides of containers that face the viewer.
    ToggleFaces,
    /// Fill what the children of the selected node have in common.
    ToggleOverlap,
    /// Let the tree go on in the meshes of the copies below the selected node, or end at the copies.
    ToggleUnfolded,
    /// Let the tree go on in the meshes of all copies.
    UnfoldAll,
    /// Let the tree end at the copies.
    FoldAll,
    /// Copy the numbers of the selected node as text.
    CopyNode,
    /// Cut the model open, or close it.
    Section(SectionStep),
    /// Show the view of this name in the dock, or close the dock.
    ToggleDock(&'static str),
    /// Select and frame another of the worst nodes.
    StepRanking(RankingStep),
    /// Select and frame another of the copies with most tests.
    StepCopies(RankingStep),
    /// Measure one of the paper's tables or figures.
    Measure(Experiment),
    /// Save the measured rows.
    SaveRows(RowFormat),
    /// Reset all settings to their defaults.
    ResetSettings,
    /// Close open dialogs; else cancel the running job; else clear the selection.
    Cancel,
    /// Undo the last change of settings.
    Undo,
    /// Redo the change that was undone last.
    Redo,
    /// Show or hide the command palette.
    Palette,
    /// Show or hide the list of keys and mouse gestures.
    Shortcuts,
    /// Start the tour of the window.
    Tour,
    /// Draw the curve that the primitives are sorted along, or not.
    ToggleCurve,
    /// Begin a lesson, by its index.
    Lesson(usize),
    /// Go to the next step of the lesson, or end it.
    LessonNext,
    /// Go to the step before.
    LessonBack,
    /// End the lesson.
    LeaveLesson,
    /// Show or hide the glossary.
    Glossary,
    /// Show or hide version, graphics and memory.
    About,
    /// Show or hide the message log.
    Messages,
}

/// A change of the second tree, or of how the two are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CompareStep {
    /// Add a second tree, or remove it.
    Toggle,
    /// Let the panel show the settings of the other tree.
    EditOther,
    /// Give the second tree the settings of the first.
    Copy,
    /// Exchange the settings of the two.
    Swap,
    /// Choose what the viewport shows.
    View(CompareView),
    /// Show the next view.
    NextView,
    /// Draw only the containers that both trees have, or all.
    OnlyCommon,
}

/// Direction of a step along the list of worst nodes or copies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RankingStep {
    /// To the next one, which is less bad.
    Next,
    /// To the one before.
    Previous,
}

/// A change of the section plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SectionStep {
    /// Cut across the x axis, or show the whole model again.
    Toggle,
    /// Cut across the x axis.
    X,
    /// Cut across the y axis.
    Y,
    /// Cut across the z axis.
    Z,
    /// Cut parallel to the picture.
    Facing,
    /// Turn the plane to the nearest axis.
    Snap,
    /// Keep the other half.
    Flip,
}

impl SectionStep {
    /// All steps, in the order of the menu.
    pub const ALL: [Self; 7] = [Self::Toggle, Self::X, Self::Y, Self::Z, Self::Facing, Self::Snap, Self::Flip];
}

/// Direction of an orbit step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OrbitStep {
    /// Towards the model's left.
    Left,
    /// Towards its right.
    Right,
    /// Over the top.
    Up,
    /// Under the bottom.
    Down,
}

impl OrbitStep {
    /// All steps, in the order of the menu.
    pub const ALL: [Self; 4] = [Self::Left, Self::Right, Self::Up, Self::Down];
}

/// Side of the model from which it is viewed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ViewDirection {
    /// The front.
    Front,
    /// The back.
    Back,
    /// The right.
    Right,
    /// The left.
    Left,
    /// The top.
    Top,
    /// The bottom.
    Bottom,
}

impl ViewDirection {
    /// All directions, in the order of the menu.
    pub const ALL: [Self; 6] = [Self::Front, Self::Back, Self::Right, Self::Left, Self::Top, Self::Bottom];
}

/// An effect that plain values cannot express; performed after the panels of the UI frame have been drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Open this model.
    Open(SceneSource),
    /// Open the model of a shared state.
    OpenShared {
        /// The model.
        source: SceneSource,
        /// The form of its copies.
        copies: Instancing,
        /// The files of its trees.
        tree_files: [Option<PathBuf>; 2],
        /// The camera to look at it from; `None` for its default view.
        camera: Option<CameraChoice>,
    },
    /// Read a tree of the present model from this file.
    OpenTree(TreeSide, PathBuf),
    /// Read a tree from a file chosen in the desktop's file dialog.
    OpenTreeDialog(TreeSide),
    /// Save the tree as a tree file in the current folder; a message names the file.
    SaveTree,
    /// Open a model chosen in the desktop's file dialog.
    OpenDialog,
    /// Choose one of a row of numbered files and open them as frames.
    OpenSequenceDialog,
    /// List models and folders of a folder for the path field.
    ListFolder(PathBuf),
    /// Read the present model again.
    Reload,
    /// Cancel loading, building and tracing (Esc, the ✕ of the job strip).
    CancelJobs,
    /// Measure what the paper panel describes.
    Measure,
    /// Stop measuring; finished rows stay.
    CancelMeasuring,
    /// Save the measured rows in the current folder; a message names the file.
    SaveRows(RowFormat),
    /// Save these plots as a PNG in the current folder, under a name that begins with this; a message names the file.
    SavePlots(String, Figure),
    /// Save the viewport as a PNG in the current folder (F12); a message names the file.
    Screenshot,
    /// Perform an action of a menu, if it is enabled.
    Perform(Action),
    /// Copy this text to the clipboard.
    Copy(String),
    /// Close the window.
    Quit,
}
