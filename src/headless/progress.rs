//! The progress bar of a command.

use std::io::IsTerminal as _;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::console::is_error_ready;
use crate::text::printable;
use bvhscope_engine::cancel::CancelToken;

/// Time that the last drawing may take before it is left alone.
const LAST_DRAWING: Duration = Duration::from_millis(200);

/// A progress bar on stderr that follows a token's progress on a thread of its own; hidden if stderr is not a terminal. Nothing
/// waits for a terminal that stands still.
pub struct Progress {
    bar: Option<ProgressBar>,
    follower: Option<Follower>,
}

/// The drawing thread. Stops on request and confirms it.
struct Follower {
    stop: Sender<()>,
    ended: Receiver<()>,
}

impl Progress {
    /// Starts a bar for the progress of `token` with `label`.
    pub fn new(label: &str, token: &CancelToken) -> Self {
        token.set_progress(0.0);
        if !std::io::stderr().is_terminal() {
            return Self { bar: None, follower: None };
        }
        let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{msg:32!} {bar:30} {percent:>3} %  {elapsed}, {eta} left") {
            bar.set_style(style);
        }
        bar.set_message(printable(label).into_owned());
        let (stop, stopped) = channel::<()>();
        let (end, ended) = channel::<()>();
        let (thread_bar, token) = (bar.clone(), token.clone());
        let follow = move || {
            // Dropped at the end of the thread.
            let _end = end;
            while let Err(RecvTimeoutError::Timeout) = stopped.recv_timeout(Duration::from_millis(50)) {
                if is_error_ready() {
                    thread_bar.set_position((token.progress() * 1000.0) as u64);
                }
            }
        };
        let follower = std::thread::Builder::new().name("progress".to_owned()).spawn(follow);
        Self { bar: Some(bar), follower: follower.ok().map(|_| Follower { stop, ended }) }
    }

    /// Changes the label.
    pub fn set_label(&self, label: &str) {
        if let Some(bar) = self.bar.as_ref().filter(|_| is_error_ready()) {
            bar.set_message(printable(label).into_owned());
        }
    }

    /// Runs `print` with the bar hidden.
    pub fn suspend<T>(&self, print: impl FnOnce() -> T) -> T {
        match &self.bar {
            Some(bar) if is_error_ready() => bar.suspend(print),
            _ => print(),
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        let Some(bar) = &self.bar else { return };
        let has_ended = self.follower.take().is_none_or(|Follower { stop, ended }| {
            drop(stop);
            !matches!(ended.recv_timeout(LAST_DRAWING), Err(RecvTimeoutError::Timeout))
        });
        if has_ended && is_error_ready() {
            bar.finish_and_clear();
        } else {
            // Otherwise it would draw itself a last time when it is dropped.
            std::mem::forget(bar.clone());
        }
    }
}
