//! Polytopes between seven pairs of parallel planes.

use glam::{DVec3, Vec3};

use super::aabb::Aabb;
use super::container::Container as _;
use super::triangle::Triangle;

/// Part of the sum of a point's absolute coordinates by which the planes along the diagonals are moved outwards: at both ends of
/// every container, and again at the origin of every ray. More than the rounding of the sums, of the slab test and of a ray's
/// direction (10 units of 2⁻²⁴ together) and than the error of a hit's distance, at most a millionth.
pub(crate) const DIAGONAL_PAD: f32 = 16.0 * f32::EPSILON;
/// Reciprocal of the length of a diagonal, √3, rounded down.
pub(crate) const PER_DIAGONAL: f32 = 0.577_35;

/// A discrete oriented polytope of fourteen planes (14-DOP): the space between two planes across each of the three axes and of the
/// four diagonals of a cube (Klosowski, Held, Mitchell, Sowizral, Zikan, *Efficient Collision Detection Using Bounding Volume
/// Hierarchies of k-DOPs*, 1998). Empty where its box is.
///
/// The planes along the diagonals stand a little outside of what they enclose, by 2⁻¹⁹ of the sum of the absolute coordinates, so that
/// neither the rounding of sums nor that of rays loses a hit.
///
/// ```
/// use bvhscope_engine::glam::Vec3;
/// use bvhscope_engine::tree::Container as _;
/// use bvhscope_engine::{Dop14, Triangle};
///
/// // A blade from corner to corner of the unit square needs hardly a tenth of the square.
/// let blade = Triangle { a: Vec3::ZERO, b: Vec3::new(1.0, 1.0, 0.0), c: Vec3::new(0.02, 0.0, 0.0) };
/// let polytope = Dop14::of_triangle(&blade);
/// assert!(polytope.half_area() < 0.1 * polytope.bounds.half_area());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Dop14 {
    /// Between the planes across the axes.
    pub bounds: Aabb,
    /// For each of [`Dop14::DIAGONALS`] the smallest dot product with it.
    pub low: [f32; 4],
    /// For each of [`Dop14::DIAGONALS`] the largest dot product with it.
    pub high: [f32; 4],
}

/// Half of the surface area of a tight polytope, for numbers or for lanes of them: from a box's `min` and `max`, the planes `low` and
/// `high` along the diagonals, and a zero. A macro, because a function called by lanes must be inlined into them.
///
/// The planes along the diagonals cut the corners off the box. A cut of depth c, measured along the edges, takes three
/// right-angled triangles from the faces, 3/2·c² together, and leaves a triangle of √3/2·c². Cuts at both ends of an edge of length l
/// meet where o = c₁ + c₂ − l is positive: the edge is gone, o²/4 was taken twice from each of its two faces, and √3/8·o² of each cut
/// lies behind the other. No other parts of cuts overlap as long as every plane touches the polytope.
macro_rules! half_area_between {
    ($min:expr, $max:expr, $low:expr, $high:expr, $zero:expr) => {{
        let ([ax, ay, az], [bx, by, bz], zero) = ($min, $max, $zero);
        let ([l0, l1, l2, l3], [h0, h1, h2, h3]) = ($low, $high);
        let (x, y, z) = (bx - ax, by - ay, bz - az);
        // Depth of the cut at each corner, the upper ones on x first; a plane outside the box cuts nothing.
        let (h0, h1) = ((bx + by + bz - h0).max(zero), (bx + by - az - h1).max(zero));
        let (h2, h3) = ((bx - ay + bz - h2).max(zero), (bx - ay - az - h3).max(zero));
        let (l0, l1) = ((l0 - (ax + ay + az)).max(zero), (l1 - (ax + ay - bz)).max(zero));
        let (l2, l3) = ((l2 - (ax - by + az)).max(zero), (l3 - (ax - by - bz)).max(zero));
        macro_rules! met {
            ($a:ident, $b:ident, $edge:ident) => {{
                let overlap = ($a + $b - $edge).max(zero);
                overlap * overlap
            }};
        }
        let cuts = h0 * h0 + h1 * h1 + h2 * h2 + h3 * h3 + (l0 * l0 + l1 * l1 + l2 * l2 + l3 * l3);
        let along_x = met!(h0, l3, x) + met!(h1, l2, x) + met!(h2, l1, x) + met!(h3, l0, x);
        let along_y = met!(h0, h2, y) + met!(h1, h3, y) + met!(l0, l2, y) + met!(l1, l3, y);
        let along_z = met!(h0, h1, z) + met!(h2, h3, z) + met!(l0, l1, z) + met!(l2, l3, z);
        let box_area = x * (y + z) + y * z;
        // (3 − √3)/4 and (2 − √3)/8.
        (box_area - cuts * 0.316_987_3 + (along_x + along_y + along_z) * 0.033_493_65).max(zero)
    }};
}

pub(crate) use half_area_between;

impl Dop14 {
    /// The directions beside the axes, not normalised.
    pub const DIAGONALS: [Vec3; 4] =
        [Vec3::ONE, Vec3::new(1.0, 1.0, -1.0), Vec3::new(1.0, -1.0, 1.0), Vec3::new(1.0, -1.0, -1.0)];

    /// A polytope around balls of a `radius` at `points`, and so around all that such a ball sweeps on straight ways between them; padded.
    /// Empty without points.
    pub fn around_balls(points: impl IntoIterator<Item = Vec3>, radius: f32) -> Self {
        let around = |a: Vec3| Self::of_triangle(&Triangle { a, b: a, c: a });
        let mut all = points.into_iter().fold(Self::EMPTY, |all, point| all.union(&around(point)));
        // Outwards of the rounded sums.
        let Aabb { min, max } = all.bounds;
        all.bounds = Aabb { min: (min - radius).map(f32::next_down), max: (max + radius).map(f32::next_up) };
        // The diagonals are √3 long.
        let along = 1.733 * radius;
        all.low = all.low.map(|plane| plane - along);
        all.high = all.high.map(|plane| plane + along);
        all
    }

    /// True if the polytope contains no point, as far as its box shows.
    pub fn is_empty(&self) -> bool {
        self.bounds.is_empty()
    }

    /// Half of the surface area, which is enough where only ratios matter; 0 for the empty polytope. Exact but for rounding and padding
    /// where every plane touches the polytope, as those of unions do.
    pub fn half_area(&self) -> f32 {
        if self.is_empty() { 0.0 } else { self.nonempty_half_area() }
    }

    /// [`Dop14::half_area`] of a polytope that is not empty, without checking. A call: it is used at many places, and is long.
    pub(crate) fn nonempty_half_area(&self) -> f32 {
        half_area_between!(self.bounds.min.to_array(), self.bounds.max.to_array(), self.low, self.high, 0.0_f32)
    }

    /// By how much `point` sticks out, in world units; negative or 0 inside.
    pub fn excess_of_point(&self, point: Vec3) -> f64 {
        let [point, min, max] = [point, self.bounds.min, self.bounds.max].map(Vec3::as_dvec3);
        let mut excess = (min - point).max(point - max).max_element();
        for (at, diagonal) in Self::DIAGONALS.into_iter().enumerate() {
            let along = point.dot(diagonal.as_dvec3());
            // Planes at the largest number stand for planes beyond it.
            let below = if self.low[at] > -f32::MAX { f64::from(self.low[at]) - along } else { f64::NEG_INFINITY };
            let above = if self.high[at] < f32::MAX { along - f64::from(self.high[at]) } else { f64::NEG_INFINITY };
            excess = excess.max(below.max(above) / 3.0_f64.sqrt());
        }
        excess
    }
}

/// The dot product of `point` with each of [`Dop14::DIAGONALS`].
#[inline(always)]
pub(crate) fn along_diagonals(point: Vec3) -> [f32; 4] {
    let (sum, difference) = (point.x + point.y, point.x - point.y);
    [sum + point.z, sum - point.z, difference + point.z, difference - point.z]
}

/// [`along_diagonals`] in double precision.
pub(super) fn exactly_along_diagonals(point: DVec3) -> [f64; 4] {
    Dop14::DIAGONALS.map(|diagonal| point.dot(diagonal.as_dvec3()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sphere::tests::numbers;

    /// Triangles of any shape and thin, flat and single-point ones, at a scale and a distance from the origin.
    fn triangles(scale: f32, offset: f32) -> Vec<Triangle> {
        let mut number = numbers();
        let mut corner = || Vec3::new(number(), number(), number());
        let triangle = |at: usize| {
            let (a, b, c) = (corner(), corner(), corner());
            let [b, c] = match at % 6 {
                0 => [b, c],
                1 => [b, a + c * 0.01],
                2 => [a + Vec3::ONE, a + Vec3::new(1.0, 1.0, 0.98)],
                3 => [a.with_x(b.x), a.with_y(c.y)],
                4 => [b, a.lerp(b, 0.4)],
                _ => [a, a],
            };
            Triangle { a, b, c }
        };
        let place = |point: Vec3| (point + Vec3::splat(offset)) * scale;
        (0..240).map(triangle).map(|Triangle { a, b, c }| Triangle { a: place(a), b: place(b), c: place(c) }).collect()
    }

    /// Scales and offsets at which they are tried.
    const PLACES: [(f32, f32); 8] =
        [(1.0, 0.0), (1.0, 100.0), (1e-3, 1e4), (1e30, 0.0), (1e-30, 0.0), (1e38, 0.0), (1.5e38, 0.0), (1e-42, 0.0)];

    #[test]
    fn every_corner_is_inside_by_more_than_rounding() {
        for (scale, offset) in PLACES {
            for triangle in triangles(scale, offset) {
                let polytope = Dop14::of_triangle(&triangle);
                let numbers: &[f32; 14] = bytemuck::cast_ref(&polytope);
                assert!(numbers.iter().all(|number| number.is_finite()), "{triangle:?} → {polytope:?}");
                for corner in [triangle.a, triangle.b, triangle.c] {
                    assert!(polytope.excess_of_point(corner) <= 0.0, "{triangle:?} → {polytope:?}");
                    let room = f64::from(corner.abs().max_element()) * 1e-6;
                    let along = exactly_along_diagonals(corner.as_dvec3());
                    let has_room = |at: usize| {
                        along[at] - f64::from(polytope.low[at]) >= room
                            && f64::from(polytope.high[at]) - along[at] >= room
                    };
                    assert!(!(1e-40..=1e37).contains(&scale) || (0..4).all(has_room), "{triangle:?} → {polytope:?}");
                }
            }
        }
    }

    #[test]
    fn a_union_holds_both_and_no_polytope_inside_is_larger() {
        for (scale, offset) in PLACES {
            // As trees do it: areas that would leave the range of single precision are computed of scaled coordinates.
            let factor = crate::geometry::area_scale(scale * (1.0 + offset));
            let polytopes: Vec<Dop14> = triangles(scale, offset).iter().map(Dop14::of_triangle).collect();
            for pair in polytopes.windows(3) {
                let both = pair[0].union(&pair[1]);
                assert!(both.contains(&pair[0], 0.0) && both.contains(&pair[1], 0.0), "{pair:?} → {both:?}");
                assert_eq!(both, pair[1].union(&pair[0]), "the order does not matter");
                let all = both.union(&pair[2]);
                let size = all.bounds.extent().max_element() * factor;
                let pad = DIAGONAL_PAD * 3.0 * all.bounds.min.abs().max(all.bounds.max.abs()).max_element() * factor;
                let rounding = 2.0 * size * (size * 1e-6 + pad);
                let [one, both, all] = [pair[0], both, all].map(|polytope| polytope.scaled(factor).half_area());
                assert!(one <= both + rounding && both <= all + rounding, "{one} {both} {all}: {pair:?}");
            }
            assert_eq!(polytopes[0].union(&Dop14::EMPTY), polytopes[0]);
            assert_eq!(Dop14::EMPTY.union(&polytopes[0]), polytopes[0]);
        }
        assert_eq!(Dop14::EMPTY.half_area(), 0.0);
    }

    #[test]
    fn an_octahedron_has_its_area() {
        let low = [-1.0; 4];
        let octahedron = Dop14 { bounds: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE }, low, high: [1.0; 4] };
        assert!((octahedron.half_area() - 2.0 * 3.0_f32.sqrt()).abs() < 1e-5, "{}", octahedron.half_area());
        let cube = Dop14 { low: [-3.0; 4], high: [3.0; 4], ..octahedron };
        assert_eq!(cube.half_area(), 12.0);
    }
}
