//! Closest hits in double precision, by textbook geometry that shares no code with the engine: what a ray surely hits, what it
//! may hit within the rounding of single precision, and where.

use bvhscope_engine::geometry::{Hit, Ray, Triangle};
use glam::{DVec2, DVec3, Vec3};

/// Bound of the rounding of single precision in the position of a corner as the ray sees it, relative to its distance: 16 ulp.
const ROUNDING: f64 = 16.0 * f32::EPSILON as f64;
/// The smallest step of numbers near zero, several times.
const SMALLEST_STEP: f64 = 1e-44;

/// A triangle that the ray hits, or may hit.
struct Candidate {
    /// Interval of the distance in lengths of the direction.
    near: f64,
    far: f64,
    /// Whether it is hit by more than rounding.
    is_sure: bool,
    /// Weights of the second and the third corner with their tolerance, where they can be told.
    weights: Option<(DVec2, f64)>,
}

/// Distance from the origin to the segment from `p` to `q`.
fn distance_to_segment(p: DVec2, q: DVec2) -> f64 {
    let edge = q - p;
    let along = if edge.length_squared() > 0.0 { (-p.dot(edge) / edge.length_squared()).clamp(0.0, 1.0) } else { 0.0 };
    (p + edge * along).length()
}

/// The hit of the line through the ray with `triangle`, seen along the ray: it meets the plane of the picture at the origin.
fn candidate(triangle: &Triangle, ray: &Ray) -> Option<Candidate> {
    let length = ray.direction.as_dvec3().length();
    let forward = ray.direction.as_dvec3() / length;
    let (right, up) = forward.any_orthonormal_pair();
    let corners = [triangle.a, triangle.b, triangle.c].map(|corner| corner.as_dvec3() - ray.origin.as_dvec3());
    let [a, b, c] = corners.map(|corner| DVec2::new(corner.dot(right), corner.dot(up)));
    let depths = corners.map(|corner| corner.dot(forward));
    let size = corners.iter().map(|corner| corner.length()).fold(0.0, f64::max);
    let slack = size * ROUNDING + SMALLEST_STEP;

    // Distances of the origin from the three edges, positive inside.
    let area = (b - a).perp_dot(c - a);
    let inside = [(b, c), (c, a), (a, b)].map(|(p, q)| {
        let edge = q - p;
        if edge.length() > 0.0 { edge.perp_dot(-p) / edge.length() * area.signum() } else { 0.0 }
    });
    let innermost = inside.iter().copied().fold(f64::INFINITY, f64::min);
    let outside = [(b, c), (c, a), (a, b)].map(|(p, q)| distance_to_segment(p, q));
    if innermost <= 0.0 && outside.into_iter().fold(f64::INFINITY, f64::min) > slack {
        return None;
    }
    let is_sure = area != 0.0 && innermost > slack;

    // Depth of the plane at the origin, and how much it changes within the slack.
    let [least, most] = [depths.into_iter().fold(f64::INFINITY, f64::min), depths.into_iter().fold(f64::MIN, f64::max)];
    let [pa, pb, pc] = [(a, depths[0]), (b, depths[1]), (c, depths[2])].map(|(p, depth)| p.extend(depth));
    let normal = (pb - pa).cross(pc - pa);
    let slope = normal.truncate().length() / normal.z.abs();
    let depth = normal.dot(pa) / normal.z;
    let tolerance = 2.0 * slack * (1.0 + slope);
    let longest = [b - a, c - b, a - c].map(DVec2::length).into_iter().fold(0.0, f64::max);
    let lowest = if longest > 0.0 { area.abs() / longest } else { 0.0 };
    // A triangle that is seen edge-on has no plane to speak of.
    let (near, far) =
        if lowest > slack { (depth - tolerance, depth + tolerance) } else { (least - slack, most + slack) };
    let (near, far) = (near.max(least - slack) / length, far.min(most + slack) / length);

    // A weight is the distance from an edge over the height on it.
    let heights = [(c - a).length(), (b - a).length()].map(|edge| area.abs() / edge);
    let weights = (is_sure && lowest > 100.0 * slack)
        .then(|| (DVec2::new(inside[1] / heights[0], inside[2] / heights[1]), 4.0 * slack / lowest));
    Some(Candidate { near, far, is_sure, weights })
}

/// Rays that miss everything, as the engine documents. A `t_min` that is NaN counts as 0.
fn is_broken(ray: &Ray) -> bool {
    let Vec3 { x, y, z } = ray.direction;
    !(x * x + y * y + z * z).is_normal() || !ray.origin.is_finite() || ray.t_max.is_nan()
}

/// Requires that `hit` is the closest hit of `ray` with `triangles`, as far as single precision can tell.
pub fn check(triangles: &[Triangle], ray: &Ray, hit: Option<&Hit>) {
    let (t_min, t_max) = (f64::from(ray.t_min.max(0.0)), f64::from(ray.t_max.min(f32::MAX)));
    if is_broken(ray) || t_min > t_max {
        assert_eq!(hit, None, "{ray:?} hits nothing");
        return;
    }
    let t = hit.map_or(f64::INFINITY, |hit| f64::from(hit.t));
    let mut own_near = t;
    if let Some(hit) = hit {
        assert!(t >= t_min && t <= t_max, "{hit:?} of {ray:?} lies outside of its interval");
        let triangle = &triangles[hit.primitive_index as usize];
        let Some(own) = candidate(triangle, ray) else { panic!("{ray:?} passes {triangle:?}, not {hit:?}") };
        let rounding = t.abs() * ROUNDING;
        assert!(
            own.near - rounding <= t && t <= own.far + rounding,
            "{hit:?} of {ray:?}: {triangle:?} lies at {} to {}",
            own.near,
            own.far
        );
        own_near = t - (own.far - own.near) - rounding;
        if let Some((weights, tolerance)) = own.weights {
            let difference = DVec2::new(f64::from(hit.u), f64::from(hit.v)) - weights;
            assert!(difference.abs().max_element() <= tolerance + 1e-5, "{hit:?} of {ray:?}, {triangle:?}: {weights}");
        }
    }
    for (index, triangle) in triangles.iter().enumerate() {
        if let Some(other) = candidate(triangle, ray)
            && other.is_sure
            && other.near > t_min
            && other.far < t_max
        {
            assert!(own_near <= other.far, "{ray:?} hits {index} at {} to {}, not {hit:?}", other.near, other.far);
        }
    }
}

#[test]
fn a_hit_on_paper_is_found_and_others_are_refused() {
    // Two walls; a ray at a quarter of the width and half of the height.
    let wall = |z: f32| Triangle { a: Vec3::new(0.0, 0.0, z), b: Vec3::new(4.0, 0.0, z), c: Vec3::new(0.0, 4.0, z) };
    let walls = [wall(5.0), wall(3.0)];
    let ray = Ray::new(Vec3::new(1.0, 2.0, 1.0), Vec3::Z * 2.0);
    let nearest = Hit { t: 1.0, primitive_index: 1, u: 0.25, v: 0.5 };
    check(&walls, &ray, Some(&nearest));
    let refused = |hit: Option<Hit>| std::panic::catch_unwind(|| check(&walls, &ray, hit.as_ref())).is_err();
    assert!(refused(None), "a miss");
    assert!(refused(Some(Hit { t: 2.0, primitive_index: 0, ..nearest })), "the farther wall");
    assert!(refused(Some(Hit { t: 1.001, ..nearest })), "another distance");
    assert!(refused(Some(Hit { u: 0.5, v: 0.25, ..nearest })), "the weights exchanged");
    assert!(refused(Some(Hit { primitive_index: 0, ..nearest })), "another triangle");
    check(&walls, &Ray { origin: DVec3::new(3.0, 3.0, 1.0).as_vec3(), ..ray }, None);
    check(&walls, &Ray { t_max: 0.9, ..ray }, None);
    check(&walls, &Ray { t_min: 1.5, ..ray }, Some(&Hit { t: 2.0, primitive_index: 0, ..nearest }));
}
