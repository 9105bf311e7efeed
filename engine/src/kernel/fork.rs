//! Forks of a computation: where it goes on in several tasks. They cost nothing unless the tasks are logged.
//!
//! ```
//! use bvhscope_engine::CancelToken;
//! use bvhscope_engine::task_log::TaskLog;
//!
//! let log = TaskLog::new();
//! let token = CancelToken::logging(&log);
//! token.begin_stage("halves");
//! let fork = token.fork();
//! let halves = [1, 2].map(|half| fork.task(|_| 10 * half));
//! fork.join();
//! token.end_task();
//! assert_eq!(halves, [10, 20]);
//! // What came before the stage, before the fork, both halves, and what comes after.
//! let waits_for: Vec<Vec<u32>> = log.records().into_iter().map(|task| task.waits_for).collect();
//! assert_eq!(waits_for, [vec![], vec![0], vec![1], vec![1], vec![2, 3]]);
//! ```

use std::sync::{Arc, Mutex, PoisonError};

use crate::cancel::{CancelToken, Cancelled};
use crate::task_log::Strand;

/// A point from which tasks go on at the same time, until [`Fork::join`].
pub struct Fork<'a> {
    token: &'a CancelToken,
    log: Option<ForkLog>,
}

/// The log entries of a fork.
struct ForkLog {
    strand: Arc<Strand>,
    /// Index of the piece that all tasks wait for.
    after: u32,
    /// Indices of the tasks' last pieces.
    ended: Mutex<Vec<u32>>,
}

impl ForkLog {
    fn add(&self, piece: u32) {
        self.ended.lock().unwrap_or_else(PoisonError::into_inner).push(piece);
    }
}

impl CancelToken {
    /// Names the stage to which what follows belongs, where tasks are logged.
    pub fn begin_stage(&self, stage: &'static str) {
        if let Some(strand) = self.strand() {
            strand.begin_stage(stage);
        }
    }

    /// Logs what was done since the last fork, where tasks are logged.
    pub fn end_task(&self) {
        if let Some(strand) = self.strand() {
            strand.cut(1);
        }
    }

    /// The results of `left` and `right`: as the tasks of a fork, after a cancellation check, where `parallel`; else one after the other.
    #[inline]
    pub fn both<A: Send, B: Send>(
        &self,
        parallel: bool,
        left: impl FnOnce(&Self) -> Result<A, Cancelled> + Send,
        right: impl FnOnce(&Self) -> Result<B, Cancelled> + Send,
    ) -> Result<(A, B), Cancelled> {
        if !parallel {
            return Ok((left(self)?, right(self)?));
        }
        self.check()?;
        let fork = self.fork();
        let (mut left, mut right) = (Half::Waiting(left), Half::Waiting(right));
        join(&mut || left.run(&fork), &mut || right.run(&fork));
        fork.join();
        Ok((left.result()?, right.result()?))
    }

    /// Begins a fork.
    pub fn fork(&self) -> Fork<'_> {
        let log = self.strand().map(|strand| ForkLog {
            strand: Arc::clone(strand),
            after: strand.cut(1),
            ended: Mutex::default(),
        });
        Fork { token: self, log }
    }
}

/// One of two computations that run at the same time.
enum Half<F, R> {
    Waiting(F),
    Running,
    Done(R),
}

impl<F: FnOnce(&CancelToken) -> R, R> Half<F, R> {
    fn run(&mut self, fork: &Fork<'_>) {
        if let Self::Waiting(work) = std::mem::replace(self, Self::Running) {
            *self = Self::Done(fork.task(work));
        }
    }

    fn result(self) -> R {
        let Self::Done(result) = self else { unreachable!("both have ended") };
        result
    }
}

/// Runs both, on two threads where there are. Behind pointers, so that rayon's part is compiled once.
fn join(left: &mut (dyn FnMut() + Send), right: &mut (dyn FnMut() + Send)) {
    rayon::join(left, right);
}

impl Fork<'_> {
    /// Runs one of the tasks, with the token to use in it: what it forks itself is part of this task.
    pub fn task<R>(&self, work: impl FnOnce(&CancelToken) -> R) -> R {
        let strand = self.log.as_ref().map(|log| Arc::new(log.strand.child(log.after)));
        let own = strand.as_ref().map(|strand| self.token.on_strand(strand));
        let result = work(own.as_ref().unwrap_or(self.token));
        if let (Some(log), Some(strand)) = (&self.log, strand) {
            log.add(strand.cut(1));
        }
        result
    }

    /// A part of a loop, from now until it is dropped: as many of its items as one thread took at once. It could be divided into
    /// `parts` of equal size. What is done in it does not fork.
    pub fn part_of_loop(&self, parts: usize) -> LoopPart<'_> {
        LoopPart(self.log.as_ref().map(|log| (log, log.strand.child(log.after), parts)))
    }

    /// Ends the fork, after all of its tasks.
    pub fn join(self) {
        drop(self);
    }
}

impl Drop for Fork<'_> {
    fn drop(&mut self) {
        if let Some(ForkLog { strand, after, ended }) = &mut self.log {
            let ended = std::mem::take(ended.get_mut().unwrap_or_else(PoisonError::into_inner));
            strand.resume(if ended.is_empty() { vec![*after] } else { ended });
        }
    }
}

/// A part of a loop under way, see [`Fork::part_of_loop`].
pub struct LoopPart<'a>(Option<(&'a ForkLog, Strand, usize)>);

impl Drop for LoopPart<'_> {
    fn drop(&mut self) {
        if let Some((log, strand, parts)) = &self.0 {
            log.add(strand.cut(u32::try_from(*parts).unwrap_or(u32::MAX).max(1)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task_log::TaskLog;

    #[test]
    fn nested_forks_are_joined_within_their_task() {
        let log = TaskLog::new();
        let token = CancelToken::logging(&log);
        let outer = token.fork();
        outer.task(|token| {
            let inner = token.fork();
            drop(inner.part_of_loop(7));
            inner.join();
        });
        outer.join();
        token.end_task();
        let records = log.records();
        let found: Vec<_> = records.iter().map(|task| (task.depth, task.parts, &task.waits_for[..])).collect();
        // Before the fork; before the inner fork, its part, what follows it; after the fork.
        assert_eq!(found, [(0, 1, &[][..]), (1, 1, &[0]), (2, 7, &[1]), (1, 1, &[2]), (0, 1, &[3])]);
        assert!(records.iter().all(|task| task.start <= task.end));
    }

    #[test]
    fn a_fork_without_tasks_and_one_without_log_do_nothing() {
        let log = TaskLog::new();
        let token = CancelToken::logging(&log);
        token.fork().join();
        token.end_task();
        assert_eq!(log.records()[1].waits_for, [0]);
        let silent = CancelToken::new();
        let fork = silent.fork();
        assert!(!fork.task(CancelToken::is_cancelled));
        fork.join();
    }
}
