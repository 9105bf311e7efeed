//! Ctrl-C and the request to terminate. The window closes as by its button: graphics drivers crash where a process exits
//! while their threads draw.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use eframe::egui;

static WINDOW: OnceLock<egui::Context> = OnceLock::new();
static ASKED: AtomicBool = AtomicBool::new(false);

/// Asks the open window to close. Returns `false` where there is none, or where it was asked before and has not closed.
pub fn interrupt() -> bool {
    let Some(window) = WINDOW.get() else { return false };
    let first = !ASKED.swap(true, Ordering::Relaxed);
    window.request_repaint();
    first
}

/// Whether the window was asked to close.
pub fn was_interrupted() -> bool {
    ASKED.load(Ordering::Relaxed)
}

/// This is the window to close.
pub(crate) fn watch(ctx: &egui::Context) {
    // A process opens one window.
    let _ = WINDOW.set(ctx.clone());
}
