//! Boxes that are turned or skewed: the space between three pairs of parallel planes.

use glam::{DVec3, Vec3};

use super::aabb::Aabb;
use super::container::Container as _;
use super::dop::Dop14;

/// Part of the sum of a point's absolute coordinates by which planes askew are moved outwards: at both ends of every container, and
/// again at the origin of every ray. More than the rounding of the dot products (27 units of 2⁻²⁴ with the slab test and the error of
/// a hit's distance) and than that of the triangle test's edges.
pub(crate) const ORIENTED_PAD: f32 = 24.0 * f32::EPSILON;

/// A box that may be turned or skewed: the space between the planes across three directions, a parallelepiped (SOBB: Káčerik, Bittner,
/// *SOBB: Skewed Oriented Bounding Boxes for Ray Tracing*, 2025). Empty where `bounds` is.
///
/// Planes that are not across the axes stand a little outside of what they enclose, so that neither the rounding of dot products nor
/// that of rays loses a hit.
///
/// ```
/// use bvhscope_engine::geometry::{OrientedBox, OrientedKind};
/// use bvhscope_engine::glam::Vec3;
/// use bvhscope_engine::Triangle;
/// use bvhscope_engine::tree::Container as _;
///
/// // A blade that lies askew needs hardly a tenth of the box around it.
/// let blade = Triangle { a: Vec3::ZERO, b: Vec3::new(1.0, 0.7, 0.4), c: Vec3::new(0.02, 0.0, 0.0) };
/// let fitted = OrientedBox::of_triangle(&blade);
/// assert_ne!(fitted.kind(), OrientedKind::Plain);
/// assert!(fitted.half_area() < 0.1 * blade.bounds().half_area());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct OrientedBox {
    /// The smallest box along the axes around what it encloses. The planes below may reach farther.
    pub bounds: Aabb,
    /// The directions across the planes, linearly independent, with coordinates from -1 to 1 up to rounding; of any length.
    pub normals: [Vec3; 3],
    /// For each direction the smallest dot product with it.
    pub low: [f32; 3],
    /// For each direction the largest dot product with it.
    pub high: [f32; 3],
}

/// Which planes an oriented box lies between.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OrientedKind {
    /// Those across the axes.
    Plain,
    /// At right angles, turned to fit.
    Fitted,
    /// Across three of the seven directions of [`Dop14`].
    Skewed,
}

impl OrientedKind {
    /// Every kind, plain boxes first.
    pub const ALL: [Self; 3] = [Self::Plain, Self::Fitted, Self::Skewed];

    /// Name in text such as JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Fitted => "fitted",
            Self::Skewed => "skewed",
        }
    }

    /// Name in a user interface.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Plain => "Plain box",
            Self::Fitted => "Fitted box",
            Self::Skewed => "Skewed box",
        }
    }
}

impl OrientedBox {
    /// The seven directions across which the planes of skewed boxes stand: the axes, then the diagonals of [`Dop14`].
    pub const DIRECTIONS: [Vec3; 7] = {
        let ([x, y, z], [a, b, c, d]) = (Vec3::AXES, Dop14::DIAGONALS);
        [x, y, z, a, b, c, d]
    };

    /// The box itself.
    pub fn plain(bounds: Aabb) -> Self {
        let (low, high) = (bounds.min.to_array(), bounds.max.to_array());
        Self { bounds, normals: Vec3::AXES, low, high }
    }

    /// The box between planes across `normals` around what has the box `bounds` and the smallest and largest dot products `intervals`
    /// with them, padded. Planes across an axis are those of `bounds`.
    pub(crate) fn between(bounds: Aabb, normals: [Vec3; 3], intervals: [[f64; 2]; 3]) -> Self {
        let pad = f64::from(ORIENTED_PAD) * bounds.min.abs().max(bounds.max.abs()).as_dvec3().element_sum();
        let mut found = Self { bounds, normals, low: [0.0; 3], high: [0.0; 3] };
        for (at, (normal, [low, high])) in normals.into_iter().zip(intervals).enumerate() {
            let axis = Vec3::AXES.iter().position(|axis| *axis == normal);
            (found.low[at], found.high[at]) = match axis {
                Some(axis) => (bounds.min[axis], bounds.max[axis]),
                None => ((low - pad) as f32, (high + pad) as f32),
            };
        }
        found
    }

    /// True if it contains no point.
    pub fn is_empty(&self) -> bool {
        self.bounds.is_empty()
    }

    /// Which planes it lies between.
    pub fn kind(&self) -> OrientedKind {
        if self.normals == Vec3::AXES {
            OrientedKind::Plain
        } else if self.normals.iter().all(|normal| Self::DIRECTIONS.contains(normal)) {
            OrientedKind::Skewed
        } else {
            OrientedKind::Fitted
        }
    }

    /// Half of the surface area, at most that of the box along the axes around what it encloses; 0 for the empty box.
    pub fn half_area(&self) -> f32 {
        if self.is_empty() { 0.0 } else { self.nonempty_half_area() }
    }

    /// [`OrientedBox::half_area`] of a box that is not empty, without checking.
    pub(crate) fn nonempty_half_area(&self) -> f32 {
        if self.normals == Vec3::AXES {
            let d = self.bounds.max - self.bounds.min;
            return d.x * d.y + d.y * d.z + d.z * d.x;
        }
        // Planes in a file may be anywhere.
        (half_area_between(self.normals.map(Vec3::as_dvec3), self.widths()) as f32).min(self.bounds.half_area())
    }

    /// The surface area over that of the box along the axes around what it encloses: below 1 where it is the smaller one. 1 where that
    /// has none.
    pub fn share_of_plain(&self) -> f32 {
        // Relative to the size, so that no area leaves the range of single precision.
        let size = self.bounds.extent().max_element();
        let scaled = self.scaled(size.recip().clamp(f32::MIN_POSITIVE, f32::MAX));
        let plain = scaled.bounds.half_area();
        if plain > 0.0 { scaled.half_area() / plain } else { 1.0 }
    }

    /// Distances of its planes, in lengths of their directions.
    pub(super) fn widths(&self) -> [f64; 3] {
        [0, 1, 2].map(|at| (f64::from(self.high[at]) - f64::from(self.low[at])).max(0.0))
    }

    /// By how much `point` sticks out, in world units; negative or 0 inside.
    pub fn excess_of_point(&self, point: Vec3) -> f64 {
        let [point, min, max] = [point, self.bounds.min, self.bounds.max].map(Vec3::as_dvec3);
        let mut excess = (min - point).max(point - max).max_element();
        for (at, normal) in self.normals.map(Vec3::as_dvec3).into_iter().enumerate() {
            let along = point.dot(normal);
            let beyond = (f64::from(self.low[at]) - along).max(along - f64::from(self.high[at]));
            excess = excess.max(beyond / normal.length());
        }
        excess
    }

    /// The eight corners: bit 0 of the index is set on the upper plane across the first direction, bit 1 across the second, bit 2
    /// across the third.
    pub fn corners(&self) -> [DVec3; 8] {
        let [a, b, c] = self.normals.map(Vec3::as_dvec3);
        let determinant = a.dot(b.cross(c));
        let edges = [b.cross(c), c.cross(a), a.cross(b)].map(|edge| edge / determinant);
        std::array::from_fn(|corner| {
            let plane = |at: usize| f64::from(if corner >> at & 1 == 1 { self.high[at] } else { self.low[at] });
            edges[0] * plane(0) + edges[1] * plane(1) + edges[2] * plane(2)
        })
    }

    /// The six half-spaces: an outward normal, not normalised, and the largest dot product with it inside.
    pub(crate) fn half_spaces(&self) -> [(DVec3, f64); 6] {
        let normals = self.normals.map(Vec3::as_dvec3);
        std::array::from_fn(|side| match (normals[side / 2], side % 2) {
            (normal, 0) => (-normal, -f64::from(self.low[side / 2])),
            (normal, _) => (normal, f64::from(self.high[side / 2])),
        })
    }
}

/// Half of the surface area between planes across `normals` at distances `widths`, in lengths of these. The edge along the planes across
/// n₁ and n₂ is w₀·n₁×n₂ over the determinant D of the three, and the face between two edges w₁·w₂·|n₀| / |D|.
pub(crate) fn half_area_between([a, b, c]: [DVec3; 3], widths: [f64; 3]) -> f64 {
    let faces =
        widths[1] * widths[2] * a.length() + widths[2] * widths[0] * b.length() + widths[0] * widths[1] * c.length();
    faces / a.dot(b.cross(c)).abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sphere::tests::numbers;

    /// Directions of all kinds: axes, unit vectors at right angles, and skewed ones.
    fn directions() -> Vec<[Vec3; 3]> {
        let mut number = numbers();
        let mut all = vec![Vec3::AXES];
        for case in 0..60 {
            let [a, b] = [0; 2].map(|_| Vec3::new(number(), number(), number()).normalize());
            all.push(if case % 2 == 0 {
                let across = a.cross(b).normalize();
                [a, across, a.cross(across)]
            } else {
                let chosen = [case % 7, (case + 1) % 7, (case * 3 + 2) % 7].map(|at| OrientedBox::DIRECTIONS[at]);
                if chosen[0].dot(chosen[1].cross(chosen[2])).abs() < 0.5 { [a, b, a.cross(b)] } else { chosen }
            });
        }
        all
    }

    /// A box between planes across `normals` at these places, with the box around its corners.
    fn between(normals: [Vec3; 3], low: [f32; 3], high: [f32; 3]) -> OrientedBox {
        let mut found = OrientedBox { bounds: Aabb::EMPTY, normals, low, high };
        found.bounds = Aabb::around(found.corners().map(DVec3::as_vec3));
        found
    }

    fn boxes() -> Vec<OrientedBox> {
        let mut number = numbers();
        let boxes = directions().into_iter().enumerate().map(|(case, normals)| {
            let low = [number(), number(), number()];
            let mut high = low.map(|plane| plane + number().abs());
            // Flat ones, lines and points among them.
            high[..case % 4].copy_from_slice(&low[..case % 4]);
            between(normals, low, high)
        });
        boxes.collect()
    }

    #[test]
    fn the_closed_formula_is_the_area_of_the_faces() {
        for container in boxes() {
            let half =
                |[a, b, c, d]: [DVec3; 4]| ((b - a).cross(d - a).length() + (b - c).cross(d - c).length()) * 0.25;
            let faces: f64 = container.faces().into_iter().map(half).sum();
            let found = if container.kind() == OrientedKind::Plain {
                f64::from(container.bounds.half_area())
            } else {
                f64::from(container.half_area())
            };
            assert!((found - faces).abs() <= 1e-5 * faces.max(1e-3), "{found}, faces {faces}: {container:?}");
        }
        let cube = between(Vec3::AXES, [0.0; 3], [1.0; 3]);
        assert_eq!(cube.half_area(), 3.0);
        // Twice as long directions with planes at twice the dot products are the same planes.
        let long = OrientedBox { normals: cube.normals.map(|normal| normal * 0.5), high: [0.5; 3], ..cube };
        assert_eq!(long.half_area(), 3.0);
        assert_eq!(OrientedBox::EMPTY.half_area(), 0.0);
    }

    #[test]
    fn corners_lie_on_three_planes_each_and_faces_turn_outwards() {
        for container in boxes() {
            let corners = container.corners();
            for (index, corner) in corners.into_iter().enumerate() {
                for at in 0..3 {
                    let plane = if index >> at & 1 == 1 { container.high[at] } else { container.low[at] };
                    let along = container.normals[at].as_dvec3().dot(corner);
                    assert!((along - f64::from(plane)).abs() < 1e-9, "{along} {plane}");
                }
            }
            let turned: Vec<bool> = container
                .faces()
                .into_iter()
                .zip(container.half_spaces())
                .map(|([a, b, _, d], (normal, limit))| {
                    assert!((normal.dot(a) - limit).abs() < 1e-9);
                    (b - a).cross(d - a).dot(normal) >= -1e-12
                })
                .collect();
            assert!(turned.iter().all(|turn| *turn == turned[0]) || container.half_area() < 1e-9, "{turned:?}");
        }
    }

    #[test]
    fn points_inside_and_outside_are_told_apart() {
        for container in boxes() {
            let [center, corner] = [container.corners().iter().sum::<DVec3>() / 8.0, container.corners()[6]];
            assert!(container.excess_of_point(center.as_vec3()) < 1e-6);
            let beyond = container.excess_of_point((corner + (corner - center) * 0.5).as_vec3());
            assert!(beyond > 0.0 || corner == center, "{beyond}");
        }
    }
}
