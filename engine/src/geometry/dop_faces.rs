//! Faces of polytopes: what is drawn, measured and cut of them.

use arrayvec::ArrayVec;
use glam::{DVec3, Vec3};

use super::aabb::Aabb;
use super::container::Container as _;
use super::dop::{Dop14, exactly_along_diagonals};

/// Most corners of a face while it is cut: three or four, and one more for each plane that cuts it.
const MAX_CORNERS: usize = 18;
/// Part of a polytope's size by which points may lie outside of a plane and still count as on it, in double precision.
const ON_PLANE: f64 = 1e-12;

/// A face of a polytope: a convex polygon.
#[derive(Debug, Clone, PartialEq)]
pub struct DopFace {
    /// The outward unit normal.
    pub normal: DVec3,
    /// At least three corners, counter-clockwise as seen from outside. Where planes meet in one point, it is there several times.
    pub corners: ArrayVec<DVec3, MAX_CORNERS>,
}

impl DopFace {
    /// The surface area.
    pub fn area(&self) -> f64 {
        self.fan().map(|[a, b, c]| (b - a).cross(c - a).length() * 0.5).sum()
    }

    /// The triangles between the first corner and each edge that does not meet it.
    pub(crate) fn fan(&self) -> impl Iterator<Item = [DVec3; 3]> {
        self.corners.windows(2).skip(1).map(|edge| [self.corners[0], edge[0], edge[1]])
    }
}

/// Cuts a convex `polygon` where `distance` is negative (Sutherland and Hodgman, *Reentrant Polygon Clipping*, 1974). One that
/// has more corners than there is space for stays open at the end.
#[inline]
pub(crate) fn cut<const N: usize>(polygon: &mut ArrayVec<DVec3, N>, distance: impl Fn(DVec3) -> f64) {
    let mut found = ArrayVec::<DVec3, N>::new();
    for at in 0..polygon.len() {
        let (from, to) = (polygon[at], polygon[(at + 1) % polygon.len()]);
        let (inside_from, inside_to) = (distance(from), distance(to));
        if inside_from >= 0.0 && !found.is_full() {
            found.push(from);
        }
        if inside_from * inside_to < 0.0 && !found.is_full() {
            found.push(from + (to - from) * (inside_from / (inside_from - inside_to)));
        }
    }
    *polygon = found;
}

impl Dop14 {
    /// The fourteen half-spaces: an outward normal, not normalised, and the largest dot product with it inside.
    pub(crate) fn half_spaces(&self) -> [(DVec3, f64); 14] {
        let normals = Vec3::AXES.into_iter().chain(Self::DIAGONALS).map(Vec3::as_dvec3);
        let low = self.bounds.min.to_array().into_iter().chain(self.low);
        let high = self.bounds.max.to_array().into_iter().chain(self.high);
        let mut found = [(DVec3::ZERO, 0.0); 14];
        for (pair, (normal, (low, high))) in found.chunks_mut(2).zip(normals.zip(low.zip(high))) {
            pair.copy_from_slice(&[(normal, f64::from(high)), (-normal, -f64::from(low))]);
        }
        found
    }

    /// The faces, those across the axes first; planes that only touch the polytope have none, or one without area. None of the empty
    /// polytope.
    pub fn faces(&self) -> impl Iterator<Item = DopFace> {
        let half_spaces = self.half_spaces();
        let largest = self.bounds.min.abs().max(self.bounds.max.abs()).max_element();
        let tolerance = ON_PLANE * f64::from(largest);
        let face = move |at: usize| {
            let (normal, offset) = half_spaces[at];
            let mut corners = self.section(normal, offset, at < 6)?;
            for (other, &(across, limit)) in half_spaces.iter().enumerate() {
                if other / 2 != at / 2 {
                    cut(&mut corners, |point| limit - across.dot(point) + tolerance);
                }
            }
            (corners.len() >= 3).then(|| DopFace { normal: normal.normalize(), corners })
        };
        (0..if self.is_empty() { 0 } else { 14 }).filter_map(face)
    }

    /// The edges, each once; none of a single point.
    pub fn edges(&self) -> Vec<[Vec3; 2]> {
        let same = 1e-6 * f64::from(self.bounds.extent().max_element());
        let mut found: Vec<[DVec3; 2]> = Vec::new();
        for face in self.faces() {
            for (&a, &b) in face.corners.iter().zip(face.corners.iter().cycle().skip(1)) {
                // Each edge is part of two faces, and of more where these are flat.
                let is = |[c, d]: &[DVec3; 2], a: DVec3, b: DVec3| c.distance(a) <= same && d.distance(b) <= same;
                if a.distance(b) > same && !found.iter().any(|edge| is(edge, a, b) || is(edge, b, a)) {
                    found.push([a, b]);
                }
            }
        }
        found.into_iter().map(|edge| edge.map(DVec3::as_vec3)).collect()
    }

    /// A polygon in the plane of a face that holds it: the side of the box, or the triangle that a diagonal plane cuts off the space
    /// around the box's corner. `None` where that plane does not reach the box.
    fn section(&self, normal: DVec3, offset: f64, is_side: bool) -> Option<ArrayVec<DVec3, MAX_CORNERS>> {
        let (min, max) = (self.bounds.min.as_dvec3(), self.bounds.max.as_dvec3());
        let corner = DVec3::select(normal.cmpgt(DVec3::ZERO), max, min);
        let mut corners: ArrayVec<DVec3, MAX_CORNERS> = ArrayVec::new();
        if is_side {
            let axis = normal.abs().max_position();
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for ends in [[false, false], [true, false], [true, true], [false, true]] {
                let mut point = corner;
                point[u] = if ends[0] { max[u] } else { min[u] };
                point[v] = if ends[1] { max[v] } else { min[v] };
                corners.push(point);
            }
        } else {
            let depth = normal.dot(corner) - offset;
            if depth < 0.0 {
                return None;
            }
            corners.extend([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| corner - axis * (normal.dot(axis) * depth)));
        }
        // The order above turns around the axis, or around the octant's diagonal.
        let turns_inwards = normal.x * normal.y * normal.z < 0.0 || is_side && normal.element_sum() < 0.0;
        if turns_inwards {
            corners.reverse();
        }
        Some(corners)
    }

    /// The intersection of both, each of whose planes touches it; empty where they have no point in common.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Self {
        let mut common = Self { bounds: self.bounds.intersection(&other.bounds), ..*self };
        for at in 0..4 {
            common.low[at] = self.low[at].max(other.low[at]);
            common.high[at] = self.high[at].min(other.high[at]);
        }
        if common.is_empty() || (0..4).any(|at| common.low[at] > common.high[at]) {
            return Self::EMPTY;
        }
        let mut found = Self::EMPTY;
        for corner in common.faces().flat_map(|face| face.corners) {
            found.bounds = found.bounds.union(&Aabb::around([corner.as_vec3()]));
            for (at, along) in exactly_along_diagonals(corner).into_iter().enumerate() {
                found.low[at] = found.low[at].min(along as f32);
                found.high[at] = found.high[at].max(along as f32);
            }
        }
        // Rounded corners may lie outside.
        let limit = |value: f32, low: f32, high: f32| value.clamp(low, high);
        if !found.is_empty() {
            found.bounds.min = found.bounds.min.clamp(common.bounds.min, common.bounds.max);
            found.bounds.max = found.bounds.max.clamp(common.bounds.min, common.bounds.max);
            for at in 0..4 {
                found.low[at] = limit(found.low[at], common.low[at], common.high[at]);
                found.high[at] = limit(found.high[at], common.low[at], common.high[at]);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Triangle;
    use crate::geometry::sphere::tests::numbers;

    /// The polytope around some points, without padding.
    fn around(points: &[Vec3]) -> Dop14 {
        let mut found = Dop14 { bounds: Aabb::around(points.iter().copied()), ..Dop14::EMPTY };
        for point in points {
            for (at, along) in exactly_along_diagonals(point.as_dvec3()).into_iter().enumerate() {
                found.low[at] = found.low[at].min(along as f32);
                found.high[at] = found.high[at].max(along as f32);
            }
        }
        found
    }

    /// Corners of a polytope, found apart from its faces: the points in which three planes meet and that lie within all others.
    fn corners(polytope: &Dop14) -> Vec<DVec3> {
        let planes = polytope.half_spaces();
        let mut found: Vec<DVec3> = Vec::new();
        for a in 0..14 {
            for b in a + 1..14 {
                for c in b + 1..14 {
                    let [(na, da), (nb, db), (nc, dc)] = [planes[a], planes[b], planes[c]];
                    let determinant = na.dot(nb.cross(nc));
                    if determinant.abs() < 0.5 {
                        continue;
                    }
                    let point = (nb.cross(nc) * da + nc.cross(na) * db + na.cross(nb) * dc) / determinant;
                    let size = polytope.bounds.extent().max_element().max(1e-30);
                    let is_inside = |&(n, d): &(DVec3, f64)| n.dot(point) <= d + f64::from(size) * 1e-6;
                    let is_new = |other: &DVec3| other.distance(point) > f64::from(size) * 1e-5;
                    if planes.iter().all(is_inside) && found.iter().all(is_new) {
                        found.push(point);
                    }
                }
            }
        }
        found
    }

    /// Surface area of the convex hull of `points`, by Cauchy's formula over the hull's supporting planes through each three points.
    fn hull_area(points: &[DVec3]) -> f64 {
        let size = points.iter().map(|a| points.iter().map(|b| a.distance(*b)).fold(0.0, f64::max)).fold(0.0, f64::max);
        let tolerance = size * 1e-6;
        let mut seen: Vec<(DVec3, f64)> = Vec::new();
        let mut area = 0.0;
        for (i, &a) in points.iter().enumerate() {
            for (j, &b) in points.iter().enumerate().skip(i + 1) {
                for &c in &points[j + 1..] {
                    let normal = (b - a).cross(c - a);
                    if normal.length() < size * size * 1e-5 {
                        continue;
                    }
                    for normal in [normal.normalize(), -normal.normalize()] {
                        let offset = normal.dot(a);
                        let is_supporting = points.iter().all(|point| normal.dot(*point) <= offset + tolerance);
                        let is_known =
                            seen.iter().any(|(n, d)| n.dot(normal) > 0.999 && (d - offset).abs() < 4.0 * tolerance);
                        if is_supporting && !is_known {
                            seen.push((normal, offset));
                            area += flat_hull_area(points, normal, offset, tolerance * 2.0);
                        }
                    }
                }
            }
        }
        area
    }

    /// Area of the hull of those of `points` that lie in a plane: around their centre, by angle.
    fn flat_hull_area(points: &[DVec3], normal: DVec3, offset: f64, tolerance: f64) -> f64 {
        let flat: Vec<DVec3> =
            points.iter().copied().filter(|p| (normal.dot(*p) - offset).abs() <= tolerance).collect();
        let center = flat.iter().sum::<DVec3>() / flat.len() as f64;
        let (u, v) = normal.any_orthonormal_pair();
        let mut around: Vec<(f64, DVec3)> =
            flat.iter().map(|p| ((*p - center).dot(v).atan2((*p - center).dot(u)), *p)).collect();
        around.sort_by(|a, b| a.0.total_cmp(&b.0));
        let next = around.iter().cycle().skip(1);
        around.iter().zip(next).map(|(a, b)| (a.1 - center).cross(b.1 - center).length() * 0.5).sum()
    }

    /// Sets of points of all shapes: a cloud, a rod along some direction, a slab, a line, a plane, one point.
    fn point_sets() -> Vec<Vec<Vec3>> {
        let mut number = numbers();
        let mut point = || Vec3::new(number(), number(), number());
        let mut sets = Vec::new();
        for case in 0..160 {
            let (along, start) = (point(), point());
            let count = 2 + case % 7;
            sets.push(
                (0..count)
                    .map(|_| match case % 8 {
                        0 | 1 => point(),
                        2 => start + along * point().x + point() * 0.02,
                        3 => start + Vec3::new(1.0, 1.0, -1.0) * point().x + point() * 0.05,
                        4 => point() * Vec3::new(1.0, 0.05, 1.0),
                        5 => start + along * point().x,
                        6 => point().with_z(0.25),
                        _ => start,
                    })
                    .collect(),
            );
        }
        sets
    }

    #[test]
    fn the_closed_formula_is_the_area_of_the_hull_of_the_corners() {
        let mut checked = 0;
        for points in point_sets() {
            let polytope = around(&points);
            let size = f64::from(polytope.bounds.extent().max_element());
            let of_faces: f64 = polytope.faces().map(|face| face.area()).sum::<f64>() * 0.5;
            let found = f64::from(polytope.half_area());
            assert!((found - of_faces).abs() <= 3e-6 * size * size, "{found}, faces {of_faces}: {points:?}");
            let hull = hull_area(&corners(&polytope)) * 0.5;
            // A flat hull has two sides; a line has no area that the search sees.
            assert!((found - hull).abs() <= 1e-4 * size * size, "{found}, hull {hull}: {points:?}");
            checked += usize::from(hull > 0.0);
        }
        assert!(checked > 100, "{checked}");
    }

    #[test]
    fn faces_turn_outwards_and_close() {
        for points in point_sets() {
            let polytope = around(&points);
            // The centre of the box may be cut off.
            let all: Vec<DVec3> = polytope.faces().flat_map(|face| face.corners).collect();
            let center = all.iter().sum::<DVec3>() / all.len().max(1) as f64;
            let mut sum = DVec3::ZERO;
            for face in polytope.faces() {
                let twice: DVec3 = face.fan().map(|[a, b, c]| (b - a).cross(c - a)).sum();
                assert!(twice.dot(face.normal) >= -1e-9, "{face:?}");
                assert!(face.normal.dot(face.corners[0] - center) >= -1e-6, "{face:?}");
                assert!(
                    face.corners.iter().all(|corner| polytope.excess_of_point(corner.as_vec3()) < 1e-5),
                    "{face:?}"
                );
                sum += twice;
            }
            // The area vectors of a closed surface cancel.
            assert!(sum.length() < 1e-5, "{points:?}");
        }
        assert_eq!(Dop14::EMPTY.faces().count(), 0);
    }

    #[test]
    fn a_solid_has_the_edges_of_its_faces() {
        let octahedron = Dop14 { bounds: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE }, low: [-1.0; 4], high: [1.0; 4] };
        assert_eq!(octahedron.edges().len(), 12);
        let cube = Dop14 { low: [-3.0; 4], high: [3.0; 4], ..octahedron };
        assert_eq!(cube.edges().len(), 12);
        let cut = Dop14 { low: [-2.5; 4], high: [2.5; 4], ..octahedron };
        assert_eq!(cut.edges().len(), 36, "three more at each corner");
        assert!(cut.edges().iter().flatten().all(|point| cut.excess_of_point(*point).abs() < 1e-6));
        assert_eq!(around(&[Vec3::ZERO, Vec3::X]).edges().len(), 1, "a line");
        assert_eq!(around(&[Vec3::ONE]).edges().len(), 0, "a point");
    }

    #[test]
    fn an_intersection_is_that_of_the_half_spaces_and_tight() {
        let (mut empty, mut common_points) = (0, 0);
        let sets = point_sets();
        let mut number = numbers();
        for pair in sets.chunks(2).filter(|pair| pair.len() == 2) {
            let (a, b) = (around(&pair[0]), around(&pair[1]));
            let common = a.intersection(&b);
            assert_eq!(common, b.intersection(&a));
            empty += usize::from(common.is_empty());
            for _ in 0..200 {
                let point = Vec3::new(number(), number(), number());
                let excess = a.excess_of_point(point).max(b.excess_of_point(point));
                let found = common.excess_of_point(point);
                assert!(excess.abs() < 1e-5 || (excess < 0.0) == (found < 0.0), "{point}: {excess}, {found}");
                common_points += usize::from(found < 0.0);
            }
            if !common.is_empty() {
                let again = common.intersection(&common);
                assert!(again.contains(&common, 1e-5) && common.contains(&again, 1e-5), "{common:?} {again:?}");
            }
        }
        assert!(empty > 5 && common_points > 50, "{empty} {common_points}");
        let triangle = Triangle { a: Vec3::ONE, b: Vec3::ONE, c: Vec3::ONE };
        let point = Dop14::of_triangle(&triangle);
        assert_eq!(point.intersection(&point).bounds, point.bounds, "a single point");
    }
}
