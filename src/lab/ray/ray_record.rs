//! A recorded ray.

use super::span::{Span, Visit};
use super::step::{RayStep, Step};
use crate::render::Crossings;
use bvhscope_engine::geometry::Ray;
use bvhscope_engine::tree::traverse::{RayEvent, TestCounts};
use bvhscope_engine::wide::trace::CacheLines;

/// Length of the surroundings of a hit, in lengths of the ray in the leaf there.
const AROUND_HIT: f32 = 8.0;

/// A ray with all that its traversal did.
#[derive(Debug, Clone, PartialEq)]
pub struct RayRecord {
    /// The ray. Its interval is the part that the section plane leaves.
    pub ray: Ray,
    /// The steps in order, of a ray that visits most of a large tree only the first million.
    pub steps: Vec<RayStep>,
    /// Steps beyond these, of which only the tests are counted.
    pub omitted: u64,
    /// The containers that the ray enters, in the order in which they are found.
    pub spans: Vec<Span>,
    /// Distance and index of the triangle that is hit: the nearest, or of an occlusion ray the first that was found.
    pub hit: Option<(f32, u32)>,
    /// All triangles that it would hit if none ended it.
    pub crossings: Crossings,
    /// Number of tests in all.
    pub counts: TestCounts,
    /// Cache lines that it reads of the wide tree, each once; `None` where it is traced through the binary one.
    pub lines: Option<CacheLines>,
}

impl RayRecord {
    /// Number of containers that were visited, of those wasted, and of those entered but never visited.
    pub fn visits(&self) -> [usize; 3] {
        let of = |visit: Visit| self.spans.iter().filter(|span| span.visit == visit).count();
        let wasted = of(Visit::Wasted);
        [of(Visit::Useful) + wasted, wasted, of(Visit::Skipped)]
    }

    /// The nodes on the stack after `step`, the top first, by their span.
    pub fn stack_after(&self, step: usize) -> Vec<u32> {
        let mut stack = Vec::new();
        for step in self.steps.iter().take(step + 1) {
            match step.what {
                Step::Event(RayEvent::Push { .. }) => stack.extend(step.span),
                Step::Event(RayEvent::Pop { .. }) => {
                    stack.pop();
                }
                Step::Again { .. } => stack.clear(),
                Step::Event(_) => {}
            }
        }
        stack.reverse();
        stack
    }

    /// The next step after `step` in which a hit becomes the nearest.
    pub fn next_hit(&self, step: usize) -> Option<usize> {
        let is_hit = |step: &RayStep| matches!(step.what, Step::Event(RayEvent::Nearer { .. }));
        self.steps.iter().skip(step + 1).position(is_hit).map(|at| at + step + 1)
    }

    /// First and last distance around the hit: some times the length of the leaf that holds it, in which the ray's last steps are.
    /// `None` of a ray that hits nothing.
    pub fn around_hit(&self) -> Option<[f32; 2]> {
        let (hit, _) = self.hit?;
        let [first, last] = self.reach();
        let holds = |span: &&Span| span.visit == Visit::Useful && span.t[0] <= hit && hit <= span.t[1];
        let lengths = self.spans.iter().filter(holds).map(|span| span.t[1] - span.t[0]);
        let shortest = lengths.fold(last - first, f32::min);
        // Not below what single precision can tell apart, and always closer than the whole ray.
        let length = (shortest * AROUND_HIT).clamp((last - first) * 1e-4, (last - first) * 0.25);
        let from = (hit - length * 0.7).clamp(first, last - length);
        Some([from, from + length])
    }

    /// First and last distance that are of interest: the part of the ray in the root's container, with a margin, from its start on
    /// where that is near.
    pub fn reach(&self) -> [f32; 2] {
        let Some(root) = self.spans.first() else { return [0.0, 1.0] };
        let margin = 0.05 * (root.t[1] - root.t[0]).max(f32::MIN_POSITIVE);
        [(root.t[0] - margin).max(self.ray.t_min.max(0.0)), root.t[1] + margin]
    }
}
