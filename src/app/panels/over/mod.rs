//! What is painted over the viewport: legends, axes gizmo, facts of the hovered pixel, messages.

pub(super) mod compare;
pub(super) mod drop_hint;
pub(super) mod empty_view;
pub(super) mod gizmo;
pub(super) mod legend;
pub(super) mod lesson;
pub(super) mod messages;
pub(super) mod node_menu;
pub(super) mod nothing_drawn;
pub(super) mod pointer;
mod projection;
pub(super) mod ray_line;
pub(super) mod scaffold;
mod seam;
pub(super) mod section_handle;
pub(super) mod tour;
