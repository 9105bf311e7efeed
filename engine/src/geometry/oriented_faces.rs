//! Faces of oriented boxes, and what two of them have in common.

use arrayvec::ArrayVec;
use glam::{DVec3, Vec3};

use super::dop_faces::cut;
use super::oriented::OrientedBox;

/// Most corners of a face while it is cut: four, and one more for each plane of another box.
const MAX_CORNERS: usize = 10;
/// Part of a box's size by which points may lie outside of a plane and still count as on it, in double precision.
const ON_PLANE: f64 = 1e-12;

impl OrientedBox {
    /// The twelve edges, as pairs of [`OrientedBox::corners`].
    pub const EDGES: [[usize; 2]; 12] =
        [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

    /// The corners of each face, counter-clockwise as seen from outside or all clockwise, in the order of
    /// [`OrientedBox::half_spaces`].
    pub(crate) fn faces(&self) -> [[DVec3; 4]; 6] {
        let corners = self.corners();
        std::array::from_fn(|side| {
            let axis = side / 2;
            let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
            let first = (side % 2) << axis;
            let turn = if side % 2 == 1 { [0, u, u | v, v] } else { [0, v, u | v, u] };
            turn.map(|corner| corners[first | corner])
        })
    }

    /// The faces of the intersection with `other`, convex polygons, counter-clockwise as seen from outside: the parts of the faces of each
    /// box that lie in the other one. Where faces of both lie on each other, their common part is there once. None where the two are
    /// disjoint.
    pub fn intersection_faces(&self, other: &Self) -> Vec<ArrayVec<DVec3, MAX_CORNERS>> {
        if self.is_empty() || other.is_empty() {
            return Vec::new();
        }
        let largest = self.bounds.min.abs().max(self.bounds.max.abs()).max_element();
        let tolerance = ON_PLANE * f64::from(largest);
        let mut found = Vec::new();
        for (own, cutting, is_second) in [(self, other, false), (other, self, true)] {
            let planes = cutting.half_spaces();
            for (face, plane) in own.faces().into_iter().zip(own.half_spaces()) {
                if is_second && planes.contains(&plane) {
                    continue;
                }
                let mut polygon: ArrayVec<_, MAX_CORNERS> = face.into_iter().collect();
                if plane.0.dot((face[1] - face[0]).cross(face[2] - face[0])) < 0.0 {
                    polygon.reverse();
                }
                for (normal, limit) in planes {
                    // A face is not cut by planes that it lies in.
                    cut(&mut polygon, |point| limit - normal.dot(point) + tolerance);
                }
                if polygon.len() >= 3 {
                    found.push(polygon);
                }
            }
        }
        found
    }

    /// The directions of the planes, each of length 1.
    pub fn unit_normals(&self) -> [Vec3; 3] {
        self.normals.map(|normal| normal.as_dvec3().normalize().as_vec3())
    }
}

/// The outward normal of a convex polygon, as long as twice its area.
pub(super) fn twice_area(polygon: &[DVec3]) -> DVec3 {
    polygon.windows(2).skip(1).map(|edge| (edge[0] - polygon[0]).cross(edge[1] - polygon[0])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sphere::tests::numbers;
    use crate::geometry::{Aabb, Container as _, Triangle};

    /// Boxes around three random triangles each.
    fn boxes() -> Vec<OrientedBox> {
        let mut number = numbers();
        let mut point = || Vec3::new(number(), number(), number());
        (0..60).map(|_| OrientedBox::of_triangle(&Triangle { a: point(), b: point(), c: point() * 2.0 })).collect()
    }

    /// A box that is not flat around the place of `container`.
    fn thickened(container: &OrientedBox) -> OrientedBox {
        let planes = |sign: f32, planes: [f32; 3]| planes.map(|plane| plane + sign * 0.3);
        let mut found =
            OrientedBox { low: planes(-1.0, container.low), high: planes(1.0, container.high), ..*container };
        found.bounds = Aabb::around(found.corners().map(DVec3::as_vec3));
        found
    }

    #[test]
    fn what_two_boxes_share_is_measured_as_by_the_lines_that_meet_it() {
        let mut number = numbers();
        let boxes: Vec<OrientedBox> = boxes().iter().map(thickened).collect();
        let mut shared = 0;
        for pair in boxes.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            let area = f64::from(a.intersection_area(&b));
            assert!((area - f64::from(b.intersection_area(&a))).abs() < 1e-4, "{area}");
            assert!(area <= f64::from(a.half_area().min(b.half_area())) * 1.0001);
            // Of the lines through a, those that meet both meet them in common with the ratio of areas (Cauchy–Crofton).
            let (mut hits, lines) = (0, 4_000);
            for _ in 0..lines {
                let ray = a.random_line(|| f64::from(number().abs()));
                let [near, far] = [a, b].iter().fold([f64::NEG_INFINITY, f64::INFINITY], |[near, far], container| {
                    (0..3).fold([near, far], |[near, far], at| {
                        let normal = container.normals[at].as_dvec3();
                        let [o, d] = [ray.origin, ray.direction].map(|v| normal.dot(v.as_dvec3()));
                        let [s, t] = [container.low[at], container.high[at]].map(|plane| (f64::from(plane) - o) / d);
                        [near.max(s.min(t)), far.min(s.max(t))]
                    })
                });
                hits += u32::from(near <= far);
            }
            let found = f64::from(hits) / f64::from(lines) * f64::from(a.half_area());
            assert!((found - area).abs() < 0.04 * f64::from(a.half_area()), "{found} by lines, {area} by faces");
            let around = a.intersection_bounds(&b);
            assert_eq!(around.is_empty(), area == 0.0);
            shared += usize::from(area > 0.0);
        }
        assert!((10..59).contains(&shared), "{shared}");
    }

    #[test]
    fn the_faces_of_an_intersection_close_and_look_outwards() {
        let boxes: Vec<OrientedBox> = boxes().iter().map(thickened).collect();
        let mut shared = 0;
        for pair in boxes.windows(2) {
            let faces = pair[0].intersection_faces(&pair[1]);
            let corners: Vec<DVec3> = faces.iter().flatten().copied().collect();
            let center = corners.iter().sum::<DVec3>() / corners.len() as f64;
            let whole: f64 = faces.iter().map(|face| twice_area(face).length()).sum();
            let open: DVec3 = faces.iter().map(|face| twice_area(face)).sum();
            assert!(faces.is_empty() || open.length() < 1e-9 * whole, "{open} of {whole}: {pair:?}");
            for face in &faces {
                assert!(twice_area(face).dot(face[0] - center) >= 0.0, "{face:?} around {center}");
            }
            shared += usize::from(!faces.is_empty());
        }
        assert!((10..59).contains(&shared), "{shared}");
    }

    #[test]
    fn a_box_shares_itself_with_itself() {
        for container in boxes().iter().map(thickened) {
            let (area, own) = (container.intersection_area(&container), container.half_area());
            assert!((area / own - 1.0).abs() < 1e-5, "{area} {own}");
            assert!(container.contains(&container.intersection_bounds(&container), 1e-5));
        }
        let [a, b] = [0.0, 5.0].map(|x| OrientedBox::plain(Aabb::around([Vec3::splat(x), Vec3::splat(x + 1.0)])));
        assert_eq!((a.intersection_area(&b), a.intersection_bounds(&b)), (0.0, OrientedBox::EMPTY));
        assert_eq!(a.intersection_area(&a), 3.0);
    }
}
