//! A step of a lesson.

use super::check::Check;
use crate::app::state::state_line::SharedState;

/// A step of a lesson.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// What the window shows.
    pub state: SharedState,
    /// Two or three sentences; `{name}` stands for a measured number.
    pub caption: String,
    /// A question that the next step answers; empty where there is none.
    pub question: String,
    /// What must be true of the measured numbers, so that the caption is.
    pub checks: Vec<Check>,
}
