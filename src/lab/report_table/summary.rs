//! One measured row as a sentence.

use super::format::{number, short, threads};
use crate::lab::measurement::Measurement;
use bvhscope_engine::settings::{Curve, Passes};

/// One measurement as a sentence, printed while the table is incomplete.
pub fn summary(row: &Measurement) -> String {
    let tree = match row.builder.as_str() {
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
        number(row.build_ms),
        number(row.trace_ms),
        number(row.tests_per_ray)
    )
}
