//! The nearest hit of a ray in double precision: textbook geometry that shares no code with the trees.

use bvhscope_engine::geometry::{Hit, PreparedRay, Ray, Shear, Triangle};
use glam::{DVec2, DVec3};

/// Bound of the rounding of single precision in the position of a corner as the ray sees it, relative to its distance: 16 ulp.
pub(super) const ROUNDING: f64 = 16.0 * f32::EPSILON as f64;
/// The smallest step of numbers near zero, several times.
const SMALLEST_STEP: f64 = 1e-44;

/// The nearest hit in double precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactHit {
    /// Distance in lengths of the direction.
    pub t: f64,
    /// The triangle; of several at the same distance the first.
    pub triangle: u32,
}

/// The result of a test of every triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reference {
    /// In double precision.
    pub(super) exact: Option<ExactHit>,
    /// By the engine's own test, which trees must find to the last bit.
    pub(super) own: Option<Hit>,
}

impl Reference {
    pub(super) fn new(triangles: &[Triangle], ray: &Ray) -> Self {
        let (line, prepared, shear) = (Line::new(ray), PreparedRay::new(*ray), Shear::new(ray.direction));
        let (mut exact, mut own) = (None::<ExactHit>, None::<Hit>);
        for (index, triangle) in (0_u32..).zip(triangles) {
            if let Some(t) = line.hit(triangle).filter(|&t| exact.is_none_or(|nearest| t < nearest.t)) {
                exact = Some(ExactHit { t, triangle: index });
            }
            if let Some(hit) = triangle.intersect(&prepared, &shear, prepared.ray.t_max)
                && own.is_none_or(|nearest| hit.t < nearest.t)
            {
                own = Some(Hit { t: hit.t, primitive_index: index, u: hit.u, v: hit.v });
            }
        }
        Self { exact, own }
    }
}

/// A ray in double precision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    origin: DVec3,
    pub(super) direction: DVec3,
    /// Smallest and largest distance.
    pub(super) limits: [f64; 2],
}

impl Line {
    pub(super) fn new(ray: &Ray) -> Self {
        let limits = [f64::from(ray.t_min.max(0.0)), f64::from(ray.t_max.min(f32::MAX))];
        Self { origin: ray.origin.as_dvec3(), direction: ray.direction.as_dvec3(), limits }
    }

    fn corners(&self, triangle: &Triangle) -> [DVec3; 3] {
        [triangle.a, triangle.b, triangle.c].map(|corner| corner.as_dvec3() - self.origin)
    }

    /// Distance of the hit. Neighbours calculate the same sign for a shared edge, so that nothing passes between them.
    fn hit(&self, triangle: &Triangle) -> Option<f64> {
        let [a, b, c] = self.corners(triangle);
        let d = self.direction;
        let weights = DVec3::new(d.dot(b.cross(c)), d.dot(c.cross(a)), d.dot(a.cross(b)));
        let sum = weights.element_sum();
        if weights.min_element() < 0.0 && weights.max_element() > 0.0 || sum == 0.0 {
            return None;
        }
        let weights = weights / sum;
        let t = (a * weights.x + b * weights.y + c * weights.z).dot(d) / d.length_squared();
        (self.limits[0]..=self.limits[1]).contains(&t).then_some(t)
    }

    /// Where the line meets `triangle`, or how far from it it passes.
    pub(super) fn meeting(&self, triangle: &Triangle) -> Meeting {
        let length = self.direction.length();
        let forward = self.direction / length;
        let (right, up) = forward.any_orthonormal_pair();
        let corners = self.corners(triangle);
        let [a, b, c] = corners.map(|corner| DVec2::new(corner.dot(right), corner.dot(up)));
        let depths = corners.map(|corner| corner.dot(forward));
        let size = corners.iter().map(|corner| corner.length()).fold(0.0, f64::max);
        let slack = size * ROUNDING + SMALLEST_STEP;
        // Distances from the three edges, positive inside.
        let area = (b - a).perp_dot(c - a);
        let edges = [(b, c), (c, a), (a, b)];
        let inside = edges.map(|(p, q)| {
            let edge = q - p;
            if edge.length() > 0.0 { edge.perp_dot(-p) / edge.length() * area.signum() } else { 0.0 }
        });
        let edge = (0..3).min_by(|&a, &b| inside[a].total_cmp(&inside[b])).unwrap_or(0);
        let innermost = inside[edge];
        let margin = if innermost > 0.0 && area != 0.0 {
            innermost
        } else {
            -edges.map(|(p, q)| distance_to_segment(p, q)).into_iter().fold(f64::INFINITY, f64::min)
        };
        // Depth of the plane, and how much it changes within the slack.
        let [least, most] = [depths.into_iter().fold(f64::MAX, f64::min), depths.into_iter().fold(f64::MIN, f64::max)];
        let [pa, pb, pc] = [(a, depths[0]), (b, depths[1]), (c, depths[2])].map(|(p, depth)| p.extend(depth));
        let normal = (pb - pa).cross(pc - pa);
        let tolerance = 2.0 * slack * (1.0 + normal.truncate().length() / normal.z.abs());
        let depth = normal.dot(pa) / normal.z;
        let longest = [b - a, c - b, a - c].map(DVec2::length).into_iter().fold(0.0, f64::max);
        // A triangle that is seen edge-on has no plane to speak of.
        let has_plane = longest > 0.0 && area.abs() / longest > slack;
        let (near, far) =
            if has_plane { (depth - tolerance, depth + tolerance) } else { (least - slack, most + slack) };
        let [near, far] = [near.max(least - slack), far.min(most + slack)].map(|depth| depth / length);
        Meeting { near, far, margin, slack, edge }
    }
}

/// Where a line meets a triangle, as far as single precision can tell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Meeting {
    /// Interval of the distance in lengths of the direction.
    pub(super) near: f64,
    pub(super) far: f64,
    /// Distance from the nearest edge, negative outside.
    margin: f64,
    slack: f64,
    /// The nearest edge, by the corner opposite.
    pub(super) edge: usize,
}

impl Meeting {
    /// Whether the triangle is hit by more than rounding.
    pub(super) fn is_sure(&self) -> bool {
        self.margin > self.slack
    }

    /// Whether single precision may find a hit.
    pub(super) fn is_possible(&self) -> bool {
        self.margin >= -self.slack
    }

    /// Whether single precision may find the distance `t`.
    pub(super) fn allows(&self, t: f64) -> bool {
        let rounding = t.abs() * ROUNDING;
        self.near - rounding <= t && t <= self.far + rounding
    }
}

/// Distance from the origin to the segment from `p` to `q`.
fn distance_to_segment(p: DVec2, q: DVec2) -> f64 {
    let edge = q - p;
    let along = if edge.length_squared() > 0.0 { (-p.dot(edge) / edge.length_squared()).clamp(0.0, 1.0) } else { 0.0 };
    (p + edge * along).length()
}
