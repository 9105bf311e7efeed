//! Tasks and lists that all threads of the calling thread's rayon pool work on, with cancellation checks.
//!
//! Rayon compiles its division of work again for each closure that it is given, some 6 kB. Here it is given a closure behind a pointer,
//! which is called once for each task or for a block of items, and compiled once, or once for each type of item.

use std::sync::{Mutex, PoisonError};

use bytemuck::Zeroable;
use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};

/// Number of items between two cancellation checks: some megabytes of the largest ones.
const CHUNK: usize = 1 << 16;

/// Items that are collected at once, so that calling through a pointer costs nothing.
const BLOCK: usize = 16;

/// Items that a logged part of a loop is at most divided into: fewer would not pay.
const MIN_ITEMS_PER_PART: usize = 256;

/// The results of `work` on each of `tasks`, in order. The tasks are those of a [`Fork`](super::fork::Fork), each with a cancellation
/// check before it, and the token to use in it.
pub fn par_tasks<T: Send, R: Send>(
    tasks: impl IntoIterator<Item = T>,
    token: &CancelToken,
    work: impl Fn(T, &CancelToken) -> Result<R, Cancelled> + Sync,
) -> Result<Vec<R>, Cancelled> {
    par_tasks_with(tasks, token, || (), |(), task, token| work(task, token))
}

/// [`par_tasks`] with memory, made by `init`, that tasks on the same thread use one after the other.
pub fn par_tasks_with<T: Send, S, R: Send>(
    tasks: impl IntoIterator<Item = T>,
    token: &CancelToken,
    init: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, T, &CancelToken) -> Result<R, Cancelled> + Sync,
) -> Result<Vec<R>, Cancelled> {
    let fork = token.fork();
    let tasks: Vec<Mutex<Task<T, R>>> = tasks.into_iter().map(|task| Mutex::new(Task::Waiting(task))).collect();
    for_each_index(tasks.len(), &|| {
        let (mut memory, tasks, fork, work) = (init(), &tasks, &fork, &work);
        Box::new(move |index| {
            // No other thread has the same index.
            let mut place = tasks[index].lock().unwrap_or_else(PoisonError::into_inner);
            if let Task::Waiting(task) = std::mem::replace(&mut *place, Task::Taken) {
                let result = fork.task(|token| token.check().and_then(|()| work(&mut memory, task, token)));
                *place = Task::Done(result);
            }
        })
    });
    fork.join();
    let places = tasks.into_iter().map(|place| place.into_inner().unwrap_or_else(PoisonError::into_inner));
    let results = places.map(|place| match place {
        Task::Done(result) => result,
        Task::Waiting(_) | Task::Taken => unreachable!("a loop calls each index"),
    });
    results.collect()
}

/// [`par_tasks`] where `parallel`; else one after the other, without the checks.
pub(crate) fn tasks_if<T: Send, R: Send>(
    parallel: bool,
    tasks: impl IntoIterator<Item = T>,
    token: &CancelToken,
    work: impl Fn(T, &CancelToken) -> Result<R, Cancelled> + Sync,
) -> Result<Vec<R>, Cancelled> {
    if parallel { par_tasks(tasks, token, work) } else { tasks.into_iter().map(|task| work(task, token)).collect() }
}

/// A task of [`par_tasks`].
enum Task<T, R> {
    Waiting(T),
    Taken,
    Done(Result<R, Cancelled>),
}

/// Calls what `worker` makes, once for each part of the loop that a thread takes, for each index below `count`.
fn for_each_index<'a>(count: usize, worker: &(dyn Fn() -> Box<dyn FnMut(usize) + 'a> + Sync + 'a)) {
    (0..count).into_par_iter().for_each_init(worker, |work, index| work(index));
}

/// Collects `item(index)` for each `index` below `count`, in order.
pub fn par_collect<T: Send>(
    count: usize,
    token: &CancelToken,
    item: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let block = |block: usize| std::array::from_fn::<T, BLOCK, _>(|at| item(BLOCK * block + at));
    let mut list = Vec::with_capacity(count.div_ceil(BLOCK));
    extend(&mut list, count / BLOCK, CHUNK / BLOCK, MIN_ITEMS_PER_PART / BLOCK, token, &block)?;
    let mut list = list.into_flattened();
    list.extend((list.len()..count).map(item));
    Ok(list)
}

/// [`par_collect`] of items that take long, with a cancellation check before each `chunk` of them.
pub fn par_collect_in_chunks<T: Send>(
    count: usize,
    chunk: usize,
    token: &CancelToken,
    item: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let mut list = Vec::with_capacity(count);
    extend(&mut list, count, chunk, MIN_ITEMS_PER_PART, token, &item)?;
    Ok(list)
}

/// Extends the empty `list` to `count` items, with a cancellation check before each `chunk` of them.
fn extend<T: Send>(
    list: &mut Vec<T>,
    count: usize,
    chunk: usize,
    min_per_part: usize,
    token: &CancelToken,
    item: &(dyn Fn(usize) -> T + Sync),
) -> Result<(), Cancelled> {
    while list.len() < count {
        token.check()?;
        let first = list.len();
        let end = count.min(first + chunk);
        let fork = token.fork();
        let parts = (end - first).div_ceil(min_per_part);
        list.par_extend((first..end).into_par_iter().map_init(|| fork.part_of_loop(parts), |_, index| item(index)));
        fork.join();
    }
    Ok(())
}

/// A list of `count` zeros, to be written in arbitrary order. Cleared in parallel: for a large list in memory that was used
/// before, one thread would take as long as a tenth of a build.
pub fn zeros<T: Zeroable + Send>(count: usize, token: &CancelToken) -> Result<Vec<T>, Cancelled> {
    par_collect(count, token, |_| T::zeroed())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_any_length_are_in_order() {
        for count in [0, 1, BLOCK - 1, BLOCK, 3 * BLOCK + 5, CHUNK, CHUNK + BLOCK + 1] {
            let expected = Ok((0..count).map(|index| 3 * index).collect());
            let token = CancelToken::new();
            assert_eq!(par_collect(count, &token, |index| 3 * index), expected);
            assert_eq!(par_collect_in_chunks(count, 1 << 10, &token, |index| 3 * index), expected);
            assert_eq!(par_tasks(0..count, &token, |index, _| Ok(3 * index)), expected);
        }
    }

    #[test]
    fn a_cancelled_task_ends_the_others() {
        let token = CancelToken::new();
        let ended = par_tasks(0..1000, &token, |index, token| {
            if index == 0 {
                token.cancel();
            }
            Ok(index)
        });
        assert_eq!(ended, Err(Cancelled));
    }
}
