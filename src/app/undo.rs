//! Undo of settings: a stack of [`Wanted`] values.

use super::state::Wanted;

/// Earlier and later settings.
#[derive(Debug, Clone, Default)]
pub struct UndoStack {
    _past: Vec<Wanted>,
}
