//! All hits of a ray.

use std::cmp::Ordering;
use std::ops::ControlFlow;

use crate::geometry::{Hit, PreparedRay, Ray};
use crate::kernel::simd::baseline;
use crate::tree::traverse::{LeafTriangles, NoProbe, Probe, walk, with_stack};
use crate::tree::{Container, Tree};

/// A hit as lists order it.
pub(crate) trait Listed: Copy {
    /// Distance along the ray.
    fn t(&self) -> f32;
    /// The thing that is hit; of equal distances the lower one comes first.
    fn index(&self) -> impl Ord;
}

impl Listed for Hit {
    fn t(&self) -> f32 {
        self.t
    }

    fn index(&self) -> impl Ord {
        self.primitive_index
    }
}

/// The hits of a ray that a traversal has found so far, of which the nearest `max` are wanted.
pub(crate) struct HitList<'a, H = Hit> {
    hits: &'a mut Vec<H>,
    max: usize,
    /// Number of hits at which those too many are dropped.
    room: usize,
    t_max: f32,
}

impl<'a, H: Listed> HitList<'a, H> {
    /// No hit yet within `t_max`. Replaces what `hits` held.
    pub(crate) fn new(hits: &'a mut Vec<H>, max: usize, t_max: f32) -> Self {
        hits.clear();
        // A hit has a finite distance.
        // So many more than are wanted that each hit is sorted a few times at most.
        let room = max.saturating_mul(2).saturating_add(64);
        Self { hits, max, room, t_max: t_max.min(f32::MAX) }
    }

    /// Distance up to which hits are wanted.
    #[inline(always)]
    pub(crate) fn t_max(&self) -> f32 {
        self.t_max
    }

    /// Whether a hit can be too many.
    pub(crate) fn is_limited(&self) -> bool {
        self.max < usize::MAX
    }

    /// Adds a hit no farther than [`HitList::t_max`]. That of a triangle in several leaves may come several times.
    #[inline(always)]
    pub(crate) fn add(&mut self, hit: H) {
        self.hits.push(hit);
        if self.hits.len() >= self.room {
            self.shrink();
        }
    }

    /// Sorts the hits, and keeps one more than are wanted, as a sign that there are more.
    #[cold]
    fn shrink(&mut self) {
        self.hits.sort_unstable_by(by_distance);
        self.hits.dedup_by(|a, b| a.index() == b.index());
        if self.hits.len() > self.max {
            self.hits.truncate(self.max + 1);
            self.t_max = self.hits[self.max].t();
        }
    }

    /// Leaves the nearest hits in the list, in order. Returns whether there are more.
    pub(crate) fn finish(mut self) -> bool {
        self.shrink();
        let has_more = self.hits.len() > self.max;
        self.hits.truncate(self.max);
        has_more
    }
}

/// The hits of many rays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HitLists {
    /// The hits, ray by ray, those of one ray by distance.
    pub hits: Vec<Hit>,
    /// For each ray the number of hits of it and the rays before it.
    pub ends: Vec<usize>,
    /// For each ray whether it has more hits than were wanted.
    pub has_more: Vec<bool>,
}

impl HitLists {
    /// The hits of ray number `ray`.
    ///
    /// # Panics
    ///
    /// If there are no more than `ray` rays.
    pub fn of(&self, ray: usize) -> &[Hit] {
        let start = ray.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.hits[start..self.ends[ray]]
    }

    /// Forgets all rays; the memory is used again.
    pub(crate) fn clear(&mut self) {
        self.hits.clear();
        self.ends.clear();
        self.has_more.clear();
    }

    /// Adds a ray's hits.
    pub(crate) fn push(&mut self, hits: &[Hit], has_more: bool) {
        self.hits.extend_from_slice(hits);
        self.ends.push(self.hits.len());
        self.has_more.push(has_more);
    }
}

/// The nearer hit first, of equal distances that of the lower index.
fn by_distance<H: Listed>(a: &H, b: &H) -> Ordering {
    a.t().partial_cmp(&b.t()).unwrap_or(Ordering::Equal).then(a.index().cmp(&b.index()))
}

/// The hits of `ray` with the triangles of `tree` between its `t_min` and `t_max`, into `hits`: each triangle once, by distance, at equal
/// distances by index, at most the `max` nearest. Returns whether there are more. `tree` may have any arity.
pub fn all_hits<C: Container>(
    tree: &Tree<C>,
    leaf_triangles: impl LeafTriangles,
    ray: &Ray,
    max: usize,
    hits: &mut Vec<Hit>,
) -> bool {
    all_hits_counted(tree, leaf_triangles, ray, max, hits, &mut NoProbe)
}

/// [`all_hits`], observed by `probe`.
pub fn all_hits_counted<C: Container, P: Probe>(
    tree: &Tree<C>,
    leaf_triangles: impl LeafTriangles,
    ray: &Ray,
    max: usize,
    hits: &mut Vec<Hit>,
    probe: &mut P,
) -> bool {
    let ray = PreparedRay::new(*ray);
    let mut list = HitList::new(hits, max, ray.ray.t_max);
    with_stack(tree.max_depth, |stack| {
        walk::<_, C, P, true, false>(baseline(), tree, &ray, stack, probe, |slots, shear, probe| {
            for (offset, triangle) in leaf_triangles.in_slots(slots.clone()).enumerate() {
                probe.primitive_test();
                let index = tree.primitive_indices[slots.start + offset];
                let hit = triangle.intersect(&ray, shear, list.t_max());
                if P::EVENTS {
                    probe.tested(index, hit.map(|hit| hit.t));
                }
                if let Some(hit) = hit {
                    list.add(hit.of(index));
                }
            }
            ControlFlow::Continue(list.t_max())
        });
    });
    list.finish()
}
