//! Effects that panels and commands request.

use std::path::PathBuf;

use crate::app::state::paper::RowFormat;
use crate::scene::SceneSource;

/// An effect that plain values cannot express; performed after the panels of the UI frame have been drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Open this model.
    Open(SceneSource),
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
    /// Save the viewport as a PNG in the current folder (F12); a message names the file.
    Screenshot,
    /// Copy this text to the clipboard.
    Copy(String),
    /// Close the window.
    Quit,
}
