//! Frame and scroll area of a panel.

use egui::{Frame, Margin, ScrollArea, Ui};

/// Frame of a panel: margins without a fill, because the window is cleared with the panels' colour.
pub(crate) fn panel_frame(margin: Margin) -> Frame {
    Frame::new().inner_margin(margin)
}

/// Shows the content of a side panel in a vertical scroll area. Its bar lies in the margin, so that the content keeps its width.
pub(crate) fn scroll(ui: &mut Ui, id: &str, content: impl FnOnce(&mut Ui)) {
    ui.spacing_mut().scroll.floating_allocated_width = 0.0;
    ScrollArea::vertical()
        .id_salt(id)
        .auto_shrink(false)
        .content_margin(Margin { left: 12, right: 12, top: 0, bottom: 8 })
        .show(ui, content);
}
