//! The tree of a scene as the source of its numbers.

use super::Accel;
use crate::catalog::reading::{Times, TreeReading, WideReading};

impl Accel {
    /// The source of its numbers, without rays. End-point overlap and wide tree are in it once they are known.
    pub fn reading(&self) -> TreeReading<'_> {
        let build_ms = self.build_ms();
        let build = self.whole_builds().map(|builds| builds.times).or(build_ms.map(Times::single));
        let wide = self.known_wide().map(WideReading::of);
        TreeReading {
            triangles: self.scene.built_triangles().len(),
            primitives: self.scene.primitive_names(),
            container: self.tree.container_kind(),
            report: &self.report,
            build,
            is_update: self.is_followed(),
            stages_ms: self.stages().iter().map(|&(name, time)| (name.to_owned(), time.as_secs_f64() * 1e3)).collect(),
            ready_ms: build.zip(wide).map(|(build, wide)| build.ms + wide.collapse_ms),
            epo: self.known_epo(),
            hashes: None,
            wide,
            trace: None,
            entering: self.entering(),
            at_rest: self.at_rest().map(|readings| (readings.rays, readings.traces)),
        }
    }
}
