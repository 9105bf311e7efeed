//! Ray-box and ray-triangle intersection.
//!
//! The two tests agree in such a way that the hit of a triangle does not depend on the boxes around it: the slab test is
//! monotone (rounding never lets a ray enter an outer box later than an inner one), and a triangle is hit only where its own
//! box is, no nearer than that box. So no tree of boxes can lose a hit that a linear scan finds.

use fearless_simd::{Simd, SimdBase, SimdMask, f32x4};
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

    /// [`Aabb::entry`] of two boxes that are not empty, with the same results.
    #[inline(always)]
    pub fn entry_pair<S: Simd>(simd: S, pair: [&Self; 2], ray: &PreparedRay, t_min: f32, t_max: f32) -> PairEntry {
        let load = |array: &[f32; 4]| f32x4::load_array_ref(simd, array);
        let [a, b] = pair.map(bytemuck::cast_ref::<Aabb, [f32; 6]>);
        // Two loads per box: (min.x, min.y, min.z, max.x) and (min.z, max.x, max.y, max.z).
        let (a0, b0) = (load(&[a[0], a[1], a[2], a[3]]), load(&[b[0], b[1], b[2], b[3]]));
        let (a1, b1) = (load(&[a[2], a[3], a[4], a[5]]), load(&[b[2], b[3], b[4], b[5]]));
        // Lanes, alternating between the boxes: lower x and y; lower z and upper x; upper y and z.
        let planes = [a0.zip_low(b0), a1.zip_low(b1), a1.zip_high(b1)];
        let t = |part: usize| (planes[part] - load(&ray.pair_origins[part])) * load(&ray.pair_inverses[part]);
        let (t0, t1, t2) = (t(0), t(1), t(2));
        // From here on only the first two lanes are used.
        let swapped = |lanes: f32x4<S>| lanes.slide::<2>(lanes);
        let upper_xy = t1.slide::<2>(t2);
        let (near_xy, far_xy) = (t0.min(upper_xy), t0.max(upper_xy));
        let (lower_z, upper_z) = (t1, swapped(t2));
        let near_z = lower_z.min(upper_z).max(f32x4::splat(simd, t_min));
        let near = near_xy.max(swapped(near_xy)).max(near_z);
        let far = far_xy.min(swapped(far_xy)).min(lower_z.max(upper_z)) * FAR_SLACK;
        let hit = near.simd_le(far) & near.simd_le(f32x4::splat(simd, t_max));
        let near = near.to_array();
        PairEntry { entry: [near[0], near[1]], hits: hit.to_bitmask() as u32 & 3 }
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
