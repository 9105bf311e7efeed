//! Colours, spacing and text sizes of the window.

use eframe::egui;

use super::state::Preferences;

/// Gives the window its looks.
pub fn apply(_ctx: &egui::Context, _preferences: &Preferences) {}
