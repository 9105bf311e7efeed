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
use bvhscope_engine::tree::Node;
use bvhscope_engine::tree::traverse::{NoProbe, Probe, TestCounts, Traversal, new_stack};
use bvhscope_engine::wide::AnyWideTree;
use bvhscope_engine::wide::trace::{CacheLines, LineProbe};
use bvhscope_engine::with_tree;

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
    /// Number of rays that enter the root.
    pub entering: u64,
    /// Cache lines of the wide tree that those rays read, each once a ray.
    pub lines: CacheLines,
    /// Wall-clock time including the counting.
    pub trace_time: Duration,
}

impl TestSummary {
    /// Averages of a ray that enters the root, whose test counts too; all others have one test each. `None` where no ray enters it.
    pub fn of_entering_ray(&self) -> Option<EnteringReading> {
        let per_ray = f64::from(self.container_tests_per_ray) + f64::from(self.primitive_tests_per_ray);
        let (missing, entering) = ((self.rays - self.entering) as f64, self.entering as f64);
        (self.entering > 0).then(|| EnteringReading {
            tests: ((per_ray * self.rays as f64 - missing) / entering) as f32,
            lines: [self.lines.nodes, self.lines.triangles].map(|lines| (lines as f64 / entering) as f32),
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
    let per_ray = |sum: u64| (sum as f64 / rays as f64) as f32;
    let mut lines = CacheLines::default();
    for tile in &tiles {
        lines += tile.lines;
    }
    Ok(TestSummary {
        rays,
        hits: tiles.iter().map(|tile| tile.hits).sum(),
        container_tests_per_ray: per_ray(tiles.iter().map(|tile| tile.probe.containers).sum()),
        primitive_tests_per_ray: per_ray(tiles.iter().map(|tile| tile.probe.primitives).sum()),
        entering: tiles.iter().map(|tile| tile.entering).sum(),
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

/// A probe that knows whether the last ray entered the root.
trait Entering: Probe + Copy + Default + Send {
    /// `true` of a ray whose tests are those since `before`, if it was tested against the root's children, too.
    fn has_entered(&self, before: &Self) -> bool;
}

impl Entering for NoProbe {
    fn has_entered(&self, _: &Self) -> bool {
        false
    }
}

impl Entering for TestCounts {
    fn has_entered(&self, before: &Self) -> bool {
        self.containers - before.containers > 1
    }
}

/// Counts of the rays of a tile.
#[derive(Default)]
struct TileCounts<P> {
    hits: u64,
    probe: P,
    /// Number of rays that enter the root.
    entering: u64,
    /// Cache lines that those rays read.
    lines: CacheLines,
}

/// Traces the primary rays, and those that enter the root once more through the wide tree, if its lines are to be counted.
fn trace<P: Entering>(
    request: &RenderRequest,
    traversal: Traversal,
    wide: Option<&AnyWideTree>,
    token: &CancelToken,
) -> Result<Vec<TileCounts<P>>, Cancelled> {
    let grid = Grid::new(request);
    let camera = request.camera.for_size(request.width_px, request.height_px);
    let tree = &request.accel.tree;
    let triangles = request.accel.compute_leaf_triangles(token)?;
    let level = request.settings.simd.level();
    let root_is_leaf = with_tree!(tree, tree => tree.nodes.first().is_some_and(Node::is_leaf));
    let trace_tile = |tile: u32, token: &CancelToken| {
        token.check()?;
        let mut stack = new_stack(tree.max_depth());
        let mut counts = TileCounts::<P>::default();
        let mut lines = wide.map(|wide| (wide, LineProbe::new(wide)));
        grid.for_each_pixel(tile, |x, y, _| {
            let point = grid.point(x, y, Vec2::splat(0.5));
            let (ray, before) = (camera.ray(point.x, point.y), counts.probe);
            let hit = request.first_visible(ray, |ray| {
                tree.closest_hit_with(level, triangles, ray, traversal, &mut stack, &mut counts.probe)
            });
            counts.hits += u64::from(hit.is_some());
            // A root that is a leaf is not tested: all rays count as entering it.
            if root_is_leaf || counts.probe.has_entered(&before) {
                counts.entering += 1;
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
        .collect::<Result<_, Cancelled>>()?;
    fork.join();
    Ok(tiles)
}
