//! The task graph of a computation, with its work and its span.

use bvhscope_engine::task_log::TaskRecord;

/// A piece of work that one core does.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Index of its stage.
    pub stage: usize,
    /// Time that one core takes for it, in seconds.
    pub work: f64,
    /// Indices of the tasks that it waits for, all lower than its own.
    pub waits_for: Vec<u32>,
    /// Number of equal parts that it can be divided into.
    pub parts: u32,
    /// It begins a task of a fork.
    pub is_forked: bool,
    /// No other task can run beside it.
    pub is_serial: bool,
}

/// Tasks, each after those that it waits for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TaskGraph {
    /// The tasks.
    pub tasks: Vec<Task>,
    /// The names of the stages.
    pub stages: Vec<&'static str>,
}

impl TaskGraph {
    /// The graph of logged tasks.
    pub fn new(records: &[TaskRecord]) -> Self {
        let mut stages: Vec<&'static str> = Vec::new();
        let task = |record: &TaskRecord| {
            let stage = stages.iter().position(|stage| *stage == record.stage).unwrap_or_else(|| {
                stages.push(record.stage);
                stages.len() - 1
            });
            let is_inner = |&after: &u32| records[after as usize].depth < record.depth;
            Task {
                stage,
                work: record.duration().as_secs_f64(),
                waits_for: record.waits_for.clone(),
                parts: record.parts,
                is_forked: record.waits_for.iter().all(is_inner) && record.depth > 0,
                is_serial: record.depth == 0,
            }
        };
        let tasks = records.iter().map(task).collect();
        Self { tasks, stages }
    }

    /// Work, T₁: the time of all tasks together, in seconds.
    pub fn work(&self) -> f64 {
        self.tasks.iter().map(|task| task.work).sum()
    }

    /// Span, T∞: the time of the longest chain of tasks that wait for each other, in seconds. No number of cores is faster.
    pub fn span(&self) -> f64 {
        let mut ends: Vec<f64> = Vec::with_capacity(self.tasks.len());
        for task in &self.tasks {
            let start = task.waits_for.iter().map(|&before| ends[before as usize]).fold(0.0, f64::max);
            ends.push(start + task.work / f64::from(task.parts.max(1)));
        }
        ends.into_iter().fold(0.0, f64::max)
    }

    /// Time of the serial sections, in seconds.
    pub fn serial(&self) -> f64 {
        self.tasks.iter().filter(|task| task.is_serial).map(|task| task.work).sum()
    }

    /// Time of the tasks of each stage that `counts`, in seconds.
    pub fn stage_work(&self, counts: impl Fn(&Task) -> bool) -> Vec<f64> {
        let mut sums = vec![0.0; self.stages.len()];
        for task in self.tasks.iter().filter(|task| counts(task)) {
            sums[task.stage] += task.work;
        }
        sums
    }

    /// The same tasks in another run, if they are the same.
    fn has_tasks_of(&self, other: &Self) -> bool {
        let pairs = self.tasks.iter().zip(&other.tasks);
        self.tasks.len() == other.tasks.len()
            && self.stages == other.stages
            && pairs.into_iter().all(|(a, b)| (a.stage, &a.waits_for) == (b.stage, &b.waits_for))
    }

    /// One graph of several runs on one thread: each stage as in the run in which it took the least time, because what disturbs a
    /// run only ever adds to it. Runs whose tasks differ from those of the first are left out.
    pub fn fastest(runs: &[Self]) -> Self {
        let Some(first) = runs.first() else { return Self::default() };
        let runs: Vec<&Self> = runs.iter().filter(|run| run.has_tasks_of(first)).collect();
        let sums: Vec<Vec<f64>> = runs.iter().map(|run| run.stage_work(|_| true)).collect();
        let best: Vec<usize> = (0..first.stages.len())
            .map(|stage| (0..runs.len()).min_by(|&a, &b| sums[a][stage].total_cmp(&sums[b][stage])).unwrap_or(0))
            .collect();
        let mut fastest = first.clone();
        for (index, task) in fastest.tasks.iter_mut().enumerate() {
            task.work = runs[best[task.stage]].tasks[index].work;
        }
        fastest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::speedup::made::{chain, fork_join, independent};
    use std::time::Duration;

    #[test]
    fn work_and_span_of_graphs_made_by_hand() {
        let of = |graph: &TaskGraph| (graph.work(), graph.span(), graph.serial());
        assert_eq!(of(&chain(&[1.0, 2.0, 4.0])), (7.0, 7.0, 7.0));
        assert_eq!(of(&independent(&[1.0, 2.0, 4.0])), (7.0, 4.0, 0.0));
        // 1, then 2 beside 4, then 8.
        assert_eq!(of(&fork_join(1.0, &[2.0, 4.0], 8.0)), (15.0, 13.0, 9.0));
        assert_eq!(of(&TaskGraph::default()), (0.0, 0.0, 0.0));
        let mut loop_of_four = chain(&[1.0, 8.0]);
        loop_of_four.tasks[1].parts = 4;
        assert_eq!((loop_of_four.work(), loop_of_four.span()), (9.0, 3.0));
    }

    #[test]
    fn records_become_tasks() {
        let record = |stage, millis: u64, waits_for: &[u32], depth| TaskRecord {
            stage,
            start: Duration::from_millis(3),
            end: Duration::from_millis(3 + millis),
            waits_for: waits_for.to_vec(),
            depth,
            parts: 1,
        };
        let records = [
            record("codes", 1, &[], 0),
            record("codes", 8, &[0], 1),
            record("codes", 6, &[0], 1),
            record("codes", 2, &[2], 1),
            record("sort", 4, &[1, 3], 0),
        ];
        let graph = TaskGraph::new(&records);
        assert_eq!(graph.stages, ["codes", "sort"]);
        assert!((graph.work() - 0.021).abs() < 1e-9 && (graph.span() - 0.013).abs() < 1e-9);
        let forked: Vec<bool> = graph.tasks.iter().map(|task| task.is_forked).collect();
        assert_eq!(forked, [false, true, true, false, false]);
        let parallel = graph.stage_work(|task| !task.is_serial);
        assert!((parallel[0] - 0.016).abs() < 1e-9 && parallel[1] == 0.0);
    }

    #[test]
    fn each_stage_is_that_of_its_fastest_run() {
        let run = |works: [f64; 3]| {
            let mut graph = chain(&works);
            graph.stages = vec!["a", "b"];
            graph.tasks[2].stage = 1;
            graph
        };
        let fastest = TaskGraph::fastest(&[run([1.0, 5.0, 9.0]), run([3.0, 2.0, 10.0]), chain(&[0.0])]);
        let works: Vec<f64> = fastest.tasks.iter().map(|task| task.work).collect();
        assert_eq!(works, [3.0, 2.0, 9.0]);
        assert_eq!(TaskGraph::fastest(&[]), TaskGraph::default());
    }
}
