//! The panels around the viewport and the overlays on it. They read and edit [`AppState`](crate::app::state::AppState) and
//! never start work.
//!
//! | module | what it shows |
//! | --- | --- |
//! | `layout` | places everything below around the viewport; start here |
//! | `side` | sections of the side panels: statistics, selection, settings |
//! | `bars` | menu, depth bar, job strip |
//! | `dock` | the laboratory: one strip of tabs above the depth bar, one open view |
//! | `over` | legends, axes gizmo, pixel facts and messages over the viewport |
//! | `dialogs` | command palette, start page, shortcuts, message log |

mod layout;

mod bars;
mod dialogs;
mod dock;
mod over;
mod side;

pub use layout::around;
