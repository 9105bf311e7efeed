//! Runs of a computation with all its tasks logged, and what follows from them.

use std::time::Duration;

use super::graph::TaskGraph;
use super::greedy::{Costs, Growth, makespan};
use super::prediction::{PredictedScaling, PredictedSpeedup, StageWork};
use bvhscope_engine::task_log::TaskRecord;

/// The numbers of cores that are predicted.
const CORES: [usize; 7] = [1, 2, 4, 8, 16, 32, 64];

/// Logged runs of one computation.
#[derive(Debug, Default)]
pub struct Runs {
    one: Vec<Run>,
    two: Vec<Run>,
}

/// A logged run.
#[derive(Debug)]
struct Run {
    graph: TaskGraph,
    /// Wall-clock time in seconds.
    elapsed: f64,
}

/// Measured times in seconds that are not part of any task.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prices {
    /// Of a fork.
    pub fork: f64,
    /// Until another thread takes a task, awake and from its sleep.
    pub steal: Option<[f64; 2]>,
}

impl Run {
    /// Time of the parallel tasks of a stage.
    fn parallel_work(&self, stage: &str) -> f64 {
        let index = self.graph.stages.iter().position(|name| *name == stage);
        index.map_or(0.0, |index| self.graph.stage_work(|task| !task.is_serial)[index])
    }
}

impl Runs {
    /// Adds a run on `threads`, 1 or 2, and its wall-clock time.
    pub fn add(&mut self, threads: usize, records: &[TaskRecord], elapsed: Duration) {
        let run = Run { graph: TaskGraph::new(records), elapsed: elapsed.as_secs_f64() };
        if threads == 1 { &mut self.one } else { &mut self.two }.push(run);
    }

    /// Work, span and speed-ups that follow from the runs and the `prices`.
    pub fn predict(&self, prices: &Prices) -> PredictedScaling {
        let graphs: Vec<TaskGraph> = self.one.iter().map(|run| run.graph.clone()).collect();
        let graph = TaskGraph::fastest(&graphs);
        let inflation: Vec<Option<[f64; 3]>> = graph.stages.iter().map(|stage| self.inflation(stage)).collect();
        let at =
            |which: usize| -> Vec<f64> { inflation.iter().map(|stage| stage.map_or(1.0, |all| all[which])).collect() };
        let steal = prices.steal.unwrap_or_default();
        let curve = |growth, inflation: &[f64], steal| {
            let costs = Costs { fork: prices.fork, steal, inflation, growth };
            let alone = makespan(&graph, 1, &costs);
            CORES.map(|cores| alone / makespan(&graph, cores, &costs))
        };
        let expected = curve(Growth::Doubling, &at(1), steal);
        let best = curve(Growth::None, &at(0), [steal[0]; 2]);
        let worst = curve(Growth::Linear, &at(2), [steal[1]; 2]);
        let point = |(index, &cores): (usize, &usize)| PredictedSpeedup {
            cores,
            speedup: expected[index],
            lower: worst[index].min(expected[index]),
            upper: best[index].max(expected[index]),
        };
        let work = graph.work();
        let (all, serial) = (graph.stage_work(|_| true), graph.stage_work(|task| task.is_serial));
        let stage = |(index, name): (usize, &&str)| StageWork {
            stage: (*name).to_owned(),
            work_ms: all[index] * 1e3,
            serial_ms: serial[index] * 1e3,
            inflation: inflation[index].map(|all| all[1]),
        };
        PredictedScaling {
            tasks: graph.tasks.len(),
            work_ms: work * 1e3,
            span_ms: graph.span() * 1e3,
            serial_share: if work > 0.0 { graph.serial() / work } else { 0.0 },
            stages: graph.stages.iter().enumerate().map(stage).collect(),
            curve: CORES.iter().enumerate().map(point).collect(),
            measured_at_two: fastest(&self.one).zip(fastest(&self.two)).map(|(one, two)| one / two),
        }
    }

    /// Time of the parallel tasks of `stage` in runs on two threads over that on one: the lower quartile of the pairs of runs, that of
    /// the fastest run of each, and the upper quartile; at least 1. `None` where it was not measured.
    fn inflation(&self, stage: &str) -> Option<[f64; 3]> {
        let of = |runs: &[Run]| -> Vec<f64> { runs.iter().map(|run| run.parallel_work(stage)).collect() };
        let (one, two) = (of(&self.one), of(&self.two));
        let least = |works: &[f64]| works.iter().copied().reduce(f64::min).filter(|&work| work > 0.0);
        let fastest = least(&two)? / least(&one)?;
        let mut pairs: Vec<f64> = one.iter().zip(&two).map(|(one, two)| two / one).collect();
        pairs.sort_by(f64::total_cmp);
        let quartiles = [pairs[pairs.len() / 4], pairs[pairs.len() - 1 - pairs.len() / 4]];
        let all = [quartiles[0].min(fastest), fastest, quartiles[1].max(fastest)];
        Some(all.map(|inflation| inflation.max(1.0)))
    }
}

fn fastest(runs: &[Run]) -> Option<f64> {
    runs.iter().map(|run| run.elapsed).reduce(f64::min).filter(|&elapsed| elapsed > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run of 10 ms, then `tasks` beside each other, then 10 ms.
    fn records(tasks: u32, millis: u64) -> Vec<TaskRecord> {
        let record = |millis, waits_for: Vec<u32>, depth| TaskRecord {
            stage: "made",
            start: Duration::from_millis(5),
            end: Duration::from_millis(5 + millis),
            waits_for,
            depth,
            parts: 1,
        };
        let mut records = vec![record(10, Vec::new(), 0)];
        records.extend((0..tasks).map(|_| record(millis, vec![0], 1)));
        records.push(record(10, (1..=tasks).collect(), 0));
        records
    }

    const fn ms(millis: u64) -> Duration {
        Duration::from_millis(millis)
    }

    #[test]
    fn the_curve_follows_from_work_and_inflation() {
        let mut runs = Runs::default();
        // 20 ms serial and 8 · 10 ms parallel; with two cores each task takes 11 ms.
        runs.add(1, &records(8, 10), ms(100));
        runs.add(1, &records(8, 20), ms(180));
        runs.add(2, &records(8, 11), ms(64));
        runs.add(2, &records(8, 22), ms(200));
        let found = runs.predict(&Prices { fork: 0.0, steal: Some([0.0; 2]) });
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6 * b;
        assert!(near(found.work_ms, 100.0) && near(found.span_ms, 30.0) && near(found.serial_share, 0.2));
        assert!(found.stages[0].inflation.is_some_and(|inflation| near(inflation, 1.1)));
        let [one, two, .., last] = &found.curve[..] else { unreachable!("{found:?}") };
        assert!(near(one.speedup, 1.0) && near(one.lower, 1.0) && near(one.upper, 1.0));
        assert!(near(two.speedup, 100.0 / 64.0) && found.difference_at_two().is_some_and(|by| by.abs() < 1e-6));
        // All eight tasks at once: 10 + 13 + 10, each doubling adds 1; at worst 10 + 17 + 10, at best 10 + 11 + 10.
        assert!(near(last.speedup, 100.0 / 33.0) && near(last.lower, 100.0 / 37.0) && near(last.upper, 100.0 / 31.0));
        assert!(found.curve.windows(2).all(|pair| pair[0].lower <= pair[1].upper));
    }

    #[test]
    fn one_thread_alone_gives_work_and_span() {
        let mut runs = Runs::default();
        runs.add(1, &records(4, 20), ms(100));
        let found = runs.predict(&Prices { fork: 0.0, steal: None });
        assert_eq!((found.measured_at_two, found.difference_at_two(), found.stages[0].inflation), (None, None, None));
        assert!(found.at(4).is_some_and(|point| (point.speedup - 2.5).abs() < 1e-6 && point.lower == point.upper));
        let nothing = Runs::default().predict(&Prices { fork: 0.0, steal: None });
        assert_eq!((nothing.work_ms, nothing.serial_share), (0.0, 0.0));
    }
}
