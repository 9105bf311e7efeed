//! Commands: the one table of actions, from which menus, command palette, list of keys and keyboard are made. Actions edit
//! [`AppState`](crate::app::state::AppState) or push a [`Request`](crate::app::state::Request); they start no work and paint
//! nothing.
//!
//! To add an action: a variant in `state::action`, its row in `rows`.

mod row;
mod rows;

mod entries;

mod camera;
mod compare;
mod lesson;
mod nodes;
mod section;
mod share;

mod keyboard;
mod keys;
mod search;

mod command_line;
mod statistics_text;

pub use crate::app::state::action::{Action, CompareStep, OrbitStep, RankingStep, SectionStep, ViewDirection};
pub use command_line::command_line;
pub use entries::{entries, entries_for};
pub use keyboard::handle_shortcuts;
pub use keys::{KeyList, keys};
pub(crate) use nodes::show_finding;
pub use row::{Category, Entry, shortcut_text};
pub(in crate::app) use rows::{compare_description, shading_description};
pub use search::search;
pub use share::{paste_state, shared_state, show_state};
pub use statistics_text::statistics_text;
