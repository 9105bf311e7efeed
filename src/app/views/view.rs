//! A view of the dock.

use egui::{Key, Ui};

use crate::app::state::AppState;
use crate::app::studies::Studies;

/// A view of the dock as the window sees it.
pub(crate) trait View: Sync {
    /// The name on its tab, by which saved settings and shared lines name it too.
    fn name(&self) -> &'static str;

    /// Its purpose in one sentence.
    fn purpose(&self) -> &'static str;

    /// The key that opens and closes it.
    fn key(&self) -> Key;

    /// Shows it.
    fn ui(&self, ui: &mut Ui, state: &mut AppState);

    /// Adds its background studies.
    fn add_studies(&self, _studies: &mut Studies) -> std::io::Result<()> {
        Ok(())
    }

    /// It shows measured visits now.
    fn needs_visits(&self, _state: &AppState) -> bool {
        false
    }

    /// It shows how many primitives are below each node.
    fn needs_counts(&self) -> bool {
        false
    }
}
