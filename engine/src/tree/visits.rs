//! How often rays visit each node, measured and as the surface area heuristic predicts it.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS, TaskProgress};
use crate::geometry::Ray;
use crate::kernel::parallel::{par_collect, par_tasks};

use super::node::Tree;
use super::node_metrics::{area_share, visit_cost};
use super::traverse::{LeafTriangles, Probe, Traversal, any_hit_with, closest_hit};
use crate::geometry::Container;

/// Purpose of rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RayQuery {
    /// The closest hit, as rays from a camera.
    ClosestHit(Traversal),
    /// Whether there is any hit, as shadow rays.
    AnyHit,
}

/// Number of visits of each node by a number of rays.
///
/// A ray visits a node when its traversal goes into it: the root if the ray enters its container, another node if the ray enters its
/// container and it is not culled before its turn comes. A root that is a leaf has no container test, and every ray that can hit
/// anything visits it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Visits {
    /// Number of visits of each node, in the order of [`Tree::nodes`].
    pub counts: Vec<u32>,
    /// Number of rays that were traced.
    pub rays: u32,
}

impl Visits {
    /// Number of rays that entered the root's container.
    pub fn root_hits(&self) -> u32 {
        self.counts.first().copied().unwrap_or(0)
    }

    /// Number of visits of `node` that the surface area heuristic predicts: area(node) / area(root) · rays that enter the root
    /// (Goldsmith and Salmon: *Automatic Creation of Object Hierarchies*, 1987). It holds for lines that are equally likely to come
    /// from everywhere and are unoccluded: measured visits differ from it by what the heuristic leaves out.
    pub fn predicted<C: Container>(&self, tree: &Tree<C>, node: u32) -> f64 {
        f64::from(area_share(tree, node)) * f64::from(self.root_hits())
    }

    /// Number of visits of all nodes, measured and by [`Visits::predicted`]. Takes a pass over the tree.
    pub fn sums<C: Container>(&self, tree: &Tree<C>, token: &CancelToken) -> Result<(u64, f64), Cancelled> {
        let (mut measured, mut predicted) = (0, 0.0);
        for (node, &count) in self.counts.iter().enumerate() {
            token.check_every(LIGHT_STEPS, node)?;
            measured += u64::from(count);
            predicted += self.predicted(tree, node as u32);
        }
        Ok((measured, predicted))
    }

    /// Mean cost of the tests of a ray that enters the root, in the unit of
    /// [`TreeStats::sah_cost`](super::statistics::TreeStats::sah_cost): visits that are as the surface area heuristic predicts them
    /// cost just that. 0 where no ray enters the root. Takes a pass over the tree.
    pub fn cost<C: Container>(&self, tree: &Tree<C>, token: &CancelToken) -> Result<f64, Cancelled> {
        let mut cost = 0.0;
        for (index, (node, &count)) in tree.nodes.iter().zip(&self.counts).enumerate() {
            token.check_every(LIGHT_STEPS, index)?;
            cost += f64::from(count) * visit_cost(node);
        }
        Ok(if self.root_hits() > 0 { cost / f64::from(self.root_hits()) } else { 0.0 })
    }
}

/// Rays per task and between two polls for cancellation.
const RAYS_PER_TASK: u32 = 1 << 10;

/// Traces `ray_count` rays, `ray` giving each by its index, and counts the visits of each node of `tree`. In parallel in the calling
/// thread's rayon pool; the same on any number of threads. Reports progress through `token`.
pub fn measure_visits<C: Container>(
    tree: &Tree<C>,
    leaf_triangles: impl LeafTriangles + Sync,
    ray_count: u32,
    ray: impl Fn(u32) -> Ray + Sync,
    query: RayQuery,
    token: &CancelToken,
) -> Result<Visits, Cancelled> {
    measure_weighted_visits(tree, leaf_triangles, ray_count, |index| (ray(index), query, 1), token)
}

/// [`measure_visits`] of rays that each have a purpose and a number of rays that they stand for, whose sum must not exceed `u32::MAX`.
/// [`Visits::rays`] is that sum; rays that stand for none are not traced.
pub fn measure_weighted_visits<C: Container>(
    tree: &Tree<C>,
    leaf_triangles: impl LeafTriangles + Sync,
    ray_count: u32,
    ray: impl Fn(u32) -> (Ray, RayQuery, u32) + Sync,
    token: &CancelToken,
) -> Result<Visits, Cancelled> {
    count_visits(tree.nodes.len(), ray_count, ray, token, |ray, query, counter| match query {
        RayQuery::ClosestHit(traversal) => {
            closest_hit(tree, leaf_triangles, ray, traversal, counter);
        }
        RayQuery::AnyHit => {
            any_hit_with(tree, leaf_triangles, ray, counter);
        }
    })
}

/// The visits of `nodes` nodes by rays as those of [`measure_weighted_visits`], each of which `trace` takes through the tree.
pub(crate) fn count_visits(
    nodes: usize,
    ray_count: u32,
    ray: impl Fn(u32) -> (Ray, RayQuery, u32) + Sync,
    token: &CancelToken,
    trace: impl Fn(&Ray, RayQuery, &mut VisitCounter<'_>) + Sync,
) -> Result<Visits, Cancelled> {
    let counts = par_collect(nodes, token, |_| AtomicU32::new(0))?;
    let progress = TaskProgress::new(u64::from(ray_count));
    let stood_for = par_tasks(0..ray_count.div_ceil(RAYS_PER_TASK), token, |task, token| {
        let mut counter = VisitCounter::new(&counts);
        let first = task * RAYS_PER_TASK;
        let rays = RAYS_PER_TASK.min(ray_count - first);
        let mut stood_for = 0;
        for index in first..first + rays {
            let (ray, query, weight) = ray(index);
            if weight == 0 {
                continue;
            }
            stood_for += weight;
            counter.weight = weight;
            trace(&ray, query, &mut counter);
        }
        counter.flush();
        progress.add(u64::from(rays), token);
        Ok(stood_for)
    })?;
    token.check()?;
    let counts = par_collect(counts.len(), token, |node| counts[node].load(Ordering::Relaxed))?;
    Ok(Visits { counts, rays: stood_for.into_iter().sum() })
}

/// Slots of a [`VisitCounter`]: 8 KiB.
const SLOTS: usize = 1 << 10;

/// Adds visits to counts that all threads share. Nearly all rays visit the nodes near the root: visits of a node are collected until
/// another node needs its slot, so that threads do not wait for each other at every step.
pub(crate) struct VisitCounter<'a> {
    counts: &'a [AtomicU32],
    /// Node and visits that are not yet in `counts`. The slot of a node is its index modulo the number of slots.
    slots: [(u32, u32); SLOTS],
    /// Visits that one of the present ray counts as.
    weight: u32,
}

impl<'a> VisitCounter<'a> {
    fn new(counts: &'a [AtomicU32]) -> Self {
        Self { counts, slots: [(0, 0); SLOTS], weight: 1 }
    }

    /// Adds what is still in the slots.
    fn flush(&mut self) {
        for (node, visits) in self.slots.iter_mut().filter(|(_, visits)| *visits > 0) {
            self.counts[*node as usize].fetch_add(*visits, Ordering::Relaxed);
            *visits = 0;
        }
    }
}

impl Probe for VisitCounter<'_> {
    #[inline(always)]
    fn container_test(&mut self) {}
    #[inline(always)]
    fn primitive_test(&mut self) {}

    #[inline(always)]
    fn visited(&mut self, node: u32) {
        let (owner, visits) = &mut self.slots[node as usize % SLOTS];
        if *owner != node {
            if *visits > 0 {
                self.counts[*owner as usize].fetch_add(*visits, Ordering::Relaxed);
            }
            (*owner, *visits) = (node, 0);
        }
        *visits += self.weight;
    }
}
