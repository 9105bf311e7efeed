//! A greedy scheduler: no core is idle while a task is ready. Without costs its time on p cores is at most work / p + span, and no
//! schedule takes less than work / p or than span (Graham, *Bounds for Certain Multiprocessing Anomalies*, 1966; Brent, *The
//! Parallel Evaluation of General Arithmetic Expressions*, 1974).

use std::collections::VecDeque;

use super::graph::TaskGraph;

/// Time after which an idle thread sleeps: rayon's yield some thirty times before, each of which takes about a microsecond.
const DOZES_AFTER: f64 = 3e-5;

/// Overheads of cores; times in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Costs<'a> {
    /// Time that each task of a fork takes in addition.
    pub fork: f64,
    /// Time until a core begins a task that waited for one on another core: where it was idle for a moment, and where it slept.
    pub steal: [f64; 2],
    /// For each stage the time of its tasks while two cores are busy, over that while one is.
    pub inflation: &'a [f64],
    /// How the inflation goes on with more cores.
    pub growth: Growth,
}

impl Costs<'_> {
    /// Time of a task of `stage` while `busy` cores work, over that while one does.
    fn slowdown(&self, stage: usize, busy: usize) -> f64 {
        let at_two = self.inflation.get(stage).map_or(0.0, |inflation| inflation - 1.0);
        1.0 + at_two * self.growth.factor(busy)
    }
}

/// How much longer tasks take the more cores share caches and memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Growth {
    /// As long as with two cores: the best case.
    None,
    /// Each doubling of the cores adds as much as the first.
    Doubling,
    /// Each core adds as much as the second: the worst case, in which a stage gets no faster than what memory delivers.
    Linear,
}

impl Growth {
    /// The addition with `busy` cores, in units of that with two.
    fn factor(self, busy: usize) -> f64 {
        match (self, busy) {
            (_, 0 | 1) => 0.0,
            (Self::None, _) => 1.0,
            (Self::Doubling, _) => (busy as f64).log2(),
            (Self::Linear, _) => (busy - 1) as f64,
        }
    }
}

/// A task or one of its parts that a core works on.
struct Running {
    task: usize,
    /// Time left if no other core were busy.
    left: f64,
    core: usize,
}

/// Time in seconds in which `cores`, at least one, do all tasks of `graph`.
pub fn makespan(graph: &TaskGraph, cores: usize, costs: &Costs<'_>) -> f64 {
    let tasks = &graph.tasks;
    let mut followers: Vec<Vec<usize>> = vec![Vec::new(); tasks.len()];
    for (index, task) in tasks.iter().enumerate() {
        task.waits_for.iter().for_each(|&before| followers[before as usize].push(index));
    }
    let mut waiting: Vec<usize> = tasks.iter().map(|task| task.waits_for.len()).collect();
    let parts_of = |task: usize| (tasks[task].parts.max(1) as usize).min(cores.max(1));
    let mut parts_left: Vec<usize> = (0..tasks.len()).map(parts_of).collect();
    // The core that finished each task; of a task in parts, of the last.
    let mut core_of = vec![0; tasks.len()];
    let mut idle: Vec<(usize, f64)> = (0..cores.max(1)).rev().map(|core| (core, f64::NEG_INFINITY)).collect();
    let mut ready: VecDeque<usize> = VecDeque::new();
    let enqueue = |ready: &mut VecDeque<usize>, task| ready.extend(std::iter::repeat_n(task, parts_of(task)));
    (0..tasks.len()).filter(|&task| waiting[task] == 0).for_each(|task| enqueue(&mut ready, task));
    let mut running: Vec<Running> = Vec::new();
    let mut now = 0.0;
    loop {
        while let Some(&task) = ready.front().filter(|_| !idle.is_empty()) {
            ready.pop_front();
            let before = &tasks[task].waits_for;
            let own =
                before.last().and_then(|&last| idle.iter().rposition(|(core, _)| *core == core_of[last as usize]));
            let (core, since) = idle.swap_remove(own.unwrap_or(idle.len() - 1));
            let is_stolen = before.iter().any(|&before| core_of[before as usize] != core);
            let slept = usize::from(now - since > DOZES_AFTER);
            let steal = if is_stolen { costs.steal[slept] } else { 0.0 };
            let fork = if tasks[task].is_forked { costs.fork } else { 0.0 };
            running.push(Running { task, left: tasks[task].work / parts_of(task) as f64 + fork + steal, core });
        }
        let busy = running.len();
        let slowdown = |running: &Running| costs.slowdown(tasks[running.task].stage, busy);
        let Some(next) = running.iter().map(|one| one.left * slowdown(one)).reduce(f64::min) else { return now };
        now += next;
        for one in &mut running {
            let done = next / costs.slowdown(tasks[one.task].stage, busy);
            one.left -= done;
        }
        // Rounding leaves a little of what should end now.
        let (ended, still): (Vec<Running>, Vec<Running>) =
            running.into_iter().partition(|one| one.left <= 1e-12 * (1.0 + now));
        running = still;
        for Running { task, core, .. } in ended {
            idle.push((core, now));
            parts_left[task] -= 1;
            if parts_left[task] > 0 {
                continue;
            }
            core_of[task] = core;
            for &follower in &followers[task] {
                waiting[follower] -= 1;
                if waiting[follower] == 0 {
                    enqueue(&mut ready, follower);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::speedup::graph::Task;
    use crate::lab::speedup::made::{chain, fork_join, independent};

    /// Nothing costs anything.
    const FREE: Costs<'_> = Costs { fork: 0.0, steal: [0.0; 2], inflation: &[], growth: Growth::None };

    fn time(graph: &TaskGraph, cores: usize) -> f64 {
        (makespan(graph, cores, &FREE) * 1e9).round() / 1e9
    }

    #[test]
    fn a_chain_is_no_faster_on_more_cores() {
        let graph = chain(&[1.0, 2.0, 3.0]);
        assert_eq!([1, 2, 64].map(|cores| time(&graph, cores)), [6.0; 3]);
        assert_eq!(time(&TaskGraph::default(), 2), 0.0);
    }

    #[test]
    fn independent_tasks_are_shared() {
        let graph = independent(&[1.0; 8]);
        assert_eq!([1, 2, 3, 8, 64].map(|cores| time(&graph, cores)), [8.0, 4.0, 3.0, 1.0, 1.0]);
        // In order: 3 and 3, then 1 and 2.
        assert_eq!(time(&independent(&[3.0, 3.0, 1.0, 2.0]), 2), 5.0);
    }

    #[test]
    fn a_fork_is_as_long_as_its_longest_task() {
        let graph = fork_join(1.0, &[2.0, 4.0, 2.0], 8.0);
        assert_eq!([1, 2, 3].map(|cores| time(&graph, cores)), [17.0, 13.0, 13.0]);
    }

    #[test]
    fn a_loop_is_divided_among_the_cores() {
        let mut graph = chain(&[1.0, 12.0, 1.0]);
        graph.tasks[1].parts = 4;
        assert_eq!([1, 2, 3, 4, 64].map(|cores| time(&graph, cores)), [14.0, 8.0, 6.0, 5.0, 5.0]);
    }

    #[test]
    fn the_bounds_of_graham_and_brent_hold() {
        // Pseudorandom graphs, the same on each run.
        let mut state = 7_u32;
        let mut random = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % below
        };
        for _ in 0..40 {
            let tasks = (0..60_u32)
                .map(|index| {
                    let mut waits_for: Vec<u32> = (0..random(3).min(index)).map(|_| random(index)).collect();
                    waits_for.sort_unstable();
                    waits_for.dedup();
                    let work = f64::from(1 + random(9));
                    Task { stage: 0, work, waits_for, parts: 1, is_forked: false, is_serial: false }
                })
                .collect();
            let graph = TaskGraph { tasks, stages: vec!["made"] };
            let (work, span) = (graph.work(), graph.span());
            for cores in [1, 2, 3, 8, 64] {
                let (time, share) = (time(&graph, cores), work / cores as f64);
                assert!(time >= share.max(span) - 1e-6 && time <= share + span + 1e-6, "{cores}: {time} {work} {span}");
            }
            assert_eq!(time(&graph, 1), work);
            assert_eq!(time(&graph, 64), span, "more cores than tasks");
        }
    }

    #[test]
    fn costs_are_added_where_they_arise() {
        let graph = fork_join(1.0, &[2.0, 2.0], 1.0);
        let fork = Costs { fork: 0.5, ..FREE };
        assert_eq!([1, 2].map(|cores| makespan(&graph, cores, &fork)), [7.0, 4.5]);
        // The second core slept; what follows the join waits for a task of another core.
        let steal = Costs { steal: [0.25, 0.5], ..FREE };
        assert_eq!(makespan(&graph, 1, &steal), 6.0);
        assert_eq!(makespan(&graph, 2, &steal), 1.0 + 2.5 + 0.25 + 1.0);
    }

    #[test]
    fn busy_cores_slow_each_other_down() {
        let graph = independent(&[1.0; 4]);
        let time = |growth, cores| makespan(&graph, cores, &Costs { inflation: &[1.5], growth, ..FREE });
        for growth in [Growth::None, Growth::Doubling, Growth::Linear] {
            assert_eq!((time(growth, 1), time(growth, 2)), (4.0, 3.0), "{growth:?}");
        }
        assert_eq!(time(Growth::None, 4), 1.5);
        assert_eq!(time(Growth::Doubling, 4), 2.0);
        assert_eq!(time(Growth::Linear, 4), 2.5);
        // One task alone is not slowed down.
        let uneven = independent(&[1.0, 3.0]);
        let inflation = Costs { inflation: &[2.0], growth: Growth::Linear, ..FREE };
        assert_eq!(makespan(&uneven, 2, &inflation), 2.0 + 2.0);
    }
}
