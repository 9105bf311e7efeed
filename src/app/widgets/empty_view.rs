//! What a view says while it has nothing to show.

use egui::{self, RichText, Ui};

use crate::app::theme;

/// Shows what to do so that the view has something to show.
pub(crate) fn empty_view(ui: &mut Ui, text: &str) {
    let text = RichText::new(text).color(theme::palette(ui).dim);
    ui.centered_and_justified(|ui| ui.add(egui::Label::new(text).wrap().selectable(false)));
}
