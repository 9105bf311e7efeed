//! What is painted over the viewport: legends, axes gizmo, facts of the hovered pixel, messages.

pub(super) mod drop_hint;
pub(super) mod gizmo;
pub(super) mod legend;
pub(super) mod messages;
pub(super) mod pointer;
