//! The walker: one ray through a laid tree, counting what it visits, tests and reads.

use std::ops::AddAssign;

use super::lay::LaidTree;
use super::layout::TRIANGLE_BYTES;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Hit, PreparedRay, Ray, Shear, Triangle};
use crate::kernel::SimdLevel;
use crate::kernel::parallel::par_tasks_with;
use crate::tree::traverse::Nearest;
use crate::wide::AnyWideTree;
use crate::wide::trace::{CacheLines, LINE_BYTES, count_distinct};

/// Rays per task and between two polls for cancellation.
const RAYS_PER_TASK: usize = 1 << 9;
/// Bytes of the lines that are counted: of most processors, and of GPUs.
const LINES: [usize; 2] = [LINE_BYTES, 2 * LINE_BYTES];

/// The query that a ray makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LaidQuery {
    /// The closest hit: the nearest child first, and nothing behind the nearest hit so far.
    Closest,
    /// Whether there is any hit: the farthest child first.
    Any,
    /// The closest hit, found by visiting everything that the ray enters: of random lines, which the surface area heuristic assumes.
    Through,
}

/// A ray, what is asked of it, and the number of rays that it stands for.
pub type LaidRay = (Ray, LaidQuery, u32);

/// Nodes that rays visit, tests, and lines and bytes that they read, in all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RayCounts {
    /// Nodes visited that have children, each with all of its boxes.
    pub nodes: u64,
    /// Boxes tested: the children of these nodes.
    pub container_tests: u64,
    /// Leaves visited.
    pub leaves: u64,
    /// Triangles tested.
    pub triangle_tests: u64,
    /// Tests of blocks of triangles; of a described layout each triangle is one.
    pub block_tests: u64,
    /// Bytes of the nodes visited and of the triangles tested.
    pub bytes: u64,
    /// Distinct lines of 64 bytes and of 128 that these lie in, counted for each ray as if none were cached before.
    pub lines: [CacheLines; 2],
    /// Most nodes that wait on the stack of one ray.
    pub greatest_stack: u64,
}

impl RayCounts {
    /// The counts of as many such rays.
    fn of(self, rays: u32) -> Self {
        let all = |count: u64| count * u64::from(rays);
        let of_lines = |lines: CacheLines| CacheLines { nodes: all(lines.nodes), triangles: all(lines.triangles) };
        Self {
            nodes: all(self.nodes),
            container_tests: all(self.container_tests),
            leaves: all(self.leaves),
            triangle_tests: all(self.triangle_tests),
            block_tests: all(self.block_tests),
            bytes: all(self.bytes),
            lines: self.lines.map(of_lines),
            greatest_stack: if rays > 0 { self.greatest_stack } else { 0 },
        }
    }
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, other: Self) {
        self.nodes += other.nodes;
        self.container_tests += other.container_tests;
        self.leaves += other.leaves;
        self.triangle_tests += other.triangle_tests;
        self.block_tests += other.block_tests;
        self.bytes += other.bytes;
        for (own, other) in self.lines.iter_mut().zip(other.lines) {
            *own += other;
        }
        self.greatest_stack = self.greatest_stack.max(other.greatest_stack);
    }
}

/// Counts of many rays through a laid tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MeasuredLayout {
    /// Number of rays, each as many times as rays it stands for.
    pub rays: u64,
    /// Their counts.
    pub counts: RayCounts,
    /// Rays that hit something.
    pub hits: u64,
    /// Rays whose hit is another one than that of the engine's own wide tree: none, unless nodes of the tree do not enclose what is below
    /// them, as those of a file may.
    pub differing_hits: u64,
}

/// Memory of a walk, which rays use one after the other.
#[derive(Debug, Default)]
pub struct WalkMemory {
    /// Nodes that wait, with their distances of entry.
    stack: Vec<Waiting>,
    entered: Vec<Waiting>,
    /// First and last byte of each record read: of nodes of either form, and of triangles.
    read: [Vec<[usize; 2]>; 3],
}

impl WalkMemory {
    /// The distinct lines of 64 bytes and of 128 that were read since these were last taken.
    pub fn take_lines(&mut self) -> [CacheLines; 2] {
        for records in &mut self.read {
            records.sort_unstable();
        }
        let found = LINES.map(|bytes| {
            let [full, compact, triangles] = self
                .read
                .each_ref()
                .map(|records| count_distinct(records.iter().map(|[first, last]| [first / bytes, last / bytes])));
            CacheLines { nodes: full + compact, triangles }
        });
        self.read.iter_mut().for_each(Vec::clear);
        found
    }
}

/// A node that a ray enters.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    entry: f32,
    reference: u32,
    node: u32,
}

impl Waiting {
    /// Nearer ones first; distances are not negative.
    fn order(&self) -> (u32, u32) {
        (self.entry.to_bits(), self.reference)
    }
}

impl LaidTree {
    /// The hit of `ray`, of [`LaidQuery::Any`] any one, and what it takes to find it. `leaf_triangles` are those of
    /// [`Tree::leaf_triangles`](crate::tree::Tree::leaf_triangles).
    pub fn trace(
        &self,
        leaf_triangles: &[Triangle],
        ray: &Ray,
        query: LaidQuery,
        memory: &mut WalkMemory,
    ) -> (Option<Hit>, RayCounts) {
        let mut counts = RayCounts::default();
        let hit = self.walk(leaf_triangles, ray, query, memory, &mut counts);
        counts.lines = memory.take_lines();
        (hit, counts)
    }

    /// The hit of `ray` as in [`LaidTree::trace`], adding all that it takes to `counts` but the lines, which `memory` goes on collecting
    /// until [`WalkMemory::take_lines`]: those that several walks read count once.
    pub fn walk(
        &self,
        leaf_triangles: &[Triangle],
        ray: &Ray,
        query: LaidQuery,
        memory: &mut WalkMemory,
        counts: &mut RayCounts,
    ) -> Option<Hit> {
        let ray = PreparedRay::new(*ray);
        let mut nearest = Nearest::new(ray.ray.t_max);
        if self.tree.nodes.is_empty() || !ray.can_hit() {
            return None;
        }
        let shear = Shear::new(ray.ray.direction);
        let WalkMemory { stack, entered, read } = memory;
        stack.clear();
        let mut current = 0;
        'visit: loop {
            let node = &self.tree.nodes[current];
            if node.is_leaf() {
                counts.leaves += 1;
                for first in node.slots().step_by(self.block) {
                    let block = first..node.slots().end.min(first + self.block);
                    counts.block_tests += 1;
                    counts.triangle_tests += block.len() as u64;
                    counts.bytes += (block.len() * TRIANGLE_BYTES) as u64;
                    read[2].push([block.start * TRIANGLE_BYTES, block.end * TRIANGLE_BYTES - 1]);
                    for (triangle, slot) in leaf_triangles[block.clone()].iter().zip(block) {
                        if let Some(hit) = triangle.intersect(&ray, &shear, nearest.t()) {
                            nearest.offer(hit, self.tree.primitive_indices[slot]);
                        }
                    }
                    if query == LaidQuery::Any && nearest.found() {
                        break 'visit;
                    }
                }
            } else {
                counts.nodes += 1;
                counts.container_tests += u64::from(node.arity());
                let (form, record) = self.record(current);
                let bytes = self.node_bytes[form];
                counts.bytes += bytes as u64;
                read[form].push([record * bytes, (record + 1) * bytes - 1]);
                let t_max = if query == LaidQuery::Through { Nearest::new(ray.ray.t_max).t() } else { nearest.t() };
                entered.clear();
                for child in node.children() {
                    if let Some(entry) = self.tree.nodes[child as usize].container.entry(&ray, ray.ray.t_min, t_max) {
                        entered.push(Waiting { entry, reference: self.references[child as usize], node: child });
                    }
                }
                if let Some(next) = push_all_but_next(entered, query, stack) {
                    counts.greatest_stack = counts.greatest_stack.max(stack.len() as u64);
                    current = next.node as usize;
                    continue;
                }
            }
            current = loop {
                let Some(waiting) = stack.pop() else { break 'visit };
                if query != LaidQuery::Closest || waiting.entry <= nearest.t() {
                    break waiting.node as usize;
                }
            };
        }
        nearest.hit()
    }

    /// Takes `count` rays through the tree, `ray` giving each by its index, and compares their hits with those of `wide`, the engine's own
    /// tree over the same triangles. In parallel in the calling thread's rayon pool; the same on any number of threads. Rays that stand
    /// for none are not traced. Reports progress through `token`.
    pub fn measure(
        &self,
        leaf_triangles: &[Triangle],
        wide: &AnyWideTree,
        count: usize,
        ray: impl Fn(usize) -> LaidRay + Sync,
        token: &CancelToken,
    ) -> Result<MeasuredLayout, Cancelled> {
        let level = SimdLevel::best().level();
        let tasks = (0..count).step_by(RAYS_PER_TASK);
        let parts = par_tasks_with(tasks, token, WalkMemory::default, |memory, first, token| {
            token.check()?;
            let mut measured = MeasuredLayout::default();
            for index in first..count.min(first + RAYS_PER_TASK) {
                let (ray, query, weight) = ray(index);
                if weight == 0 {
                    continue;
                }
                let (hit, counts) = self.trace(leaf_triangles, &ray, query, memory);
                let is_same = match query {
                    LaidQuery::Any => hit.is_some() == wide.any_hit(level, &ray),
                    LaidQuery::Closest | LaidQuery::Through => hit == wide.closest_hit(level, &ray),
                };
                measured.rays += u64::from(weight);
                measured.counts += counts.of(weight);
                measured.hits += u64::from(weight) * u64::from(hit.is_some());
                measured.differing_hits += u64::from(!is_same);
            }
            Ok(measured)
        })?;
        Ok(parts.into_iter().fold(MeasuredLayout::default(), |mut sum, part| {
            sum.rays += part.rays;
            sum.counts += part.counts;
            sum.hits += part.hits;
            sum.differing_hits += part.differing_hits;
            sum
        }))
    }
}

/// Pushes those of `entered` that are to be visited later, the next of them last, and returns the one to visit now. As in the engine's
/// own tree, a ray that looks for any hit goes to the farthest child, of several the last, and leaves the others in their order.
fn push_all_but_next(entered: &mut [Waiting], query: LaidQuery, stack: &mut Vec<Waiting>) -> Option<Waiting> {
    if query != LaidQuery::Any {
        entered.sort_unstable_by_key(Waiting::order);
        let (next, others) = entered.split_first()?;
        stack.extend(others.iter().rev());
        return Some(*next);
    }
    let (first, others) = entered.split_first()?;
    let mut next = *first;
    for &other in others {
        let mut other = other;
        if other.entry >= next.entry {
            std::mem::swap(&mut other, &mut next);
        }
        stack.push(other);
    }
    Some(next)
}
