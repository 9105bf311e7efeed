//! The window: the only place that owns threads and egui.

pub mod state;
mod undo;
