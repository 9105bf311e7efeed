//! Rendering in tiles, the unit of work and of cancellation.

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Instant;

use arrayvec::ArrayVec;
use glam::Vec3;
use rayon::prelude::*;

use super::adaptation::{Adaptation, Metered};
use super::assemble::{self, Pixel, assemble};
use super::clusters::Clusters;
use super::edges;
use super::exposure::meter;
use super::frame::{Frame, FrameStats};
use super::grid::{Grid, TILE_AREA};
use super::ground::Ground;
use super::lights::Lights;
use super::lit::Lit;
use super::primary::{TestSummary, count_tests};
use super::request::RenderRequest;
use super::sampling::{SampleId, subpixel};
use super::settings::{HeatKind, Shading};
use super::shade::{AmbientOcclusion, Counting, Depth, Heat, Normals, Shade};
use super::surface;
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
    trace(request, None, token, deliver, None)
}

/// [`render`] of a picture that is shown after another one of the same scene: exposure and openness follow by `adaptation`.
pub fn render_adapting(
    request: &RenderRequest,
    adaptation: Option<Adaptation>,
    token: &CancelToken,
    deliver: &(dyn Fn(Frame) + Sync),
) -> Result<Frame, RenderError> {
    trace(request, adaptation, token, deliver, None)
}

/// [`render`] that also returns the linear radiance of each pixel, row by row: red, green and blue in linear sRGB, neither
/// exposed nor tone mapped. The background, unlit surfaces and all shading modes but the lit one have the colours with which
/// they are shown; modes that show values are black.
pub fn render_radiance(request: &RenderRequest, token: &CancelToken) -> Result<(Frame, Vec<[f32; 3]>), RenderError> {
    let mut radiance = Vec::new();
    let frame = trace(request, None, token, &|_| (), Some(&mut radiance))?;
    Ok((frame, radiance))
}

/// [`render_adapting`], with the radiance of the last frame into `radiance`.
fn trace(
    request: &RenderRequest,
    adaptation: Option<Adaptation>,
    token: &CancelToken,
    deliver: &(dyn Fn(Frame) + Sync),
    radiance: Option<&mut Vec<[f32; 3]>>,
) -> Result<Frame, RenderError> {
    let accel = &*request.accel;
    with_tree!(&accel.tree, tree => {
        // Coarse pictures do not wait for the wide tree, unless they show its steps.
        if request.coarseness <= 1.0 || request.settings.shading == Shading::Heat(HeatKind::Steps) {
            accel.widen(token)?;
        }
        let normals = surface::Normals::new(&request.settings, &accel.scene, token)?;
        let context = TraceContext::new(request, tree, normals);
        // The shading mode is chosen here, outside of all loops.
        let mut output = Output { request, metered: (Metered::NOTHING, true), deliver, radiance };
        match request.settings.shading {
            Shading::Lit => {
                let mut lit = Lit::new(Lights::new(request.settings.light, accel.scene.up));
                let metered = meter(&context, &lit, request, token)?;
                let exposure = request.settings.exposure;
                output.metered =
                    adaptation.map_or((metered, true), |adaptation| adaptation.towards(metered, exposure));
                lit.mean_openness = output.metered.0.openness;
                lit.ground = request.settings.ground.then(|| Ground::new(&accel.scene.bounds, accel.scene.up));
                passes(&context, &lit, output, token)
            }
            Shading::Normals => passes(&context, &Normals, output, token),
            Shading::Depth => passes(&context, &Depth, output, token),
            Shading::AmbientOcclusion => passes(&context, &AmbientOcclusion, output, token),
            Shading::Clusters => {
                let clusters = Clusters::new(request, token)?;
                passes(&context, &clusters, output, token)
            }
            Shading::Heat(kind) => passes(&context, &Heat(kind), output, token),
        }
    })
}

/// What becomes of the traced pixels.
struct Output<'a> {
    request: &'a RenderRequest,
    /// Exposure and openness of the picture, and whether they are those of its view.
    metered: (Metered, bool),
    deliver: &'a (dyn Fn(Frame) + Sync),
    /// Receives the radiance of the last frame.
    radiance: Option<&'a mut Vec<[f32; 3]>>,
}

/// Sample passes over all tiles.
fn passes<C: Container, S: Shade<C>>(
    context: &TraceContext<C>,
    shade: &S,
    output: Output<'_>,
    token: &CancelToken,
) -> Result<Frame, RenderError> {
    let Output { request, metered, deliver, radiance } = output;
    let grid = Grid::new(request);
    if S::COUNTS {
        // Once here rather than in every thread.
        request.accel.compute_leaf_triangles(token)?;
    }
    let samples = if grid.coarseness > 1.0 { 1 } else { request.settings.wanted_samples() };
    // One allocation per tile, so that neither allocating nor freeing delays cancellation.
    let mut pixels: Vec<Vec<Pixel>> = vec![Vec::new(); grid.tile_count as usize];
    let tiles_done = AtomicU32::new(0);
    let tiles_in_all = (grid.tile_count * samples) as f32;
    let mut nan_samples = 0;
    let mut sample = 0;
    let counts_itself = S::COUNTS && shade.counting() == Counting::Tests;
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
                assemble(request, &grid, &pixels, sample, metered, stats, token)
            };
            let to_count = request.count_tests && grid.coarseness == 1.0 && !counts_itself && counted.is_none();
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
                if let Some(radiance) = radiance {
                    *radiance = assemble::radiance(&grid, &pixels, samples, token)?;
                }
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
    let mut finish = |[x, y]: [u32; 2],
                      index: usize,
                      ray: Ray,
                      hit: Option<(Hit, S::Point)>,
                      tests: TestCounts,
                      blocked: &[bool]| {
        let pixel = &mut pixels[index];
        let mut shaded = match &hit {
            Some((hit, point)) => shade.hit(context, &ray, hit, point, tests, blocked),
            None => shade.miss(context, &ray, context.background(grid.point(x, y, within).y), tests, blocked),
        };
        let hit = hit.map(|(hit, _)| hit);
        // Where colours stand for values, the cut shows those of what is behind it.
        let is_colored = hit.filter(|_| !request.settings.shading.has_values());
        if let Some(color) = is_colored.and_then(|hit| context.cut_surface(&ray, &hit)) {
            (shaded.color, shaded.is_radiance) = (color, false);
        }
        if let Some(hit) = hit.filter(|_| request.settings.mesh_edges) {
            let triangle = &context.scene.triangles[hit.primitive_index as usize];
            let pixel_size = context.camera.pixel_size(context.camera.view_depth(&ray, hit.t)) * grid.coarseness;
            let ink = edges::ink(triangle, &ray, &hit, pixel_size);
            // Values are coloured afterwards: until then the unused colour stores the line's coverage.
            let values = request.settings.shading.has_values();
            shaded.color = if values { Vec3::splat(ink) } else { edges::over_surface(shaded.color, ink) };
        }
        if !shaded.color.is_finite() {
            counts.nan_samples += 1;
        } else if shaded.is_radiance {
            pixel.radiance += shaded.color;
            pixel.radiance_samples += 1;
        } else {
            pixel.shown += shaded.color;
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
            let hit = match shade.counting() {
                Counting::Tests => context.closest_solid(&ray, request.settings.traversal, &mut tests),
                Counting::Steps => context.closest_in_steps(&ray, &mut tests),
                Counting::WholeRay => context.closest_of_whole_ray(&ray, &mut tests.containers),
            };
            finish([x, y], index, ray, hit.map(|hit| (hit, S::Point::default())), tests, &[]);
        });
    } else {
        let (mut rays, mut places) = (ArrayVec::<_, TILE_AREA>::new(), ArrayVec::<_, TILE_AREA>::new());
        grid.for_each_pixel(tile, |x, y, index| {
            rays.push(ray(x, y));
            places.push(([x, y], index));
        });
        let mut hits = [None; TILE_AREA];
        context.closest_hits(&rays, &mut hits);
        // All rays of a kind are traced together, pixel after pixel.
        let mut bounces = Vec::new();
        let mut points = Vec::with_capacity(rays.len());
        for ((&([x, y], _), ray), hit) in places.iter().zip(&rays).zip(&hits) {
            let id = SampleId { x, y, sample };
            let start = bounces.len();
            let point = hit.map(|hit| (hit, shade.prepare(context, ray, &hit, id, &mut bounces)));
            points.push((point, start..bounces.len()));
        }
        let mut bounce_hits = vec![None; bounces.len()];
        context.closest_hits(&bounces, &mut bounce_hits);
        let mut towards_light = Vec::with_capacity(rays.len() + bounces.len());
        let mut ends = ArrayVec::<_, TILE_AREA>::new();
        for ((&([x, y], _), ray), (point, own)) in places.iter().zip(&rays).zip(&mut points) {
            match point {
                Some((hit, point)) => {
                    let bounces = (&bounces[own.clone()], &bounce_hits[own.clone()]);
                    shade.occlusion_rays(context, ray, hit, point, bounces, &mut towards_light);
                }
                None => shade.occlusion_rays_of_miss(context, ray, SampleId { x, y, sample }, &mut towards_light),
            }
            ends.push(towards_light.len());
        }
        let mut blocked = vec![false; towards_light.len()];
        context.are_blocked(&towards_light, &mut blocked);
        let mut start = 0;
        for ((((pixel, index), ray), (hit, _)), end) in places.into_iter().zip(rays).zip(points).zip(ends) {
            finish(pixel, index, ray, hit, TestCounts::default(), &blocked[start..end]);
            start = end;
        }
    }
    counts
}
