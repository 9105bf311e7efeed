//! Appends all copies of all meshes to the scene, each with the transform of its node or its joints.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::rc::Rc;
use std::sync::Arc;

use glam::{Affine3A, DMat4, DVec3, Mat4, Vec3, Vec4};

use super::instances::Instances;
use super::nodes::Placement;
use super::primitive::Primitive;
use super::skin::Skin;
use crate::scene::assemble::{
    Assembly, BATCH_SIZE, BYTES_PER_TRIANGLE, BYTES_PER_VERTEX, VertexLists, check_vertices, collect_cancellable,
    offset_corners,
};
use crate::scene::error::{FileLocation, LoadError};
use crate::scene::motion::{Hold, Shape, Vertices};
use crate::scene::offset::Extent;
use crate::scene::options::Instancing;
use crate::scene::placed_meshes::KeptCopies;
use crate::scene::read::{ModelFile, READ_PROGRESS};
use crate::scene::two_levels::is_flat;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// Maximum number of triangles that are made; more are taken for a mistake or an attack.
pub(super) const MAX_TRIANGLES: u64 = 1 << 28;

/// A mesh of the scene and how often it is there.
pub(super) struct Copies<'a> {
    pub(super) placement: Placement,
    pub(super) instances: Instances<'a>,
    pub(super) skin: Option<Rc<Skin>>,
    /// From mesh space to the world by each joint, where the mesh has a skin.
    pub(super) joints: Option<Vec<DMat4>>,
    /// Weights of the morph targets.
    pub(super) weights: Vec<f32>,
    /// Whether what is placed is returned, for clips to move it.
    pub(super) is_kept: bool,
}

impl Copies<'_> {
    /// The mesh whose copies these are, as a node with weights of its own shows it; `None` under a skin, which places each vertex.
    fn mesh(&self) -> Option<(usize, Option<usize>)> {
        let is_plain = self.weights.iter().all(|&weight| weight == 0.0);
        self.joints.is_none().then_some((self.placement.mesh, (!is_plain).then_some(self.placement.node)))
    }

    /// Transforms of one copy from mesh space to the world: one, or one for each joint.
    fn transforms(&self, copy: usize) -> impl Iterator<Item = DMat4> {
        let (joints, node) = match &self.joints {
            Some(joints) => (&joints[..], DMat4::IDENTITY),
            None => (&[DMat4::IDENTITY][..], self.placement.transform * self.instances.transform(copy).as_dmat4()),
        };
        joints.iter().map(move |joint| node * *joint)
    }
}

/// Appends all copies of all meshes, or each mesh once and its copies apart. Returns what clips move.
pub(super) fn expand(
    file: &ModelFile<'_>,
    copies: &[Copies],
    meshes: &[Option<Vec<Primitive>>],
    instances: Instancing,
    assembly: &mut Assembly,
) -> Result<Moved, LoadError> {
    let ModelFile { path, token, .. } = *file;
    let primitives = |of: &Copies| meshes.get(of.placement.mesh).and_then(Option::as_deref).unwrap_or_default();
    let triangles_of =
        |of: &Copies| primitives(of).iter().fold(0, |sum: u64, one| sum.saturating_add(one.triangles.len() as u64));
    let with_attributes = |of: &Copies| primitives(of).iter().filter(|one| one.has_attributes());
    let vertices_of =
        |of: &Copies| with_attributes(of).fold(0, |sum: u64, one| sum.saturating_add(one.shape.positions.len() as u64));
    let (triangles, vertices) = (counts(copies, triangles_of, token)?, counts(copies, vertices_of, token)?);
    let bytes =
        triangles[0].saturating_mul(BYTES_PER_TRIANGLE).saturating_add(vertices[0].saturating_mul(BYTES_PER_VERTEX));
    assembly.repeats_meshes = triangles[1] < triangles[0];
    let has_copies = triangles[1] < triangles[0] || instances == Instancing::TwoLevel;
    let is_flat = !has_copies || triangles[0] <= MAX_TRIANGLES && is_flat(instances, triangles[0], bytes);
    let made = |[all, once]: [u64; 2]| usize::try_from(if is_flat { all } else { once }).unwrap_or(usize::MAX);
    check_vertices(made(vertices)).map_err(|error| error.in_file(path))?;
    assembly.reserve(made(triangles)).map_err(|error| error.in_file(path))?;
    assembly.offset = offset(copies, primitives, token)?;
    if !is_flat {
        return Ok(Moved::Copies(keep(copies, primitives, assembly, token)?));
    }
    let to_scene = DMat4::from_translation(-assembly.offset);
    let (mut done, mut placed) = (0_usize, Vec::new());
    for (index, one) in copies.iter().enumerate() {
        token.check()?;
        if primitives(one).iter().all(|primitive| primitive.triangles.is_empty()) {
            continue;
        }
        for copy in 0..one.instances.count() {
            token.check()?;
            token.set_progress(READ_PROGRESS + (1.0 - READ_PROGRESS) * done as f32 / triangles[0] as f32);
            let transforms: Vec<Mat4> =
                one.transforms(copy).map(|transform| (to_scene * transform).as_mat4()).collect();
            for primitive in primitives(one) {
                let first_triangle = assembly.triangle_count();
                let (shape, first_vertex, corners) =
                    add_primitive(primitive, &transforms, false, one, assembly, token)?;
                if one.is_kept {
                    placed.push(Placed { copy: [index, copy], shape, first_vertex, corners, first_triangle });
                }
                done = done.saturating_add(primitive.triangles.len());
            }
        }
    }
    Ok(Moved::Parts(placed))
}

/// Sums of `of` each mesh: over all copies, and over each mesh that is made once.
pub(super) fn counts(
    copies: &[Copies],
    of: impl Fn(&Copies) -> u64,
    token: &CancelToken,
) -> Result<[u64; 2], Cancelled> {
    let (mut all, mut once, mut known) = (0_u64, 0_u64, HashSet::new());
    for one in copies {
        token.check()?;
        let (count, copies) = (of(one), one.instances.count() as u64);
        all = all.saturating_add(count.saturating_mul(copies));
        let made = one.mesh().map_or(copies, |mesh| u64::from(copies > 0 && known.insert(mesh)));
        once = once.saturating_add(count.saturating_mul(made));
    }
    Ok([all, once])
}

/// Appends each mesh once, as copies that are mirrored and others show it, and its copies apart. Copies without a place of their own, as by
/// skins or by transforms that flatten them, are meshes of one copy, unless clips move them. Returns the index of those that these do, with
/// the number of the copy, in order.
fn keep<'a>(
    copies: &[Copies],
    primitives: impl Fn(&Copies) -> &'a [Primitive],
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<Vec<[usize; 2]>, Cancelled> {
    let to_scene = DMat4::from_translation(-assembly.offset);
    let (mut kept, mut known, mut moved) = (KeptCopies::new(), HashMap::new(), Vec::new());
    for (index, one) in copies.iter().enumerate() {
        token.set_progress(READ_PROGRESS + (1.0 - READ_PROGRESS) * index as f32 / copies.len() as f32);
        for copy in 0..one.instances.count() {
            token.check()?;
            let transforms: Vec<Mat4> =
                one.transforms(copy).map(|transform| (to_scene * transform).as_mat4()).collect();
            let is_mirrored = transforms.iter().all(|transform| transform.determinant() < 0.0);
            let mut add = |transforms: &[Mat4], is_mirrored: bool, kept: &mut KeptCopies| {
                let first = assembly.triangle_count();
                for primitive in primitives(one) {
                    add_primitive(primitive, transforms, is_mirrored, one, assembly, token)?;
                }
                kept.add_mesh(assembly.triangles(), first, token)
            };
            if let (Some(mesh), [transform]) = (one.mesh(), &transforms[..]) {
                let mesh = match known.entry((mesh, is_mirrored)) {
                    Entry::Occupied(known) => *known.get(),
                    Entry::Vacant(new) => *new.insert(add(&[Mat4::IDENTITY], is_mirrored, &mut kept)?),
                };
                let (Some(mesh), transform) = (mesh, Affine3A::from_mat4(*transform)) else { continue };
                if one.is_kept {
                    kept.place_moving(mesh, transform);
                    moved.push([index, copy]);
                }
                if one.is_kept || kept.place(mesh, transform) {
                    continue;
                }
            }
            if let Some(mesh) = add(&transforms, false, &mut kept)? {
                kept.place(mesh, Affine3A::IDENTITY);
            }
        }
    }
    let (copies, reach) = kept.finish();
    (assembly.copies, assembly.reach) = (Some(copies), Some(reach));
    Ok(moved)
}

/// The offset of the scene. Where the vertices themselves are far from the origin, which single precision has rounded in the file,
/// there is none.
fn offset<'a>(
    copies: &[Copies],
    primitives: impl Fn(&Copies) -> &'a [Primitive],
    token: &CancelToken,
) -> Result<DVec3, Cancelled> {
    let (mut extent, mut is_fine) = (Extent::EMPTY, false);
    for one in copies {
        for primitive in primitives(one).iter().filter(|primitive| !primitive.triangles.is_empty()) {
            let [min, max] = primitive.bounds;
            let corners: [DVec3; 8] = std::array::from_fn(|k| {
                let side = |axis: usize| if k >> axis & 1 == 0 { min[axis] } else { max[axis] };
                Vec3::new(side(0), side(1), side(2)).as_dvec3()
            });
            is_fine |= Extent::around(corners).offset() == DVec3::ZERO;
            for copy in 0..one.instances.count() {
                token.check()?;
                for transform in one.transforms(copy) {
                    for corner in corners {
                        extent.add(transform.transform_point3(corner));
                    }
                }
            }
        }
    }
    Ok(if is_fine { extent.offset() } else { DVec3::ZERO })
}

/// Contents of a scene that clips move.
pub(super) enum Moved {
    /// The copies of primitives in a flat scene.
    Parts(Vec<Placed>),
    /// The copies of meshes in one of two levels, each as [`Placed::copy`] has it.
    Copies(Vec<[usize; 2]>),
}

/// A copy of a primitive in the scene.
pub(super) struct Placed {
    /// Index in the list of copies, and number of the copy.
    pub(super) copy: [usize; 2],
    pub(super) shape: Arc<Shape>,
    /// Index of the first of its vertices among those of the scene; `None` where they have no more than a position.
    pub(super) first_vertex: Option<u32>,
    /// Vertices of each triangle that the scene has, of the primitive.
    pub(super) corners: Vec<[u32; 3]>,
    /// Index of its first triangle in the scene.
    pub(super) first_triangle: usize,
}

/// Shape, first vertex and corners of a primitive in the scene, as [`Placed`] has them.
type AddedPrimitive = (Arc<Shape>, Option<u32>, Vec<[u32; 3]>);

/// The shape of a primitive for the joints of `one`, and how many of its vertices name a joint that the skin does not have.
fn held(shape: &Arc<Shape>, one: &Copies) -> (Arc<Shape>, u64) {
    let Some(joints) = one.joints.as_ref().map(Vec::len) else { return (Arc::clone(shape), 0) };
    let is_sound = |hold: &Hold| hold.joints.iter().all(|&joint| usize::from(joint) < joints);
    if shape.holds.iter().flatten().all(is_sound) {
        return (Arc::clone(shape), 0);
    }
    let mut own = Shape::clone(shape);
    let faulty = own.drop_joints(joints);
    (Arc::new(own), faulty)
}

/// Appends a primitive of `one` with one transform, or with those of its joints; with its triangles turned around where `is_mirrored` by a
/// transform that they have not got yet.
fn add_primitive(
    primitive: &Primitive,
    transforms: &[Mat4],
    is_mirrored: bool,
    one: &Copies,
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<AddedPrimitive, Cancelled> {
    let (shape, faulty) = held(&primitive.shape, one);
    let what = "vertices held by joints that do not exist";
    let location = || FileLocation::Json(format!("nodes[{}].skin", one.placement.node));
    assembly.warnings.add_many(faulty, what, location);
    let count = shape.positions.len();
    let mut positions = vec![Vec3::ZERO; count];
    let mut normals = vec![Vec3::ZERO; shape.normals.len()];
    let mut tangents = vec![Vec4::ZERO; shape.tangents.len()];
    for (batch, positions) in positions.chunks_mut(BATCH_SIZE).enumerate() {
        token.check()?;
        let first = batch.saturating_mul(BATCH_SIZE);
        let range = first..first.saturating_add(positions.len());
        let normals = normals.get_mut(range.clone()).unwrap_or_default();
        let tangents = tangents.get_mut(range).unwrap_or_default();
        shape.place(first, transforms, &one.weights, Vertices { positions, normals, tangents });
    }
    let lists = VertexLists {
        normals,
        tangents,
        uvs: collect_cancellable(primitive.uvs.len(), primitive.uvs.iter().copied(), token)?,
        uvs2: collect_cancellable(primitive.uvs2.len(), primitive.uvs2.iter().copied(), token)?,
        colors: collect_cancellable(primitive.colors.len(), primitive.colors.iter().copied(), token)?,
        alphas: collect_cancellable(primitive.alphas.len(), primitive.alphas.iter().copied(), token)?,
    };
    let first = assembly.add_vertices(positions.len(), &lists, token)?;
    let mut kept = Vec::new();
    for (k, &[a, b, c]) in primitive.triangles.iter().enumerate() {
        token.check_every(BATCH_SIZE, k)?;
        // A mirroring transform reverses the winding; swapping two corners restores it.
        let own = if shape.is_mirrored(a as usize, transforms) == is_mirrored { [a, b, c] } else { [a, c, b] };
        // A hidden triangle is a point, which no ray hits, until a clip shows it.
        let shown = if one.placement.is_hidden { [a; 3] } else { own };
        let [a, b, c] = shown.map(|corner| positions[corner as usize]);
        let (corners, material) = (offset_corners(own, first), primitive.material as u32);
        let location = || FileLocation::Json(format!("nodes[{}]", one.placement.node));
        if assembly.push(Triangle { a, b, c }, corners, material, location) && one.is_kept {
            kept.push(own);
        }
    }
    Ok((shape, first, kept))
}
