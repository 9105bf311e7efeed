//! One measured row as a sentence.

use super::format::{number, short, threads};
use crate::catalog::numbers::rows::{BUILD_MS, TESTS_PER_RAY, TRACE_MS};
use crate::lab::measurement::Measurement;
use bvhscope_engine::settings::{Curve, Passes};

/// One measurement as a sentence, printed while the table is incomplete.
pub fn summary(row: &Measurement) -> String {
    let tree = match row.builder.as_str() {
        builder if row.tree.is_some() => format!("{}, {builder}", row.container.name()),
        "aac" => {
            let curve = if row.curve == Curve::Morton { String::new() } else { format!(", {}", row.curve.name()) };
            let passes = if row.optimize == Passes::NONE { String::new() } else { format!(", {}", row.optimize) };
            format!("{}, δ {}, ε {}{curve}{passes}", row.container.name(), row.threshold, row.epsilon)
        }
        "none" => "without BVH".to_owned(),
        builder => format!("{}, {builder}", row.container.name()),
    };
    format!(
        "{}, {tree}, {}: build {} ms, trace {} ms, {} tests per ray",
        short(&row.model),
        threads(row.threads),
        number(row.number(BUILD_MS)),
        number(row.number(TRACE_MS)),
        number(row.number(TESTS_PER_RAY))
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::sample::sample;

    #[test]
    fn a_row_is_a_sentence() {
        let times = "build 20.00 ms, trace 50.00 ms, 29.50 tests per ray";
        let plain = Measurement { curve: Curve::Morton, optimize: Passes::NONE, threads: 1, ..sample() };
        assert_eq!(summary(&sample()), format!("thing.obj, box, δ 11, ε 0.25, hilbert, collapse, 3 threads: {times}"));
        assert_eq!(summary(&plain), format!("thing.obj, box, δ 11, ε 0.25, 1 thread: {times}"));
        let other = |builder: &str| Measurement { builder: builder.to_owned(), ..sample() };
        assert_eq!(summary(&other("lbvh")), format!("thing.obj, box, lbvh, 3 threads: {times}"));
        assert_eq!(summary(&other("none")), format!("thing.obj, without BVH, 3 threads: {times}"));
    }
}
