//! What stands around the viewport and over it.

use eframe::egui;

use super::state::AppState;

/// The menu bar.
pub fn top(_ui: &mut egui::Ui, _state: &mut AppState) {}

/// Scene, statistics, selection.
pub fn left(_ui: &mut egui::Ui, _state: &mut AppState) {}

/// Tree, containers, picture.
pub fn right(_ui: &mut egui::Ui, _state: &mut AppState) {}

/// Depth bar and job strip.
pub fn bottom(_ui: &mut egui::Ui, _state: &mut AppState) {}

/// Legend, gizmo, messages, help and the hovered value, over the viewport's rectangle.
pub fn over_viewport(_ui: &mut egui::Ui, _rect: egui::Rect, _state: &mut AppState) {}

/// Command palette, shortcuts, start page.
pub fn windows(_ctx: &egui::Context, _state: &mut AppState) {}
