//! The window: the only place that owns threads and egui.

pub mod state;

pub mod orbit;
pub mod undo;

pub mod commands;
pub mod panels;
pub mod theme;

mod options;
pub use options::StartOptions;
