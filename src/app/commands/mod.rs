//! Commands: the one table of actions, from which menus, command palette, list of shortcuts and keyboard are made, and what each
//! action does. Actions edit [`AppState`](crate::app::state::AppState) or push a [`Request`](crate::app::state::Request); they
//! start no work and paint nothing.
//!
//! To add an action: a variant in `action`, its line in `entries`, its effect in `perform`.

mod action;
mod entry;
mod finding;
mod lesson;

mod descriptions;
mod entries;

mod camera;
mod compare;
mod perform;
mod section;
mod share;
mod status;
mod walk;

mod keyboard;
mod search;

mod command_line;
mod statistics_text;

pub use action::{Action, CompareStep, OrbitStep, RankingStep, SectionStep, ViewDirection};
pub use command_line::command_line;
pub(crate) use descriptions::{builder_description, compare_description, shading_description};
pub use entries::{entries, entries_for};
pub use entry::{Category, Entry, shortcut_text};
pub(crate) use finding::show_finding;
pub use keyboard::handle_shortcuts;
pub use search::search;
pub use share::{paste_state, shared_state, show_state};
pub use statistics_text::statistics_text;
pub use status::is_preset;
