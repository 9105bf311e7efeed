//! Bounds as numbers of the file, and by how much something sticks out of them.

use bytemuck::Pod;
use glam::{DVec3, Vec3};

use super::arrays::Rows;
use super::bounds_problem::BoundsProblem;
use crate::geometry::{Aabb, Dop14, OrientedBox, Sphere, Triangle};
use crate::tree::Container;

/// Largest absolute coordinate and radius: of larger ones, squares and areas are not finite.
pub const MAX_COORDINATE: f32 = 1e18;

/// Largest absolute coordinate of a direction across planes: 1, rounded, for which the padding of rays is made.
const MAX_DIRECTION: f32 = 1.000_001;
/// Shortest direction across planes: of much shorter ones, products with the directions of rays would not be numbers.
const LEAST_DIRECTION: f32 = 1e-6;
/// Smallest volume that three directions of length 1 span.
const LEAST_VOLUME: f64 = 1e-6;

/// A container as tree files have it: its numbers in the order of its fields.
pub(super) trait FileContainer: Container + Pod {
    /// The fault of these bounds, where all their numbers are finite.
    fn problem(&self) -> Option<BoundsProblem>;
    /// By how much `inner` sticks out, in world units; negative or 0 where it does not.
    fn excess_of(&self, inner: &Self) -> f64;
    /// By how much `triangle` sticks out, in world units; negative or 0 where it does not.
    fn excess_of_triangle(&self, triangle: &Triangle) -> f64;

    /// By how much a box along the axes sticks out, in world units; negative or 0 where it does not.
    fn excess_of_bounds(&self, inner: &Aabb) -> f64 {
        self.bounds().excess_of(inner)
    }

    /// Reads the container of a node.
    fn read(rows: Rows<'_>, node: u32) -> Result<Self, BoundsProblem> {
        let mut container = Self::EMPTY;
        let numbers: &mut [f32] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut container));
        let found: [f32; 21] = rows.floats(node);
        numbers.copy_from_slice(&found[..numbers.len().min(21)]);
        // The first six are coordinates, and a radius; planes askew are at sums of these.
        if let Some(&number) = numbers.iter().take(6).find(|number| !is_usable(**number)) {
            return Err(BoundsProblem::Number(number));
        }
        container.problem().map_or(Ok(container), Err)
    }

    /// Its numbers, in the order of the file.
    fn numbers(&self) -> &[f32] {
        bytemuck::cast_slice(std::slice::from_ref(self))
    }
}

/// Whether a coordinate or radius is finite and not too large.
pub(super) fn is_usable(number: f32) -> bool {
    number.abs() <= MAX_COORDINATE
}

impl FileContainer for Aabb {
    fn problem(&self) -> Option<BoundsProblem> {
        let inside_out = |&axis: &usize| self.min[axis] > self.max[axis];
        let axis = (0..3).find(inside_out)?;
        Some(BoundsProblem::InsideOut { axis, min: self.min[axis], max: self.max[axis] })
    }

    fn excess_of(&self, inner: &Self) -> f64 {
        let [min, max, inner_min, inner_max] = [self.min, self.max, inner.min, inner.max].map(Vec3::as_dvec3);
        (min - inner_min).max(inner_max - max).max_element()
    }

    fn excess_of_triangle(&self, triangle: &Triangle) -> f64 {
        self.excess_of(&triangle.bounds())
    }
}

impl FileContainer for Sphere {
    fn problem(&self) -> Option<BoundsProblem> {
        (self.radius < 0.0).then_some(BoundsProblem::NegativeRadius(self.radius))
    }

    fn excess_of(&self, inner: &Self) -> f64 {
        let [center, inner_center] = [self.center, inner.center].map(Vec3::as_dvec3);
        center.distance(inner_center) + f64::from(inner.radius) - f64::from(self.radius)
    }

    fn excess_of_triangle(&self, triangle: &Triangle) -> f64 {
        let center = self.center.as_dvec3();
        let distances = [triangle.a, triangle.b, triangle.c].map(|corner| DVec3::distance(center, corner.as_dvec3()));
        distances.into_iter().fold(0.0, f64::max) - f64::from(self.radius)
    }
}

impl FileContainer for Dop14 {
    fn problem(&self) -> Option<BoundsProblem> {
        let planes = self.low.into_iter().chain(self.high);
        if let Some(plane) = planes.into_iter().find(|plane| plane.is_nan() || plane.abs() > 4.0 * MAX_COORDINATE) {
            return Some(BoundsProblem::Diagonal(plane));
        }
        let inside_out = || {
            let diagonal = (0..4).find(|&at| self.low[at] > self.high[at])?;
            let (low, high) = (self.low[diagonal], self.high[diagonal]);
            Some(BoundsProblem::DiagonalInsideOut { diagonal, low, high })
        };
        self.bounds.problem().or_else(inside_out)
    }

    fn excess_of(&self, inner: &Self) -> f64 {
        let beyond = |at: usize| {
            let (low, high) = (f64::from(self.low[at]), f64::from(self.high[at]));
            (low - f64::from(inner.low[at])).max(f64::from(inner.high[at]) - high) / 3.0_f64.sqrt()
        };
        (0..4).map(beyond).fold(self.bounds.excess_of(&inner.bounds), f64::max)
    }

    fn excess_of_triangle(&self, triangle: &Triangle) -> f64 {
        let corners = [triangle.a, triangle.b, triangle.c];
        corners.into_iter().map(|corner| self.excess_of_point(corner)).fold(f64::NEG_INFINITY, f64::max)
    }
}

impl FileContainer for OrientedBox {
    fn problem(&self) -> Option<BoundsProblem> {
        let unusable = |number: &f32| number.is_nan() || number.abs() > 4.0 * MAX_COORDINATE;
        if let Some(plane) = self.low.into_iter().chain(self.high).find(unusable) {
            return Some(BoundsProblem::Diagonal(plane));
        }
        let coordinates = self.normals.map(|normal| normal.to_array());
        if let Some(&number) =
            coordinates.as_flattened().iter().find(|number| number.is_nan() || number.abs() > MAX_DIRECTION)
        {
            return Some(BoundsProblem::Direction(number));
        }
        let [a, b, c] = self.normals.map(Vec3::as_dvec3);
        let shortest = [a, b, c].map(DVec3::length).into_iter().fold(f64::INFINITY, f64::min) as f32;
        if shortest < LEAST_DIRECTION {
            return Some(BoundsProblem::ShortDirection(shortest));
        }
        let volume = a.dot(b.cross(c)).abs();
        if volume < LEAST_VOLUME * a.length() * b.length() * c.length() {
            return Some(BoundsProblem::FlatDirections);
        }
        let inside_out = || {
            let at = (0..3).find(|&at| self.low[at] > self.high[at])?;
            Some(BoundsProblem::OrientedInsideOut { at, low: self.low[at], high: self.high[at] })
        };
        self.bounds.problem().or_else(inside_out)
    }

    fn excess_of(&self, inner: &Self) -> f64 {
        self.bounds.excess_of(&inner.bounds)
    }

    fn excess_of_bounds(&self, inner: &Aabb) -> f64 {
        let [min, max] = [inner.min, inner.max].map(Vec3::as_dvec3);
        let beyond = self.half_spaces().map(|(normal, limit)| {
            let reach = (normal * min).max(normal * max).element_sum();
            (reach - limit) / normal.length()
        });
        beyond.into_iter().fold(self.bounds.excess_of(inner), f64::max)
    }

    fn excess_of_triangle(&self, triangle: &Triangle) -> f64 {
        let corners = [triangle.a, triangle.b, triangle.c];
        corners.into_iter().map(|corner| self.excess_of_point(corner)).fold(f64::NEG_INFINITY, f64::max)
    }
}
