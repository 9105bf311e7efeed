//! The cost of rays in copies: how often rays are carried into each, with how many tests, and how many of them end there.

use std::sync::atomic::{AtomicU64, Ordering};

use super::counted::BinaryLevels;
use super::hit::InstanceHit;
use crate::cancel::{CancelToken, Cancelled, TaskProgress};
use crate::geometry::Ray;
use crate::kernel::parallel::{par_collect, par_tasks};
use crate::tree::traverse::{Probe, TestCounts};
use crate::tree::visits::RayQuery;

/// Rays that one thread traces at a time.
const RAYS_PER_TASK: u32 = 1 << 10;

/// The cost of one copy, each ray as many times as rays it stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CopyCost {
    /// Rays that are carried into the coordinates of its mesh, whose tree they are tested with.
    pub entered: u64,
    /// Those of them whose query ends with a hit on it.
    pub hits: u64,
    /// Their tests in the tree of the mesh.
    pub tests: TestCounts,
}

/// The cost of rays in a tree over copies, and in each copy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CopyCosts {
    /// Number of rays, each as many times as rays it stands for.
    pub rays: u64,
    /// Those that hit something.
    pub hits: u64,
    /// Containers tested in the tree over the copies.
    pub containers_above: u64,
    /// By copy.
    pub copies: Vec<CopyCost>,
}

impl BinaryLevels<'_> {
    /// The cost of `ray_count` rays in each copy. `ray` gives each by its index, with what is asked and the number of rays that it stands for;
    /// rays that stand for none are left out.
    ///
    /// # Errors
    ///
    /// Once `token` is cancelled.
    pub fn costs(
        &self,
        ray_count: u32,
        ray: impl Fn(u32) -> (Ray, RayQuery, u32) + Sync,
        token: &CancelToken,
    ) -> Result<CopyCosts, Cancelled> {
        let (count, levels) = (self.copies.copies().len(), BinaryLevels { unfolded: None, ..*self });
        let sums = par_collect(count, token, |_| [const { AtomicU64::new(0) }; 4])?;
        let progress = TaskProgress::new(u64::from(ray_count));
        let of_tasks = par_tasks(0..ray_count.div_ceil(RAYS_PER_TASK), token, |task, token| {
            let (first, mut log) = (task * RAYS_PER_TASK, CopyLog::default());
            let rays = RAYS_PER_TASK.min(ray_count - first);
            let mut totals = [0; 3];
            for index in first..first + rays {
                let (ray, query, weight) = ray(index);
                if weight > 0 {
                    let hit = levels.query(&ray, query, &mut log);
                    let of_ray = [1, u64::from(hit.is_some()), log.counts.containers - log.below().containers];
                    log.add_to(&sums, hit, u64::from(weight));
                    totals.iter_mut().zip(of_ray).for_each(|(total, of_ray)| *total += of_ray * u64::from(weight));
                }
            }
            progress.add(u64::from(rays), token);
            Ok(totals)
        })?;
        token.check()?;
        let [rays, hits, containers_above] =
            of_tasks.into_iter().fold([0; 3], |sum, task| [sum[0] + task[0], sum[1] + task[1], sum[2] + task[2]]);
        let copies = par_collect(count, token, |copy| {
            let [entered, hits, containers, primitives] = sums[copy].each_ref().map(|sum| sum.load(Ordering::Relaxed));
            CopyCost { entered, hits, tests: TestCounts { containers, primitives } }
        })?;
        Ok(CopyCosts { rays, hits, containers_above, copies })
    }
}

/// The copies that one ray is carried into, with the tests in each.
#[derive(Default)]
struct CopyLog {
    /// All tests of the ray so far.
    counts: TestCounts,
    /// Those before it was carried into the present copy.
    before: TestCounts,
    entered: Vec<(u32, TestCounts)>,
}

impl CopyLog {
    /// Tests in all copies.
    fn below(&self) -> TestCounts {
        self.entered.iter().map(|(_, tests)| *tests).sum()
    }

    /// Adds the ray, which stands for `weight`, to the sums of the copies, and forgets it.
    fn add_to(&mut self, sums: &[[AtomicU64; 4]], hit: Option<InstanceHit>, weight: u64) {
        for (copy, TestCounts { containers, primitives }) in self.entered.drain(..) {
            let is_hit = hit.is_some_and(|hit| hit.instance == copy);
            let of_ray = [1, u64::from(is_hit), containers, primitives];
            for (sum, of_ray) in sums[copy as usize].iter().zip(of_ray).filter(|(_, of_ray)| *of_ray > 0) {
                sum.fetch_add(of_ray * weight, Ordering::Relaxed);
            }
        }
        self.counts = TestCounts::default();
    }
}

impl Probe for CopyLog {
    const EVENTS: bool = true;

    fn container_test(&mut self) {
        self.counts.containers += 1;
    }
    fn primitive_test(&mut self) {
        self.counts.primitives += 1;
    }
    fn carried(&mut self, _: u32) {
        self.before = self.counts;
    }
    fn tested(&mut self, copy: u32, _: Option<f32>) {
        let containers = self.counts.containers - self.before.containers;
        let primitives = self.counts.primitives - self.before.primitives;
        self.entered.push((copy, TestCounts { containers, primitives }));
    }
}
