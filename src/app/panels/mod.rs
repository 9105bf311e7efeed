//! The panels around the viewport and what lies over it. They read and edit [`AppState`](crate::app::state::AppState) and
//! never start work.

mod layout;

mod bars;
mod dialogs;
mod over;
mod paper;
mod side;
mod widgets;

pub use layout::around;
