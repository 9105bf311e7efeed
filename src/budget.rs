//! How much memory this process may use. Asked before each allocation whose size an input or an option decides, so that a
//! refusal is a sentence and not an abort.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use sysinfo::{MemoryRefreshKind, ProcessRefreshKind, ProcessesToUpdate, System};

/// Share of the available memory that is used where nothing else was said.
const DEFAULT_SHARE: f64 = 0.75;

/// Allocations below this are not looked at: asking costs more than they do.
const SMALL: u64 = 16 << 20;

/// A limit as a user gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MemoryLimit {
    /// So many bytes for the whole process.
    Bytes(u64),
    /// This share of the memory that was available at the start, above 0, at most 1.
    Share(f64),
}

impl Default for MemoryLimit {
    fn default() -> Self {
        Self::Share(DEFAULT_SHARE)
    }
}

/// Something would need more memory than there may be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{what} would need about {} of memory, but only {} of {} may still be used; take something smaller or raise --memory-limit",
    in_words(*needed), in_words(*left), in_words(*limit)
)]
pub struct OverBudget {
    /// What would need it.
    pub what: String,
    /// Bytes that it would need.
    pub needed: u64,
    /// Bytes that may still be used.
    pub left: u64,
    /// Bytes that the process may use altogether.
    pub limit: u64,
}

/// The memory that the process may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    limit: u64,
}

/// Bytes; 0 until someone asks or sets it. The memory of a process is the one thing that all of its parts share.
static LIMIT: AtomicU64 = AtomicU64::new(0);

impl Budget {
    /// The budget of this process: what [`Budget::set_limit`] said, else 75 % of what was available at the first question.
    pub fn of_process() -> Self {
        static DEFAULT: OnceLock<u64> = OnceLock::new();
        match LIMIT.load(Ordering::Relaxed) {
            0 => Self { limit: *DEFAULT.get_or_init(|| bytes_of(MemoryLimit::default())) },
            limit => Self { limit },
        }
    }

    /// A budget of so much.
    pub fn limited(limit: MemoryLimit) -> Self {
        Self { limit: bytes_of(limit) }
    }

    /// Sets the budget of this process from now on.
    pub fn set_limit(limit: MemoryLimit) {
        LIMIT.store(Self::limited(limit).limit.max(1), Ordering::Relaxed);
    }

    /// Whether `needed` more bytes may be allocated for `what` ("the tree").
    pub fn check(&self, what: &str, needed: u64) -> Result<(), OverBudget> {
        if needed < SMALL.min(self.limit / 16) {
            return Ok(());
        }
        let left = self.left();
        if needed <= left { Ok(()) } else { Err(OverBudget { what: what.to_owned(), needed, left, limit: self.limit }) }
    }

    /// Bytes that may still be allocated.
    pub fn left(&self) -> u64 {
        self.limit.saturating_sub(used())
    }
}

/// A limit in bytes. A share is taken of what this process uses and could still get.
fn bytes_of(limit: MemoryLimit) -> u64 {
    match limit {
        MemoryLimit::Bytes(bytes) => bytes,
        MemoryLimit::Share(share) => {
            // Where the system does not tell, nothing is refused.
            let Ok(mut system) = System::new() else { return u64::MAX };
            system.refresh_memory_specifics(MemoryRefreshKind::nothing().with_ram());
            // In a container less is available than the machine has.
            let contained =
                system.cgroup_limits().map_or(u64::MAX, |limits| limits.total_memory.saturating_sub(limits.rss));
            let available = system.available_memory().min(contained).min(address_space_left());
            if available == 0 { u64::MAX } else { (available.saturating_add(used()) as f64 * share) as u64 }
        }
    }
}

/// Bytes that this process has in memory.
fn used() -> u64 {
    let (Ok(pid), Ok(mut system)) = (sysinfo::get_current_pid(), System::new()) else { return 0 };
    let kind = ProcessRefreshKind::nothing().with_memory().without_tasks();
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[pid]), false, kind);
    system.process(pid).map_or(0, sysinfo::Process::memory)
}

/// What `ulimit -v` leaves: beyond it allocations fail although there is memory.
fn address_space_left() -> u64 {
    let number = |file: &str, start: &str, column: usize| -> Option<u64> {
        let text = std::fs::read_to_string(file).ok()?;
        let line = text.lines().find(|line| line.starts_with(start))?;
        line.split_whitespace().nth(column)?.parse().ok()
    };
    // Without a limit the word there is "unlimited", and other systems have no such files.
    let limit = number("/proc/self/limits", "Max address space", 3);
    let taken = number("/proc/self/status", "VmSize:", 1).unwrap_or(0).saturating_mul(1024);
    limit.map_or(u64::MAX, |limit| limit.saturating_sub(taken))
}

/// Bytes with a unit that people read.
pub fn in_words(bytes: u64) -> String {
    let megabytes = bytes as f64 / 1e6;
    if megabytes >= 1000.0 { format!("{:.1} GB", megabytes / 1e3) } else { format!("{megabytes:.1} MB") }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused_in_words() {
        let budget = Budget { limit: 40 << 30 };
        let error = budget.check("the tree", 50 << 30).unwrap_err();
        let text = error.to_string();
        assert!(text.starts_with("the tree would need about 53.7 GB of memory, but only"), "{text}");
        assert!(text.ends_with("raise --memory-limit"), "{text}");
        assert!(budget.check("a line", 100).is_ok());
    }

    #[test]
    fn memory_in_use_counts() {
        let budget = Budget { limit: 1 };
        assert_eq!(budget.left(), 0, "this process is larger than a byte");
        assert!(budget.check("a byte", 1).is_err());
        assert!(used() > 1 << 20, "a process with its tests has more than a megabyte");
    }

    #[test]
    fn a_share_is_of_what_is_there() {
        let (half, all) = (bytes_of(MemoryLimit::Share(0.5)), bytes_of(MemoryLimit::Share(1.0)));
        assert!(half > 0 && half < all, "{half} of {all}");
    }
}
