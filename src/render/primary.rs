//! Primary rays alone, timed or counted: no shading, and alpha cut-outs are solid.

use std::time::{Duration, Instant};

use arrayvec::ArrayVec;
use glam::Vec2;
use rayon::prelude::*;

use super::grid::{Grid, TILE_AREA};
use super::request::RenderRequest;
use crate::catalog::reading::EnteringReading;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Ray;
use bvhscope_engine::tree::traverse::{NoProbe, Probe, TestCounts, Traversal, new_stack};
use bvhscope_engine::wide::AnyWideTree;
use bvhscope_engine::wide::trace::{CacheLines, LineProbe};

/// Test counts of the primary rays through all pixel centres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestSummary {
    /// Number of rays, one per pixel.
    pub rays: u64,
    /// Number of rays that hit a surface.
    pub hits: u64,
    /// Average container tests per ray.
    pub container_tests_per_ray: f32,
    /// Average primitive tests per ray.
    pub primitive_tests_per_ray: f32,
    /// Number of rays that enter the scene's box, see [`Scene::is_entered_by`](crate::scene::Scene::is_entered_by): the same in every
    /// tree of a scene.
    pub entering: u64,
    /// Container and primitive tests of these rays.
    pub entering_tests: u64,
    /// Cache lines of the wide tree that these rays read, each once a ray.
    pub lines: CacheLines,
    /// Wall-clock time including the counting.
    pub trace_time: Duration,
}

impl TestSummary {
    /// Averages of a ray that enters the scene's box. `None` where no ray enters it.
    pub fn of_entering_ray(&self) -> Option<EnteringReading> {
        let per_ray = |sum: u64| (sum as f64 / self.entering as f64) as f32;
        (self.entering > 0).then(|| EnteringReading {
            tests: per_ray(self.entering_tests),
            lines: [self.lines.nodes, self.lines.triangles].map(per_ray),
        })
    }
}

/// Trace time of the primary rays through all pixel centres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrimaryTrace {
    /// Number of rays, one per pixel.
    pub rays: u64,
    /// Number of rays that hit a surface.
    pub hits: u64,
    /// Wall-clock time of tracing.
    pub trace_time: Duration,
}

/// Counts the tests of the primary rays in the order of `request.settings.traversal`, and the cache lines that they read of the wide
/// tree, in the calling thread's rayon pool.
pub fn count_tests(request: &RenderRequest, token: &CancelToken) -> Result<TestSummary, Cancelled> {
    request.accel.compute_leaf_triangles(token)?;
    let wide = &request.accel.widen(token)?.tree;
    let start = Instant::now();
    let tiles = trace::<TestCounts>(request, request.settings.traversal, Some(wide), token)?;
    let rays = Grid::new(request).ray_count();
    let sum = |count: fn(&Tile<TestCounts>) -> u64| -> u64 { tiles.iter().map(count).sum() };
    let per_ray = |sum: u64| (sum as f64 / rays as f64) as f32;
    let mut lines = CacheLines::default();
    for tile in &tiles {
        lines += tile.lines;
    }
    Ok(TestSummary {
        rays,
        hits: sum(|tile| tile.hits),
        container_tests_per_ray: per_ray(sum(|tile| tile.probe.containers)),
        primitive_tests_per_ray: per_ray(sum(|tile| tile.probe.primitives)),
        entering: sum(|tile| tile.entering),
        entering_tests: sum(|tile| tile.entering_tests),
        lines,
        trace_time: start.elapsed(),
    })
}

/// Traces the primary rays through the binary tree without shading, in the calling thread's rayon pool.
pub fn trace_primary(
    request: &RenderRequest,
    traversal: Traversal,
    token: &CancelToken,
) -> Result<PrimaryTrace, Cancelled> {
    request.accel.compute_leaf_triangles(token)?;
    let start = Instant::now();
    let tiles = trace::<NoProbe>(request, traversal, None, token)?;
    let hits = tiles.iter().map(|tile| tile.hits).sum();
    Ok(PrimaryTrace { rays: Grid::new(request).ray_count(), hits, trace_time: start.elapsed() })
}

/// Traces the primary rays in packets through the wide tree, as pictures do, without shading, in the calling thread's rayon
/// pool.
pub fn trace_primary_wide(request: &RenderRequest, token: &CancelToken) -> Result<PrimaryTrace, Cancelled> {
    let wide = &request.accel.widen(token)?.tree;
    let start = Instant::now();
    let grid = Grid::new(request);
    let camera = request.camera.for_size(request.width_px, request.height_px);
    let level = request.settings.simd.level();
    let trace_tile = |tile: u32, token: &CancelToken| {
        token.check()?;
        let mut rays = ArrayVec::<Ray, TILE_AREA>::new();
        grid.for_each_pixel(tile, |x, y, _| {
            let point = grid.point(x, y, Vec2::splat(0.5));
            rays.push(camera.ray(point.x, point.y));
        });
        let mut hits = [None; TILE_AREA];
        wide.closest_hits(level, &rays, &mut hits);
        Ok(hits.iter().flatten().count() as u64)
    };
    let fork = token.fork();
    let hits = (0..grid.tile_count)
        .into_par_iter()
        .map(|tile| fork.task(|token| trace_tile(tile, token)))
        .try_reduce(|| 0, |a, b| Ok(a + b))?;
    fork.join();
    Ok(PrimaryTrace { rays: grid.ray_count(), hits, trace_time: start.elapsed() })
}

/// A probe that may count tests.
trait Counting: Probe + Copy + Default + Send {
    /// Number of all tests so far.
    fn tests(&self) -> u64;
}

impl Counting for NoProbe {
    fn tests(&self) -> u64 {
        0
    }
}

impl Counting for TestCounts {
    fn tests(&self) -> u64 {
        self.containers + self.primitives
    }
}

/// Counts of the rays of a tile.
#[derive(Default)]
struct Tile<P> {
    hits: u64,
    /// Tests of all rays.
    probe: P,
    /// Number of rays that enter the scene's box.
    entering: u64,
    /// Tests of these rays.
    entering_tests: u64,
    /// Cache lines that they read.
    lines: CacheLines,
}

/// The counts of each tile. The rays that enter the scene's box are traced once more through the wide tree, if its lines are to be
/// counted.
fn trace<P: Counting>(
    request: &RenderRequest,
    traversal: Traversal,
    wide: Option<&AnyWideTree>,
    token: &CancelToken,
) -> Result<Vec<Tile<P>>, Cancelled> {
    let grid = Grid::new(request);
    let camera = request.camera.for_size(request.width_px, request.height_px);
    let (tree, scene) = (&request.accel.tree, &request.accel.scene);
    let triangles = request.accel.compute_leaf_triangles(token)?;
    let level = request.settings.simd.level();
    let trace_tile = |tile: u32, token: &CancelToken| {
        token.check()?;
        let mut stack = new_stack(tree.max_depth());
        let mut counts = Tile::<P>::default();
        let mut lines = wide.map(|wide| (wide, LineProbe::new(wide)));
        grid.for_each_pixel(tile, |x, y, _| {
            let point = grid.point(x, y, Vec2::splat(0.5));
            let (ray, before, mut enters) = (camera.ray(point.x, point.y), counts.probe.tests(), false);
            let hit = request.first_visible(ray, |ray| {
                // A timed trace does no more than tracing.
                enters |= P::ACTIVE && scene.is_entered_by(ray);
                tree.closest_hit_with(level, triangles, ray, traversal, &mut stack, &mut counts.probe)
            });
            counts.hits += u64::from(hit.is_some());
            if enters {
                counts.entering += 1;
                counts.entering_tests += counts.probe.tests() - before;
                if let Some((wide, probe)) = &mut lines {
                    request.first_visible(ray, |ray| wide.closest_hit_with(level, ray, probe));
                    counts.lines += probe.take();
                }
            }
        });
        Ok(counts)
    };
    let fork = token.fork();
    let tiles = (0..grid.tile_count)
        .into_par_iter()
        .map(|tile| fork.task(|token| trace_tile(tile, token)))
        .collect::<Result<Vec<Tile<P>>, Cancelled>>()?;
    fork.join();
    Ok(tiles)
}
