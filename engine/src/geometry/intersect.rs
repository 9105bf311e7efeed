//! Ray-box and ray-triangle intersection.
//!
//! The two tests agree in such a way that the hit of a triangle does not depend on the boxes around it: the slab test is
//! monotone (rounding never lets a ray enter an outer box later than an inner one), and a triangle is hit only where its own
//! box is, no nearer than that box. So no tree of boxes can lose a hit that a linear scan finds.

use glam::{Vec3, Vec3A};

use super::aabb::Aabb;
use super::prepared_ray::{PreparedRay, Shear};
use super::ray::Hit;
use super::triangle::Triangle;

/// Factor on a box's exit distance, 16 ulp: more than the rounding of slab and triangle test together (about 6 ulp each), so
/// that a ray along a shared face is never lost (Ize: *Robust BVH Ray Traversal*, JCGT 2013).
pub(crate) const FAR_SLACK: f32 = 1.0 + 16.0 * f32::EPSILON;

/// Edge functions smaller than this are recomputed in double precision: they may be zero only by rounding.
pub(crate) const EDGE_MIN: f32 = 1e-30;
/// Edge functions larger than this are recomputed in double precision: they may have overflowed.
pub(crate) const EDGE_MAX: f32 = 1e37;

/// Intersection of a ray with a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleHit {
    /// Distance along the ray, in lengths of its direction.
    pub t: f32,
    /// Barycentric weight of the second corner.
    pub u: f32,
    /// Barycentric weight of the third corner.
    pub v: f32,
}

impl TriangleHit {
    /// The hit of the triangle with this index.
    #[inline(always)]
    pub(crate) fn of(self, primitive_index: u32) -> Hit {
        let Self { t, u, v } = self;
        Hit { t, primitive_index, u, v }
    }
}

/// Intersection of a ray with two sibling containers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairEntry {
    /// Entry distances, at least `t_min`; meaningless where the container is missed.
    pub entry: [f32; 2],
    /// Bit 0: the first container is hit; bit 1: the second is.
    pub hits: u32,
}

impl PairEntry {
    /// Of the entry distance of each container, `None` where it is missed.
    #[inline(always)]
    pub(crate) fn of([a, b]: [Option<f32>; 2]) -> Self {
        let hits = u32::from(a.is_some()) | u32::from(b.is_some()) << 1;
        Self { entry: [a.unwrap_or(f32::INFINITY), b.unwrap_or(f32::INFINITY)], hits }
    }
}

/// A single instruction, unlike `f32::min`, which also handles NaN; that cannot occur here.
#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

impl Aabb {
    /// Entry distance of a ray, at least `t_min`; `None` where it misses or enters beyond `t_max`. A ray in the plane of a face
    /// touches the box.
    ///
    /// Slab test: Kay and Kajiya, *Ray Tracing Complex Scenes*, SIGGRAPH 1986.
    #[inline]
    pub fn entry(&self, ray: &PreparedRay, t_min: f32, t_max: f32) -> Option<f32> {
        let t0 = (self.min - ray.origin_low) * ray.inverse_direction;
        let t1 = (self.max - ray.origin_high) * ray.inverse_direction;
        let near = max(max(min(t0.x, t1.x), min(t0.y, t1.y)), max(min(t0.z, t1.z), t_min));
        let far = min(min(max(t0.x, t1.x), max(t0.y, t1.y)), max(t0.z, t1.z)) * FAR_SLACK;
        // An empty box is inverted and must stay a miss.
        (near <= min(far, t_max) && self.min.x <= self.max.x).then_some(near)
    }
}

impl Triangle {
    /// Intersection of a ray, whose `shear` it is, with the triangle between `ray.t_min` and `t_max`, from either side.
    ///
    /// Watertight: neighbours compute the exact same sign for a shared edge, and a zero belongs to both, so no ray passes through
    /// a closed mesh (Woop, Benthin, Wald: *Watertight Ray/Triangle Intersection*, JCGT 2013). Holds for coordinates up to 1e18.
    #[inline(always)]
    pub fn intersect(&self, ray: &PreparedRay, shear: &Shear, t_max: f32) -> Option<TriangleHit> {
        let o = ray.ray.origin;
        let [row_x, row_y, row_z] = shear.rows;
        // Corners relative to the origin, one vector per axis.
        let x = Vec3A::new(self.a.x, self.b.x, self.c.x) - Vec3A::splat(o.x);
        let y = Vec3A::new(self.a.y, self.b.y, self.c.y) - Vec3A::splat(o.y);
        let z = Vec3A::new(self.a.z, self.b.z, self.c.z) - Vec3A::splat(o.z);
        // Shear the ray onto the z axis.
        let px = x * row_x.x + y * row_x.y + z * row_x.z;
        let py = x * row_y.x + y * row_y.y + z * row_y.z;
        // Twice the areas of the triangles between the axis and each edge: the corners' weights.
        let weights = px.cross(py);
        let (least, most) = (weights.min_element(), weights.max_element());
        if least < 0.0 && most > 0.0 {
            return None;
        }
        let pz = x * row_z.x + y * row_z.y + z * row_z.z;
        let size = weights.abs();
        let (t, u, v) = if size.min_element() > EDGE_MIN && size.max_element() < EDGE_MAX {
            let normalized = weights * (weights.x + weights.y + weights.z).recip();
            (normalized.dot(pz), normalized.y, normalized.z)
        } else {
            edge_case(px.into(), py.into(), pz.into())?
        };
        let depths = [pz.min_element(), pz.max_element()];
        let is_within = |near: f32, far: f32| far >= ray.ray.t_min && near <= t_max;
        if !is_within(t, t) && !is_within(depths[0], depths[1]) {
            return None;
        }
        let t = if self.is_needle() { self.needle_distance(&ray.ray, t, depths) } else { t };
        if !is_within(t, t) {
            return None;
        }
        self.hit_in_box(ray, TriangleHit { t, u, v }, t_max)
    }

    /// `hit` where the triangle's own box is entered up to `t_max`, moved to the box's entry where rounding put it nearer. See the
    /// module's documentation.
    #[inline(always)]
    pub(crate) fn hit_in_box(&self, ray: &PreparedRay, hit: TriangleHit, t_max: f32) -> Option<TriangleHit> {
        let entry = self.bounds().entry(ray, ray.ray.t_min, t_max)?;
        Some(TriangleHit { t: max(hit.t, entry), ..hit })
    }
}

/// t, u and v where single precision cannot tell on which side of an edge the ray passes: products of two floats are exact in
/// double precision.
#[cold]
fn edge_case(px: Vec3, py: Vec3, pz: Vec3) -> Option<(f32, f32, f32)> {
    let (px, py, pz) = (px.as_dvec3(), py.as_dvec3(), pz.as_dvec3());
    let weights = px.cross(py);
    if weights.min_element() < 0.0 && weights.max_element() > 0.0 {
        return None;
    }
    let sum = weights.element_sum();
    // Degenerate triangles and those seen edge-on have no area to hit.
    if sum == 0.0 || !sum.is_finite() {
        return None;
    }
    let weights = weights / sum;
    Some((weights.dot(pz) as f32, weights.y as f32, weights.z as f32))
}
