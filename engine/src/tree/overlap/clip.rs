//! Area of the part of a triangle inside a container.

use arrayvec::ArrayVec;

use crate::geometry::Container;
use crate::geometry::{Aabb, Dop14, OrientedBox, Sphere, Triangle, cut};

/// A container that a triangle can be clipped against.
pub(super) trait Clip: Container {
    /// Area of the part of `triangle`, whose box is `bounds`, that lies inside the container.
    fn clipped_area(&self, triangle: &Triangle, bounds: &Aabb) -> f64;

    /// Whether a box lies inside the container as a whole.
    fn contains_box(&self, other: &Aabb) -> bool;

    /// Whether a box is known to lie outside of the container as a whole.
    fn misses_box(&self, other: &Aabb) -> bool;
}

/// Whether a box lies as a whole in half-spaces, each an outward normal and the largest dot product with it inside.
fn all_within(half_spaces: &[(glam::DVec3, f64)], other: &Aabb) -> bool {
    half_spaces.iter().all(|(normal, limit)| normal.dot(farthest(*normal, other)) <= *limit)
}

/// Whether a box lies as a whole outside of one of the half-spaces.
fn all_beyond_one(half_spaces: &[(glam::DVec3, f64)], other: &Aabb) -> bool {
    half_spaces.iter().any(|(normal, limit)| normal.dot(farthest(-*normal, other)) > *limit)
}

/// The corner of a box that is farthest along `normal`.
fn farthest(normal: glam::DVec3, of: &Aabb) -> glam::DVec3 {
    glam::DVec3::select(normal.cmpgt(glam::DVec3::ZERO), of.max.as_dvec3(), of.min.as_dvec3())
}

impl Clip for Aabb {
    /// Exact: clipping against each face (Sutherland and Hodgman, *Reentrant Polygon Clipping*, 1974).
    fn clipped_area(&self, triangle: &Triangle, bounds: &Aabb) -> f64 {
        if self.intersection(bounds).is_empty() {
            return 0.0;
        }
        if Aabb::contains(self, bounds, 0.0) {
            return triangle.area();
        }
        let (min, max) = (self.min.as_dvec3(), self.max.as_dvec3());
        // Each of the six planes adds at most one corner to a convex polygon.
        let mut polygon: ArrayVec<_, 9> =
            [triangle.a, triangle.b, triangle.c].map(glam::Vec3::as_dvec3).into_iter().collect();
        for axis in 0..3 {
            for (plane, sign) in [(min[axis], 1.0), (max[axis], -1.0)] {
                cut(&mut polygon, |point| (point[axis] - plane) * sign);
                if polygon.len() < 3 {
                    return 0.0;
                }
            }
        }
        area(&polygon)
    }

    fn contains_box(&self, other: &Aabb) -> bool {
        self.contains(other, 0.0)
    }

    fn misses_box(&self, other: &Aabb) -> bool {
        self.intersection(other).is_empty()
    }
}

impl Clip for Dop14 {
    /// Exact, as for boxes.
    fn clipped_area(&self, triangle: &Triangle, bounds: &Aabb) -> f64 {
        let corners = [triangle.a, triangle.b, triangle.c];
        if self.bounds.intersection(bounds).is_empty() {
            return 0.0;
        }
        if corners.iter().all(|&corner| self.excess_of_point(corner) <= 0.0) {
            return triangle.area();
        }
        let mut polygon: ArrayVec<_, 17> = corners.map(glam::Vec3::as_dvec3).into_iter().collect();
        for (normal, limit) in self.half_spaces() {
            cut(&mut polygon, |point| limit - normal.dot(point));
            if polygon.len() < 3 {
                return 0.0;
            }
        }
        area(&polygon)
    }

    fn contains_box(&self, other: &Aabb) -> bool {
        all_within(&self.half_spaces(), other)
    }

    fn misses_box(&self, other: &Aabb) -> bool {
        all_beyond_one(&self.half_spaces(), other)
    }
}

impl Clip for OrientedBox {
    /// Exact, as for boxes.
    fn clipped_area(&self, triangle: &Triangle, _: &Aabb) -> f64 {
        // A box that is turned may reach beyond the one around what it encloses, and holds triangles there.
        let corners = [triangle.a, triangle.b, triangle.c];
        let mut polygon: ArrayVec<_, 9> = corners.map(glam::Vec3::as_dvec3).into_iter().collect();
        let half_spaces = self.half_spaces();
        if half_spaces.iter().all(|(normal, limit)| polygon.iter().all(|point| normal.dot(*point) <= *limit)) {
            return triangle.area();
        }
        for (normal, limit) in half_spaces {
            cut(&mut polygon, |point| limit - normal.dot(point));
            if polygon.len() < 3 {
                return 0.0;
            }
        }
        area(&polygon)
    }

    fn contains_box(&self, other: &Aabb) -> bool {
        all_within(&self.half_spaces(), other)
    }

    fn misses_box(&self, other: &Aabb) -> bool {
        all_beyond_one(&self.half_spaces(), other)
    }
}

/// Surface area of a convex polygon of at least three corners.
fn area(polygon: &[glam::DVec3]) -> f64 {
    let fan = (1..polygon.len() - 1).map(|i| (polygon[i] - polygon[0]).cross(polygon[i + 1] - polygon[0]));
    fan.sum::<glam::DVec3>().length() * 0.5
}

impl Clip for Sphere {
    /// Exact: the sphere cuts the plane of the triangle in a disc; the area common to a triangle and a disc is a sum over the edges.
    fn clipped_area(&self, triangle: &Triangle, bounds: &Aabb) -> f64 {
        let center = self.center.as_dvec3();
        let radius = f64::from(self.radius);
        let nearest = center.clamp(bounds.min.as_dvec3(), bounds.max.as_dvec3());
        if radius <= 0.0 || nearest.distance_squared(center) >= radius * radius {
            return 0.0;
        }
        let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(glam::Vec3::as_dvec3);
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { return 0.0 };
        let height = (center - a).dot(normal);
        let disc_squared = radius * radius - height * height;
        if disc_squared <= 0.0 {
            return 0.0;
        }
        let x_axis = (b - a).normalize();
        let y_axis = normal.cross(x_axis);
        let [a, b, c] = [a, b, c].map(|corner| {
            let offset = corner - center;
            glam::DVec2::new(offset.dot(x_axis), offset.dot(y_axis))
        });
        let area = edge_area(a, b, disc_squared) + edge_area(b, c, disc_squared) + edge_area(c, a, disc_squared);
        area.max(0.0)
    }

    fn contains_box(&self, other: &Aabb) -> bool {
        let center = self.center.as_dvec3();
        let farthest = (center - other.min.as_dvec3()).abs().max((other.max.as_dvec3() - center).abs());
        farthest.length() <= f64::from(self.radius)
    }

    fn misses_box(&self, other: &Aabb) -> bool {
        let center = self.center.as_dvec3();
        let nearest = center.clamp(other.min.as_dvec3(), other.max.as_dvec3());
        nearest.distance(center) > f64::from(self.radius)
    }
}

/// Signed area common to the disc and the triangle from the disc's centre to the edge `p`–`q`.
fn edge_area(p: glam::DVec2, q: glam::DVec2, radius_squared: f64) -> f64 {
    // Angle between two directions, signed.
    let sector = |from: glam::DVec2, to: glam::DVec2| 0.5 * radius_squared * from.perp_dot(to).atan2(from.dot(to));
    let edge = q - p;
    let (aa, half_b, cc) = (edge.length_squared(), p.dot(edge), p.length_squared() - radius_squared);
    let discriminant = half_b * half_b - aa * cc;
    if aa == 0.0 || discriminant <= 0.0 {
        return sector(p, q);
    }
    // Where the line of the edge enters and leaves the disc, clamped to the edge.
    let root = discriminant.sqrt();
    let (enter, leave) = (((-half_b - root) / aa).max(0.0), ((-half_b + root) / aa).min(1.0));
    if enter >= leave {
        return sector(p, q);
    }
    let (inside_from, inside_to) = (p + edge * enter, p + edge * leave);
    sector(p, inside_from) + 0.5 * inside_from.perp_dot(inside_to) + sector(inside_to, q)
}
