//! One sample of each pixel of a tile.

use arrayvec::ArrayVec;
use glam::{Vec2, Vec3};

use super::assemble::Pixel;
use super::edges;
use super::grid::{Grid, TILE_AREA};
use super::request::RenderRequest;
use super::sampling::{SampleId, subpixel};
use super::settings::Shading;
use super::shade::{Sample, Shade, Shaded};
use super::trace_context::TraceContext;
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::tree::traverse::TestCounts;

/// Counters of a pass; integers, so that the order of summation does not matter.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PassCounts {
    pub(super) hits: u64,
    pub(super) nan_samples: u64,
    tests: TestCounts,
}

impl PassCounts {
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            hits: self.hits + other.hits,
            nan_samples: self.nan_samples + other.nan_samples,
            tests: self.tests + other.tests,
        }
    }

    /// Container tests and primitive tests per primary ray.
    pub(super) fn tests_per_ray(&self, grid: &Grid) -> [f32; 2] {
        let per_ray = |count: u64| (count as f64 / grid.ray_count() as f64) as f32;
        [self.tests.containers, self.tests.primitives].map(per_ray)
    }
}

/// A pass of one sample a pixel.
pub(super) struct Pass<'a, 's, S> {
    pub(super) context: &'a TraceContext<'s>,
    pub(super) shade: &'a S,
    pub(super) request: &'a RenderRequest,
    pub(super) grid: &'a Grid,
    /// Index of the sample.
    pub(super) sample: u32,
}

/// A pixel of the grid and its index in the tile.
type Place = ([u32; 2], usize);

impl<S: Shade> Pass<'_, '_, S> {
    /// Adds the sample to each pixel of a tile.
    pub(super) fn trace_tile(&self, tile: u32, pixels: &mut Vec<Pixel>) -> PassCounts {
        if self.sample == 0 {
            *pixels = vec![Pixel::BLANK; TILE_AREA];
        }
        let mut counts = PassCounts::default();
        let within = subpixel(self.sample);
        if S::COUNTS {
            self.count(tile, within, pixels, &mut counts);
        } else {
            self.trace(tile, within, pixels, &mut counts);
        }
        counts
    }

    fn ray(&self, [x, y]: [u32; 2], within: Vec2) -> Ray {
        let point = self.grid.point(x, y, within);
        self.context.camera.ray(point.x, point.y)
    }

    /// The primary ray of a pixel before anything is traced for it.
    fn sample_of<'r>(&'r self, ray: &'r Ray, [x, y]: [u32; 2]) -> Sample<'r> {
        let id = SampleId { x, y, sample: self.sample };
        Sample { context: self.context, ray, id, tests: TestCounts::default(), blocked: &[] }
    }

    /// Traces primary rays alone, and counts the work of each.
    fn count(&self, tile: u32, within: Vec2, pixels: &mut [Pixel], counts: &mut PassCounts) {
        let (rays, places) = self.primary_rays(tile, within);
        let mut found = [(None, TestCounts::default()); TILE_AREA];
        self.context.counted(&rays, (self.shade.counting(), self.request.settings.traversal), &mut found);
        for ((([x, y], index), ray), (hit, tests)) in places.into_iter().zip(rays).zip(found) {
            let hit = hit.map(|hit| (hit, S::Point::default()));
            let traced = Sample { tests, ..self.sample_of(&ray, [x, y]) };
            self.add(self.grid.point(x, y, within).y, &traced, hit, &mut pixels[index], counts);
        }
    }

    /// The primary rays of a tile, with the pixels that they belong to.
    fn primary_rays(&self, tile: u32, within: Vec2) -> (ArrayVec<Ray, TILE_AREA>, ArrayVec<Place, TILE_AREA>) {
        let (mut rays, mut places) = (ArrayVec::new(), ArrayVec::new());
        self.grid.for_each_pixel(tile, |x, y, index| {
            rays.push(self.ray([x, y], within));
            places.push(([x, y], index));
        });
        (rays, places)
    }

    /// Traces all rays of a kind together, pixel after pixel: primary rays, bounces, then rays towards light.
    fn trace(&self, tile: u32, within: Vec2, pixels: &mut [Pixel], counts: &mut PassCounts) {
        let (context, shade) = (self.context, self.shade);
        let (rays, places) = self.primary_rays(tile, within);
        let mut hits = [None; TILE_AREA];
        context.closest_hits(&rays, &mut hits);
        let mut bounces = Vec::new();
        let mut points = Vec::with_capacity(rays.len());
        for ((&(pixel, _), ray), hit) in places.iter().zip(&rays).zip(&hits) {
            let start = bounces.len();
            let point = hit.map(|hit| (hit, shade.prepare(&self.sample_of(ray, pixel), &hit, &mut bounces)));
            points.push((point, start..bounces.len()));
        }
        let mut bounce_hits = vec![None; bounces.len()];
        context.closest_hits(&bounces, &mut bounce_hits);
        let mut towards_light = Vec::with_capacity(rays.len() + bounces.len());
        let mut ends = ArrayVec::<_, TILE_AREA>::new();
        for ((&(pixel, _), ray), (point, own)) in places.iter().zip(&rays).zip(&mut points) {
            let sample = self.sample_of(ray, pixel);
            match point {
                Some((hit, point)) => {
                    let bounces = (&bounces[own.clone()], &bounce_hits[own.clone()]);
                    shade.occlusion_rays(&sample, hit, point, bounces, &mut towards_light);
                }
                None => shade.occlusion_rays_of_miss(&sample, &mut towards_light),
            }
            ends.push(towards_light.len());
        }
        let mut blocked = vec![false; towards_light.len()];
        context.are_blocked(&towards_light, &mut blocked);
        let mut start = 0;
        for (((([x, y], index), ray), (hit, _)), end) in places.into_iter().zip(&rays).zip(points).zip(ends) {
            let traced = Sample { blocked: &blocked[start..end], ..self.sample_of(ray, [x, y]) };
            self.add(self.grid.point(x, y, within).y, &traced, hit, &mut pixels[index], counts);
            start = end;
        }
    }

    /// Adds a sample, which lies at `y` from the upper edge, to its pixel. `hit` comes with what the shading mode prepared for it.
    fn add(
        &self,
        y: f32,
        traced: &Sample<'_>,
        hit: Option<(Hit, S::Point)>,
        pixel: &mut Pixel,
        counts: &mut PassCounts,
    ) {
        let (context, tests) = (self.context, traced.tests);
        let shaded = self.shade_sample(y, traced, hit.as_ref());
        let hit = hit.map(|(hit, _)| hit);
        if !shaded.color.is_finite() {
            counts.nan_samples += 1;
        } else if shaded.is_radiance {
            pixel.radiance += shaded.color;
            pixel.radiance_samples += 1;
        } else if hit.is_none() && context.is_clear() && !self.request.settings.shading.has_values() {
            pixel.clear += shaded.color.x;
        } else {
            pixel.shown += shaded.color;
        }
        counts.hits += u64::from(hit.is_some());
        counts.tests += tests;
        if self.sample == 0 {
            pixel.value = shaded.value;
            if let Some(hit) = hit {
                pixel.depth = context.camera.view_depth(traced.ray, hit.t);
                pixel.distance = hit.t - context.camera.ortho_offset();
                pixel.primitive = context.scene.primitive_of(hit.primitive_index);
            }
        }
    }

    /// The sample in its shading mode, with the section's cut and the edges of triangles.
    fn shade_sample(&self, y: f32, traced: &Sample<'_>, hit: Option<&(Hit, S::Point)>) -> Shaded {
        let (context, settings, ray) = (self.context, &self.request.settings, traced.ray);
        let mut shaded = match hit {
            Some((hit, point)) => self.shade.hit(traced, hit, point),
            None => self.shade.miss(traced, context.background(y)),
        };
        let Some((hit, _)) = hit else { return shaded };
        let has_values = settings.shading.has_values();
        // Where colours stand for values, the cut shows those of what is behind it.
        if !has_values && let Some(color) = context.cut_surface(ray, hit) {
            (shaded.color, shaded.is_radiance) = (color, false);
        }
        // Nor is the surface in the picture where its distance is.
        if settings.mesh_edges && settings.shading != Shading::Distance {
            let triangle = &context.scene.triangle(hit.primitive_index);
            let pixel_size = context.camera.pixel_size(context.camera.view_depth(ray, hit.t)) * self.grid.coarseness;
            let ink = edges::ink(triangle, ray, hit, pixel_size);
            // Values are coloured afterwards: until then the unused colour stores the line's coverage.
            shaded.color = if has_values { Vec3::splat(ink) } else { edges::over_surface(shaded.color, ink) };
        }
        shaded
    }
}
