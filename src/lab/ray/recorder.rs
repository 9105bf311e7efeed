//! Keeps the steps of a traversal with the tests counted up to each.

use super::step::Step;
use bvhscope_engine::tree::traverse::{Probe, RayEvent, TestCounts};
use bvhscope_engine::wide::AnyWideTree;
use bvhscope_engine::wide::trace::LineProbe;

/// Largest number of steps that are kept: 56 MB. The paper's order visits all that a ray enters, in the worst case the whole tree.
const MAX_STEPS: usize = 1_000_000;

/// Records the steps of one ray, also where it is traced in several parts.
#[derive(Debug)]
pub(super) struct Recorder<'a> {
    /// The steps, each with the tests up to it.
    pub(super) steps: Vec<(Step, TestCounts)>,
    /// Steps that were too many to keep.
    pub(super) omitted: u64,
    /// Tests as the traversal counts them.
    pub(super) counts: TestCounts,
    /// Tests of the steps so far, where each is one test: not in the wide tree.
    of_steps: TestCounts,
    /// Cache lines that are read of the wide tree, where that is traced.
    pub(super) lines: Option<LineProbe<'a>>,
}

impl<'a> Recorder<'a> {
    /// Of a ray through the wide tree, or else through the binary one.
    pub(super) fn new(wide: Option<&'a AnyWideTree>) -> Self {
        let (counts, of_steps) = Default::default();
        Self { steps: Vec::new(), omitted: 0, counts, of_steps, lines: wide.map(LineProbe::new) }
    }

    /// The ray is traced from `t` on: again, if it was before.
    pub(super) fn begin(&mut self, t: f32) {
        if !self.steps.is_empty() {
            self.keep(Step::Again { t });
        }
    }

    fn keep(&mut self, step: Step) {
        if self.steps.len() < MAX_STEPS {
            self.steps.push((step, if self.lines.is_some() { self.counts } else { self.of_steps }));
        } else {
            self.omitted += 1;
        }
    }
}

impl Probe for Recorder<'_> {
    const EVENTS: bool = true;

    fn container_test(&mut self) {
        self.counts.container_test();
    }
    fn primitive_test(&mut self) {
        self.counts.primitive_test();
        self.lines.iter_mut().for_each(Probe::primitive_test);
    }
    fn event(&mut self, event: RayEvent) {
        if let (Some(lines), RayEvent::Visit { node }) = (&mut self.lines, event) {
            lines.visited(node);
        }
        // The containers of siblings are tested at once, but are steps one after the other.
        self.of_steps.containers += u64::from(matches!(event, RayEvent::Enter { .. } | RayEvent::Miss { .. }));
        self.of_steps.primitives += u64::from(matches!(event, RayEvent::Triangle { .. }));
        self.keep(Step::Event(event));
    }
}
