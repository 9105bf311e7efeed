//! Answers for many rays and points, as one list for each number of the answer.

use std::ops::Range;

use bvhscope_engine::geometry::Feature;
use bvhscope_engine::kernel::parallel::par_tasks;
use bvhscope_engine::tree::traverse::{IndexedTriangles, TestCounts, Traversal, any_hit_with, closest_hit};
use bvhscope_engine::tree::visits::{RayQuery, measure_visits};
use bvhscope_engine::{CancelToken, Cancelled, ClosestPoint, Hit, Ray, with_tree};

use crate::model::Model;
use crate::rays::{Points, Rays};

/// Rays or points that a thread takes at once.
const PART: usize = 1024;

/// Calls `work` with each part and the index of its first ray or point, on all threads of the pool. A single part on the calling
/// thread, which needs no pool.
fn for_each_part<T: Send, R: Send>(
    parts: impl ExactSizeIterator<Item = T>,
    token: &CancelToken,
    work: impl Fn(usize, T) -> R + Sync,
) -> Result<Vec<R>, Cancelled> {
    let parts = parts.enumerate().map(|(index, part)| (PART * index, part));
    if parts.len() <= 1 {
        return Ok(parts.map(|(first, part)| work(first, part)).collect());
    }
    par_tasks(parts, token, |(first, part), _| Ok(work(first, part)))
}

/// The rays of a range.
fn rays_of(model: &Model, rays: &Rays, range: Range<usize>) -> Vec<Ray> {
    range.map(|index| rays.ray(index, model.offset)).collect()
}

/// `steps` until `token` is cancelled. The results of the others are missing then, and nobody waits for any.
fn until_cancelled<T>(steps: impl Iterator<Item = T>, token: &CancelToken) -> impl Iterator<Item = T> {
    steps.take_while(|_| !token.is_cancelled())
}

/// The nearest hit of each ray: −1, infinite and NaN where it misses.
#[derive(Default)]
pub(crate) struct Hits {
    /// Number of the triangle.
    pub(crate) triangle: Vec<i32>,
    /// Distance in multiples of the direction.
    pub(crate) t: Vec<f32>,
    /// Weight of the second corner.
    pub(crate) u: Vec<f32>,
    /// Weight of the third corner.
    pub(crate) v: Vec<f32>,
}

/// The nearest hits of `rays`.
pub(crate) fn closest_hits(model: &Model, rays: &Rays, token: &CancelToken) -> Result<Hits, Cancelled> {
    let count = rays.count();
    let mut hits = Hits {
        triangle: vec![-1; count],
        t: vec![f32::INFINITY; count],
        u: vec![f32::NAN; count],
        v: vec![f32::NAN; count],
    };
    let Hits { triangle, t, u, v } = &mut hits;
    let numbers = t.chunks_mut(PART).zip(u.chunks_mut(PART).zip(v.chunks_mut(PART)));
    for_each_part(triangle.chunks_mut(PART).zip(numbers), token, |first, (triangle, (t, (u, v)))| {
        let rays = rays_of(model, rays, first..first + triangle.len());
        let mut found = vec![None; rays.len()];
        model.wide.closest_hits(&rays, &mut found);
        for (at, hit) in found.into_iter().enumerate() {
            if let Some(Hit { t: distance, primitive_index, u: second, v: third }) = hit {
                (triangle[at], t[at], u[at], v[at]) = (primitive_index as i32, distance, second, third);
            }
        }
    })?;
    Ok(hits)
}

/// For each ray, whether it hits a triangle.
pub(crate) fn any_hits(model: &Model, rays: &Rays, token: &CancelToken) -> Result<Vec<bool>, Cancelled> {
    let mut blocked = vec![false; rays.count()];
    for_each_part(blocked.chunks_mut(PART), token, |first, blocked| {
        model.wide.any_hits(&rays_of(model, rays, first..first + blocked.len()), blocked);
    })?;
    Ok(blocked)
}

/// All hits of rays, ray by ray, by distance.
#[derive(Default)]
pub(crate) struct AllHits {
    /// For each ray the place of its first hit, and at the end the number of all hits.
    pub(crate) starts: Vec<i64>,
    /// Number of the ray of each hit.
    pub(crate) ray: Vec<i64>,
    /// The hits.
    pub(crate) hits: Hits,
    /// For each ray whether there are more hits than were wanted.
    pub(crate) has_more: Vec<bool>,
}

/// The hits of `rays`, at most the `max` nearest of each.
pub(crate) fn all_hits(model: &Model, rays: &Rays, max: usize, token: &CancelToken) -> Result<AllHits, Cancelled> {
    let mut has_more = vec![false; rays.count()];
    let parts = for_each_part(has_more.chunks_mut(PART), token, |first, has_more| {
        let (mut all, mut counts, mut hits) = (Vec::new(), Vec::with_capacity(has_more.len()), Vec::new());
        for (index, has_more) in until_cancelled(has_more.iter_mut().enumerate(), token) {
            *has_more = model.wide.all_hits(&rays.ray(first + index, model.offset), max, &mut hits);
            counts.push(hits.len());
            all.extend_from_slice(&hits);
        }
        (all, counts)
    })?;
    token.check()?;
    let mut result = AllHits { starts: vec![0], has_more, ..AllHits::default() };
    for (hits, counts) in parts {
        token.check()?;
        for count in counts {
            let ray = result.starts.len() as i64 - 1;
            result.ray.extend(std::iter::repeat_n(ray, count));
            result.starts.push(result.ray.len() as i64);
        }
        result.hits.triangle.extend(hits.iter().map(|hit| hit.primitive_index as i32));
        result.hits.t.extend(hits.iter().map(|hit| hit.t));
        result.hits.u.extend(hits.iter().map(|hit| hit.u));
        result.hits.v.extend(hits.iter().map(|hit| hit.v));
    }
    Ok(result)
}

/// The nearest point of the mesh for each of many points: NaN, infinite and −1 where there is none.
pub(crate) struct ClosestPoints {
    /// The point of the mesh, three coordinates each.
    pub(crate) point: Vec<f64>,
    /// Its distance.
    pub(crate) distance: Vec<f64>,
    /// Number of its triangle.
    pub(crate) triangle: Vec<i32>,
    /// Weight of the triangle's second corner.
    pub(crate) u: Vec<f64>,
    /// Weight of the triangle's third corner.
    pub(crate) v: Vec<f64>,
    /// Number of the part of the triangle: 0 is the face, 1 to 3 are its edges, 4 to 6 its corners.
    pub(crate) feature: Vec<u8>,
}

/// The points of the mesh that are nearest to `points`, within `radius`.
pub(crate) fn closest_points(
    model: &Model,
    points: &Points,
    radius: f32,
    token: &CancelToken,
) -> Result<ClosestPoints, Cancelled> {
    let count = points.count();
    let mut found = ClosestPoints {
        point: vec![f64::NAN; 3 * count],
        distance: vec![f64::INFINITY; count],
        triangle: vec![-1; count],
        u: vec![f64::NAN; count],
        v: vec![f64::NAN; count],
        feature: vec![0; count],
    };
    let ClosestPoints { point, distance, triangle, u, v, feature } = &mut found;
    let weights = u.chunks_mut(PART).zip(v.chunks_mut(PART).zip(feature.chunks_mut(PART)));
    let places = point.chunks_mut(3 * PART).zip(distance.chunks_mut(PART).zip(triangle.chunks_mut(PART)));
    for_each_part(places.zip(weights), token, |first, ((point, (distance, triangle)), (u, (v, feature)))| {
        for at in until_cancelled(0..distance.len(), token) {
            let nearest = model.wide.closest_point(points.less(first + at, model.offset), radius);
            if let Some(ClosestPoint {
                point: place,
                distance: far,
                primitive_index,
                u: second,
                v: third,
                feature: part,
            }) = nearest
            {
                (place + model.offset).write_to_slice(&mut point[3 * at..]);
                (distance[at], triangle[at], u[at], v[at]) = (far, primitive_index as i32, second, third);
                feature[at] = number_of(part);
            }
        }
    })?;
    Ok(found)
}

/// The number of a part of a triangle.
fn number_of(feature: Feature) -> u8 {
    match feature {
        Feature::Face => 0,
        Feature::Edge(edge) => 1 + edge,
        Feature::Corner(corner) => 4 + corner,
    }
}

/// Whether each of `points` lies inside.
pub(crate) fn contains(model: &Model, points: &Points, token: &CancelToken) -> Result<Vec<bool>, Cancelled> {
    let mut inside = vec![false; points.count()];
    for_each_part(inside.chunks_mut(PART), token, |first, inside| {
        let places = until_cancelled((first..).zip(inside), token);
        places.for_each(|(index, inside)| *inside = model.wide.contains(points.less(index, model.offset)));
    })?;
    Ok(inside)
}

/// The distance of each of `points`, negative inside; infinite without triangles, NaN for a point that is not finite.
pub(crate) fn signed_distances(model: &Model, points: &Points, token: &CancelToken) -> Result<Vec<f64>, Cancelled> {
    let missing = if model.triangles.is_empty() { f64::INFINITY } else { f64::NAN };
    let mut distances = vec![missing; points.count()];
    for_each_part(distances.chunks_mut(PART), token, |first, distances| {
        for (index, distance) in until_cancelled((first..).zip(distances), token) {
            let found = model.wide.signed_distance(points.less(index, model.offset));
            *distance = found.unwrap_or(missing);
        }
    })?;
    Ok(distances)
}

/// Number of tests of containers and of triangles that each ray takes in the tree.
pub(crate) fn tests(
    model: &Model,
    rays: &Rays,
    query: RayQuery,
    token: &CancelToken,
) -> Result<[Vec<i64>; 2], Cancelled> {
    let [mut containers, mut triangles] = [vec![0; rays.count()], vec![0; rays.count()]];
    let of_leaves = IndexedTriangles { triangles: &model.triangles, indices: model.tree.primitive_indices() };
    let parts = containers.chunks_mut(PART).zip(triangles.chunks_mut(PART));
    for_each_part(parts, token, |first, (containers, triangles)| {
        for at in until_cancelled(0..containers.len(), token) {
            let (ray, mut counts) = (rays.ray(first + at, model.offset), TestCounts::default());
            with_tree!(&model.tree, tree => match query {
                RayQuery::ClosestHit(traversal) => drop(closest_hit(tree, of_leaves, &ray, traversal, &mut counts)),
                RayQuery::AnyHit => drop(any_hit_with(tree, of_leaves, &ray, &mut counts)),
            });
            (containers[at], triangles[at]) = (counts.containers as i64, counts.primitives as i64);
        }
    })?;
    Ok([containers, triangles])
}

/// Number of visits of each node by `rays`, of which there are at most 2³² − 1.
pub(crate) fn visits(model: &Model, rays: &Rays, query: RayQuery, token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
    let of_leaves = IndexedTriangles { triangles: &model.triangles, indices: model.tree.primitive_indices() };
    let ray = |index: u32| rays.ray(index as usize, model.offset);
    let visits = with_tree!(&model.tree, tree =>
        measure_visits(tree, of_leaves, rays.count() as u32, ray, query, token))?;
    Ok(visits.counts)
}

/// The query of rays that stop at any hit, or of those that seek the nearest.
pub(crate) fn query(stops_at_any: bool, traversal: Traversal) -> RayQuery {
    if stops_at_any { RayQuery::AnyHit } else { RayQuery::ClosestHit(traversal) }
}
