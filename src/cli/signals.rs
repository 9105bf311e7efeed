//! Ctrl-C and termination requests, from the first moment of the process: the first one ends what runs, the second the process.

#[cfg(feature = "gui")]
use std::sync::atomic::{AtomicBool, Ordering};

use crate::{console, export};
use bvhscope_engine::cancel::CancelToken;

/// Exit code of an interrupted process.
pub const INTERRUPTED: u8 = 130;

/// The window takes the signals now, and is closed by them.
#[cfg(feature = "gui")]
static WINDOW: AtomicBool = AtomicBool::new(false);

/// Signals that ask the process to end.
#[cfg(unix)]
const ENDING: [libc::c_int; 3] = [libc::SIGINT, libc::SIGTERM, libc::SIGHUP];

/// Installs the handlers. The token is cancelled by the first signal.
pub fn install() -> CancelToken {
    let token = CancelToken::new();
    let handler_token = token.clone();
    let handler = move || {
        console::stop_waiting();
        #[cfg(feature = "gui")]
        if WINDOW.load(Ordering::SeqCst) {
            return interrupt_window();
        }
        if handler_token.is_cancelled() {
            end_at_once();
        }
        handler_token.cancel();
    };
    if let Err(error) = listen(handler) {
        console::note(format_args!("bvhscope: Ctrl-C ends the program at once: {error}"));
        // Without a thread for the handler the signals would be lost.
        #[cfg(unix)]
        for signal in ENDING {
            let at_once = std::sync::Arc::new(true.into());
            let _ = signal_hook::flag::register_conditional_shutdown(signal, INTERRUPTED.into(), at_once);
        }
    }
    // A file that grows beyond its limit is an error of the write, not the end of the process.
    #[cfg(unix)]
    if let Err(error) = signal_hook::flag::register(libc::SIGXFSZ, std::sync::Arc::default()) {
        console::note(format_args!("bvhscope: a limit on the size of files ends the program: {error}"));
    }
    token
}

/// Calls `handler` in a thread of its own at each signal that asks the process to end.
#[cfg(unix)]
fn listen(handler: impl Fn() + Send + 'static) -> std::io::Result<()> {
    let mut signals = signal_hook::iterator::Signals::new(ENDING)?;
    let wait = move || signals.forever().for_each(|_| handler());
    std::thread::Builder::new().name("signals".into()).spawn(wait).map(drop)
}

/// Calls `handler` in a thread of its own at Ctrl-C and where the console is closed.
#[cfg(not(unix))]
fn listen(handler: impl Fn() + Send + 'static) -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(handler)
}

/// Lets the window take the signals. Returns whether one came before.
#[cfg(feature = "gui")]
pub fn pass_to_window(token: &CancelToken) -> bool {
    WINDOW.store(true, Ordering::SeqCst);
    token.is_cancelled()
}

#[cfg(feature = "gui")]
fn interrupt_window() {
    crate::app::mark_clean_exit();
    if !crate::app::interrupt() {
        end_at_once();
    }
}

/// Ends the process without waiting for what it does; no incomplete file stays.
fn end_at_once() -> ! {
    export::remove_incomplete();
    std::process::exit(INTERRUPTED.into());
}
