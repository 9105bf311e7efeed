//! The dock above the depth bar: which of its views is open, and its height.

use serde::{Deserialize, Deserializer, Serialize};

use crate::app::state::paper::PaperPlan;

/// The dock, as saved between runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Dock {
    /// Name of the open view; `None` while the dock is closed.
    pub open: Option<String>,
    /// Height in points that the user gave it.
    pub height: f32,
}

impl Default for Dock {
    fn default() -> Self {
        Self { open: None, height: 288.0 }
    }
}

impl Dock {
    /// Opens a view, or closes the dock where it shows that view.
    pub fn toggle(&mut self, view: &str) {
        self.open = (!self.shows(view)).then(|| view.to_owned());
    }

    /// Opens a view.
    pub fn show(&mut self, view: &str) {
        self.open = Some(view.to_owned());
    }

    /// Whether a view is open.
    pub fn shows(&self, view: &str) -> bool {
        self.open.as_deref() == Some(view)
    }
}

/// Reads a saved dock. Version 0.1 saved whether its paper panel was open.
pub(super) fn from_saved<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Dock, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Saved {
        PaperOpen(bool),
        Dock(Dock),
    }
    Ok(match Saved::deserialize(deserializer)? {
        Saved::PaperOpen(open) => Dock { open: open.then(|| PaperPlan::VIEW.to_owned()), ..Dock::default() },
        Saved::Dock(dock) => dock,
    })
}
