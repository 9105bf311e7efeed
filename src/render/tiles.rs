//! Rendering in tiles, the unit of work and of cancellation.

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Instant;

use arrayvec::ArrayVec;
use glam::Vec3;
use rayon::prelude::*;

use super::assemble::{Pixel, assemble};
use super::clusters::Clusters;
use super::edges;
use super::frame::{Frame, FrameStats};
use super::grid::{Grid, TILE_AREA};
use super::lit::Lit;
use super::primary::{TestSummary, count_tests};
use super::request::RenderRequest;
use super::sampling::{SampleId, subpixel};
use super::settings::{HeatKind, Shading};
use super::shade::{AmbientOcclusion, Depth, Heat, Normals, Shade};
use super::trace_context::TraceContext;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::tree::Container;
use bvhscope_engine::tree::traverse::TestCounts;
use bvhscope_engine::with_tree;

/// The only error of [`render`]: it was cancelled.
pub type RenderError = Cancelled;

/// Counters of a pass; integers, so that the order of summation does not matter.
#[derive(Debug, Clone, Copy, Default)]
struct PassCounts {
    hits: u64,
    nan_samples: u64,
    tests: TestCounts,
}

impl PassCounts {
    fn plus(self, other: Self) -> Self {
        Self {
            hits: self.hits + other.hits,
            nan_samples: self.nan_samples + other.nan_samples,
            tests: TestCounts {
                containers: self.tests.containers + other.tests.containers,
                primitives: self.tests.primitives + other.tests.primitives,
            },
        }
    }
}

/// Renders a picture in the calling thread's rayon pool: one sample through each pixel's centre, then, at full resolution,
/// [`wanted_samples`](super::RenderSettings::wanted_samples) in all. `deliver` receives the frame after the first pass and after
/// each further power of two of samples; the last frame is returned. With [`RenderRequest::count_tests`], frames after the first
/// carry the test counts of the primary rays. Equal requests give equal pictures on any number of threads.
///
/// Depth, distance, triangle and value of a pixel are those of its centre; further samples only change colours. Samples with a
/// NaN or infinite colour are counted and black.
pub fn render(
    request: &RenderRequest,
    token: &CancelToken,
    deliver: &(dyn Fn(Frame) + Sync),
) -> Result<Frame, RenderError> {
    let accel = &*request.accel;
    with_tree!(&accel.tree, tree => {
        let camera = request.camera.for_size(request.width_px, request.height_px);
        // Coarse pictures do not wait for the wide tree, unless they show its steps.
        if request.coarseness <= 1 || request.settings.shading == Shading::Heat(HeatKind::Steps) {
            accel.widen(token)?;
        }
        let context = TraceContext::new(accel, tree, camera, request.height_px.max(1), request.settings.simd);
        // The shading mode is chosen here, outside of all loops.
        match request.settings.shading {
            Shading::Lit => {
                let lit = Lit::new(request.settings.light, accel.scene.up);
                passes(&context, &lit, request, token, deliver)
            }
            Shading::Normals => passes(&context, &Normals, request, token, deliver),
            Shading::Depth => passes(&context, &Depth, request, token, deliver),
            Shading::AmbientOcclusion => passes(&context, &AmbientOcclusion, request, token, deliver),
            Shading::Clusters => {
                let clusters = Clusters::new(tree, request.settings.cluster_depth, token)?;
                passes(&context, &clusters, request, token, deliver)
            }
            Shading::Heat(kind) => passes(&context, &Heat(kind), request, token, deliver),
        }
    })
}

/// Sample passes over all tiles.
fn passes<C: Container, S: Shade<C>>(
    context: &TraceContext<C>,
    shade: &S,
    request: &RenderRequest,
    token: &CancelToken,
    deliver: &(dyn Fn(Frame) + Sync),
) -> Result<Frame, RenderError> {
    let grid = Grid::new(request);
    if S::COUNTS {
        // Once here rather than in every thread.
        request.accel.compute_leaf_triangles(token)?;
    }
    let samples = if grid.coarseness > 1 { 1 } else { request.settings.wanted_samples() };
    // One allocation per tile, so that neither allocating nor freeing delays cancellation.
    let mut pixels: Vec<Vec<Pixel>> = vec![Vec::new(); grid.tile_count as usize];
    let tiles_done = AtomicU32::new(0);
    let tiles_in_all = (grid.tile_count * samples) as f32;
    let mut nan_samples = 0;
    let mut sample = 0;
    let counts_itself = S::COUNTS && !shade.counts_steps();
    let mut counted: Option<TestSummary> = None;
    loop {
        let start = Instant::now();
        let counts = pixels
            .par_iter_mut()
            .enumerate()
            .map(|(tile, pixels)| {
                token.check()?;
                let counts = trace_tile(context, shade, request, &grid, tile as u32, sample, pixels);
                token.set_progress((tiles_done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / tiles_in_all);
                Ok(counts)
            })
            .try_reduce(PassCounts::default, |a, b| Ok(a.plus(b)))?;
        let trace_time = start.elapsed();
        nan_samples += counts.nan_samples;
        sample += 1;
        if sample.is_power_of_two() || sample == samples {
            let rays = u64::from(grid.width) * u64::from(grid.height);
            let per_ray = |count: u64| counts_itself.then(|| (count as f64 / rays as f64) as f32);
            let frame = |counted: Option<TestSummary>| {
                let stats = FrameStats {
                    primary_rays: rays,
                    hits: counts.hits,
                    trace_time,
                    container_tests_per_ray: per_ray(counts.tests.containers)
                        .or(counted.map(|summary| summary.container_tests_per_ray)),
                    primitive_tests_per_ray: per_ray(counts.tests.primitives)
                        .or(counted.map(|summary| summary.primitive_tests_per_ray)),
                    nan_samples,
                };
                assemble(request, &grid, &pixels, sample, stats, token)
            };
            let to_count = request.count_tests && grid.coarseness == 1 && !counts_itself && counted.is_none();
            if sample < samples || to_count {
                token.check()?;
                deliver(frame(counted)?);
            }
            if to_count {
                // Counted after the first frame was delivered; later frames carry the counts.
                counted = Some(count_tests(request, token)?);
            }
            if sample == samples {
                let frame = frame(counted)?;
                // From the last to the first: some allocators return memory only from the end of the heap.
                while let Some(tile) = pixels.pop() {
                    token.check()?;
                    drop(tile);
                }
                return Ok(frame);
            }
        }
    }
}

/// Adds sample `sample` to each pixel of a tile.
fn trace_tile<C: Container, S: Shade<C>>(
    context: &TraceContext<C>,
    shade: &S,
    request: &RenderRequest,
    grid: &Grid,
    tile: u32,
    sample: u32,
    pixels: &mut Vec<Pixel>,
) -> PassCounts {
    if sample == 0 {
        *pixels = vec![Pixel::BLANK; TILE_AREA];
    }
    let mut counts = PassCounts::default();
    let within = subpixel(sample);
    let ortho_offset = context.camera.ortho_offset();
    let ray = |x: u32, y: u32| {
        let point = grid.point(x, y, within);
        context.camera.ray(point.x, point.y)
    };
    let mut finish =
        |[x, y]: [u32; 2], index: usize, ray: Ray, hit: Option<Hit>, tests: TestCounts, blocked: &[bool]| {
            let pixel = &mut pixels[index];
            let point = grid.point(x, y, within);
            let mut shaded = match &hit {
                Some(hit) => shade.hit(context, &ray, hit, tests, blocked),
                None => shade.miss(context.background(point.y), tests),
            };
            if let Some(hit) = hit.filter(|_| request.settings.mesh_edges) {
                let triangle = &context.scene.triangles[hit.primitive_index as usize];
                let pixel_size =
                    context.camera.pixel_size(context.camera.view_depth(&ray, hit.t)) * grid.coarseness as f32;
                let ink = edges::ink(triangle, &ray, &hit, pixel_size);
                // Values are coloured afterwards: until then the unused colour stores the line's coverage.
                let values = request.settings.shading.has_values();
                shaded.color = if values { Vec3::splat(ink) } else { edges::over_surface(shaded.color, ink) };
            }
            if shaded.color.is_finite() {
                pixel.sum += shaded.color;
            } else {
                counts.nan_samples += 1;
            }
            counts.hits += u64::from(hit.is_some());
            counts.tests.containers += tests.containers;
            counts.tests.primitives += tests.primitives;
            if sample == 0 {
                pixel.value = shaded.value;
                if let Some(hit) = hit {
                    pixel.depth = context.camera.view_depth(&ray, hit.t);
                    pixel.distance = hit.t - ortho_offset;
                    pixel.primitive = hit.primitive_index;
                }
            }
        };
    if S::COUNTS {
        grid.for_each_pixel(tile, |x, y, index| {
            let (ray, mut tests) = (ray(x, y), TestCounts::default());
            let hit = if shade.counts_steps() {
                context.closest_in_steps(&ray, &mut tests)
            } else {
                context.closest_solid(&ray, request.settings.traversal, &mut tests)
            };
            finish([x, y], index, ray, hit, tests, &[]);
        });
    } else {
        let (mut rays, mut places) = (ArrayVec::<_, TILE_AREA>::new(), ArrayVec::<_, TILE_AREA>::new());
        grid.for_each_pixel(tile, |x, y, index| {
            rays.push(ray(x, y));
            places.push(([x, y], index));
        });
        let mut hits = [None; TILE_AREA];
        context.closest_of_tile(&rays, &mut hits);
        // All occlusion rays of the tile are traced together, pixel after pixel.
        let (mut towards_light, mut ends) = (Vec::new(), ArrayVec::<usize, TILE_AREA>::new());
        for ((&([x, y], _), ray), hit) in places.iter().zip(&rays).zip(&hits) {
            if let Some(hit) = hit {
                shade.occlusion_rays(context, ray, hit, SampleId { x, y, sample }, &mut towards_light);
            }
            ends.push(towards_light.len());
        }
        let mut blocked = vec![false; towards_light.len()];
        context.are_blocked(&towards_light, &mut blocked);
        let mut start = 0;
        for ((((pixel, index), ray), hit), end) in places.into_iter().zip(rays).zip(hits).zip(ends) {
            finish(pixel, index, ray, hit, TestCounts::default(), &blocked[start..end]);
            start = end;
        }
    }
    counts
}
