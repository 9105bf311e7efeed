//! The panels around the viewport and the overlays on it. They read and edit [`AppState`](crate::app::state::AppState) and
//! never start work.
//!
//! | module | what it shows |
//! | --- | --- |
//! | `layout` | places everything below around the viewport; start here |
//! | `side` | sections of the side panels: statistics, selection, settings |
//! | `menu`, `depth_bar`, `time_strip`, `job_strip` | the bars across the window |
//! | `dock` | the laboratory: one strip of tabs above the depth bar, one open view |
//! | `lesson` | the lesson that is being read, below the viewport |
//! | `over` | legends, axes gizmo, pixel facts and messages over the viewport |
//! | `dialogs` | command palette, start page, help, message log, about |

mod layout;

mod depth_bar;
mod dialogs;
mod dock;
mod job_strip;
mod lesson;
mod menu;
mod over;
mod side;
mod time_strip;

pub use layout::around;
