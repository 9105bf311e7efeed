//! A wake-up signal from the worker threads to the UI thread.

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Instant;

/// A flag that worker threads set when a result is ready, and for which the UI thread can wait. Clones share the flag.
#[derive(Debug, Clone, Default)]
pub(crate) struct WakeSignal {
    shared: Arc<(Mutex<bool>, Condvar)>,
}

impl WakeSignal {
    /// Sets the signal.
    pub(crate) fn set(&self) {
        let (is_set, changed) = &*self.shared;
        *is_set.lock().unwrap_or_else(PoisonError::into_inner) = true;
        changed.notify_all();
    }

    /// Waits until the signal is set or `deadline` has passed, and clears it. Returns whether it was set.
    pub(crate) fn wait(&self, deadline: Instant) -> bool {
        let (is_set, changed) = &*self.shared;
        let mut is_set = is_set.lock().unwrap_or_else(PoisonError::into_inner);
        while !*is_set {
            let remaining = deadline.saturating_duration_since(Instant::now());
            if remaining.is_zero() {
                return false;
            }
            is_set = changed.wait_timeout(is_set, remaining).unwrap_or_else(PoisonError::into_inner).0;
        }
        *is_set = false;
        true
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_signal_is_received_once_and_before_the_deadline() {
        let signal = WakeSignal::default();
        signal.set();
        signal.set();
        let (now, distant) = (Instant::now(), Instant::now() + Duration::from_hours(1));
        assert!(signal.wait(now), "a signal set before the wait counts even after the deadline");
        assert!(!signal.wait(now), "it counts once");
        let other = signal.clone();
        let thread = std::thread::spawn(move || other.set());
        assert!(signal.wait(distant));
        assert!(thread.join().is_ok());
    }
}
