//! Appends all copies of all meshes to the scene, each with the transform of its node or its joints.

use std::path::Path;

use glam::{DMat4, DVec3, Mat3, Mat4, Vec3, Vec4};

use super::instances::Instances;
use super::nodes::Placement;
use super::primitive::Primitive;
use super::skin::blend;
use crate::scene::assemble::{Assembly, BATCH_SIZE, VertexLists, check_vertices, collect_cancellable, offset_corners};
use crate::scene::error::{FileLocation, LoadError};
use crate::scene::offset::Extent;
use crate::scene::read::READ_PROGRESS;
use crate::vectors::direction;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// A mesh of the scene and how often it is there.
pub(super) struct Copies<'a> {
    pub(super) placement: Placement,
    pub(super) instances: Instances<'a>,
    /// From mesh space to the world by each joint, where the mesh has a skin.
    pub(super) joints: Option<Vec<DMat4>>,
}

impl Copies<'_> {
    /// Transforms of one copy from mesh space to the world: one, or one for each joint.
    fn transforms(&self, copy: usize) -> impl Iterator<Item = DMat4> {
        let (joints, node) = match &self.joints {
            Some(joints) => (&joints[..], DMat4::IDENTITY),
            None => (&[DMat4::IDENTITY][..], self.placement.transform * self.instances.transform(copy).as_dmat4()),
        };
        joints.iter().map(move |joint| node * *joint)
    }
}

/// Appends all copies of all meshes.
pub(super) fn expand(
    path: &Path,
    copies: &[Copies],
    meshes: &[Option<Vec<Primitive>>],
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<(), LoadError> {
    let primitives = |of: &Copies| meshes.get(of.placement.mesh).and_then(Option::as_deref).unwrap_or_default();
    let (mut triangles, mut vertices) = (0_usize, 0_usize);
    for one in copies {
        token.check()?;
        for primitive in primitives(one) {
            let sum = |total: usize, count: usize| total.saturating_add(count.saturating_mul(one.instances.count()));
            triangles = sum(triangles, primitive.triangles.len());
            vertices = sum(vertices, if primitive.has_attributes() { primitive.positions.len() } else { 0 });
        }
    }
    check_vertices(vertices).map_err(|error| error.in_file(path))?;
    assembly.reserve(triangles).map_err(|error| error.in_file(path))?;
    assembly.offset = offset(copies, primitives, token)?;
    let to_scene = DMat4::from_translation(-assembly.offset);
    let mut done = 0_usize;
    for one in copies {
        token.check()?;
        if primitives(one).iter().all(|primitive| primitive.triangles.is_empty()) {
            continue;
        }
        for copy in 0..one.instances.count() {
            token.check()?;
            token.set_progress(READ_PROGRESS + (1.0 - READ_PROGRESS) * done as f32 / triangles as f32);
            let transforms: Vec<Mat4> =
                one.transforms(copy).map(|transform| (to_scene * transform).as_mat4()).collect();
            for primitive in primitives(one) {
                add_primitive(primitive, &transforms, assembly, one.placement.node, token)?;
                done = done.saturating_add(primitive.triangles.len());
            }
        }
    }
    Ok(())
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

/// Appends a primitive with one transform, or with those of its joints.
fn add_primitive(
    primitive: &Primitive,
    transforms: &[Mat4],
    assembly: &mut Assembly,
    node: usize,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    // For points the transform; for normals its cofactor matrix, which is the inverse transpose up to a factor and also exists for
    // singular transforms.
    let prepare = |transform: Mat4| {
        let linear = Mat3::from_mat4(transform);
        // Products of very small or large numbers leave the range of single precision.
        let largest = linear.to_cols_array().into_iter().fold(f32::MIN_POSITIVE, |most, number| number.abs().max(most));
        let linear = linear / largest;
        let sign = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
        (transform, Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign, sign)
    };
    let rigid = prepare(transforms.first().copied().unwrap_or_default());
    let at = |k: usize| {
        if primitive.joints.is_empty() || transforms.len() == 1 {
            rigid
        } else {
            prepare(blend(primitive, transforms, k))
        }
    };
    let count = primitive.positions.len();
    let positions = primitive.positions.iter().enumerate().map(|(k, &point)| at(k).0.transform_point3(point));
    let positions = collect_cancellable(count, positions, token)?;
    let normals = primitive.normals.iter().enumerate().map(|(k, &normal)| (at(k).1 * normal).normalize_or_zero());
    // The bitangent is mirrored with the surface.
    let tangent = |(k, tangent): (usize, &Vec4)| {
        let (transform, _, sign) = at(k);
        direction(transform.transform_vector3(tangent.truncate())).unwrap_or_default().extend(tangent.w * sign)
    };
    let tangents = primitive.tangents.iter().enumerate().map(tangent);
    let lists = VertexLists {
        normals: collect_cancellable(primitive.normals.len(), normals, token)?,
        tangents: collect_cancellable(primitive.tangents.len(), tangents, token)?,
        uvs: collect_cancellable(primitive.uvs.len(), primitive.uvs.iter().copied(), token)?,
        uvs2: collect_cancellable(primitive.uvs2.len(), primitive.uvs2.iter().copied(), token)?,
        colors: collect_cancellable(primitive.colors.len(), primitive.colors.iter().copied(), token)?,
        alphas: collect_cancellable(primitive.alphas.len(), primitive.alphas.iter().copied(), token)?,
    };
    let first = assembly.add_vertices(positions.len(), &lists, token)?;
    for (k, &[a, b, c]) in primitive.triangles.iter().enumerate() {
        if k.is_multiple_of(BATCH_SIZE) {
            token.check()?;
        }
        // A mirroring transform reverses the winding; swapping two corners restores it.
        let corners = if at(a as usize).2 < 0.0 { [a, c, b] } else { [a, b, c] };
        let [a, b, c] = corners.map(|corner| positions[corner as usize]);
        let corners = offset_corners(corners, first);
        let material = primitive.material as u32;
        assembly.push(Triangle { a, b, c }, corners, material, || FileLocation::Json(format!("nodes[{node}]")));
    }
    Ok(())
}
