//! One measured row as a sentence.

use super::format::{number, short, threads};
use crate::catalog::numbers::rows::{BUILD_MS, POPULATION_TESTS_PER_RAY, READY_MS, TESTS_PER_ENTERING_RAY, TRACE_MS};
use crate::lab::measurement::Measurement;

/// One measurement as a sentence, printed while the table is incomplete.
pub fn summary(row: &Measurement) -> String {
    if let Some(motion) = row.motion.as_ref().filter(|_| row.command == "animate") {
        return format!(
            "{}, {}, {}, frame {} ({} s): ready after {} ms, {} tests a ray",
            short(&row.model),
            row.container.name(),
            motion.policy.name(),
            motion.frame,
            number(motion.time_s.into()),
            number(row.number(READY_MS)),
            number(row.number(POPULATION_TESTS_PER_RAY))
        );
    }
    let tree = match row.builder.as_str() {
        "none" => "without BVH".to_owned(),
        builder => {
            let mut parts = vec![row.container.name().to_owned()];
            let name = row.label.clone().or_else(|| row.file_name());
            parts.extend(name.or_else(|| (builder != "aac").then(|| builder.to_owned())));
            parts.extend(row.settings.by_symbol());
            parts.extend(row.settings.by_name());
            parts.join(", ")
        }
    };
    format!(
        "{}, {tree}, {}: build {} ms, trace {} ms, {} tests per entering ray",
        short(&row.model),
        threads(row.threads),
        number(row.number(BUILD_MS)),
        number(row.number(TRACE_MS)),
        number(row.number(TESTS_PER_ENTERING_RAY))
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::settings::{CURVE, OPTIMIZE, Stated};
    use crate::lab::sample::sample;
    use bvhscope_engine::settings::{BuildSettings, BuilderKind};

    #[test]
    fn a_frame_is_a_sentence() {
        let row = Measurement { command: "animate".to_owned(), ..sample() };
        let expected = "thing.obj, box, rotate, frame 37 (1.500 s): ready after 23.75 ms, 33.50 tests a ray";
        assert_eq!(summary(&row), expected);
    }

    #[test]
    fn a_row_is_a_sentence() {
        let times = "build 20.00 ms, trace 50.00 ms, 41.50 tests per entering ray";
        let settings = sample().settings.with(&CURVE, "morton").with(&OPTIMIZE, "none");
        let plain = Measurement { settings, threads: 1, ..sample() };
        assert_eq!(summary(&sample()), format!("thing.obj, box, δ 11, ε 0.25, hilbert, collapse, 3 threads: {times}"));
        assert_eq!(summary(&plain), format!("thing.obj, box, δ 11, ε 0.25, 1 thread: {times}"));
        let other = |builder: BuilderKind| {
            let settings = Stated::of(&BuildSettings { builder, ..BuildSettings::default() });
            Measurement { builder: builder.name().to_owned(), settings, ..sample() }
        };
        assert_eq!(summary(&other(BuilderKind::Lbvh)), format!("thing.obj, box, lbvh, 3 threads: {times}"));
        assert_eq!(summary(&other(BuilderKind::None)), format!("thing.obj, without BVH, 3 threads: {times}"));
    }
}
