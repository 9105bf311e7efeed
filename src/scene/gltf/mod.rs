//! glTF 2.0 and GLB loader.
//!
//! Files are taken as they come, not as the specification wants them: what can be shown is shown, and what a file announces and
//! the scene does not hold is counted as a warning with its place in the JSON. Every count, length and index is checked before
//! it is used.

mod accessor;
mod advice;
mod announced;
mod document;
mod glb;
mod instances;
mod json;
mod material;
mod nodes;
mod place;
mod primitive;
mod schema;
mod uri;

use std::path::Path;

use glam::{Mat3, Mat4, Vec3};

use self::accessor::{AccessorError, Accessors};
use self::document::Document;
use self::instances::Instances;
use self::nodes::Placement;
use self::place::place;
use self::primitive::{Decoded, MaterialUse, Primitive, declared_triangles};
use super::assemble::{Assembly, BATCH_SIZE, VertexLists, check_vertices, collect_cancellable, offset_corners};
use super::error::{FileLocation, LoadError};
use super::images::Images;
use super::options::LoadOptions;
use super::read::READ_PROGRESS;
use crate::text::counted;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// Maximum number of triangles, copies included; more are taken for a mistake or an attack.
const MAX_TRIANGLES: u64 = 1 << 28;

/// Loads a glTF or GLB file from memory.
pub(super) fn load(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<(), LoadError> {
    let mut images = Images::new(path, options, token);
    let document = Document::parse(path, bytes, &images, &mut assembly.warnings, token)?;
    let root = &document.root;
    let placements = nodes::placements(path, root, &mut assembly.warnings, token)?;
    let accessors = Accessors::new(&document);
    let copies = plan(path, &document, &accessors, &placements, assembly, token)?;
    announced::warn(root, &mut assembly.warnings, token)?;
    let (materials, uses) = material::read_all(&document, &mut images);
    token.check()?;
    assembly.materials = materials;
    images.finish(assembly);
    assembly.mesh_count = root.meshes.len();
    for (count, what) in [(root.meshes.len(), "meshes"), (root.nodes.len(), "nodes")] {
        if count > 0 {
            assembly.other_contents.push(counted(count as u64, what));
        }
    }
    let mut meshes: Vec<Option<Vec<Primitive>>> = root.meshes.iter().map(|_| None).collect();
    for Placement { mesh, .. } in &placements {
        if meshes[*mesh].is_none() {
            meshes[*mesh] = Some(read_mesh(*mesh, &document, &accessors, &uses, assembly, token)?);
        }
    }
    expand(path, &placements, &copies, &meshes, assembly, token)
}

/// The copies of each placement. Refuses files with too many triangles before any of them is made.
fn plan<'a>(
    path: &Path,
    document: &'a Document,
    accessors: &Accessors<'a>,
    placements: &[Placement],
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<Vec<Instances<'a>>, LoadError> {
    let root = &document.root;
    let mut declared: Vec<Option<u64>> = vec![None; root.meshes.len()];
    let (mut copies, mut total) = (Vec::with_capacity(placements.len()), 0_u64);
    for Placement { node, mesh, .. } in placements {
        token.check()?;
        let once = if let Some(known) = declared[*mesh] {
            known
        } else {
            let mut once = 0_u64;
            for primitive in root.meshes[*mesh].primitives.iter() {
                token.check()?;
                once = once.saturating_add(declared_triangles(primitive, accessors, token)?);
            }
            *declared[*mesh].insert(once)
        };
        let instances = instances::read(&root.nodes[*node], *node, accessors, &mut assembly.warnings, token)?;
        total = total.saturating_add(once.saturating_mul(instances.count() as u64));
        copies.push(instances);
    }
    if total > MAX_TRIANGLES {
        let problem = format!("contains {total} triangles with all copies, more than {MAX_TRIANGLES}");
        return Err(LoadError::of_file(path, problem, "take a part of the model"));
    }
    Ok(copies)
}

fn read_mesh(
    index: usize,
    document: &Document,
    accessors: &Accessors,
    uses: &[MaterialUse],
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<Vec<Primitive>, Cancelled> {
    let mut primitives = Vec::new();
    let list = &document.root.meshes[index].primitives;
    let warnings = &mut assembly.warnings;
    if list.is_empty() {
        warnings.add("meshes without primitives", || FileLocation::Json(format!("meshes[{index}]")));
    }
    for (k, json) in list.iter().enumerate() {
        token.check()?;
        let path = || format!("meshes[{index}].primitives[{k}]");
        match primitive::read(json, accessors, uses, token) {
            Ok(Decoded::Surface(mut primitive)) => {
                for (count, what, detail) in std::mem::take(&mut primitive.faults) {
                    warnings.add_many(count, &what, || FileLocation::Json(format!("{}.{detail}", path())));
                }
                assembly.point_count = assembly.point_count.saturating_add(primitive.positions.len() as u64);
                primitives.push(primitive);
            }
            Ok(Decoded::Points(count)) => {
                assembly.point_count = assembly.point_count.saturating_add(count);
                warnings.add("primitives of points or lines not shown", || FileLocation::Json(path()));
            }
            Err(AccessorError::Unreadable(fault)) => {
                warnings.add(&format!("primitives left out: {}", fault.kind), || place(path(), &fault.detail));
            }
            Err(AccessorError::Cancelled(cancelled)) => return Err(cancelled),
        }
    }
    Ok(primitives)
}

/// Appends all copies of all meshes.
fn expand(
    path: &Path,
    placements: &[Placement],
    copies: &[Instances],
    meshes: &[Option<Vec<Primitive>>],
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<(), LoadError> {
    let primitives = |placement: &Placement| meshes[placement.mesh].as_deref().unwrap_or_default();
    let (mut triangles, mut vertices) = (0_usize, 0_usize);
    for (placement, instances) in placements.iter().zip(copies) {
        token.check()?;
        for primitive in primitives(placement) {
            let sum = |total: usize, one: usize| total.saturating_add(one.saturating_mul(instances.count()));
            triangles = sum(triangles, primitive.triangles.len());
            vertices = sum(vertices, if primitive.has_attributes() { primitive.positions.len() } else { 0 });
        }
    }
    check_vertices(vertices).map_err(|error| error.in_file(path))?;
    assembly.reserve(triangles).map_err(|error| error.in_file(path))?;
    let mut done = 0_usize;
    for (placement, instances) in placements.iter().zip(copies) {
        token.check()?;
        if primitives(placement).iter().all(|primitive| primitive.triangles.is_empty()) {
            continue;
        }
        for copy in 0..instances.count() {
            token.check()?;
            token.set_progress(READ_PROGRESS + (1.0 - READ_PROGRESS) * done as f32 / triangles as f32);
            for primitive in primitives(placement) {
                let transform = placement.transform * instances.transform(copy);
                add_primitive(primitive, transform, assembly, placement.node, token)?;
                done = done.saturating_add(primitive.triangles.len());
            }
        }
    }
    Ok(())
}

/// Appends a primitive with the transform of a node.
fn add_primitive(
    primitive: &Primitive,
    transform: Mat4,
    assembly: &mut Assembly,
    node: usize,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let linear = Mat3::from_mat4(transform);
    // A mirroring transform reverses the winding; swapping two corners restores it.
    let mirrored = linear.determinant() < 0.0;
    // The cofactor matrix is the inverse transpose up to a factor and also exists for singular transforms.
    let sign = if mirrored { -1.0 } else { 1.0 };
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    let cofactors = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
    let turned = |points: &[Vec3], by: &dyn Fn(Vec3) -> Vec3| {
        collect_cancellable(points.len(), points.iter().map(|&p| by(p)), token)
    };
    let positions = turned(&primitive.positions, &|point| transform.transform_point3(point))?;
    let lists = VertexLists {
        normals: turned(&primitive.normals, &|normal| (cofactors * normal).normalize_or_zero())?,
        uvs: collect_cancellable(primitive.uvs.len(), primitive.uvs.iter().copied(), token)?,
        uvs2: collect_cancellable(primitive.uvs2.len(), primitive.uvs2.iter().copied(), token)?,
        colors: collect_cancellable(primitive.colors.len(), primitive.colors.iter().copied(), token)?,
    };
    let first = assembly.add_vertices(positions.len(), &lists, token)?;
    for (at, &[a, b, c]) in primitive.triangles.iter().enumerate() {
        if at.is_multiple_of(BATCH_SIZE) {
            token.check()?;
        }
        let corners = if mirrored { [a, c, b] } else { [a, b, c] };
        let [a, b, c] = corners.map(|corner| positions[corner as usize]);
        let corners = offset_corners(corners, first);
        let material = primitive.material as u32;
        assembly.push(Triangle { a, b, c }, corners, material, || FileLocation::Json(format!("nodes[{node}]")));
    }
    Ok(())
}
