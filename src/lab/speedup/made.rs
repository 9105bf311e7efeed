//! Task graphs made by hand, for tests.

use super::graph::{Task, TaskGraph};

fn task(work: f64, waits_for: Vec<u32>, is_forked: bool, is_serial: bool) -> Task {
    Task { stage: 0, work, waits_for, parts: 1, is_forked, is_serial }
}

/// Tasks one after another.
pub fn chain(works: &[f64]) -> TaskGraph {
    let before = |index: u32| if index > 0 { vec![index - 1] } else { Vec::new() };
    let tasks = works.iter().zip(0..).map(|(&work, index)| task(work, before(index), false, true)).collect();
    TaskGraph { tasks, stages: vec!["made"] }
}

/// Tasks that wait for nothing.
pub fn independent(works: &[f64]) -> TaskGraph {
    TaskGraph { tasks: works.iter().map(|&work| task(work, Vec::new(), true, false)).collect(), stages: vec!["made"] }
}

/// A task, then some beside each other, then one more.
pub fn fork_join(before: f64, works: &[f64], after: f64) -> TaskGraph {
    let mut tasks = vec![task(before, Vec::new(), false, true)];
    tasks.extend(works.iter().map(|&work| task(work, vec![0], true, false)));
    tasks.push(task(after, (1..=works.len() as u32).collect(), false, true));
    TaskGraph { tasks, stages: vec!["made"] }
}
