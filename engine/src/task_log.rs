//! A log of the tasks of a computation: how long each piece of its work took, and which pieces that one had to wait for. From it
//! follow work and span (Blumofe, Leiserson, *Scheduling Multithreaded Computations by Work Stealing*, 1999), and with them how
//! the computation would run on other numbers of cores.
//!
//! A computation is a strand of pieces, one after another, with forks between them; each task of a fork is a strand of its own.
//! Knows neither what is computed nor on how many threads.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A piece of work without a fork in it, done by one thread.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TaskRecord {
    /// The stage of the computation that it belongs to.
    pub stage: &'static str,
    /// When it began, by the clock of the log.
    pub start: Duration,
    /// When it ended, by the same clock on the same thread.
    pub end: Duration,
    /// Indices of the pieces that it waits for, all lower than its own.
    pub waits_for: Vec<u32>,
    /// Number of forks around it: 0 for a serial section, beside which no other piece can run.
    pub depth: u32,
    /// Number of equal parts that could run at the same time, where it is a part of a loop that any number of threads share.
    pub parts: u32,
}

impl TaskRecord {
    /// Time that the piece took.
    pub fn duration(&self) -> Duration {
        self.end.saturating_sub(self.start)
    }
}

/// The pieces of a computation, in the order in which they ended.
#[derive(Debug)]
pub struct TaskLog {
    clock: Clock,
    records: Mutex<Vec<TaskRecord>>,
}

impl TaskLog {
    /// An empty log of wall-clock times, which begin now.
    pub fn new() -> Arc<Self> {
        Arc::new(Self { clock: Clock::Wall(Instant::now()), records: Mutex::default() })
    }

    /// An empty log with a per-thread `clock`, such as processor time.
    pub fn with_clock(clock: fn() -> Duration) -> Arc<Self> {
        Arc::new(Self { clock: Clock::Given(clock), records: Mutex::default() })
    }

    /// The pieces so far.
    pub fn records(&self) -> Vec<TaskRecord> {
        lock(&self.records).clone()
    }

    /// Adds a piece that ends now and returns its index.
    fn record(&self, piece: Current, depth: u32, parts: u32) -> u32 {
        let Current { stage, start, waits_for } = piece;
        let end = self.clock.now();
        let mut records = lock(&self.records);
        records.push(TaskRecord { stage, start, end, waits_for, depth, parts });
        records.len() as u32 - 1
    }
}

/// Clock by which pieces are timed.
#[derive(Debug, Clone, Copy)]
enum Clock {
    Wall(Instant),
    Given(fn() -> Duration),
}

impl Clock {
    fn now(self) -> Duration {
        match self {
            Self::Wall(origin) => origin.elapsed(),
            Self::Given(clock) => clock(),
        }
    }
}

/// The piece that a strand is working on.
#[derive(Debug, Default)]
struct Current {
    stage: &'static str,
    start: Duration,
    waits_for: Vec<u32>,
}

/// Pieces of work one after another, of which one is under way.
#[derive(Debug)]
pub(crate) struct Strand {
    log: Arc<TaskLog>,
    depth: u32,
    current: Mutex<Current>,
}

impl Strand {
    /// The strand of a whole computation, which begins now.
    pub fn new(log: &Arc<TaskLog>) -> Self {
        let current = Current { stage: "start", start: log.clock.now(), waits_for: Vec::new() };
        Self { log: Arc::clone(log), depth: 0, current: Mutex::new(current) }
    }

    /// The strand of a task that waits for the piece `after` of this one, and begins now.
    pub fn child(&self, after: u32) -> Self {
        let stage = lock(&self.current).stage;
        let current = Current { stage, start: self.log.clock.now(), waits_for: vec![after] };
        Self { log: Arc::clone(&self.log), depth: self.depth + 1, current: Mutex::new(current) }
    }

    /// Ends the piece under way, which could be divided into `parts`, and returns its index. The next one waits for it.
    pub fn cut(&self, parts: u32) -> u32 {
        let mut current = lock(&self.current);
        let stage = current.stage;
        let index = self.log.record(std::mem::take(&mut *current), self.depth, parts);
        *current = Current { stage, start: self.log.clock.now(), waits_for: vec![index] };
        index
    }

    /// The pieces from now on belong to `stage`.
    pub fn begin_stage(&self, stage: &'static str) {
        self.cut(1);
        lock(&self.current).stage = stage;
    }

    /// Begins a piece now that waits for `waits_for` alone; what passed since the last one ended is no work of this strand.
    pub fn resume(&self, waits_for: Vec<u32>) {
        let mut current = lock(&self.current);
        (current.start, current.waits_for) = (self.log.clock.now(), waits_for);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
