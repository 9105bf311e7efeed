//! The window: the only room that owns threads and egui. Nothing here blocks the UI thread.
//!
//! Once a UI frame the panels edit the plain values of [`state`], `shell` compares them with what is shown and in flight, and
//! its workers are given what is stale.
//!
//! | Module | What it does | What it must not know |
//! |---|---|---|
//! | [`state`] | plain values: what is wanted, shown, selected, running | egui, threads |
//! | [`mod@format`] | numbers as text | state |
//! | [`theme`] | colours and sizes | what is shown |
//! | [`viewport`] | picture and overlay, camera, picking, screenshots | panels, commands |
//! | `widgets` | what panels and views are made of | what is shown |
//! | `studies` | values derived from the presented tree in the background, in one list | views |
//! | `views` | the views of the dock, a folder each, in one list | each other, commands |
//! | [`commands`] | the table of actions, shortcuts, what each does | panels |
//! | [`panels`] | everything around and over the viewport | `shell` |
//! | `shell` | options, saved settings, graphics device, the [`App`] itself; threads that load, build, trace and measure | – |
//!
//! Start reading at [`state::AppState`], then `shell/app.rs` and `shell/reconcile.rs`.

pub mod state;

pub mod format;
pub mod theme;

mod widgets;

pub mod viewport;

mod studies;

pub mod views;

pub mod commands;

pub mod panels;

mod shell;

pub use shell::app::App;
pub use shell::options::{Overrides, StartOptions};
pub use shell::run::{AppError, run};
pub use shell::settings::{SettingsUse, mark_clean_exit};
pub use shell::storage::saved_bookmark;
pub use shell::system::{interrupt, was_interrupted};
pub use state::SharedState;
