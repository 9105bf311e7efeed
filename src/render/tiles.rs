//! Rendering in tiles, the unit of work and of cancellation.

use std::time::Instant;

use rayon::prelude::*;

use super::adaptation::{Adaptation, Metered};
use super::assemble::{self, Pixel, assemble};
use super::clusters::{Clusters, Copies};
use super::exposure::meter;
use super::frame::{Frame, FrameStats};
use super::grid::Grid;
use super::ground::Ground;
use super::lights::Lights;
use super::lit::Lit;
use super::primary::count_tests;
use super::queries::{OfRay, QueriedPlane, Thickness, all_hits_tests};
use super::request::RenderRequest;
use super::settings::{HeatKind, Shading};
use super::shade::{AmbientOcclusion, Depth, Heat, Normals, Shade};
use super::surface;
use super::tile::{Pass, PassCounts};
use super::trace_context::TraceContext;
use crate::accel::tracer::Counting;
use bvhscope_engine::cancel::{CancelToken, Cancelled, TaskProgress};

/// The only error of [`render`]: it was cancelled.
pub type RenderError = Cancelled;

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
    // Coarse pictures wait neither for the wide tree, unless they count in it, nor for the smooth normals of a large model.
    let is_coarse = request.coarseness > 1.0;
    let is_wide = matches!(request.settings.shading, Shading::Heat(kind) if kind.is_of_wide_tree());
    if !is_coarse || is_wide && request.counted_layout().is_none() {
        accel.widen(token)?;
    }
    let normals = if is_coarse {
        surface::Normals::at_once(&request.settings, &accel.scene, token)?
    } else {
        surface::Normals::new(&request.settings, &accel.scene, token)?
    };
    let context = TraceContext::new(request, normals);
    // The shading mode is chosen here, outside of all loops.
    let mut output = Output { request, metered: (Metered::NOTHING, true), deliver, radiance };
    match request.settings.shading {
        Shading::Lit => {
            let mut lit = Lit::new(Lights::of_scene(request.settings.light, &accel.scene));
            let metered = meter(&context, &lit, request, token)?;
            let exposure = request.settings.exposure;
            output.metered = adaptation.map_or((metered, true), |adaptation| adaptation.towards(metered, exposure));
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
        Shading::Copies => passes(&context, &Copies::each(&accel.scene), output, token),
        Shading::Meshes => passes(&context, &Copies::by_mesh(&accel.scene), output, token),
        Shading::Thickness => passes(&context, &Thickness, output, token),
        Shading::Distance => {
            let plane = QueriedPlane::new(&context, request);
            passes(&context, &OfRay(&|sample| plane.surface_distance(sample)), output, token)
        }
        Shading::Heat(HeatKind::AllHits) => passes(&context, &OfRay(&all_hits_tests), output, token),
        Shading::Heat(HeatKind::ClosestPoint) => {
            let plane = QueriedPlane::new(&context, request);
            passes(&context, &OfRay(&|sample| plane.closest_point_tests(sample)), output, token)
        }
        Shading::Heat(kind) => passes(&context, &Heat(kind), output, token),
    }
}

/// Use of the traced pixels.
struct Output<'a> {
    request: &'a RenderRequest,
    /// Exposure and openness of the picture; `true` if they are those of its view.
    metered: (Metered, bool),
    deliver: &'a (dyn Fn(Frame) + Sync),
    /// Receives the radiance of the last frame.
    radiance: Option<&'a mut Vec<[f32; 3]>>,
}

/// Sample passes over all tiles.
fn passes<S: Shade>(
    context: &TraceContext,
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
    let progress = TaskProgress::new(u64::from(grid.tile_count) * u64::from(samples));
    // One allocation per tile, so that neither allocating nor freeing delays cancellation.
    let mut pixels: Vec<Vec<Pixel>> = vec![Vec::new(); grid.tile_count as usize];
    // The tests of a frame are those of its tree.
    let counts_itself = S::COUNTS && shade.counting() == Counting::Tests && request.counted_layout().is_none();
    let (mut sample, mut nan_samples, mut counted) = (0, 0, None);
    loop {
        let start = Instant::now();
        let pass = Pass { context, shade, request, grid: &grid, sample };
        let counts = trace_pass(&pass, &progress, &mut pixels, token)?;
        let trace_time = start.elapsed();
        nan_samples += counts.nan_samples;
        sample += 1;
        if !sample.is_power_of_two() && sample < samples {
            continue;
        }
        let frame = |counted: Option<[f32; 2]>| {
            let tests = if counts_itself { Some(counts.tests_per_ray(&grid)) } else { counted };
            let stats = FrameStats {
                primary_rays: grid.ray_count(),
                hits: counts.hits,
                trace_time,
                container_tests_per_ray: tests.map(|[containers, _]| containers),
                primitive_tests_per_ray: tests.map(|[_, primitives]| primitives),
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
            let summary = count_tests(request, token)?;
            counted = Some([summary.container_tests_per_ray, summary.primitive_tests_per_ray]);
        }
        if sample == samples {
            let frame = frame(counted)?;
            if let Some(radiance) = radiance {
                *radiance = assemble::radiance(&grid, &pixels, samples, token)?;
            }
            free(pixels, token)?;
            return Ok(frame);
        }
    }
}

/// Adds one sample to each pixel of all tiles.
fn trace_pass<S: Shade>(
    pass: &Pass<'_, '_, S>,
    progress: &TaskProgress,
    pixels: &mut [Vec<Pixel>],
    token: &CancelToken,
) -> Result<PassCounts, Cancelled> {
    let trace_tile = |(tile, pixels): (usize, &mut Vec<Pixel>)| {
        token.check()?;
        let counts = pass.trace_tile(tile as u32, pixels);
        progress.add(1, token);
        Ok(counts)
    };
    let tiles = pixels.par_iter_mut().enumerate().map(trace_tile);
    tiles.try_reduce(PassCounts::default, |a, b| Ok(a.plus(b)))
}

/// Frees the pixels from the last tile to the first: some allocators return memory only from the end of the heap.
fn free(mut pixels: Vec<Vec<Pixel>>, token: &CancelToken) -> Result<(), Cancelled> {
    while let Some(tile) = pixels.pop() {
        token.check()?;
        drop(tile);
    }
    Ok(())
}
