//! Primary rays alone, timed or counted: no shading, and alpha cut-outs are solid.

use std::time::{Duration, Instant};

use arrayvec::ArrayVec;
use glam::Vec2;
use rayon::prelude::*;

use super::grid::{Grid, TILE_AREA};
use super::request::RenderRequest;
use crate::accel::tracer::{CountedQuery, Counting};
use crate::catalog::reading::EnteringReading;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Ray;
use bvhscope_engine::tree::traverse::{TestCounts, Traversal};
use bvhscope_engine::wide::trace::CacheLines;

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
    pub entering_tests: TestCounts,
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
            tests: per_ray(self.entering_tests.total()),
            container_tests: per_ray(self.entering_tests.containers),
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
    request.accel.widen(token)?;
    let start = Instant::now();
    let tiles = trace(request, request.settings.traversal, Counting::Tests, token)?;
    let rays = Grid::new(request).ray_count();
    let sum = |count: fn(&Tile) -> u64| -> u64 { tiles.iter().map(count).sum() };
    let per_ray = |sum: u64| (sum as f64 / rays as f64) as f32;
    let mut lines = CacheLines::default();
    for tile in &tiles {
        lines += tile.lines;
    }
    Ok(TestSummary {
        rays,
        hits: sum(|tile| tile.hits),
        container_tests_per_ray: per_ray(sum(|tile| tile.tests.containers)),
        primitive_tests_per_ray: per_ray(sum(|tile| tile.tests.primitives)),
        entering: sum(|tile| tile.entering),
        entering_tests: tiles.iter().map(|tile| tile.entering_tests).sum(),
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
    let tiles = trace(request, traversal, Counting::Nothing, token)?;
    let hits = tiles.iter().map(|tile| tile.hits).sum();
    Ok(PrimaryTrace { rays: Grid::new(request).ray_count(), hits, trace_time: start.elapsed() })
}

/// Traces the primary rays in packets through the wide tree, as pictures do, without shading, in the calling thread's rayon
/// pool.
pub fn trace_primary_wide(request: &RenderRequest, token: &CancelToken) -> Result<PrimaryTrace, Cancelled> {
    request.accel.widen(token)?;
    let tracer = request.accel.tracer(request.settings.simd);
    let start = Instant::now();
    let grid = Grid::new(request);
    let trace_tile = |tile: u32, token: &CancelToken| {
        token.check()?;
        let mut hits = [None; TILE_AREA];
        tracer.nearest(&rays_of_tile(request, &grid, tile), &mut hits);
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

/// The rays through the centres of a tile's pixels.
fn rays_of_tile(request: &RenderRequest, grid: &Grid, tile: u32) -> ArrayVec<Ray, TILE_AREA> {
    let camera = request.camera.for_size(request.width_px, request.height_px);
    let mut rays = ArrayVec::new();
    grid.for_each_pixel(tile, |x, y, _| {
        let point = grid.point(x, y, Vec2::splat(0.5));
        rays.push(camera.ray(point.x, point.y));
    });
    rays
}

/// Counts of the rays of a tile.
#[derive(Default)]
struct Tile {
    hits: u64,
    /// Tests of all rays.
    tests: TestCounts,
    /// Number of rays that enter the scene's box.
    entering: u64,
    /// Tests of these rays.
    entering_tests: TestCounts,
    /// Cache lines that they read.
    lines: CacheLines,
}

/// The counts of each tile. Where tests are counted, the rays that enter the scene's box are traced once more, for the cache lines that
/// they read.
fn trace(
    request: &RenderRequest,
    traversal: Traversal,
    counting: Counting,
    token: &CancelToken,
) -> Result<Vec<Tile>, Cancelled> {
    let grid = Grid::new(request);
    let (tracer, visible) = (request.accel.tracer(request.settings.simd), request.visible());
    let passes = &|primitive_index| visible.is_hidden(primitive_index);
    let trace_tile = |tile: u32, token: &CancelToken| {
        token.check()?;
        let rays = rays_of_tile(request, &grid, tile);
        let rays = visible.cut_all(&rays);
        let mut found = [(None, TestCounts::default()); TILE_AREA];
        tracer.counted(&rays, CountedQuery { counting, traversal, passes }, &mut found);
        let found = &found[..rays.len()];
        let mut counts = Tile { hits: found.iter().filter(|(hit, _)| hit.is_some()).count() as u64, ..Tile::default() };
        // A timed trace does no more than tracing.
        if counting == Counting::Nothing {
            return Ok(counts);
        }
        let mut entering = ArrayVec::<Ray, TILE_AREA>::new();
        for (ray, (_, tests)) in rays.iter().zip(found) {
            counts.tests += *tests;
            if request.accel.scene.is_entered_by(ray) {
                counts.entering_tests += *tests;
                entering.push(*ray);
            }
        }
        counts.entering = entering.len() as u64;
        let mut lines = [(None, TestCounts::default()); TILE_AREA];
        tracer.counted(&entering, CountedQuery { counting: Counting::Lines, traversal, passes }, &mut lines);
        for (_, TestCounts { containers, primitives }) in &lines[..entering.len()] {
            counts.lines += CacheLines { nodes: *containers, triangles: *primitives };
        }
        Ok(counts)
    };
    let fork = token.fork();
    let tiles = (0..grid.tile_count)
        .into_par_iter()
        .map(|tile| fork.task(|token| trace_tile(tile, token)))
        .collect::<Result<Vec<Tile>, Cancelled>>()?;
    fork.join();
    Ok(tiles)
}
