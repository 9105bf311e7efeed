//! Copies of meshes: where one stands, and rays carried into the coordinates of its mesh, with a bound on what rounding moves.

use std::array::from_fn;

use glam::{Affine3A, DMat3, DVec3, Vec3};

use super::aabb::Aabb;
use super::ray::Ray;
use super::triangle::Triangle;

/// Part of the reach of copy and ray by which the boxes of a mesh are widened for a ray carried into its coordinates: 64 units of 2⁻²⁴,
/// of which docs/containers.md accounts for 47.
const CARRY_PAD: f64 = 64.0 / (1 << 24) as f64;
/// Part of its terms by which a computed coordinate may be off, 4 units of 2⁻²⁴: three products and three sums.
const PLACE_PAD: f64 = 4.0 / (1 << 24) as f64;
/// Largest scale of a transform, and of its inverse, whose rays stay within the range of single precision.
const LARGEST_SCALE: f64 = 1e12;
/// Largest coordinate of a copy: as far as triangles are watertight.
const LARGEST_COORDINATE: f64 = 1e18;
/// Least widening of boxes for rays that are carried in single precision: more than what products of small numbers lose.
pub(crate) const LEAST_WIDENING: f32 = 1e-20;
/// Largest component of the direction of such a ray in a mesh, inverted the smallest.
pub(crate) const LARGEST_DIRECTION: f32 = 1e15;
/// Largest difference from the identity of a transform times its computed inverse.
const LARGEST_RESIDUAL: f64 = 1.0 / (1 << 30) as f64;

/// The place of a copy of a mesh: an affine transform from its coordinates to those of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Factors of the coordinates and the translation, by axis of the world.
    pub(crate) rows: [[f32; 4]; 3],
    /// The inverse of the factors: of the coordinates of the world, by axis of the mesh. NaN, as is the widening, where there is none.
    pub(crate) inverse: [[f32; 3]; 3],
    /// By how much boxes are widened on each axis of the mesh for each unit of the sum of `reach` and the largest absolute coordinate of the
    /// ray's origin.
    pub(crate) widening: [f32; 3],
    /// The largest sum of the absolute terms of a coordinate of the copy, or a little more.
    pub(crate) reach: f32,
}

/// A point in the coordinates of a mesh, and the widening of boxes there for rays that begin at it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CarriedPoint {
    pub(crate) point: Vec3,
    /// See [`CarriedRay::widening`].
    pub(crate) widening: [f32; 3],
}

/// A ray in the coordinates of a mesh.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CarriedRay {
    /// The ray, whose direction may be scaled by a power of two.
    pub(crate) ray: Ray,
    /// Distances along it for one of the ray that was carried: a power of two.
    per_distance: f32,
    /// By how much boxes must be widened on each axis, so that it enters every box of a triangle that the ray in the world hits.
    pub(crate) widening: [f32; 3],
}

impl Placement {
    /// A copy of a mesh within `bounds`.
    ///
    /// # Errors
    ///
    /// Why there can be no such copy: a transform that is not finite, singular or nearly so, or with scales or coordinates out of range.
    pub fn new(transform: &Affine3A, bounds: &Aabb) -> Result<Self, &'static str> {
        Self::with_inverse(transform, bounds, inverse_of)
    }

    /// A copy that moves, which may be pressed flat or to a point on its way: as no inverse carries rays into the mesh then, they are tested
    /// with every triangle of it.
    ///
    /// # Errors
    ///
    /// Why there can be no such copy: a transform that is not finite, or coordinates out of range.
    pub fn moving(transform: &Affine3A, bounds: &Aabb) -> Result<Self, &'static str> {
        Self::with_inverse(transform, bounds, |matrix| Ok(inverse_of(matrix).unwrap_or(DMat3::NAN)))
    }

    fn with_inverse(
        transform: &Affine3A,
        bounds: &Aabb,
        inverse_of: impl FnOnce(&DMat3) -> Result<DMat3, &'static str>,
    ) -> Result<Self, &'static str> {
        let [x, y, z] = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis];
        let rows: [[f32; 4]; 3] = from_fn(|axis| [x[axis], y[axis], z[axis], transform.translation[axis]]);
        if !rows.as_flattened().iter().all(|number| number.is_finite()) {
            return Err("its transform is not finite");
        }
        let inverse = inverse_of(&DMat3::from_cols(x.as_dvec3(), y.as_dvec3(), z.as_dvec3()))?;
        let farthest = if bounds.is_empty() { Vec3::ZERO } else { bounds.min.abs().max(bounds.max.abs()) }.as_dvec3();
        let terms = |row: [f32; 4]| {
            let [x, y, z, translation] = row.map(|number| f64::from(number.abs()));
            x * farthest.x + y * farthest.y + z * farthest.z + translation
        };
        let reach = rows.map(terms).into_iter().fold(0.0, f64::max);
        if reach > LARGEST_COORDINATE {
            return Err("its coordinates exceed 1e18");
        }
        let widening = rows_of(&inverse).map(|row| (row.abs().element_sum() * CARRY_PAD) as f32);
        let inverse = rows_of(&inverse).map(|row| row.as_vec3().to_array());
        Ok(Self { rows, inverse, widening, reach: (reach as f32).next_up() })
    }

    /// True if no ray can be carried into the coordinates of the mesh, see [`Placement::moving`].
    pub fn is_singular(&self) -> bool {
        self.inverse[0][0].is_nan()
    }

    /// A point of the mesh in the world: ((x·m₀ + y·m₁) + z·m₂) + m₃ on each axis, each operation rounded to single precision. Whoever
    /// computes the corners of a copy so has a flat scene with the very same hits.
    #[inline]
    pub fn point(&self, point: Vec3) -> Vec3 {
        let coordinate = |[x, y, z, translation]: [f32; 4]| point.x * x + point.y * y + point.z * z + translation;
        let [x, y, z] = self.rows;
        Vec3::new(coordinate(x), coordinate(y), coordinate(z))
    }

    /// A triangle of the mesh in the world: its corners, in their order.
    pub fn triangle(&self, triangle: &Triangle) -> Triangle {
        let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(|corner| self.point(corner));
        Triangle { a, b, c }
    }

    /// The direction in the world of a normal in the mesh, which stays perpendicular to what it was; its length is another. A mirrored copy
    /// keeps its outside.
    pub fn normal(&self, normal: Vec3) -> Vec3 {
        let normal = normal.as_dvec3();
        let direction = if self.is_singular() {
            // The cofactors, which are the inverse transpose up to a factor.
            let [x, y, z] = rows_of(&self.matrix());
            DVec3::new(y.cross(z).dot(normal), z.cross(x).dot(normal), x.cross(y).dot(normal))
        } else {
            let [x, y, z] = self.inverse.map(|row| Vec3::from_array(row).as_dvec3());
            x * normal.x + y * normal.y + z * normal.z
        };
        // Within the range of single precision, whatever the scale.
        (direction / direction.abs().max_element().max(f64::MIN_POSITIVE)).as_vec3()
    }

    /// Factors of the coordinates and the translation, by axis of the world, see [`Placement::point`].
    pub fn rows(&self) -> &[[f32; 4]; 3] {
        &self.rows
    }

    /// From the coordinates of the mesh to those of the world.
    pub fn transform(&self) -> Affine3A {
        transform_of(&self.rows)
    }

    /// The direction in the world of one in the mesh, stretched as the copy is.
    pub fn direction(&self, direction: Vec3) -> Vec3 {
        let component = |[x, y, z, _]: [f32; 4]| direction.x * x + direction.y * y + direction.z * z;
        Vec3::from_array(self.rows.map(component))
    }

    /// True if the copy is mirrored, so that its triangles turn the other way around.
    pub fn is_mirrored(&self) -> bool {
        self.matrix().determinant() < 0.0
    }

    /// A box in the world around all that [`Placement::point`] makes of points in `bounds`; empty where that is empty.
    pub fn bounds(&self, bounds: &Aabb) -> Aabb {
        if bounds.is_empty() {
            return Aabb::EMPTY;
        }
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let pad = f64::from(self.reach) * PLACE_PAD;
        let sides = self.rows.map(|row| {
            let [x, y, z, translation] = row.map(f64::from);
            let ends = DVec3::new(x, y, z);
            let (low, high) = ((ends * min).min(ends * max), (ends * min).max(ends * max));
            let [low, high] = [low, high].map(|ends| translation + ends.element_sum());
            [((low - pad) as f32).next_down(), ((high + pad) as f32).next_up()]
        });
        Aabb { min: sides.map(|side| side[0]).into(), max: sides.map(|side| side[1]).into() }
    }

    /// The directions across the planes of a box of the mesh in the world, with coordinates from -1 to 1, and between which dot products with
    /// each of them what [`Placement::point`] makes of its points lies, up to rounding.
    pub(crate) fn planes(&self, bounds: &Aabb) -> ([[f32; 3]; 3], [[f64; 2]; 3]) {
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let (matrix, [x, y, z]) = (self.matrix(), self.rows.map(|row| f64::from(row[3])));
        let across = |inverse: [f32; 3]| {
            let normal = Vec3::from_array(inverse).as_dvec3();
            (normal / normal.abs().max_element()).as_vec3()
        };
        let planes = self.inverse.map(across);
        let interval = |normal: Vec3| {
            // Rounded, it is not quite perpendicular to the other two axes of the mesh.
            let normal = normal.as_dvec3();
            let (along, offset) = (matrix.transpose() * normal, normal.dot(DVec3::new(x, y, z)));
            let (low, high) = ((along * min).min(along * max), (along * min).max(along * max));
            [offset + low.element_sum(), offset + high.element_sum()]
        };
        (planes.map(|plane| plane.to_array()), planes.map(interval))
    }

    /// Upper bound of how far the boxes of [`Placement::bounds`] are padded on each side: the rounding of coordinates included.
    #[cfg(feature = "tree-file")]
    pub(crate) fn pad(&self) -> f64 {
        f64::from(self.reach) * 2.0 * PLACE_PAD
    }

    /// The factors of the coordinates.
    fn matrix(&self) -> DMat3 {
        let [x, y, z] = self.rows.map(|[x, y, z, _]| DVec3::new(f64::from(x), f64::from(y), f64::from(z)));
        DMat3::from_cols(x, y, z).transpose()
    }

    /// `ray` in the coordinates of the mesh; `None` where these leave the range of single precision.
    ///
    /// The widening is more than what rounding moves between the two: 47 units of 2⁻²⁴ of S·W on an axis, where S is the sum of the
    /// absolute elements of the inverse's row and W that of the reaches of copy and ray. docs/containers.md, "Copies of meshes", derives it.
    #[inline(always)]
    pub(crate) fn carry(&self, ray: &Ray) -> Option<CarriedRay> {
        let direction = self.carry_vector(ray.direction);
        let largest = direction.abs().max_element();
        // NaN fails each comparison.
        if let Some(CarriedPoint { point, widening }) = self.carry_point(ray.origin)
            && (1.0 / LARGEST_DIRECTION..=LARGEST_DIRECTION).contains(&largest)
        {
            let ray = Ray { origin: point, direction, t_min: ray.t_min.max(0.0), t_max: ray.t_max };
            return Some(CarriedRay { ray, per_distance: 1.0, widening });
        }
        self.carry_scaled(ray)
    }

    /// `point` in the coordinates of the mesh, with the widening of [`Placement::carry`] for rays that begin there; `None` where numbers may
    /// leave the range of single precision.
    #[inline(always)]
    pub(crate) fn carry_point(&self, point: Vec3) -> Option<CarriedPoint> {
        let carried = self.carry_vector(point - Vec3::from_array(self.rows.map(|row| row[3])));
        let reach = self.reach + point.abs().max_element();
        let widening = self.widening.map(|factor| factor * reach);
        let fits = carried.is_finite() && widening.iter().all(|&width| width >= LEAST_WIDENING);
        fits.then_some(CarriedPoint { point: carried, widening })
    }

    /// A direction of the world in the coordinates of the mesh.
    #[inline(always)]
    fn carry_vector(&self, vector: Vec3) -> Vec3 {
        let component = |[x, y, z]: [f32; 3]| vector.x * x + vector.y * y + vector.z * z;
        let [x, y, z] = self.inverse;
        Vec3::new(component(x), component(y), component(z))
    }

    /// [`Placement::carry`] in double precision, with the direction scaled by a power of two: for scales that single precision has no
    /// room for.
    #[cold]
    #[inline(never)]
    fn carry_scaled(&self, ray: &Ray) -> Option<CarriedRay> {
        if self.is_singular() {
            return None;
        }
        let inverse = self.matrix().inverse();
        let [x, y, z] = self.rows.map(|row| f64::from(row[3]));
        let origin = (inverse * (ray.origin.as_dvec3() - DVec3::new(x, y, z))).as_vec3();
        let reach = f64::from(self.reach) + f64::from(ray.origin.abs().max_element());
        let widening = rows_of(&inverse).map(|row| (row.abs().element_sum() * CARRY_PAD * reach) as f32);
        let direction = inverse * ray.direction.as_dvec3();
        // So that neither its square nor its reciprocal leaves the range.
        let (scale, per_distance) = powers(direction.abs().max_element())?;
        let carried = Ray {
            origin,
            direction: (direction * scale).as_vec3(),
            t_min: (ray.t_min.max(0.0) * per_distance).next_down().max(0.0),
            t_max: ray.t_max,
        };
        let fits = carried.origin.is_finite() && carried.direction.is_finite();
        let carried = CarriedRay { ray: carried, per_distance, widening };
        fits.then(|| CarriedRay { ray: Ray { t_max: carried.distance(ray.t_max), ..carried.ray }, ..carried })
    }
}

/// The transform whose factors and translation `rows` has, by axis of the world.
pub(crate) fn transform_of(rows: &[[f32; 4]; 3]) -> Affine3A {
    let column = |at: usize| Vec3::from_array(rows.map(|row| row[at]));
    Affine3A::from_cols(column(0).into(), column(1).into(), column(2).into(), column(3).into())
}

/// The inverse of the factors of the coordinates; the error says why there is none to rely on.
fn inverse_of(matrix: &DMat3) -> Result<DMat3, &'static str> {
    let inverse = matrix.inverse();
    let residual = inverse * *matrix - DMat3::IDENTITY;
    // NaN fails each comparison.
    let is_within = |matrix: &DMat3, limit: f64| matrix.to_cols_array().iter().all(|number| number.abs() <= limit);
    if !is_within(&residual, LARGEST_RESIDUAL) {
        return Err("its transform is singular, or nearly so");
    }
    if !(is_within(matrix, LARGEST_SCALE) && is_within(&inverse, LARGEST_SCALE)) {
        return Err("its scale is below 1e-12 or above 1e12");
    }
    Ok(inverse)
}

fn rows_of(matrix: &DMat3) -> [DVec3; 3] {
    let rows = matrix.transpose();
    [rows.x_axis, rows.y_axis, rows.z_axis]
}

/// The power of two by which `length` is divided to be from 1 to below 2, inverted, and itself; `None` where one of them has no normal
/// number of its precision.
#[inline(always)]
fn powers(length: f64) -> Option<(f64, f32)> {
    // The exponent without the fraction.
    let power = f64::from_bits(length.to_bits() & f64::INFINITY.to_bits());
    (power as f32).is_normal().then(|| (1.0 / power, power as f32))
}

impl CarriedRay {
    /// A distance along the ray that was carried, along this one, or the next larger number.
    #[inline(always)]
    pub(crate) fn distance(&self, distance: f32) -> f32 {
        (distance * self.per_distance).next_up()
    }

    /// A distance along this ray, along the one that was carried.
    #[inline(always)]
    pub(crate) fn distance_in_world(&self, distance: f32) -> f32 {
        distance / self.per_distance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sphere::tests::numbers;

    #[test]
    fn copies_lie_in_their_boxes() {
        let mut number = numbers();
        let mut vector = |scale: f32| Vec3::new(number(), number(), number()) * scale;
        for case in 0..3_000 {
            let scale = [1e-6, 1.0, 1e6][case % 3];
            let matrix = glam::Mat3A::from_cols(vector(scale).into(), vector(scale).into(), vector(scale).into());
            let transform = Affine3A { matrix3: matrix, translation: vector([1.0, 1e7][case % 2]).into() };
            let (a, b) = (vector(3.0), vector(3.0));
            let bounds = Aabb { min: a.min(b), max: a.max(b) };
            let Ok(placement) = Placement::new(&transform, &bounds) else { continue };
            let placed = placement.bounds(&bounds);
            for corner in 0..8 {
                let side = |axis: usize| if corner >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
                let point = placement.point(Vec3::new(side(0), side(1), side(2)));
                assert!(point.cmpge(placed.min).all() && point.cmple(placed.max).all(), "{transform:?} {point}");
            }
        }
    }

    #[test]
    fn transforms_without_an_inverse_are_refused_by_name() {
        let unit = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let refused = |transform: Affine3A| Placement::new(&transform, &unit).expect_err("refused");
        assert!(refused(Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0))).contains("singular"));
        assert!(refused(Affine3A::from_scale(Vec3::NAN)).contains("not finite"));
        assert!(refused(Affine3A::from_translation(Vec3::INFINITY)).contains("not finite"));
        assert!(refused(Affine3A::from_scale(Vec3::splat(1e13))).contains("scale"));
        assert!(refused(Affine3A::from_scale(Vec3::splat(1e-13))).contains("scale"));
        assert!(refused(Affine3A::from_translation(Vec3::splat(2e18))).contains("coordinates"));
        let flat = glam::Mat3A::from_cols_array(&[1.0, 2.0, 3.0, 2.0, 4.0, 6.0, 0.0, 0.0, 1.0]);
        assert!(refused(Affine3A { matrix3: flat, translation: glam::Vec3A::ZERO }).contains("singular"));
    }
}
