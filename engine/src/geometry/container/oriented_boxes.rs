//! Oriented boxes as containers.

use glam::{DVec3, Vec3, Vec3A};

use super::{Container, ContainerKind, line_entering};
use crate::geometry::aabb::Aabb;
use crate::geometry::extremes::Extremes;
use crate::geometry::intersect::FAR_SLACK;
use crate::geometry::oriented::{ORIENTED_PAD, OrientedBox, OrientedKind};
use crate::geometry::oriented_faces::twice_area;
use crate::geometry::oriented_fit::intervals;
use crate::geometry::prepared_ray::{PARALLEL_PAD, PreparedRay};
use crate::geometry::ray::Ray;
use crate::geometry::ray_oriented::{FARTHEST, OrientedRay};
use crate::geometry::triangle::Triangle;

impl Container for OrientedBox {
    const KIND: ContainerKind = ContainerKind::Oriented;
    type RayPart = OrientedRay;
    const EMPTY: Self =
        Self { bounds: Aabb::EMPTY, normals: Vec3::AXES, low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    /// The smallest of a plain, a fitted and a skewed box, as the pass Orient chooses it.
    fn of_triangle(triangle: &Triangle) -> Self {
        let corners = [triangle.a, triangle.b, triangle.c];
        let Some(extremes) = Extremes::around(corners) else { return Self::EMPTY };
        Self::choose(triangle.bounds(), &extremes, true, |normals| intervals(corners, normals))
    }

    /// A box along the axes around the boxes of both; the other one where one is empty.
    fn union(&self, other: &Self) -> Self {
        match (self.is_empty(), other.is_empty()) {
            (true, _) => *other,
            (_, true) => *self,
            _ => Self::plain(self.bounds.union(&other.bounds)),
        }
    }

    fn relative_area(&self) -> f32 {
        self.half_area()
    }

    fn scaled(&self, factor: f32) -> Self {
        Self {
            bounds: Aabb { min: self.bounds.min * factor, max: self.bounds.max * factor },
            low: self.low.map(|plane| plane * factor),
            high: self.high.map(|plane| plane * factor),
            ..*self
        }
    }

    fn ray_part(ray: &PreparedRay) -> OrientedRay {
        OrientedRay::new(ray)
    }

    /// Errs towards hits: the planes have room for all rounding, see `docs/containers.md`.
    #[inline]
    fn entry(&self, _: &PreparedRay, ray: &OrientedRay, t_min: f32, t_max: f32) -> Option<f32> {
        let [a, b, c] = self.normals;
        let rows = [Vec3A::new(a.x, b.x, c.x), Vec3A::new(a.y, b.y, c.y), Vec3A::new(a.z, b.z, c.z)];
        let along = |v: Vec3| rows[0] * v.x + rows[1] * v.y + rows[2] * v.z;
        let (origin, reciprocal) = (along(ray.origin), along(ray.direction).recip());
        // Where the ray is parallel to planes, it passes if the origin lies between them.
        let parallel = !reciprocal.is_finite_mask();
        let inverse = Vec3A::select(parallel, Vec3A::MAX, reciprocal);
        let pad = Vec3A::select(parallel, Vec3A::splat(ray.pad + PARALLEL_PAD), Vec3A::splat(ray.pad));
        let t0 = (Vec3A::from_array(self.low) - (origin + pad)) * inverse;
        let t1 = (Vec3A::from_array(self.high) - (origin - pad)) * inverse;
        let near = t0.min(t1).max_element();
        let far = t0.max(t1).min_element() * FAR_SLACK;
        let entry = if near > t_min { near } else { t_min };
        // An empty box is inverted and must stay a miss.
        (entry <= far && entry <= t_max && self.low[0] <= self.high[0]).then_some(entry)
    }

    /// Of the largest distance to the box along the axes and to the planes.
    fn distance_squared(&self, point: Vec3) -> f32 {
        let size = point.abs().element_sum();
        let mut farthest = 0.0_f32;
        if size <= FARTHEST {
            for (at, normal) in self.normals.into_iter().enumerate() {
                let along = normal.dot(point);
                let outside = (self.low[at] - along).max(along - self.high[at]) - ORIENTED_PAD * size;
                let distance = outside / normal.length();
                // A direction too short for its length to be a normal number has no meaning.
                farthest = farthest.max(if distance <= f32::MAX { distance } else { 0.0 });
            }
        }
        self.bounds.distance_squared(point).max(farthest * farthest)
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn contains_point(&self, point: Vec3, slack: f32) -> bool {
        self.excess_of_point(point) <= f64::from(slack)
    }

    /// True if the box along the axes around what `other` encloses lies inside that of this one. What encloses the same triangles may
    /// still stick out of the planes: each is fitted to the triangles alone.
    fn contains(&self, other: &Self, slack: f32) -> bool {
        self.bounds.contains(&other.bounds, slack)
    }

    fn intersection_area(&self, other: &Self) -> f32 {
        let common = self.bounds.intersection(&other.bounds);
        if self.is_empty() || other.is_empty() {
            return 0.0;
        }
        if [self, other].map(Self::kind) == [OrientedKind::Plain; 2] {
            return common.half_area();
        }
        (self.intersection_faces(other).iter().map(|face| twice_area(face).length()).sum::<f64>() * 0.25) as f32
    }

    fn intersection_bounds(&self, other: &Self) -> Self {
        if self.is_empty() || other.is_empty() {
            return Self::EMPTY;
        }
        let bounds = if [self, other].map(Self::kind) == [OrientedKind::Plain; 2] {
            self.bounds.intersection(&other.bounds)
        } else {
            Aabb::around(self.intersection_faces(other).into_iter().flatten().map(DVec3::as_vec3))
        };
        if bounds.is_empty() { Self::EMPTY } else { Self::plain(bounds) }
    }

    fn random_line(&self, mut random: impl FnMut() -> f64) -> Ray {
        if self.is_empty() {
            return self.bounds.random_line(random);
        }
        let faces = self.faces().map(|[a, b, _, d]| [a, b - a, d - a]);
        let areas = faces.map(|[_, u, v]| u.cross(v).length());
        let mut at = random() * areas.iter().sum::<f64>();
        let chosen = areas.iter().position(|area| {
            at -= area;
            at < 0.0
        });
        let [corner, u, v] = faces[chosen.unwrap_or(5)];
        let (normal, _) = self.half_spaces()[chosen.unwrap_or(5)];
        let entry = corner + u * random() + v * random();
        let diagonal = self.corners().into_iter().map(|corner| corner.distance(entry)).fold(0.0, f64::max);
        line_entering(entry, -normal.normalize(), diagonal, random)
    }
}
