//! Choosing three directions for the planes of an oriented box.

use glam::{DVec3, Vec3};

use super::aabb::Aabb;
use super::extremes::Extremes;
use super::oriented::{OrientedBox, half_area_between};

/// Share of the surface of the plain box that planes askew must stay below. Tests cost the same for all kinds, and the plain one is
/// exact: it stays where the other ones gain next to nothing.
const LARGEST_SHARE: f64 = 0.98;
/// Smallest and largest coordinate, in absolute value, of what is enclosed: beyond, sums of products leave the range in which the
/// padding holds.
const SMALLEST_SIZE: f32 = 1e-20;
const LARGEST_SIZE: f32 = 1e18;
/// Part of the longest distance between points below which a distance counts as none.
const NO_DISTANCE: f64 = 1e-9;

/// Each three of the seven directions that are linearly independent; the axes alone come first.
const TRIPLES: [[usize; 3]; 29] = triples();

const fn triples() -> [[usize; 3]; 29] {
    let (mut found, mut count, mut a) = ([[0; 3]; 29], 0, 0);
    while a < 7 {
        let mut b = a + 1;
        while b < 7 {
            let mut c = b + 1;
            while c < 7 {
                if determinant(a, b, c) != 0 {
                    found[count] = [a, b, c];
                    count += 1;
                }
                c += 1;
            }
            b += 1;
        }
        a += 1;
    }
    found
}

/// The determinant of three of the directions.
const fn determinant(a: usize, b: usize, c: usize) -> i32 {
    const WHOLE: [[i32; 3]; 7] = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [1, 1, -1], [1, -1, 1], [1, -1, -1]];
    let ([ax, ay, az], [bx, by, bz], [cx, cy, cz]) = (WHOLE[a], WHOLE[b], WHOLE[c]);
    ax * (by * cz - bz * cy) - ay * (bx * cz - bz * cx) + az * (bx * cy - by * cx)
}

impl OrientedBox {
    /// The smallest of a plain box, of a skewed one between the planes of the 14-DOP, and of a fitted one by DiTO-14, around points with
    /// these `bounds` and `extremes`, whose dot products with three directions lie between those that `project` returns. Plain where the
    /// others are not smaller than [`LARGEST_SHARE`] of it, and where coordinates are too small or too large to bound the rounding of
    /// the others. Fitted only if `fits`.
    pub(crate) fn choose(
        bounds: Aabb,
        extremes: &Extremes<Vec3>,
        fits: bool,
        project: impl FnOnce([Vec3; 3]) -> [[f64; 2]; 3],
    ) -> Self {
        let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
        if !(SMALLEST_SIZE..=LARGEST_SIZE).contains(&largest) {
            return Self::plain(bounds);
        }
        let area = |found: &Self| half_area_between(found.normals.map(Vec3::as_dvec3), found.widths());
        let mut best = Self::plain(bounds);
        let mut least = LARGEST_SHARE * area(&best);
        let skewed = skewed(bounds, extremes);
        if area(&skewed) < least {
            (best, least) = (skewed, area(&skewed));
        }
        if fits
            && let Some((normals, bound)) = fitted(extremes)
            && bound < least
        {
            let fitted = Self::between(bounds, normals, project(normals));
            if area(&fitted) < least {
                best = fitted;
            }
        }
        best
    }
}

/// The skewed box of least surface, or of least volume where several have the same (Káčerik, Bittner: *SOBB: Skewed Oriented Bounding
/// Boxes for Ray Tracing*, 2025).
fn skewed(bounds: Aabb, extremes: &Extremes<Vec3>) -> OrientedBox {
    let mut intervals = extremes.intervals();
    for (axis, interval) in intervals.iter_mut().enumerate().take(3) {
        *interval = [bounds.min[axis].into(), bounds.max[axis].into()];
    }
    let directions = OrientedBox::DIRECTIONS;
    let (mut chosen, mut least) = (TRIPLES[0], [f64::INFINITY; 2]);
    for triple in TRIPLES {
        let widths = triple.map(|at| (intervals[at][1] - intervals[at][0]).max(0.0));
        let area = half_area_between(triple.map(|at| directions[at].as_dvec3()), widths);
        let volume = widths[0] * widths[1] * widths[2] / f64::from(determinant(triple[0], triple[1], triple[2]).abs());
        if [area, volume] < least {
            (chosen, least) = (triple, [area, volume]);
        }
    }
    OrientedBox::between(bounds, chosen.map(|at| directions[at]), chosen.map(|at| intervals[at]))
}

/// The axes of a fitted box, and half of its surface area around the extreme points, no more than that around all points; `None` where
/// all points coincide (DiTO-14: Larsson, Källberg, *Fast Computation of Tight-Fitting Oriented Bounding Boxes*, Game Engine Gems 2,
/// 2011).
fn fitted(extremes: &Extremes<Vec3>) -> Option<([Vec3; 3], f64)> {
    let mut search = Search { points: &extremes.distinct(), best: None };
    // The base triangle: the extreme points of one direction that are farthest apart, and the one farthest from the line through them.
    let ends = extremes.least.iter().zip(&extremes.most).map(|(a, b)| [a.as_dvec3(), b.as_dvec3()]);
    let [p, q] = ends.reduce(|far, next| if length(next) > length(far) { next } else { far })?;
    let size = length([p, q]);
    if size == 0.0 {
        return None;
    }
    let along = (q - p) / size;
    let from_line = |point: DVec3| (point - p).cross(along).length();
    let r = farthest(search.points, from_line)?;
    if from_line(r) <= NO_DISTANCE * size {
        let (u, v) = along.any_orthonormal_pair();
        search.offer([along, u, v]);
    } else {
        search.offer_edges([p, q, r]);
        // The tetrahedra over both sides of the base.
        let normal = (q - p).cross(r - p).normalize();
        for side in [1.0, -1.0] {
            let height = |point: DVec3| (point - p).dot(normal) * side;
            let top = farthest(search.points, height)?;
            if height(top) > NO_DISTANCE * size {
                for triangle in [[p, q, top], [q, r, top], [r, p, top]] {
                    search.offer_edges(triangle);
                }
            }
        }
    }
    search.best
}

fn length([a, b]: [DVec3; 2]) -> f64 {
    a.distance(b)
}

/// The first of `points` with the largest `measure`.
fn farthest(points: &[DVec3], measure: impl Fn(DVec3) -> f64) -> Option<DVec3> {
    points.iter().copied().reduce(|far, next| if measure(next) > measure(far) { next } else { far })
}

/// The smallest box of those that are tried.
struct Search<'a> {
    points: &'a [DVec3],
    best: Option<([Vec3; 3], f64)>,
}

impl Search<'_> {
    /// Tries the boxes with a side along the `triangle` and an edge along one of its edges.
    fn offer_edges(&mut self, [a, b, c]: [DVec3; 3]) {
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { return };
        for edge in [b - a, c - b, a - c] {
            if let Some(along) = edge.try_normalize() {
                self.offer([along, normal, along.cross(normal)]);
            }
        }
    }

    /// Tries the box with these axes.
    fn offer(&mut self, axes: [DVec3; 3]) {
        let [x, y, z] = axes.map(|axis| {
            let along = self.points.iter().map(|point| point.dot(axis));
            let [low, high] =
                along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)]);
            high - low
        });
        let area = x * y + y * z + z * x;
        if self.best.is_none_or(|(_, least)| area < least) {
            self.best = Some((axes.map(DVec3::as_vec3), area));
        }
    }
}

/// The smallest and largest dot products of `points` with each of `normals`.
pub(crate) fn intervals(points: impl IntoIterator<Item = Vec3>, normals: [Vec3; 3]) -> [[f64; 2]; 3] {
    let normals = normals.map(Vec3::as_dvec3);
    let mut found = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for point in points {
        let point = point.as_dvec3();
        for ([low, high], normal) in found.iter_mut().zip(normals) {
            let along = normal.dot(point);
            (*low, *high) = (low.min(along), high.max(along));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::OrientedKind;
    use crate::geometry::sphere::tests::numbers;

    /// The box around some points.
    fn around(points: &[Vec3]) -> OrientedBox {
        let extremes = Extremes::around(points.iter().copied()).expect("there are points");
        let bounds = Aabb::around(points.iter().copied());
        OrientedBox::choose(bounds, &extremes, true, |normals| intervals(points.iter().copied(), normals))
    }

    /// Points in a box with these half sides, turned by `turn`.
    fn turned(half: Vec3, turn: glam::Quat, count: usize) -> Vec<Vec3> {
        let mut number = numbers();
        let corner = |at: usize| {
            let sign = |bit: usize| if at >> bit & 1 == 1 { 1.0 } else { -1.0 };
            Vec3::new(sign(0), sign(1), sign(2)) * half
        };
        let inside = (0..count).map(|_| Vec3::new(number(), number(), number()) * half).collect::<Vec<_>>();
        (0..8).map(corner).chain(inside).map(|point| turn * point + Vec3::new(3.0, -2.0, 1.0)).collect()
    }

    #[test]
    fn a_turned_box_of_points_gets_its_own_box_back() {
        for case in 0..40 {
            let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, case as f32, 0.7 * case as f32, 0.3);
            let half = Vec3::new(1.0, 0.3, 0.05 + 0.02 * (case % 5) as f32);
            let points = turned(half, turn, 50);
            let found = around(&points);
            let own = 4.0 * (half.x * half.y + half.y * half.z + half.z * half.x);
            // The extreme points are corners, though not always all that matter.
            assert!(found.half_area() <= 1.35 * own, "{case}: {} for {own}", found.half_area());
            assert!(found.half_area() >= 0.999 * own, "{case}: {} for {own}", found.half_area());
            assert!(points.iter().all(|point| found.excess_of_point(*point) <= 0.0));
        }
    }

    #[test]
    fn a_fitted_box_is_near_the_best_of_many_turns() {
        let mut worse = 0;
        for case in 0..30_u16 {
            let mut number = numbers();
            let _ = (0..case).map(|_| number()).sum::<f32>();
            let mut point = || Vec3::new(number(), number() * 0.4, number() * 0.1);
            let turn = glam::Quat::from_rotation_y(f32::from(case)) * glam::Quat::from_rotation_x(0.5);
            let points: Vec<Vec3> = (0..20).map(|_| turn * point()).collect();
            let found = f64::from(around(&points).half_area());
            let best = (0..4_000_u16)
                .map(|at| {
                    // Turns spread evenly (Shoemake, Uniform Random Rotations, Graphics Gems III, 1992).
                    let at = f32::from(at);
                    let [u, v, w] = [0.754_877_7, 0.569_840_3, 0.430_159_7].map(|step: f32| (at * step).fract());
                    let (inner, outer) = ((1.0 - u).sqrt(), u.sqrt());
                    let (v, w) = (v * std::f32::consts::TAU, w * std::f32::consts::TAU);
                    let turn =
                        glam::Quat::from_xyzw(inner * v.sin(), inner * v.cos(), outer * w.sin(), outer * w.cos());
                    let [x, y, z] = intervals(points.iter().copied(), Vec3::AXES.map(|axis| turn * axis))
                        .map(|[low, high]| high - low);
                    x * y + y * z + z * x
                })
                .fold(f64::INFINITY, f64::min);
            assert!(found < 1.25 * best, "{case}: {found}, {best}");
            worse += u32::from(found > 1.02 * best);
        }
        assert!(worse < 12, "{worse} of 30 are worse than the best of 4,000 turns");
    }

    #[test]
    fn a_skewed_box_is_the_best_of_all_triples() {
        let mut number = numbers();
        for _ in 0..60 {
            let along = Vec3::new(number(), number(), number());
            let points: Vec<Vec3> =
                (0..12).map(|_| along * number() + Vec3::new(number(), number(), number()) * 0.2).collect();
            let extremes = Extremes::around(points.iter().copied()).expect("there are points");
            let found = skewed(Aabb::around(points.iter().copied()), &extremes);
            let area = |triple: [usize; 3]| {
                let normals = triple.map(|at| OrientedBox::DIRECTIONS[at]);
                let widths = intervals(points.iter().copied(), normals).map(|[low, high]| high - low);
                half_area_between(normals.map(Vec3::as_dvec3), widths)
            };
            let best = TRIPLES.into_iter().map(area).fold(f64::INFINITY, f64::min);
            assert!((f64::from(found.half_area()) / best - 1.0).abs() < 1e-4, "{} {best}", found.half_area());
        }
        assert_eq!(TRIPLES[0], [0, 1, 2]);
    }

    #[test]
    fn points_lines_and_what_lies_along_the_axes_stay_plain() {
        assert_eq!(around(&[Vec3::ONE; 3]).kind(), OrientedKind::Plain);
        assert_eq!(around(&[Vec3::ZERO, Vec3::X, Vec3::Y]).kind(), OrientedKind::Plain, "half of a square");
        assert_eq!(around(&turned(Vec3::new(1.0, 2.0, 3.0), glam::Quat::IDENTITY, 9)).kind(), OrientedKind::Plain);
        let line = [Vec3::ZERO, Vec3::new(1.0, 0.3, 0.7), Vec3::new(2.0, 0.6, 1.4)];
        assert!(around(&line).half_area() < 1e-3, "a line askew has hardly a surface");
        for scale in [1e-30, 1e25] {
            assert_eq!(around(&line.map(|point| point * scale)).kind(), OrientedKind::Plain, "out of range");
        }
        let rod = [Vec3::ZERO, Vec3::new(5.0, 5.0, 0.0), Vec3::new(5.0, 5.0, 0.2), Vec3::Z * 0.2];
        assert_eq!(around(&rod).kind(), OrientedKind::Fitted, "flat, and across no direction of the 14-DOP");
    }
}
