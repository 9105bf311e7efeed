//! The window: the only room that owns threads and egui. Nothing here blocks the UI thread.
//!
//! Once a UI frame the panels edit the plain values of [`state`], `work` compares them with what is shown and in flight, and
//! its workers are given what is stale.
//!
//! | Module | What it does | What it must not know |
//! |---|---|---|
//! | [`glossary`] | the words of the window, explained | everything else |
//! | [`state`] | plain values: what is wanted, shown, selected, running | egui, threads |
//! | [`mod@format`] | numbers as text | state |
//! | [`theme`] | colours and sizes | what is shown |
//! | [`viewport`] | picture and overlay, camera, picking, screenshots | panels, commands |
//! | [`commands`] | the table of actions, shortcuts, what each does | panels |
//! | [`panels`] | everything around and over the viewport | `work` |
//! | `work` | threads that load, build, trace and measure | panels, commands |
//! | `launch` | options, saved settings, graphics device, the [`App`] itself | – |
//!
//! Start reading at [`state::AppState`], then `launch/app.rs` and `work/reconcile.rs`.

pub mod glossary;

pub mod state;

pub mod format;
pub mod theme;

pub mod viewport;

pub mod commands;

pub mod panels;

mod work;

mod launch;

pub use launch::app::App;
pub use launch::interrupt::{interrupt, was_interrupted};
pub use launch::options::{CliOverrides, StartOptions};
pub use launch::run::{AppError, run};
pub use launch::settings::{SettingsUse, mark_clean_exit};
pub use launch::storage::saved_bookmark;
pub use state::SharedState;
