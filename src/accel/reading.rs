//! The tree of a scene as the source of its numbers.

use super::Accel;
use crate::catalog::reading::{Times, TreeReading, WideReading};

impl Accel {
    /// The source of its numbers, without rays. End-point overlap and wide tree are in it once they are known.
    pub fn reading(&self) -> TreeReading<'_> {
        let build_ms = self.build_ms();
        let whole_ms = self.whole_builds().map(|times| times.ms).or(build_ms);
        let wide = self.known_wide().map(WideReading::of);
        let stages = self.report.stages.stages.iter();
        TreeReading {
            triangles: self.scene.triangles.len(),
            report: &self.report,
            build: self.whole_builds().or(build_ms.map(Times::single)),
            stages_ms: stages.map(|&(name, time)| (name.to_owned(), time.as_secs_f64() * 1e3)).collect(),
            ready_ms: whole_ms.zip(wide).map(|(build_ms, wide)| build_ms + wide.collapse_ms),
            epo: self.known_epo(),
            hashes: None,
            wide,
            trace: None,
            entering_tests: self.entering_tests(),
        }
    }
}
