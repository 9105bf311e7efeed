//! Ctrl-C and termination requests. They close the window as its button does, because some graphics drivers crash where a
//! process exits while their threads draw.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// The window of this process.
static WINDOW: OnceLock<egui::Context> = OnceLock::new();
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Closes the open window. Returns `false` where there is none, or where a previous call has not closed it.
pub fn interrupt() -> bool {
    let Some(window) = WINDOW.get() else { return false };
    let is_first = !INTERRUPTED.swap(true, Ordering::Relaxed);
    window.request_repaint();
    is_first
}

/// Whether [`interrupt`] was called.
pub fn was_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Sets the window that [`interrupt`] closes.
pub(crate) fn watch(ctx: &egui::Context) {
    // A process opens only one window, so it is never set already.
    let _ = WINDOW.set(ctx.clone());
}
