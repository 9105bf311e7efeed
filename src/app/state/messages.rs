//! Messages to the user: those still shown, and a history.

use std::collections::VecDeque;
use std::time::Instant;

/// Maximum number of messages in the history.
const MAX_HISTORY: usize = 200;

/// Severity of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// Good to know; fades by itself.
    Info,
    /// Something was skipped or limited.
    Warning,
    /// Something failed; stays until closed.
    Error,
}

impl Severity {
    /// The word in front of the text.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Info => "Note",
            Self::Warning => "Warning",
            Self::Error => "Error",
        }
    }
}

/// A message to the user.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// How serious it is.
    pub severity: Severity,
    /// What happened, where, why, and what to do about it.
    pub text: String,
    /// When it was posted.
    pub since: Instant,
}

/// All messages of this run.
#[derive(Debug, Default)]
pub struct MessageLog {
    /// Messages that have neither faded nor been closed, oldest first.
    pub open: Vec<Message>,
    /// The newest messages, closed or not, oldest first.
    pub history: VecDeque<Message>,
}

impl MessageLog {
    /// Posts a message.
    pub fn notify(&mut self, severity: Severity, text: impl Into<String>) {
        let message = Message { severity, text: text.into(), since: Instant::now() };
        if self.history.len() == MAX_HISTORY {
            self.history.pop_front();
        }
        self.history.push_back(message.clone());
        self.open.push(message);
    }
}
