//! Finds out once at start whether there is a clipboard. The window's library does not say when it cannot reach one.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

/// The answer of the probe, which runs on a thread of its own because the display may be slow.
pub(crate) struct ClipboardProbe {
    answer: Receiver<Option<String>>,
}

impl ClipboardProbe {
    /// Starts the probe; `wake` is called when it has an answer.
    pub(crate) fn start(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        let (sender, answer) = channel();
        let thread = std::thread::Builder::new().name("clipboard".to_owned()).spawn(move || {
            let _ = sender.send(fault());
            wake();
        });
        if let Err(error) = thread {
            log::warn!("the clipboard is not probed: {error}");
        }
        Self { answer }
    }

    /// The reason why there is no clipboard, once the probe has found one.
    pub(crate) fn fault(&self) -> Option<String> {
        self.answer.try_recv().ok().flatten()
    }
}

/// Why there is no clipboard, if so.
fn fault() -> Option<String> {
    // On Wayland the window's own connection is the clipboard.
    let wayland = ["WAYLAND_DISPLAY", "WAYLAND_SOCKET"]
        .iter()
        .any(|name| std::env::var_os(name).is_some_and(|it| !it.is_empty()));
    if cfg!(target_os = "linux") && wayland {
        return None;
    }
    arboard::Clipboard::new().err().map(|error| error.to_string().trim_end_matches('.').to_owned())
}
