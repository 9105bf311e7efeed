//! Polytopes as containers.

use fearless_simd::Simd;
use glam::{DVec3, Vec3};

use super::{Container, ContainerKind, line_entering};
use crate::geometry::aabb::Aabb;
use crate::geometry::dop::{DIAGONAL_PAD, Dop14, PER_DIAGONAL, along_diagonals};
use crate::geometry::intersect::PairEntry;
use crate::geometry::prepared_ray::PreparedRay;
use crate::geometry::ray::Ray;
use crate::geometry::ray_dop::DiagonalRay;
use crate::geometry::triangle::Triangle;

impl Container for Dop14 {
    const KIND: ContainerKind = ContainerKind::Dop14;
    type RayPart = DiagonalRay;
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, low: [f32::INFINITY; 4], high: [f32::NEG_INFINITY; 4] };

    /// Padded.
    fn of_triangle(triangle: &Triangle) -> Self {
        let mut found = Self { bounds: triangle.bounds(), ..Self::EMPTY };
        for corner in [triangle.a, triangle.b, triangle.c] {
            let pad = DIAGONAL_PAD * corner.abs().element_sum();
            for (diagonal, along) in along_diagonals(corner).into_iter().enumerate() {
                // Where sums overflow the planes cut nothing off: these functions drop a NaN.
                found.low[diagonal] = found.low[diagonal].min((along - pad).max(-f32::MAX));
                found.high[diagonal] = found.high[diagonal].max((along + pad).min(f32::MAX));
            }
        }
        found
    }

    fn union(&self, other: &Self) -> Self {
        let mut union = Self { bounds: self.bounds.union(&other.bounds), ..*self };
        for diagonal in 0..4 {
            union.low[diagonal] = self.low[diagonal].min(other.low[diagonal]);
            union.high[diagonal] = self.high[diagonal].max(other.high[diagonal]);
        }
        union
    }

    fn relative_area(&self) -> f32 {
        self.half_area()
    }

    #[inline]
    fn scaled(&self, factor: f32) -> Self {
        Self {
            bounds: Aabb { min: self.bounds.min * factor, max: self.bounds.max * factor },
            low: self.low.map(|plane| plane * factor),
            high: self.high.map(|plane| plane * factor),
        }
    }

    fn ray_part(ray: &PreparedRay) -> DiagonalRay {
        DiagonalRay::new(ray)
    }

    /// Errs towards hits: the planes across the axes are those of [`Aabb::entry`], and the others have room for all rounding.
    fn entry(&self, ray: &PreparedRay, part: &DiagonalRay, t_min: f32, t_max: f32) -> Option<f32> {
        self.entry_inlined(ray, part, t_min, t_max)
    }

    #[inline(always)]
    fn entry_pair<S: Simd>(
        _: S,
        pair: [&Self; 2],
        ray: &PreparedRay,
        part: &DiagonalRay,
        t_min: f32,
        t_max: f32,
    ) -> PairEntry {
        PairEntry::of([pair[0].entry_inlined(ray, part, t_min, t_max), pair[1].entry_inlined(ray, part, t_min, t_max)])
    }

    /// Of the largest distance to the box and to the planes along the diagonals.
    fn distance_squared(&self, point: Vec3) -> f32 {
        let pad = DIAGONAL_PAD * point.abs().element_sum();
        let mut farthest = 0.0_f32;
        for (at, along) in along_diagonals(point).into_iter().enumerate() {
            let outside = (self.low[at] - along).max(along - self.high[at]) - pad;
            farthest = farthest.max(if outside <= f32::MAX { outside * PER_DIAGONAL } else { 0.0 });
        }
        self.bounds.distance_squared(point).max(farthest * farthest)
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn contains_point(&self, point: Vec3, slack: f32) -> bool {
        self.excess_of_point(point) <= f64::from(slack)
    }

    fn contains(&self, other: &Self, slack: f32) -> bool {
        // The diagonals are √3 long.
        let slack_along = slack * 1.75;
        let between =
            |at: usize| self.low[at] - slack_along <= other.low[at] && other.high[at] <= self.high[at] + slack_along;
        other.is_empty() || self.bounds.contains(&other.bounds, slack) && (0..4).all(between)
    }

    fn intersection_area(&self, other: &Self) -> f32 {
        self.intersection(other).half_area()
    }

    fn intersection_bounds(&self, other: &Self) -> Self {
        self.intersection(other)
    }

    fn random_line(&self, mut random: impl FnMut() -> f64) -> Ray {
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
