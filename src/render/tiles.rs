//! The picture in tiles: the unit of work and of cancelling.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Instant;

use arrayvec::ArrayVec;
use glam::Vec3;
use rayon::prelude::*;

use super::clusters::Clusters;
use super::grid::{Grid, TILE_AREA};
use super::lit::Lit;
use super::primary::{TestSummary, count_tests};
use super::sampling::{SampleId, subpixel};
use super::shade::{AmbientOcclusion, Depth, Heat, Normals, Shade};
use super::srgb::Encoder;
use super::view::View;
use super::{Frame, FrameStats, HeatKind, RenderSettings, Shading, edges};
use crate::accel::Accel;
use crate::camera::Camera;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::tree::Container;
use bvhscope_engine::tree::traverse::TestCounts;
use bvhscope_engine::with_tree;

/// One picture that is wanted.
#[derive(Debug, Clone)]
pub struct RenderRequest {
    /// What is seen.
    pub accel: Arc<Accel>,
    /// From where.
    pub camera: Camera,
    /// How.
    pub settings: RenderSettings,
    /// Width in pixels, at least 1.
    pub width_px: u32,
    /// Height in pixels, at least 1.
    pub height_px: u32,
    /// 1 for full resolution; n traces one ray for n×n pixels.
    pub coarseness: u32,
    /// Tests a ray are counted at full resolution, in a pass of their own where the picture itself does not count them.
    pub count_tests: bool,
}

/// Why there is no picture.
pub type RenderError = Cancelled;

/// Pixels of a finished picture between two looks at the token.
const ASSEMBLED_AT_ONCE: u32 = 1 << 14;

/// What a traced pixel gathers.
#[derive(Debug, Clone, Copy)]
struct Pixel {
    /// Sum of the samples' linear colours.
    sum: Vec3,
    depth: f32,
    distance: f32,
    primitive: u32,
    value: f32,
}

impl Pixel {
    /// Before the first sample.
    const BLANK: Self =
        Self { sum: Vec3::ZERO, depth: Frame::NO_HIT, distance: f32::INFINITY, primitive: u32::MAX, value: 0.0 };
}

/// What a pass counts; whole numbers, so that the order of adding does not matter.
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

/// Traces a picture in the calling thread's rayon pool: one sample a pixel through its centre, then, at full resolution,
/// [`RenderSettings::wanted_samples`] in all. `deliver` gets the frame after the first pass and after each further power of
/// two of samples; the last one is returned. Where [`RenderRequest::count_tests`] asks for it, frames after the first bring
/// the tests of the primary rays along. Equal requests give equal pictures for any number of threads.
///
/// Depth, distance, triangle and value of a pixel are those of its centre; further samples change colours only. A sample
/// that is not a number is counted and black.
pub fn render(
    request: &RenderRequest,
    token: &CancelToken,
    deliver: &(dyn Fn(Frame) + Sync),
) -> Result<Frame, RenderError> {
    let accel = &*request.accel;
    with_tree!(&accel.tree, tree => {
        let camera = request.camera.for_size(request.width_px, request.height_px);
        // Only a coarse picture does without the wide tree, unless it shows that tree's steps.
        if request.coarseness <= 1 || request.settings.shading == Shading::Heat(HeatKind::Steps) {
            accel.widen(token)?;
        }
        let view = View::new(accel, tree, camera, request.height_px.max(1), request.settings.simd);
        // The variant is chosen here, outside of all loops.
        match request.settings.shading {
            Shading::Lit => {
                let lit = Lit::new(request.settings.light, accel.scene.up);
                passes(&view, &lit, request, token, deliver)
            }
            Shading::Normals => passes(&view, &Normals, request, token, deliver),
            Shading::Depth => passes(&view, &Depth, request, token, deliver),
            Shading::AmbientOcclusion => passes(&view, &AmbientOcclusion, request, token, deliver),
            Shading::Clusters => {
                let clusters = Clusters::new(tree, request.settings.cluster_depth, token)?;
                passes(&view, &clusters, request, token, deliver)
            }
            Shading::Heat(kind) => passes(&view, &Heat(kind), request, token, deliver),
        }
    })
}

/// One pass after the other over all tiles.
fn passes<C: Container, S: Shade<C>>(
    view: &View<C>,
    shade: &S,
    request: &RenderRequest,
    token: &CancelToken,
    deliver: &(dyn Fn(Frame) + Sync),
) -> Result<Frame, RenderError> {
    let grid = Grid::new(request);
    if S::COUNTS {
        // Once, rather than by every thread.
        request.accel.leaf_triangles_unless(token)?;
    }
    let samples = if grid.coarseness > 1 { 1 } else { request.settings.wanted_samples() };
    // Each tile's are its own, so that neither getting their memory nor giving it back takes long at a time.
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
                let counts = trace_tile(view, shade, request, &grid, tile as u32, sample, pixels);
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
                // The first picture did not wait for this; those that follow bring the counts along.
                counted = Some(count_tests(request, token)?);
            }
            if sample == samples {
                let frame = frame(counted)?;
                // From the last on: some allocators give memory back only from its end.
                while let Some(tile) = pixels.pop() {
                    token.check()?;
                    drop(tile);
                }
                return Ok(frame);
            }
        }
    }
}

/// Adds sample number `sample` to each pixel of a tile.
fn trace_tile<C: Container, S: Shade<C>>(
    view: &View<C>,
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
    let ortho_offset = view.camera.ortho_offset();
    let ray = |x: u32, y: u32| {
        let point = grid.point(x, y, within);
        view.camera.ray(point.x, point.y)
    };
    let mut finish =
        |[x, y]: [u32; 2], index: usize, ray: Ray, hit: Option<Hit>, tests: TestCounts, blocked: &[bool]| {
            let pixel = &mut pixels[index];
            let point = grid.point(x, y, within);
            let mut shaded = match &hit {
                Some(hit) => shade.hit(view, &ray, hit, tests, blocked),
                None => shade.miss(view.background(point.y), tests),
            };
            if let Some(hit) = hit.filter(|_| request.settings.mesh_edges) {
                let triangle = &view.scene.triangles[hit.primitive_index as usize];
                let pixel_size = view.camera.pixel_size(view.camera.view_depth(&ray, hit.t)) * grid.coarseness as f32;
                let ink = edges::ink(triangle, &ray, &hit, pixel_size);
                // Where values are coloured afterwards, the line waits in the unused colour.
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
                    pixel.depth = view.camera.view_depth(&ray, hit.t);
                    pixel.distance = hit.t - ortho_offset;
                    pixel.primitive = hit.primitive_index;
                }
            }
        };
    if S::COUNTS {
        grid.for_each_pixel(tile, |x, y, index| {
            let (ray, mut tests) = (ray(x, y), TestCounts::default());
            let hit = if shade.counts_steps() {
                view.closest_in_steps(&ray, &mut tests)
            } else {
                view.closest_solid(&ray, request.settings.traversal, &mut tests)
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
        view.closest_of_tile(&rays, &mut hits);
        // The tile's rays towards light all together; each pixel's are behind those of the pixel before.
        let (mut towards_light, mut ends) = (Vec::new(), ArrayVec::<usize, TILE_AREA>::new());
        for ((&([x, y], _), ray), hit) in places.iter().zip(&rays).zip(&hits) {
            if let Some(hit) = hit {
                shade.occlusion_rays(view, ray, hit, SampleId { x, y, sample }, &mut towards_light);
            }
            ends.push(towards_light.len());
        }
        let mut blocked = vec![false; towards_light.len()];
        view.are_blocked(&towards_light, &mut blocked);
        let mut start = 0;
        for ((((pixel, index), ray), hit), end) in places.into_iter().zip(rays).zip(hits).zip(ends) {
            finish(pixel, index, ray, hit, TestCounts::default(), &blocked[start..end]);
            start = end;
        }
    }
    counts
}

/// The pixels of all tiles as a frame, row by row.
fn assemble(
    request: &RenderRequest,
    grid: &Grid,
    pixels: &[Vec<Pixel>],
    samples: u32,
    stats: FrameStats,
    token: &CancelToken,
) -> Result<Frame, Cancelled> {
    let settings = request.settings;
    let rows = Rows { grid, pixels, token };
    let (scale, encoder) = (1.0 / samples as f32, Encoder::new());
    let mut frame = Frame {
        width_px: grid.width,
        height_px: grid.height,
        coarseness: grid.coarseness,
        rgba: rows.list(|pixel| encoder.rgba(pixel.sum * scale))?,
        depth: rows.list(|pixel| pixel.depth)?,
        distance: rows.list(|pixel| pixel.distance)?,
        primitive: rows.list(|pixel| pixel.primitive)?,
        values: Vec::new(),
        value_range: [0.0, 1.0],
        samples,
        camera: request.camera,
        settings,
        stats,
    };
    if settings.shading.has_values() {
        frame.values = rows.list(|pixel| pixel.value)?;
        let range = if matches!(settings.shading, Shading::Heat(_)) { settings.heat_range } else { None };
        frame.recolor(range, settings.color_map, token)?;
        if settings.mesh_edges {
            rows.for_each(&mut frame.rgba, |color, pixel| *color = edges::over_value(*color, pixel.sum.x))?;
        }
    }
    Ok(frame)
}

/// The pixels of all tiles, row by row.
struct Rows<'a> {
    grid: &'a Grid,
    pixels: &'a [Vec<Pixel>],
    token: &'a CancelToken,
}

impl Rows<'_> {
    /// What `of` makes of each pixel.
    fn list<T: bytemuck::Zeroable + Send>(&self, of: impl Fn(&Pixel) -> T + Sync) -> Result<Vec<T>, Cancelled> {
        let mut list = bytemuck::zeroed_vec(self.grid.width as usize * self.grid.height as usize);
        self.for_each(&mut list, |place, pixel| *place = of(pixel))?;
        Ok(list)
    }

    /// Calls `visit` with each place of a list of all pixels and its pixel.
    fn for_each<T: Send>(&self, list: &mut [T], visit: impl Fn(&mut T, &Pixel) + Sync) -> Result<(), Cancelled> {
        let rows = ASSEMBLED_AT_ONCE.div_ceil(self.grid.width);
        let chunks = list.par_chunks_mut((rows * self.grid.width) as usize).enumerate();
        chunks.try_for_each(|(chunk, list)| {
            let first = chunk as u32 * rows;
            self.token.check()?;
            for (row, y) in list.chunks_mut(self.grid.width as usize).zip(first..) {
                for (place, x) in row.iter_mut().zip(0..) {
                    let (tile, within) = self.grid.index(x, y);
                    visit(place, &self.pixels[tile][within]);
                }
            }
            Ok(())
        })
    }
}
