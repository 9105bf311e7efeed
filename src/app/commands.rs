//! Every action, with its name and its keys.

use eframe::egui;

use super::state::AppState;

/// Carries out what was asked for by keys.
pub fn handle_shortcuts(_ctx: &egui::Context, _state: &mut AppState) {}
