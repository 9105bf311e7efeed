//! Random lines through convex bodies.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use super::aabb::Aabb;
use super::dop::Dop14;
use super::oriented::OrientedBox;
use super::ray::Ray;
use super::sphere::Sphere;

/// The line that enters a body at `entry`, where its inward unit normal is `normal`, in a direction of density cosine over π. It
/// begins `distance` before.
fn line_entering(entry: DVec3, normal: DVec3, distance: f64, mut random: impl FnMut() -> f64) -> Ray {
    let (sine_squared, angle) = (random(), TAU * random());
    let (sin, cos) = angle.sin_cos();
    let (x, y) = normal.any_orthonormal_pair();
    let direction = (x * cos + y * sin) * sine_squared.sqrt() + normal * (1.0 - sine_squared).sqrt();
    Ray::new((entry - direction * distance).as_vec3(), direction.as_vec3())
}

impl Aabb {
    /// A line that enters the box at a point uniform over its surface, in a direction of density cosine over π: a uniform choice
    /// among all lines that meet the box. It begins a diagonal before. `random` gives independent numbers, uniform in 0 to 1.
    pub(crate) fn random_line(&self, mut random: impl FnMut() -> f64) -> Ray {
        let (low, extent) = (self.min.as_dvec3(), self.extent().as_dvec3());
        let faces = [extent.y * extent.z, extent.z * extent.x, extent.x * extent.y];
        // One number chooses a face in proportion to the areas.
        let mut at = random() * 2.0 * faces.iter().sum::<f64>();
        let is_upper = at >= faces.iter().sum::<f64>();
        at -= if is_upper { faces.iter().sum() } else { 0.0 };
        let axis = if at < faces[0] { 0 } else { 1 + usize::from(at >= faces[0] + faces[1]) };
        let mut position = DVec3::new(random(), random(), random());
        position[axis] = f64::from(u8::from(is_upper));
        let normal = Vec3::AXES[axis].as_dvec3() * if is_upper { -1.0 } else { 1.0 };
        line_entering(low + position * extent, normal, extent.length(), random)
    }
}

impl Dop14 {
    /// A line that enters the polytope at a point uniform over its surface; see [`Aabb::random_line`]. It begins a diagonal of the box
    /// before.
    pub(crate) fn random_line(&self, mut random: impl FnMut() -> f64) -> Ray {
        let parts: Vec<(DVec3, [DVec3; 3])> =
            self.faces().flat_map(|face| face.fan().map(|part| (-face.normal, part)).collect::<Vec<_>>()).collect();
        let area = |[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a).length();
        let total: f64 = parts.iter().map(|(_, part)| area(part)).sum();
        let mut at = random() * total;
        let chosen = parts.iter().find(|(_, part)| {
            at -= area(part);
            at < 0.0
        });
        // A line or a point has no surface.
        let Some((normal, [a, b, c])) = chosen.or(parts.last()) else { return self.bounds.random_line(random) };
        // Uniform over the triangle (Turk, *Generating Random Points in Triangles*, Graphics Gems, 1990).
        let (u, v) = (random().sqrt(), random());
        let entry = *a * (1.0 - u) + *b * (u * (1.0 - v)) + *c * (u * v);
        line_entering(entry, *normal, self.bounds.extent().as_dvec3().length(), random)
    }
}

impl OrientedBox {
    /// A line that enters the box at a point uniform over its surface; see [`Aabb::random_line`]. It begins a diagonal before.
    pub(crate) fn random_line(&self, mut random: impl FnMut() -> f64) -> Ray {
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

impl Sphere {
    /// A line that enters the sphere at a point uniform over its surface; see [`Aabb::random_line`]. It begins a diameter before.
    pub(crate) fn random_line(&self, mut random: impl FnMut() -> f64) -> Ray {
        let radius = f64::from(self.radius.max(0.0));
        let (z, angle) = (2.0 * random() - 1.0, TAU * random());
        let (sin, cos) = angle.sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        let outward = DVec3::new(r * cos, r * sin, z);
        line_entering(self.center.as_dvec3() + outward * radius, -outward, 2.0 * radius, random)
    }
}
