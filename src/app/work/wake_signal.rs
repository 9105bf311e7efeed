//! Waiting for the workers' news, where a UI frame without news is not worth its price.

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Instant;

/// Rung by workers that have news. Clones are the same bell.
#[derive(Debug, Clone, Default)]
pub struct WakeSignal {
    shared: Arc<(Mutex<bool>, Condvar)>,
}

impl WakeSignal {
    /// There is news.
    pub fn ring(&self) {
        let (rung, changed) = &*self.shared;
        *rung.lock().unwrap_or_else(PoisonError::into_inner) = true;
        changed.notify_all();
    }

    /// Waits until it has rung since the last time, or until `latest`. Returns whether it has rung.
    pub fn wait(&self, latest: Instant) -> bool {
        let (rung, changed) = &*self.shared;
        let mut rung = rung.lock().unwrap_or_else(PoisonError::into_inner);
        while !*rung {
            let left = latest.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            rung = changed.wait_timeout(rung, left).unwrap_or_else(PoisonError::into_inner).0;
        }
        *rung = false;
        true
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn it_is_heard_once_and_before_the_latest_time() {
        let wake_signal = WakeSignal::default();
        wake_signal.ring();
        wake_signal.ring();
        let (now, never) = (Instant::now(), Instant::now() + Duration::from_hours(1));
        assert!(wake_signal.wait(now), "what rang before counts, however late it is");
        assert!(!wake_signal.wait(now), "but once");
        let other = wake_signal.clone();
        let thread = std::thread::spawn(move || other.ring());
        assert!(wake_signal.wait(never));
        assert!(thread.join().is_ok());
    }
}
