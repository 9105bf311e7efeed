//! Copies of meshes in a scene of two levels, whose triangles exist once a mesh.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::ops::Range;
use std::sync::Arc;

use glam::{Affine3A, Vec3, Vec4};

use super::moving_place::moving;
use bvhscope_engine::Copies;
use bvhscope_engine::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::kernel::parallel::{par_collect, par_tasks};

/// Copies in a task.
const COPIES_PER_TASK: usize = 1 << 14;

/// The copies of a scene of two levels, and the triangles of its meshes. All copies' triangles are numbered copy by copy, as the flat scene
/// has them: a hit names one by that number.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneCopies {
    meshes: Arc<SceneMeshes>,
    copies: Arc<Copies>,
}

/// The meshes of a scene of two levels, wherever their copies are.
#[derive(Debug, PartialEq)]
pub struct SceneMeshes {
    /// The triangles of each mesh in its own coordinates, one mesh after the other.
    triangles: Vec<Triangle>,
    /// The triangles of each mesh; none is without.
    ranges: Vec<Range<u32>>,
    /// Boxes around the parts of each mesh in the octants of its box.
    octants: Vec<Vec<Aabb>>,
    /// The number of the first triangle of each copy, and behind them that of all.
    firsts: Vec<u32>,
    /// Bytes that the flat scene would have.
    flat_bytes: u64,
}

impl SceneCopies {
    /// Copies of `meshes`, of which each has at least one of `triangles`; flat they would take `flat_bytes`. Indices of 32 bits must suffice
    /// for all copies' triangles.
    pub(super) fn new(
        triangles: Vec<Triangle>,
        ranges: Vec<Range<u32>>,
        copies: Copies,
        flat_bytes: u64,
        token: &CancelToken,
    ) -> Result<Self, Cancelled> {
        let (mut firsts, mut all) = (Vec::with_capacity(copies.len() + 1), 0);
        for copy in 0..copies.len() as u32 {
            token.check_every(MEDIUM_STEPS, copy as usize)?;
            firsts.push(all);
            all += ranges[copies.mesh(copy) as usize].len() as u32;
        }
        firsts.push(all);
        let of_mesh = |mesh: &Range<u32>| octants(&triangles[mesh.start as usize..mesh.end as usize]);
        let octants = ranges.iter().map(of_mesh).collect();
        let meshes = SceneMeshes { triangles, ranges, octants, firsts, flat_bytes };
        Ok(Self { meshes: Arc::new(meshes), copies: Arc::new(copies) })
    }

    /// The same copies with these transforms, one each, and the number of triangles of those that are nowhere: where coordinates are not
    /// numbers or too large, a copy is a point, which no ray hits.
    pub(super) fn moved(&self, transforms: &[Affine3A], token: &CancelToken) -> Result<(Self, u64), Cancelled> {
        let places = par_collect(transforms.len(), token, |copy| {
            let mesh = self.copies.mesh(copy as u32);
            let (place, is_lost) = moving(&transforms[copy], &united(&self.meshes.octants[mesh as usize]));
            (mesh, place, is_lost)
        })?;
        let lost = places.iter().filter(|(.., is_lost)| *is_lost).map(|(mesh, ..)| self.mesh(*mesh).len() as u64).sum();
        let copies = Copies::at(places.into_iter().map(|(mesh, place, _)| (mesh, place)));
        Ok((Self { meshes: Arc::clone(&self.meshes), copies: Arc::new(copies) }, lost))
    }

    /// The meshes, which all moments of a model that moves share.
    pub fn meshes(&self) -> &Arc<SceneMeshes> {
        &self.meshes
    }

    /// Number of triangles of all copies.
    pub fn triangle_count(&self) -> u64 {
        u64::from(self.meshes.firsts.last().copied().unwrap_or_default())
    }

    /// Where the copies stand.
    pub fn copies(&self) -> &Arc<Copies> {
        &self.copies
    }

    /// Bytes that the flat scene would have.
    pub fn flat_bytes(&self) -> u64 {
        self.meshes.flat_bytes
    }

    /// Number of meshes.
    pub fn mesh_count(&self) -> usize {
        self.meshes.ranges.len()
    }

    /// The triangles of all meshes, one mesh after the other.
    pub fn triangles(&self) -> &[Triangle] {
        &self.meshes.triangles
    }

    /// The triangles of a mesh.
    pub fn mesh(&self, mesh: u32) -> &[Triangle] {
        let Range { start, end } = self.meshes.ranges[mesh as usize];
        &self.meshes.triangles[start as usize..end as usize]
    }

    /// The number of a triangle of a copy, from its number in the mesh.
    pub fn number(&self, copy: u32, triangle: u32) -> u32 {
        self.meshes.firsts[copy as usize] + triangle
    }

    /// The copy that has the triangle of a number.
    pub fn copy_of(&self, number: u32) -> u32 {
        self.meshes.firsts.partition_point(|&first| first <= number).saturating_sub(1) as u32
    }

    /// Index of the triangle of a number among those of all meshes.
    pub fn in_meshes(&self, number: u32) -> u32 {
        self.find(number).1
    }

    /// The copy that has the triangle of a number, and the triangle's index among those of all meshes.
    fn find(&self, number: u32) -> (u32, u32) {
        let copy = self.copy_of(number);
        (copy, number - self.meshes.firsts[copy as usize] + self.meshes.ranges[self.copies.mesh(copy) as usize].start)
    }

    /// The triangle of a number in the world.
    pub fn triangle(&self, number: u32) -> Triangle {
        let (copy, triangle) = self.find(number);
        self.copies.place(copy).triangle(&self.meshes.triangles[triangle as usize])
    }

    /// Normals of the mesh that has the triangle of a number, in the world: of unit length, or zero as they are.
    pub fn normals(&self, number: u32, normals: [Vec3; 3]) -> [Vec3; 3] {
        let place = self.copies.place(self.copy_of(number));
        normals.map(|normal| place.normal(normal).normalize_or_zero())
    }

    /// A tangent of the mesh that has the triangle of a number, in the world; its length is another.
    pub fn tangent(&self, number: u32, tangent: Vec4) -> Vec4 {
        let place = self.copies.place(self.copy_of(number));
        let sign = if place.is_mirrored() { -1.0 } else { 1.0 };
        place.direction(tangent.truncate()).extend(tangent.w * sign)
    }

    /// The triangle across a box around each copy. The tree over them is that over the copies; the boxes lie closer around copies that are
    /// turned than the turned boxes of their meshes, as they are around the parts of a mesh in each octant of its box.
    pub(super) fn stand_ins(&self, token: &CancelToken) -> Result<Vec<Triangle>, Cancelled> {
        let tasks = (0..self.copies.len()).step_by(COPIES_PER_TASK);
        let parts = par_tasks(tasks, token, |first, _| {
            let of_task = first..self.copies.len().min(first + COPIES_PER_TASK);
            let stand_in = |copy: u32| {
                let place = self.copies.place(copy);
                let parts = self.meshes.octants[self.copies.mesh(copy) as usize].iter();
                Triangle::across(&parts.fold(Aabb::EMPTY, |all, part| all.union(&place.bounds(part))))
            };
            Ok(of_task.map(|copy| stand_in(copy as u32)).collect::<Vec<_>>())
        })?;
        Ok(parts.concat())
    }

    /// The box around all triangles, which is that of the flat scene. Of the copies, which lie within the boxes of `stand_ins`, those alone
    /// are looked at that may reach farthest.
    pub(super) fn bounds(&self, stand_ins: &[Triangle], token: &CancelToken) -> Result<Aabb, Cancelled> {
        let mut bounds = Aabb::EMPTY;
        for axis in 0..3 {
            let mut ends = Ends { copies: self, axis, known: HashMap::new(), token };
            bounds.min[axis] = -ends.farthest(-1.0, |copy| -stand_ins[copy].bounds().min[axis])?;
            bounds.max[axis] = ends.farthest(1.0, |copy| stand_ins[copy].bounds().max[axis])?;
        }
        Ok(bounds)
    }

    /// Bytes of triangles and copies.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.meshes.triangles[..]) + self.copies.bytes() + size_of_val(&self.meshes.firsts[..])
    }
}

/// How far copies reach along an axis.
struct Ends<'a> {
    copies: &'a SceneCopies,
    axis: usize,
    /// The least and the largest sum of the products of a corner by mesh and factors: it is the same in copies that stand elsewhere.
    known: HashMap<(u32, [u32; 3]), [f32; 2]>,
    token: &'a CancelToken,
}

impl Ends<'_> {
    /// The coordinate times `side`, 1 or -1, of the farthest corner that way; no copy reaches farther than `limit` has it.
    fn farthest(&mut self, side: f32, limit: impl Fn(usize) -> f32) -> Result<f32, Cancelled> {
        let mut most = f32::NEG_INFINITY;
        let (all, mut farthest) = (self.copies.copies.len(), 0);
        for copy in 0..all {
            self.token.check_every(MEDIUM_STEPS, copy)?;
            if limit(copy) > limit(farthest) {
                farthest = copy;
            }
        }
        // The farthest first, so that few others are looked at.
        for copy in std::iter::once(farthest).chain(0..all) {
            self.token.check_every(MEDIUM_STEPS, copy)?;
            if limit(copy) > most {
                most = most.max(self.reach(copy as u32, side)?);
            }
        }
        Ok(most)
    }

    /// [`Ends::farthest`] of a copy. Sums are rounded in the order of [`Placement::point`](bvhscope_engine::geometry::Placement::point), whose
    /// last, of the translation, keeps the order of the sums before it.
    fn reach(&mut self, copy: u32, side: f32) -> Result<f32, Cancelled> {
        let mesh = self.copies.copies.mesh(copy);
        let [x, y, z, translation] = self.copies.copies.place(copy).rows()[self.axis];
        let [least, largest] = match self.known.entry((mesh, [x, y, z].map(f32::to_bits))) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(new) => {
                let mut ends = [f32::INFINITY, f32::NEG_INFINITY];
                for (index, triangle) in self.copies.mesh(mesh).iter().enumerate() {
                    self.token.check_every(MEDIUM_STEPS, index)?;
                    for corner in [triangle.a, triangle.b, triangle.c] {
                        let sum = corner.x * x + corner.y * y + corner.z * z;
                        ends = [ends[0].min(sum), ends[1].max(sum)];
                    }
                }
                *new.insert(ends)
            }
        };
        Ok(side * (if side < 0.0 { least } else { largest } + translation))
    }
}

fn united(boxes: &[Aabb]) -> Aabb {
    boxes.iter().fold(Aabb::EMPTY, |all, one| all.union(one))
}

fn around(triangles: &[Triangle]) -> Aabb {
    triangles.iter().fold(Aabb::EMPTY, |all, triangle| all.union(&triangle.bounds()))
}

/// Boxes around the triangles whose boxes' centres lie in each octant of the box around all.
fn octants(triangles: &[Triangle]) -> Vec<Aabb> {
    let center = around(triangles).center();
    let mut octants = [Aabb::EMPTY; 8];
    for triangle in triangles {
        let bounds = triangle.bounds();
        let octant = bounds.center().cmpgt(center).bitmask() as usize;
        octants[octant] = octants[octant].union(&bounds);
    }
    octants.into_iter().filter(|octant| !octant.is_empty()).collect()
}
