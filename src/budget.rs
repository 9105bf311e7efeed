//! The memory budget of the process, checked before each allocation whose size depends on an input file or an option, so that
//! too large a model ends in an error message and not in an abort.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use sysinfo::{MemoryRefreshKind, ProcessRefreshKind, ProcessesToUpdate, System};

/// Fraction of the available memory that is used unless a limit is set.
const DEFAULT_FRACTION: f64 = 0.75;

/// Allocations below this many bytes are not checked: asking the system for the memory in use takes longer than they do.
const MIN_CHECKED: u64 = 16 << 20;

/// The least range of addresses that the allocator reserves at once, in bytes: its memory comes from ranges of 32 MiB to 1 GiB. Stacks of
/// threads are smaller.
const MIN_RESERVE: u64 = 32 << 20;

/// Bytes of what `ulimit -v` and `ulimit -d` leave that are kept free, for stacks of threads and all that is too small to be checked.
/// Found by trying: with less, models of 70,000 triangles abort under limits of 60 MB.
const HEADROOM: u64 = 16 << 20;

/// A memory limit as the user states it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MemoryLimit {
    /// Bytes for the whole process.
    Bytes(u64),
    /// Fraction, in (0, 1], of the memory that is available when the limit is first needed.
    Fraction(f64),
}

impl Default for MemoryLimit {
    fn default() -> Self {
        Self::Fraction(DEFAULT_FRACTION)
    }
}

/// An allocation that would exceed the memory budget.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{}; {}", self.shortage(), Self::ADVICE
)]
pub struct OverBudget {
    /// Name of the allocation, as in "the tree".
    pub what: String,
    /// Bytes of the allocation.
    pub needed: u64,
    /// Bytes left in the budget.
    pub left: u64,
    /// Bytes of the whole budget.
    pub limit: u64,
}

impl OverBudget {
    /// Remedy.
    pub const ADVICE: &str = "take something smaller or raise --memory-limit";

    /// Message with the allocation, its size and the memory that is left.
    pub fn shortage(&self) -> String {
        let [needed, left, limit] = [self.needed, self.left, self.limit].map(format_bytes);
        format!("{} would need about {needed} of memory, but only {left} of {limit} may still be used", self.what)
    }
}

/// The number of bytes that a process may use.
///
/// ```
/// use bvhscope::budget::{Budget, MemoryLimit};
///
/// let budget = Budget::limited(MemoryLimit::Bytes(64 << 30));
/// assert!(budget.check("the triangles", 100).is_ok());
/// assert!(budget.check("the triangles", 1 << 40).is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    limit: u64,
}

/// The limit in bytes; 0 until it is set. Global because the memory is that of the whole process.
static LIMIT: AtomicU64 = AtomicU64::new(0);

impl Budget {
    /// The budget of this process: that of [`Budget::set_limit`], else 75 % of the memory available at the first call.
    pub fn of_process() -> Self {
        static DEFAULT: OnceLock<u64> = OnceLock::new();
        match LIMIT.load(Ordering::Relaxed) {
            0 => Self { limit: *DEFAULT.get_or_init(|| bytes_of(MemoryLimit::default())) },
            limit => Self { limit },
        }
    }

    /// A budget of `limit`.
    pub fn limited(limit: MemoryLimit) -> Self {
        Self { limit: bytes_of(limit) }
    }

    /// Sets the budget of this process.
    pub fn set_limit(limit: MemoryLimit) {
        LIMIT.store(Self::limited(limit).limit.max(1), Ordering::Relaxed);
    }

    /// Checks that `needed` more bytes fit into the budget; `what` ("the tree") names the allocation in the error.
    pub fn check(&self, what: &str, needed: u64) -> Result<(), OverBudget> {
        if needed < MIN_CHECKED.min(self.limit / 16) {
            return Ok(());
        }
        let left = self.left();
        if needed <= left { Ok(()) } else { Err(OverBudget { what: what.to_owned(), needed, left, limit: self.limit }) }
    }

    /// The largest allocation that [`Budget::check`] lets pass now, in bytes: for what counts its memory itself.
    pub fn allowance(&self) -> u64 {
        self.left().max(MIN_CHECKED.min(self.limit / 16))
    }

    /// The error of an allocation of `needed` bytes, of which `allowed` were [allowed](Budget::allowance).
    pub fn exceeded(&self, what: &str, needed: u64, allowed: u64) -> OverBudget {
        OverBudget { what: what.to_owned(), needed, left: allowed, limit: self.limit }
    }

    /// The limit in bytes; `u64::MAX` where nothing is refused.
    pub const fn limit(&self) -> u64 {
        self.limit
    }

    /// Resident memory of this process in bytes; 0 where the system does not report it.
    pub fn used() -> u64 {
        used()
    }

    /// Bytes left in the budget.
    pub fn left(&self) -> u64 {
        self.limit.saturating_sub(used())
    }
}

/// The limit in bytes. A fraction refers to the memory that this process uses plus what is still available.
fn bytes_of(limit: MemoryLimit) -> u64 {
    match limit {
        MemoryLimit::Bytes(bytes) => bytes,
        MemoryLimit::Fraction(fraction) => {
            // Without information from the system nothing is refused.
            let Ok(mut system) = System::new() else { return u64::MAX };
            system.refresh_memory_specifics(MemoryRefreshKind::nothing().with_ram());
            // A control group may allow less than the machine has.
            let in_cgroup =
                system.cgroup_limits().map_or(u64::MAX, |limits| limits.total_memory.saturating_sub(limits.rss));
            let limited = left_by_limits().saturating_sub(HEADROOM).max(1);
            let available = system.available_memory().min(in_cgroup).min(limited);
            if available == 0 { u64::MAX } else { (available.saturating_add(used()) as f64 * fraction) as u64 }
        }
    }
}

/// Resident memory of this process in bytes.
fn used() -> u64 {
    let (Ok(pid), Ok(mut system)) = (sysinfo::get_current_pid(), System::new()) else { return 0 };
    let kind = ProcessRefreshKind::nothing().with_memory().without_tasks();
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[pid]), false, kind);
    system.process(pid).map_or(0, sysinfo::Process::memory)
}

/// Bytes that `ulimit -v` and `ulimit -d` leave, `u64::MAX` without them; allocations beyond them fail although there is free memory.
fn left_by_limits() -> u64 {
    let field = |file: &str, start: &str, column: usize| -> Option<u64> {
        let text = std::fs::read_to_string(file).ok()?;
        let line = text.lines().find(|line| line.starts_with(start))?;
        line.split_whitespace().nth(column)?.parse().ok()
    };
    // An absent limit reads "unlimited"; systems other than Linux have no such files.
    let left = |limit: &str, taken: &str| {
        let taken = field("/proc/self/status", taken, 1).unwrap_or(0).saturating_mul(1024);
        field("/proc/self/limits", limit, 3).map(|limit| limit.saturating_sub(taken))
    };
    let limits = [left("Max address space", "VmSize:"), left("Max data size", "VmData:")];
    let Some(outside) = limits.into_iter().flatten().min() else { return u64::MAX };
    // Both limits count a range as taken once the allocator has reserved it. The larger of the two, not their sum: a large allocation lies
    // in one of them.
    outside.max(std::fs::read_to_string("/proc/self/smaps").map_or(0, |maps| largest_reserve(&maps)))
}

/// Unused bytes of the range that the allocator has used least of, by the lines of `/proc/self/smaps`.
fn largest_reserve(maps: &str) -> u64 {
    let (mut is_anonymous, mut size, mut largest) = (false, 0, 0);
    for line in maps.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let bytes = |kilobytes: &str| kilobytes.parse().unwrap_or(0_u64).saturating_mul(1024);
        match words[..] {
            ["Size:", kilobytes, ..] => size = bytes(kilobytes),
            ["Rss:", kilobytes, ..] if is_anonymous && size >= MIN_RESERVE => {
                largest = largest.max(size.saturating_sub(bytes(kilobytes)));
            }
            [range, mode, _, _, file, ..] if range.contains('-') => is_anonymous = mode == "rw-p" && file == "0",
            _ => {}
        }
    }
    largest
}

/// A number of bytes as text, in MB or GB (powers of 1000).
pub fn format_bytes(bytes: u64) -> String {
    let megabytes = bytes as f64 / 1e6;
    if megabytes >= 1000.0 { format!("{:.1} GB", megabytes / 1e3) } else { format!("{megabytes:.1} MB") }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn an_allocation_over_budget_is_refused_with_a_message() {
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
    fn a_fraction_is_of_the_available_memory() {
        let (half, all) = (bytes_of(MemoryLimit::Fraction(0.5)), bytes_of(MemoryLimit::Fraction(1.0)));
        assert!(half > 0 && half < all, "{half} of {all}");
    }

    #[test]
    fn reserved_addresses_are_no_memory_in_use() {
        let range = |mode: &str, file: u32, size: u32, used: u32| {
            format!(
                "7ff694021000-7ff698000000 {mode} 00000000 00:00 {file} [anon:mimalloc]\nSize: {size} kB\nKernelPageSize: 4 kB\n\
                 Rss: {used} kB\nPss: 9 kB\nVmFlags: rd wr mr mw me ac sd\n"
            )
        };
        let ranges = [("rw-p", 0, 131_072, 31_072), ("rw-p", 0, 65_536, 5), ("---p", 0, 999_999, 0)];
        // A file and the stack of a thread.
        let others = [("rw-p", 7, 999_999, 0), ("rw-p", 0, 8_192, 0)];
        let maps = ranges.into_iter().chain(others).map(|(mode, file, size, used)| range(mode, file, size, used));
        assert_eq!(largest_reserve(&maps.collect::<String>()), 100_000 * 1024);
        assert_eq!(largest_reserve(""), 0);
    }
}
