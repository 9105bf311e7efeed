//! Smooth normals of models that have none: at each corner of a triangle the mean of the triangles that meet there at no more
//! than the crease angle, so that scans look smooth and a cube stays a cube.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use glam::{Vec2, Vec3};

use crate::budget::{Budget, OverBudget};
use crate::vectors::direction;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::kernel::parallel::par_tasks;

/// Triangles, or corners, between two cancellation checks.
const BATCH: usize = 1 << 15;
/// Corners at one point beyond which they stay flat: comparing each with each would take too long, and such points are the
/// tips of fans.
const MAX_VALENCE: usize = 256;
/// Peak bytes per triangle: three packed normals, and three keys held twice while they are sorted.
const BYTES_PER_TRIANGLE: u64 = 3 * (4 + 8 + 8);
/// Stands for the geometric normal of the triangle; no packed normal has these bits.
const FLAT: u32 = 0x8000_8000;

/// A unit normal for each corner of each triangle.
#[derive(Debug)]
pub struct CornerNormals {
    /// Two 16-bit coordinates on an octahedron, corner after corner; [`FLAT`] for none. Atomic because threads fill the list by
    /// position of the corners in space, not in the list.
    packed: Vec<AtomicU32>,
}

impl CornerNormals {
    /// The unit normals of a triangle's corners; zero stands for the geometric normal.
    pub fn of(&self, triangle_index: u32) -> [Vec3; 3] {
        let first = triangle_index as usize * 3;
        std::array::from_fn(|corner| {
            self.packed.get(first + corner).map_or(Vec3::ZERO, |packed| unpack(packed.load(Ordering::Relaxed)))
        })
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.packed[..])
    }

    /// The normals of `triangles`. The same triangles give the same normals on any number of threads.
    pub fn new(triangles: &[Triangle], crease_degrees: f32, token: &CancelToken) -> Result<Self, Cancelled> {
        let corners = triangles.len() * 3;
        let mut packed = Vec::with_capacity(corners);
        while packed.len() < corners {
            token.check()?;
            let end = corners.min(packed.len() + BATCH);
            packed.resize_with(end, || AtomicU32::new(FLAT));
        }
        let grid = Grid::around(triangles, token)?;
        // Corners with the cell of their position above their index, sorted: those at one point are adjacent, and those nearby in
        // space follow, most of which are nearby in memory.
        let sorted: Vec<Vec<u64>> = par_tasks(triangles.chunks(BATCH).enumerate(), token, |(chunk, triangles), _| {
            let points = triangles.iter().flat_map(|triangle| [triangle.a, triangle.b, triangle.c]);
            let first = (chunk * BATCH * 3) as u64;
            let mut keys: Vec<u64> = points.zip(first..).map(|(point, corner)| key(grid.cell(point), corner)).collect();
            keys.sort_unstable();
            Ok(keys)
        })?;
        let cosine = crease_degrees.to_radians().cos();
        let starts = bucket_starts(&sorted);
        par_tasks(0..starts.len(), token, |bucket, _| {
            let is_before = |key: u64, bucket: usize| starts.get(bucket).is_none_or(|&start| key >> 32 < start);
            let mut keys = Vec::new();
            for chunk in &sorted {
                let start = chunk.partition_point(|&key| is_before(key, bucket));
                let end = chunk.partition_point(|&key| is_before(key, bucket + 1));
                keys.extend_from_slice(&chunk[start..end]);
            }
            keys.sort_unstable();
            let mut meeting = Vec::new();
            for in_cell in keys.chunk_by_mut(|a, b| a >> 32 == b >> 32) {
                // From now on with the hash of the position.
                for in_cell in in_cell.iter_mut() {
                    *in_cell = key(hash(point(triangles, *in_cell as u32)), *in_cell & u64::from(u32::MAX));
                }
                in_cell.sort_unstable();
                for same_hash in in_cell.chunk_by(|a, b| a >> 32 == b >> 32) {
                    smooth_point(triangles, same_hash, cosine, &mut meeting, &packed);
                }
            }
            Ok(())
        })?;
        Ok(Self { packed })
    }
}

/// A number by which corners are sorted, above the corner's index.
fn key(sorted_by: u32, corner: u64) -> u64 {
    u64::from(sorted_by) << 32 | corner
}

/// The cells at which parts of about [`BATCH`] corners begin, in ascending order and the first at 0, which tasks work through.
fn bucket_starts(sorted: &[Vec<u64>]) -> Vec<u64> {
    let samples = sorted.iter().flat_map(|keys| keys.iter().skip(BATCH / 2).step_by(BATCH));
    let mut starts: Vec<u64> = samples.map(|key| key >> 32).chain([0]).collect();
    starts.sort_unstable();
    starts.dedup();
    starts
}

/// Cells of a box in the order of Morton's curve.
struct Grid {
    min: Vec3,
    cells_per_unit: Vec3,
}

impl Grid {
    fn around(triangles: &[Triangle], token: &CancelToken) -> Result<Self, Cancelled> {
        let batches = par_tasks(triangles.chunks(BATCH), token, |batch, _| {
            Ok(batch.iter().fold(Aabb::EMPTY, |all, triangle| all.union(&triangle.bounds())))
        })?;
        let bounds = batches.iter().fold(Aabb::EMPTY, |all, batch| all.union(batch));
        let cells_per_unit = bounds.extent().map(|extent| if extent > 0.0 { 1024.0 / extent } else { 0.0 });
        Ok(Self { min: bounds.min, cells_per_unit })
    }

    /// The code of the cell that a position is in: ten bits of each axis.
    fn cell(&self, point: Vec3) -> u32 {
        let [x, y, z] = ((point - self.min) * self.cells_per_unit).to_array().map(|at| spread(at.min(1023.0) as u32));
        x << 2 | y << 1 | z
    }
}

/// Inserts two zero bits before each of the lowest ten bits.
fn spread(bits: u32) -> u32 {
    const SPREAD: [(u32, u32); 4] = [(16, 0x0300_00ff), (8, 0x0300_f00f), (4, 0x030c_30c3), (2, 0x0924_9249)];
    SPREAD.iter().fold(bits, |bits, (shift, mask)| (bits | bits << shift) & mask)
}

/// A triangle's corner at a point.
struct Corner {
    point: Vec3,
    /// Unit normal of the triangle; zero if it has no area.
    normal: Vec3,
    /// Angle between the triangle's edges at the corner, in radians.
    angle: f32,
}

/// Writes the normals of the corners in `keys`, which have positions of one hash. Each triangle counts by its angle there
/// (Thürmer and Wüthrich, *Computing Vertex Normals from Polygonal Facets*, 1998).
fn smooth_point(
    triangles: &[Triangle],
    keys: &[u64],
    crease_cosine: f32,
    meeting: &mut Vec<Corner>,
    packed: &[AtomicU32],
) {
    if keys.len() > MAX_VALENCE {
        return;
    }
    meeting.clear();
    meeting.extend(keys.iter().map(|&key| corner(triangles, key as u32)));
    for (own, &key) in meeting.iter().zip(keys) {
        let others = meeting.iter().filter(|other| {
            other.point == own.point && (other.normal == own.normal || other.normal.dot(own.normal) >= crease_cosine)
        });
        let sum = others.fold(Vec3::ZERO, |sum, other| sum + other.normal * other.angle);
        if let Some(normal) = sum.try_normalize() {
            packed[key as u32 as usize].store(pack(normal), Ordering::Relaxed);
        }
    }
}

/// The position of a corner.
fn point(triangles: &[Triangle], index: u32) -> Vec3 {
    let Triangle { a, b, c } = triangles[index as usize / 3];
    [a, b, c][index as usize % 3]
}

fn corner(triangles: &[Triangle], index: u32) -> Corner {
    let Triangle { a, b, c } = triangles[index as usize / 3];
    let [point, next, last] = match index % 3 {
        0 => [a, b, c],
        1 => [b, c, a],
        _ => [c, a, b],
    };
    let unit = |vector: Vec3| direction(vector).unwrap_or_default();
    let (to_next, to_last) = (unit(next - point), unit(last - point));
    let angle = to_next.dot(to_last).clamp(-1.0, 1.0).acos();
    // From `a` for all corners, so that they agree to the last bit.
    let normal = unit(b - a).cross(unit(c - a)).normalize_or_zero();
    Corner { point, normal, angle }
}

/// Hashes a position; equal coordinates have equal hashes, 0 and -0 as well.
fn hash(point: Vec3) -> u32 {
    let mut hash = 0_u32;
    for coordinate in point.to_array() {
        // The finaliser of MurmurHash3 (public domain).
        hash = hash.rotate_left(13) ^ (coordinate + 0.0).to_bits().wrapping_mul(0xcc9e_2d51);
        hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
        hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
        hash ^= hash >> 16;
    }
    hash
}

/// A unit vector as two signed 16-bit coordinates on an unfolded octahedron, at most 0.004 degrees off (Cigolle et al., *A Survey
/// of Efficient Representations for Independent Unit Vectors*, 2014).
fn pack(normal: Vec3) -> u32 {
    let on_octahedron = normal / normal.abs().element_sum();
    let mut at = on_octahedron.truncate();
    if on_octahedron.z < 0.0 {
        at = (Vec2::ONE - at.yx_abs()) * Vec2::new(1.0_f32.copysign(at.x), 1.0_f32.copysign(at.y));
    }
    let quantized = |x: f32| u32::from((x * 32_767.0).round() as i16 as u16);
    quantized(at.x) << 16 | quantized(at.y)
}

/// The vector of [`pack`]; zero for [`FLAT`].
fn unpack(packed: u32) -> Vec3 {
    if packed == FLAT {
        return Vec3::ZERO;
    }
    let coordinate = |bits: u32| f32::from(bits as u16 as i16) / 32_767.0;
    let mut at = Vec2::new(coordinate(packed >> 16), coordinate(packed));
    let z = 1.0 - at.x.abs() - at.y.abs();
    if z < 0.0 {
        at = (Vec2::ONE - at.yx_abs()) * Vec2::new(1.0_f32.copysign(at.x), 1.0_f32.copysign(at.y));
    }
    at.extend(z).normalize_or_zero()
}

/// Absolute values, swapped.
trait Swapped {
    fn yx_abs(self) -> Self;
}

impl Swapped for Vec2 {
    fn yx_abs(self) -> Self {
        Self::new(self.y.abs(), self.x.abs())
    }
}

/// Why there are no smooth normals.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum NoNormals {
    #[error(transparent)]
    OverBudget(#[from] OverBudget),
    #[error("cancelled")]
    Cancelled(#[from] Cancelled),
}

/// The smooth normals of a scene by the crease angle that was asked for last.
#[derive(Debug, Default)]
pub struct SmoothNormals {
    newest: Mutex<Option<(f32, Arc<CornerNormals>)>>,
}

impl SmoothNormals {
    /// The crease angle in degrees unless another is chosen: keeps the edges of machines and the folds of cloth, and smooths
    /// what scans are made of.
    pub const DEFAULT_CREASE_DEGREES: f32 = 40.0;

    /// The normals by this crease angle, if they were made before.
    pub(super) fn known(&self, crease_degrees: f32) -> Option<Arc<CornerNormals>> {
        let newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner).clone();
        newest.filter(|(degrees, _)| *degrees == crease_degrees).map(|(_, normals)| normals)
    }

    /// Refuses the normals of `triangles` where they do not fit into the memory budget now.
    pub(super) fn check(triangle_count: usize) -> Result<(), OverBudget> {
        Budget::of_process().check("the smooth normals", triangle_count as u64 * BYTES_PER_TRIANGLE)
    }

    /// The normals of `triangles` by this crease angle, in the calling thread's rayon pool.
    pub(super) fn get(
        &self,
        triangles: &[Triangle],
        crease_degrees: f32,
        token: &CancelToken,
    ) -> Result<Arc<CornerNormals>, NoNormals> {
        if let Some(normals) = self.known(crease_degrees) {
            return Ok(normals);
        }
        Self::check(triangles.len())?;
        // Not under the lock: a thread that waits for rayon tasks here may run one that asks for the normals too.
        let made = Arc::new(CornerNormals::new(triangles, crease_degrees, token)?);
        *self.newest.lock().unwrap_or_else(PoisonError::into_inner) = Some((crease_degrees, Arc::clone(&made)));
        Ok(made)
    }

    /// Bytes of the normals made so far.
    pub fn bytes(&self) -> usize {
        let newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        newest.as_ref().map_or(0, |(_, normals)| normals.bytes())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn normals(triangles: &[Triangle], degrees: f32) -> CornerNormals {
        CornerNormals::new(triangles, degrees, &CancelToken::new()).unwrap()
    }

    fn geometric(triangle: &Triangle) -> Vec3 {
        triangle.scaled_normal().normalize()
    }

    /// A cube of two triangles a side, facing outwards.
    fn cube() -> Vec<Triangle> {
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for side in [0.0, 1.0] {
                let at = |u: f32, v: f32| {
                    let mut point = [side; 3];
                    (point[(axis + 1) % 3], point[(axis + 2) % 3]) = if side > 0.5 { (u, v) } else { (v, u) };
                    Vec3::from_array(point)
                };
                triangles.push(Triangle { a: at(0.0, 0.0), b: at(1.0, 0.0), c: at(1.0, 1.0) });
                triangles.push(Triangle { a: at(0.0, 0.0), b: at(1.0, 1.0), c: at(0.0, 1.0) });
            }
        }
        triangles
    }

    /// An octahedron whose triangles are divided into four, on the unit sphere, so often.
    fn sphere(times: u32) -> Vec<Triangle> {
        let mut triangles = Vec::new();
        for signs in 0..8 {
            let sign = |axis: u32| if signs >> axis & 1 == 0 { 1.0 } else { -1.0 };
            let [a, b, c] = [Vec3::X * sign(0), Vec3::Y * sign(1), Vec3::Z * sign(2)];
            let outward = sign(0) * sign(1) * sign(2) > 0.0;
            triangles.push(if outward { Triangle { a, b, c } } else { Triangle { a, b: c, c: b } });
        }
        for _ in 0..times {
            let divide = |&Triangle { a, b, c }: &Triangle| {
                let [ab, bc, ca] = [a + b, b + c, c + a].map(Vec3::normalize);
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(|[a, b, c]| Triangle { a, b, c })
            };
            triangles = triangles.iter().flat_map(divide).collect();
        }
        triangles
    }

    #[test]
    fn a_cube_keeps_its_flat_sides() {
        let triangles = cube();
        let normals = normals(&triangles, 40.0);
        let mut at_points = HashSet::new();
        for (index, triangle) in triangles.iter().enumerate() {
            for (point, normal) in [triangle.a, triangle.b, triangle.c].into_iter().zip(normals.of(index as u32)) {
                assert!(normal.dot(geometric(triangle)) > 0.999_999, "{index}: {normal}");
                at_points.insert([point, normal.round()].map(Vec3::as_ivec3));
            }
        }
        assert_eq!(at_points.len(), 24, "three normals at each of eight points");
    }

    #[test]
    fn a_sphere_becomes_smooth() {
        let triangles = sphere(4);
        let normals = normals(&triangles, 40.0);
        for (index, triangle) in triangles.iter().enumerate() {
            for (point, normal) in [triangle.a, triangle.b, triangle.c].into_iter().zip(normals.of(index as u32)) {
                assert!(normal.dot(point) > 0.999, "{point}: {normal}");
            }
        }
    }

    /// Two squares of two triangles that meet at this angle.
    fn fold(degrees: f32) -> Vec<Triangle> {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let [a, b] = [Vec3::ZERO, Vec3::Y];
        let (left, right) = (Vec3::NEG_X, Vec3::new(cos, 0.0, sin));
        let square = |from: Vec3, to: Vec3| {
            [
                Triangle { a: from, b: from + (to - from), c: to + Vec3::Y },
                Triangle { a: from, b: to + Vec3::Y, c: from + Vec3::Y },
            ]
        };
        assert_eq!(a + Vec3::Y, b);
        [square(left, a), square(a, right)].concat()
    }

    #[test]
    fn folds_below_the_crease_angle_are_smooth_and_others_sharp() {
        for (degrees, crease, is_smooth) in
            [(30.0, 40.0, true), (60.0, 40.0, false), (60.0, 61.0, true), (30.0, 29.0, false)]
        {
            let triangles = fold(degrees);
            let normals = normals(&triangles, crease);
            // The first triangle's second corner lies on the fold, its first far from it.
            let [far, on_fold, _] = normals.of(0);
            assert!(far.dot(geometric(&triangles[0])) > 0.999_999);
            let turned = on_fold.angle_between(far).to_degrees();
            assert_eq!(turned > 5.0, is_smooth, "{degrees}° at {crease}°: turned by {turned}°");
            assert!(turned < degrees, "between both sides");
        }
    }

    #[test]
    fn normals_do_not_depend_on_the_number_of_threads() {
        let triangles = sphere(6);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let normals = pool.install(|| normals(&triangles, 40.0));
            normals.packed.into_iter().map(AtomicU32::into_inner).collect::<Vec<u32>>()
        };
        assert!(on(1) == on(3));
    }

    #[test]
    fn degenerate_triangles_have_no_normals_and_spoil_none() {
        let mut triangles = fold(10.0);
        let sound = normals(&triangles, 40.0).of(0);
        triangles.push(Triangle { a: Vec3::ZERO, b: Vec3::ZERO, c: Vec3::Y });
        let normals = normals(&triangles, 40.0);
        assert_eq!(normals.of(0), sound);
        assert_eq!(normals.of(4), [Vec3::ZERO; 3]);
        assert_eq!(normals.of(99), [Vec3::ZERO; 3]);
    }

    #[test]
    fn packed_normals_are_close() {
        for index in 0..2_000 {
            let angle = index as f32;
            let normal = Vec3::new(angle.sin(), (angle * 1.7).cos(), (angle * 0.31).sin()).normalize();
            assert!(unpack(pack(normal)).distance(normal) < 8e-5, "{normal}");
        }
    }
}
