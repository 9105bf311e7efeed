//! Effects that panels and commands request.

use std::path::PathBuf;

use crate::app::state::action::Action;
use crate::app::state::paper::RowFormat;
use crate::app::state::second_tree::TreeSide;
use crate::camera::Camera;
use crate::lab::plot::Figure;
use crate::scene::SceneSource;

/// An effect that plain values cannot express; performed after the panels of the UI frame have been drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Open this model.
    Open(SceneSource),
    /// Open this model with its trees in these files, and look at it from this camera.
    OpenShared(SceneSource, [Option<PathBuf>; 2], Option<Camera>),
    /// Read a tree of the present model from this file.
    OpenTree(TreeSide, PathBuf),
    /// Read a tree from a file chosen in the desktop's file dialog.
    OpenTreeDialog(TreeSide),
    /// Save the tree as a tree file in the current folder; a message names the file.
    SaveTree,
    /// Open a model chosen in the desktop's file dialog.
    OpenDialog,
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
