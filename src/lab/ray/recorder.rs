//! Keeps the steps of a traversal with the tests counted up to each.

use super::step::Step;
use bvhscope_engine::tree::traverse::{Probe, RayEvent, TestCounts};

/// Largest number of steps that are kept: 56 MB. The paper's order visits all that a ray enters, in the worst case the whole tree.
const MAX_STEPS: usize = 1_000_000;

/// Records the steps of one ray, also where it is traced in several parts.
#[derive(Debug)]
pub(super) struct Recorder {
    /// The steps, each with the tests up to it.
    pub(super) steps: Vec<(Step, TestCounts)>,
    /// Steps that were too many to keep.
    pub(super) omitted: u64,
    /// Tests as the traversal counts them.
    pub(super) counts: TestCounts,
    /// Tests of the steps so far, where each is one test: not in the wide tree.
    of_steps: TestCounts,
    is_wide: bool,
}

impl Recorder {
    pub(super) fn new(is_wide: bool) -> Self {
        Self { steps: Vec::new(), omitted: 0, counts: TestCounts::default(), of_steps: TestCounts::default(), is_wide }
    }

    /// The ray is traced from `t` on: again, if it was before.
    pub(super) fn begin(&mut self, t: f32) {
        if !self.steps.is_empty() {
            self.keep(Step::Again { t });
        }
    }

    fn keep(&mut self, step: Step) {
        if self.steps.len() < MAX_STEPS {
            self.steps.push((step, if self.is_wide { self.counts } else { self.of_steps }));
        } else {
            self.omitted += 1;
        }
    }
}

impl Probe for Recorder {
    const EVENTS: bool = true;

    fn container_test(&mut self) {
        self.counts.container_test();
    }
    fn primitive_test(&mut self) {
        self.counts.primitive_test();
    }
    fn event(&mut self, event: RayEvent) {
        // The containers of siblings are tested at once, but are steps one after the other.
        self.of_steps.containers += u64::from(matches!(event, RayEvent::Enter { .. } | RayEvent::Miss { .. }));
        self.of_steps.primitives += u64::from(matches!(event, RayEvent::Triangle { .. }));
        self.keep(Step::Event(event));
    }
}
