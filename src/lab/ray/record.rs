//! Records a ray.

use std::sync::Arc;

use super::ray_record::RayRecord;
use super::recorder::Recorder;
use super::request::{RayMethod, RayRequest};
use super::span::Spans;
use super::step::{RayStep, Step};
use crate::accel::Accel;
use crate::render::{Crossings, NoRay, RenderRequest, single_ray};
use bvhscope_engine::cancel::{CancelToken, Cancelled, HEAVY_STEPS};
use bvhscope_engine::geometry::{Hit, Ray};
use bvhscope_engine::tree::traverse::RayEvent;
use bvhscope_engine::wide::trace::LineProbe;

/// Most hits that are kept of a ray.
const MOST_HITS: usize = 10_000;

/// Traces the ray of `request` through the tree and keeps what the traversal does. Like counted rays of pictures it meets the
/// cut-outs of textures as if they were solid, and is traced again behind hidden triangles.
///
/// # Errors
///
/// Fails if cancelled. The inner error is the reason why there is no such ray.
pub fn record(
    accel: &Arc<Accel>,
    request: &RayRequest,
    token: &CancelToken,
) -> Result<Result<RayRecord, NoRay>, Cancelled> {
    let picture = RenderRequest {
        hidden: request.hidden.clone(),
        ..RenderRequest::new(accel, request.camera, request.settings, request.size_px)
    };
    let ray = match single_ray(&picture, request.start, request.kind, token)? {
        Ok(ray) => picture.visible().cut(ray),
        Err(reason) => return Ok(Err(reason)),
    };
    let is_wide = request.method_in(accel) == RayMethod::Wide;
    // All hits are sought in it whatever the traversal.
    accel.widen(token)?;
    if !is_wide {
        accel.compute_leaf_triangles(token)?;
    }
    let (mut recorder, nearest) = traced(&picture, request, ray);
    let mut spans = Spans::new(accel, &ray, is_wide);
    let mut steps: Vec<RayStep> = Vec::with_capacity(recorder.steps.len());
    for (index, &(what, counts)) in recorder.steps.iter().enumerate() {
        token.check_every(HEAVY_STEPS, index)?;
        steps.push(spans.follow(index, what, counts));
    }
    let nearest = nearest.map(|hit| (hit.t, accel.scene.primitive_of(hit.primitive_index)));
    let hit = if request.ends_at_any_hit() { any_hit(&steps) } else { nearest };
    let lines = recorder.lines.as_mut().map(LineProbe::take);
    let Recorder { counts, omitted, .. } = recorder;
    let crossings = crossings(&picture, &ray);
    Ok(Ok(RayRecord { ray, steps, omitted, spans: spans.finish(), hit, crossings, counts, lines }))
}

/// All hits of `ray`, without those on hidden triangles.
fn crossings(picture: &RenderRequest, ray: &Ray) -> Crossings {
    let mut hits = Vec::new();
    let has_more = picture.accel.tracer(picture.settings.simd).all_hits(ray, MOST_HITS, &mut hits);
    hits.retain(|hit| !picture.visible().is_hidden(hit.primitive_index));
    Crossings::new(&hits, has_more, ray.direction, |hit| picture.accel.scene.triangle(hit))
}

/// Traces `ray` and records it. Returns the nearest hit too, where that is looked for.
fn traced<'a>(picture: &'a RenderRequest, request: &RayRequest, ray: Ray) -> (Recorder<'a>, Option<Hit>) {
    let accel = &*picture.accel;
    let level = picture.settings.simd.level();
    let method = request.method_in(accel);
    let mut recorder = Recorder::new((method == RayMethod::Wide).then(|| &accel.wide().tree));
    if request.ends_at_any_hit() {
        match method {
            RayMethod::Binary(_) => accel.any_hit_with(&ray, &mut recorder),
            RayMethod::Wide => accel.wide().tree.any_hit_with(level, &ray, &mut recorder),
        };
        return (recorder, None);
    }
    let nearest = picture.visible().first(ray, |rest| {
        recorder.begin(rest.t_min);
        match method {
            RayMethod::Binary(traversal) => accel.closest_hit_with(rest, traversal, &mut recorder),
            RayMethod::Wide => accel.wide().tree.closest_hit_with(level, rest, &mut recorder),
        }
    });
    (recorder, nearest)
}

/// Distance and triangle of the hit that ended the ray. Other triangles of its leaf may have been tested after it.
fn any_hit(steps: &[RayStep]) -> Option<(f32, u32)> {
    let nearer = |step: &RayStep| match step.what {
        Step::Event(RayEvent::Nearer { t }) => Some(t),
        _ => None,
    };
    let (last, t) = steps.iter().enumerate().rev().find_map(|(index, step)| Some((index, nearer(step)?)))?;
    let of = |step: &RayStep| match step.what {
        Step::Event(RayEvent::Triangle { index, t: Some(own) }) if own == t => Some(index),
        _ => None,
    };
    // Of a block of triangles the one at this distance.
    steps[..last].iter().rev().find_map(of).map(|triangle| (t, triangle))
}
