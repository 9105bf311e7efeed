//! Commands: the one table of actions, from which menus, command palette, list of keys and keyboard are made. Actions edit
//! [`AppState`](crate::app::state::AppState) or push a [`Request`](crate::app::state::Request); they start no work and paint
//! nothing.
//!
//! To add an action: a variant in `state::action`, its row in `rows`.

mod row;
mod rows;

mod entries;

mod camera;
mod nodes;

mod keyboard;

mod clipboard;
mod command_line;

pub use crate::app::state::action::{Action, CompareStep, OrbitStep, RankingStep, SectionStep, ViewDirection};
pub use clipboard::{paste_state, shared_state, show_state, statistics_text};
pub use command_line::command_line;
pub use entries::{entries, entries_for, search};
pub use keyboard::{KeyList, handle_shortcuts, keys};
pub(crate) use nodes::{go_to, show_finding};
pub use row::{Category, Entry, shortcut_text};
pub(in crate::app) use rows::{compare_description, refused_policy};
