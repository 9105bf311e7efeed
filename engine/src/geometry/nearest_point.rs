//! The point of a triangle that is nearest to a given point, in double precision.

use glam::{DVec3, Vec3};

use super::triangle::Triangle;

/// Square of the sine of the angle between two edges below which a triangle counts as degenerate, so that its nearest point is sought on
/// its edges alone. The products of coordinates below are exact to 2⁻⁵² of the edges' squares, a millionth of it.
const FLATTEST: f64 = 1e-20;

/// The part of a triangle that a point lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Feature {
    /// The inside.
    Face,
    /// An edge without its ends, by its position: from a to b, from b to c, from c to a.
    Edge(u8),
    /// A corner: a, b or c.
    Corner(u8),
}

/// The point of a triangle that is nearest to a given point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrianglePoint {
    /// The point of the triangle.
    pub point: DVec3,
    /// Square of its distance, in world units.
    pub distance_squared: f64,
    /// Barycentric weight of the triangle's second corner.
    pub u: f64,
    /// Barycentric weight of the triangle's third corner.
    pub v: f64,
    /// The part of the triangle that it lies on.
    pub feature: Feature,
}

/// The largest bound of a container that may hold a point at the squared distance `nearest`: with room for the rounding of five
/// operations (2⁻²² together) and of squares that are no normal numbers.
pub(crate) fn reach(nearest: f64) -> f32 {
    (nearest * (1.0 + 2e-6) + 1e-43) as f32
}

impl Triangle {
    /// The point of the triangle that is nearest to `point` (Ericson, *Real-Time Collision Detection*, 2005, section 5.1.5), in double
    /// precision, whose range holds all products of single-precision coordinates. Never nearer than the triangle's own box, so that no
    /// tree of boxes can lose it.
    pub fn nearest_point(&self, point: Vec3) -> TrianglePoint {
        let p = point.as_dvec3();
        let [a, b, c] = [self.a, self.b, self.c].map(Vec3::as_dvec3);
        let (ab, ac) = (b - a, c - a);
        let is_flat = ab.cross(ac).length_squared() <= FLATTEST * ab.length_squared() * ac.length_squared();
        let (feature, u, v) = if is_flat { on_edges([a, b, c], p) } else { on_regions([a, b, c], p) };
        let nearest = match feature {
            Feature::Corner(0) => a,
            Feature::Corner(1) => b,
            Feature::Corner(_) => c,
            Feature::Edge(1) => b + (c - b) * v,
            Feature::Edge(_) | Feature::Face => a + ab * u + ac * v,
        };
        let bounds = self.bounds();
        let outside = (bounds.min.as_dvec3() - p).max(p - bounds.max.as_dvec3()).max(DVec3::ZERO);
        let distance_squared = nearest.distance_squared(p).max(outside.length_squared());
        TrianglePoint { point: nearest, distance_squared, u, v, feature }
    }
}

/// Feature and weights of the point nearest to `p` by the Voronoi region that `p` lies in.
fn on_regions([a, b, c]: [DVec3; 3], p: DVec3) -> (Feature, f64, f64) {
    let (ab, ac) = (b - a, c - a);
    let along = |corner: DVec3| (ab.dot(p - corner), ac.dot(p - corner));
    let ((a1, a2), (b1, b2), (c1, c2)) = (along(a), along(b), along(c));
    if a1 <= 0.0 && a2 <= 0.0 {
        return (Feature::Corner(0), 0.0, 0.0);
    }
    if b1 >= 0.0 && b2 <= b1 {
        return (Feature::Corner(1), 1.0, 0.0);
    }
    if c2 >= 0.0 && c1 <= c2 {
        return (Feature::Corner(2), 0.0, 1.0);
    }
    let weight_c = a1 * b2 - b1 * a2;
    if weight_c <= 0.0 && a1 >= 0.0 && b1 <= 0.0 {
        return (Feature::Edge(0), a1 / (a1 - b1), 0.0);
    }
    let weight_b = c1 * a2 - a1 * c2;
    if weight_b <= 0.0 && a2 >= 0.0 && c2 <= 0.0 {
        return (Feature::Edge(2), 0.0, a2 / (a2 - c2));
    }
    let weight_a = b1 * c2 - c1 * b2;
    if weight_a <= 0.0 && b2 >= b1 && c1 >= c2 {
        let v = (b2 - b1) / ((b2 - b1) + (c1 - c2));
        return (Feature::Edge(1), 1.0 - v, v);
    }
    let scale = 1.0 / (weight_a + weight_b + weight_c);
    (Feature::Face, weight_b * scale, weight_c * scale)
}

/// Feature and weights of the point on the edges that is nearest to `p`: all of a degenerate triangle.
fn on_edges(corners: [DVec3; 3], p: DVec3) -> (Feature, f64, f64) {
    let mut best = (f64::INFINITY, 0, 0.0);
    for edge in 0..3 {
        let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
        let length_squared = (to - from).length_squared();
        let along = if length_squared > 0.0 { (p - from).dot(to - from) / length_squared } else { 0.0 };
        let along = along.clamp(0.0, 1.0);
        let distance = (from + (to - from) * along).distance_squared(p);
        if distance < best.0 {
            best = (distance, edge, along);
        }
    }
    let (_, edge, along) = best;
    let corner = |corner: usize| (Feature::Corner(corner as u8), f64::from(corner == 1), f64::from(corner == 2));
    match (edge, along) {
        (edge, 0.0) => corner(edge),
        (edge, 1.0) => corner((edge + 1) % 3),
        (0, along) => (Feature::Edge(0), along, 0.0),
        (1, along) => (Feature::Edge(1), 1.0 - along, along),
        (_, along) => (Feature::Edge(2), 0.0, 1.0 - along),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sphere::tests::numbers;

    /// Nearest squared distance among points of a fine grid over the triangle, and of the plane where `p` projects into it.
    fn by_sampling(triangle: &Triangle, p: Vec3) -> f64 {
        let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3);
        let steps = 64;
        let weights = (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| (i, j)));
        let points = weights.map(|(i, j)| a + (b - a) * (f64::from(i) / 64.0) + (c - a) * (f64::from(j) / 64.0));
        points.map(|point| point.distance_squared(p.as_dvec3())).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn no_point_of_the_triangle_is_nearer() {
        let mut number = numbers();
        let mut features = std::collections::HashMap::new();
        for case in 0..2_000 {
            let mut point = |scale: f32| Vec3::new(number(), number(), number()) * scale;
            let a = point(1.0);
            // Thin ones, points and lines among them.
            let c = match case % 5 {
                0 => a,
                1 => a + point(1e-6),
                _ => point(1.0),
            };
            let b = if case % 7 == 0 { a } else { point(1.0) };
            let triangle = Triangle { a, b, c };
            let p = if case % 3 == 0 { point(0.5) } else { point(4.0) };
            let found = triangle.nearest_point(p);
            *features.entry(found.feature).or_insert(0) += 1;
            let sampled = by_sampling(&triangle, p);
            assert!(found.distance_squared <= sampled * (1.0 + 1e-12) + 1e-24, "{triangle:?} {p} {found:?} {sampled}");
            // The sampled points are within a grid step, so that the true one is not much nearer either.
            assert!(found.distance_squared.sqrt() >= sampled.sqrt() - 0.1, "{triangle:?} {p} {found:?} {sampled}");
            let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3);
            let by_weights = a * (1.0 - found.u - found.v) + b * found.u + c * found.v;
            assert!(by_weights.distance(found.point) < 1e-12, "{triangle:?} {p} {found:?}");
            assert!(found.u >= 0.0 && found.v >= 0.0 && found.u + found.v <= 1.0 + 1e-12, "{found:?}");
            // Nothing shorter: the way to the point is perpendicular to the part of the triangle that it lies on.
            let way = p.as_dvec3() - found.point;
            let edges = [b - a, c - b, a - c];
            let free = match found.feature {
                Feature::Face => &edges[..],
                Feature::Edge(edge) => std::slice::from_ref(&edges[usize::from(edge)]),
                Feature::Corner(_) => &[],
            };
            for edge in free {
                assert!(way.dot(*edge).abs() <= 1e-9 * (1.0 + way.length()), "{triangle:?} {p} {found:?}");
            }
        }
        assert_eq!(features.len(), 7, "{features:?}");
    }

    #[test]
    fn numbers_at_both_ends_of_the_range_are_no_trouble() {
        for scale in [1e-44_f32, 1e-30, 1.0, 1e30, 1e38] {
            let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z) * scale;
            let triangle = Triangle { a: at(0.0, 0.0, 0.0), b: at(3.0, 0.0, 0.0), c: at(0.0, 3.0, 0.0) };
            let found = triangle.nearest_point(at(1.0, 1.0, 2.0));
            let height = f64::from(scale * 2.0);
            assert_eq!(found.feature, Feature::Face, "{scale}");
            assert!((found.distance_squared.sqrt() / height - 1.0).abs() < 1e-12, "{scale} {found:?}");
        }
    }
}
