//! The graphics adapter and what the overlay draws with it.

use std::sync::Arc;

use crate::app::state::lab::Standing;
use crate::overlay::{OverlaySettings, Shown};

/// The graphics adapter and its state.
#[derive(Debug, Clone, Default)]
pub struct Graphics {
    /// Name of the adapter; empty where there is none.
    pub adapter_name: String,
    /// Graphics interface through which the adapter is used: "Vulkan", "OpenGL".
    pub backend: String,
    /// The adapter renders in software.
    pub is_software: bool,
    /// The driver reported an error, so the overlay's pipeline is no longer used.
    pub failed: bool,
    /// The containers that are drawn; `None` while they are off.
    pub shown: Option<Arc<Shown>>,
    /// The containers of the second tree that are drawn; `None` while they are off or that tree is out of view.
    pub second_shown: Option<Arc<Shown>>,
    /// The clusters that are drawn in place of the chosen depths; `None` where the depths are.
    pub standing: Option<Arc<Standing>>,
    /// Number of containers drawn in the last UI frame, and number that the settings select.
    pub overlay_counts: (usize, usize),
}

impl Graphics {
    /// Number of containers that the adapter draws where no limit is set.
    pub const fn automatic_budget(&self) -> u32 {
        if self.is_software { OverlaySettings::SOFTWARE_BUDGET } else { OverlaySettings::BUDGET }
    }
}
