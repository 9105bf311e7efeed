//! glTF 2.0 and GLB loader on top of the gltf crate's JSON types and its chunk and accessor readers.
//!
//! The crate's validation is not used, since it rejects files that other programs open; everything its readers would panic on
//! is checked here first. Its `import` feature, which reads any file that a model names, is off.

mod accessor;
mod document;
mod estimate;
mod material;
mod primitive;

use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;

use glam::{Mat3, Mat4, Quat, Vec3};
use gltf::json::Root;
use gltf::json::scene::Node;
use serde_json::Value;

use self::accessor::AccessorError;
use self::document::Document;
use self::estimate::estimate_triangles;
use self::primitive::Primitive;
use super::assemble::{Assembly, BATCH_SIZE, VertexLists, check_vertices, collect_cancellable, offset_corners};
use super::error::{FileLocation, LoadError};
use super::images::Images;
use super::options::LoadOptions;
use super::read::READ_PROGRESS;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// Maximum number of triangles, copies included; more are taken for a mistake or an attack.
const MAX_TRIANGLES: usize = 1 << 28;

/// Parent index of a node that the scene itself names.
const SCENE: usize = usize::MAX;

/// Loads a glTF or GLB file from memory.
pub(super) fn load(
    path: &Path,
    bytes: &[u8],
    options: &LoadOptions,
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<(), LoadError> {
    let mut images = Images::new(path, options, token);
    let document = Document::parse(path, bytes, &images, token)?;
    let root = document.root();
    check_extensions(path, root)?;
    warn_of_short_buffers(&document, assembly);
    token.check()?;
    let (materials, uv_sets) = material::read_all(&document, &mut images);
    token.check()?;
    assembly.materials = materials;
    images.finish(assembly);
    assembly.mesh_count = root.meshes.len();
    assembly.reserve_hint(estimate_triangles(root, token)?);
    let nodes = &root.nodes;
    // The parent of each visited node.
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    let mut stack: Vec<(usize, usize, Mat4)> = roots(root).into_iter().map(|n| (n, SCENE, Mat4::IDENTITY)).collect();
    let mut meshes: HashMap<usize, Rc<Vec<Primitive>>> = HashMap::new();
    let mut done = 0_usize;
    while let Some((index, parent, transform)) = stack.pop() {
        token.check()?;
        token.set_progress(READ_PROGRESS + (1.0 - READ_PROGRESS) * done as f32 / nodes.len() as f32);
        done = done.saturating_add(1);
        let location = || FileLocation::Json(format!("nodes[{index}]"));
        let Some(node) = nodes.get(index) else {
            assembly.warnings.add("nodes that do not exist left out", location);
            continue;
        };
        if let Some(first) = parents[index] {
            let (problem, advice) = describe_second_parent(index, first, parent, &parents);
            return Err(LoadError::at(path, location(), problem, advice));
        }
        parents[index] = Some(parent);
        let transform = transform * local_transform(node);
        if !transform.is_finite() {
            assembly.warnings.add("nodes placed by numbers that are not finite left out", location);
            continue;
        }
        let children = node.children.as_deref().unwrap_or_default();
        stack.extend(children.iter().rev().map(|child| (child.value(), index, transform)));
        let Some(mesh) = node.mesh.map(|mesh| mesh.value()) else { continue };
        let primitives = if let Some(known) = meshes.get(&mesh) {
            Rc::clone(known)
        } else {
            let read = Rc::new(read_mesh(mesh, &document, &uv_sets, assembly, token)?);
            meshes.insert(mesh, Rc::clone(&read));
            read
        };
        for instance in instances(node, &document, assembly, index, token)? {
            token.check()?;
            for primitive in &*primitives {
                if assembly.len().saturating_add(primitive.triangles.len()) > MAX_TRIANGLES {
                    let problem = format!("contains more than {MAX_TRIANGLES} triangles");
                    return Err(LoadError::of_file(path, problem, "take a part of the model"));
                }
                add_primitive(primitive, transform * instance, path, assembly, index, token)?;
            }
        }
    }
    Ok(())
}

/// Checks that every required extension is supported.
fn check_extensions(path: &Path, root: &Root) -> Result<(), LoadError> {
    const SUPPORTED: [&str; 4] =
        ["KHR_mesh_quantization", "KHR_texture_transform", "EXT_mesh_gpu_instancing", "KHR_lights_punctual"];
    for name in &root.extensions_required {
        if !SUPPORTED.contains(&name.as_str()) && !name.starts_with("KHR_materials_") {
            let problem = format!("the extension {name} is required but not supported");
            let location = FileLocation::Json("extensionsRequired".to_owned());
            let advice =
                "convert the file with 'gltf-transform optimize --compress false --texture-compress false IN OUT'";
            return Err(LoadError::at(path, location, problem, advice));
        }
    }
    Ok(())
}

fn warn_of_short_buffers(document: &Document, assembly: &mut Assembly) {
    for (index, (buffer, json)) in document.buffers.iter().zip(&document.root().buffers).enumerate() {
        let declared = json.byte_length.0;
        if let Ok(bytes) = buffer
            && (bytes.len() as u64) < declared
        {
            let name = json.uri.as_ref().filter(|uri| !uri.starts_with("data:")).map_or("", String::as_str);
            let what = format!("buffers shorter than declared: {} of {declared} bytes {name}", bytes.len());
            assembly.warnings.add(what.trim_end(), || FileLocation::Json(format!("buffers[{index}]")));
        }
    }
}

/// The root nodes of the default scene; without scenes, the nodes that have no parent.
fn roots(root: &Root) -> Vec<usize> {
    if let Some(scene) = root.scenes.get(root.scene.map_or(0, |scene| scene.value())) {
        return scene.nodes.iter().rev().map(gltf::json::Index::value).collect();
    }
    let mut is_root = vec![true; root.nodes.len()];
    for child in root.nodes.iter().filter_map(|node| node.children.as_ref()).flatten() {
        if let Some(is_root) = is_root.get_mut(child.value()) {
            *is_root = false;
        }
    }
    let roots: Vec<usize> = (0..is_root.len()).rev().filter(|&index| is_root[index]).collect();
    // If every node has a parent there is a cycle, which is reported from any of its nodes.
    if roots.is_empty() && !is_root.is_empty() { vec![0] } else { roots }
}

/// The error message about a node that was reached from parent `first` and again from parent `second`.
fn describe_second_parent(
    index: usize,
    first: usize,
    second: usize,
    parents: &[Option<usize>],
) -> (String, &'static str) {
    // If the way up from the second parent leads back to the node, there is a cycle.
    let mut path = vec![index];
    let mut ancestor = second;
    while ancestor != index {
        path.push(ancestor);
        let Some(parent) = parents.get(ancestor).copied().flatten() else {
            let owner = |node| if node == SCENE { "the scene".to_owned() } else { format!("nodes[{node}]") };
            return if first == second {
                (format!("is named twice by {}", owner(first)), "name it once")
            } else {
                (format!("has two parents, {} and {}", owner(first), owner(second)), "copy it for one of them")
            };
        };
        ancestor = parent;
    }
    path.push(index);
    let names: Vec<String> = path.iter().rev().map(|node| format!("nodes[{node}]")).collect();
    // A long path is abbreviated in the middle.
    let text = if names.len() <= 8 {
        names.join(" → ")
    } else {
        format!("{} → … → {}", names[..4].join(" → "), names[names.len().saturating_sub(3)..].join(" → "))
    };
    (format!("stands below itself: {text} is a loop"), "take it out of the children of one of them")
}

fn local_transform(node: &Node) -> Mat4 {
    if let Some(matrix) = &node.matrix {
        return Mat4::from_cols_array(matrix);
    }
    let rotation = node.rotation.map_or(Quat::IDENTITY, |quaternion| rotation(quaternion.0));
    let scale = node.scale.map_or(Vec3::ONE, Vec3::from_array);
    let translation = node.translation.map_or(Vec3::ZERO, Vec3::from_array);
    Mat4::from_scale_rotation_translation(scale, rotation, translation)
}

fn rotation(numbers: [f32; 4]) -> Quat {
    let quaternion = Quat::from_array(numbers);
    let length = quaternion.length();
    if length > 0.0 && length.is_finite() { quaternion / length } else { Quat::IDENTITY }
}

fn read_mesh(
    index: usize,
    document: &Document,
    uv_sets: &[u32],
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<Vec<Primitive>, Cancelled> {
    let list = document.root().meshes.get(index).map(|mesh| mesh.primitives.as_slice());
    let mut primitives = Vec::new();
    for (k, json) in list.unwrap_or_default().iter().enumerate() {
        let location = || FileLocation::Json(format!("meshes[{index}].primitives[{k}]"));
        match primitive::read(json, document, uv_sets, token) {
            Ok(Some(primitive)) => {
                let skipped = primitive.out_of_range as u64;
                assembly.warnings.add_many(skipped, "triangles with a vertex that does not exist skipped", location);
                assembly.point_count = assembly.point_count.saturating_add(primitive.positions.len() as u64);
                primitives.push(primitive);
            }
            Ok(None) => assembly.warnings.add("primitives of points or lines not shown", location),
            Err(AccessorError::Unreadable(reason)) => {
                assembly.warnings.add(&format!("primitives left out: {reason}"), location);
            }
            Err(AccessorError::Cancelled(cancelled)) => return Err(cancelled),
        }
    }
    Ok(primitives)
}

/// Transforms of the copies made by EXT_mesh_gpu_instancing; a single identity without it.
fn instances(
    node: &Node,
    document: &Document,
    assembly: &mut Assembly,
    index: usize,
    token: &CancelToken,
) -> Result<Vec<Mat4>, Cancelled> {
    let extension = node.extensions.as_ref().and_then(|extensions| extensions.others.get("EXT_mesh_gpu_instancing"));
    let Some(attributes) = extension.and_then(|extension| extension["attributes"].as_object()) else {
        return Ok(vec![Mat4::IDENTITY]);
    };
    let read = |name: &str, width: usize| {
        let accessor = attributes.get(name).and_then(Value::as_u64);
        let elements = accessor::read(document, usize::try_from(accessor?).ok()?, token);
        elements.ok().filter(|elements| elements.width == width)
    };
    let vectors = |name: &str| match read(name, 3) {
        Some(elements) => primitive::vectors(&elements, token),
        None => Ok(Vec::new()),
    };
    let (translations, scales) = (vectors("TRANSLATION")?, vectors("SCALE")?);
    let rotations = read("ROTATION", 4).map(|elements| elements.numbers).unwrap_or_default();
    let rotations = rotations.as_chunks::<4>().0;
    token.check()?;
    let count = translations.len().max(scales.len()).max(rotations.len());
    if count == 0 {
        assembly.warnings.add("instances left out", || FileLocation::Json(format!("nodes[{index}]")));
    }
    let instance = |k: usize| {
        Mat4::from_scale_rotation_translation(
            scales.get(k).copied().unwrap_or(Vec3::ONE),
            rotations.get(k).copied().map_or(Quat::IDENTITY, rotation),
            translations.get(k).copied().unwrap_or(Vec3::ZERO),
        )
    };
    collect_cancellable(count, (0..count).map(instance), token)
}

/// Appends a primitive with the transform of a node.
fn add_primitive(
    primitive: &Primitive,
    transform: Mat4,
    path: &Path,
    assembly: &mut Assembly,
    node: usize,
    token: &CancelToken,
) -> Result<(), LoadError> {
    let linear = Mat3::from_mat4(transform);
    // A mirroring transform reverses the winding; swapping two corners restores it.
    let mirrored = linear.determinant() < 0.0;
    // The cofactor matrix is the inverse transpose up to a factor and also exists for singular transforms.
    let sign = if mirrored { -1.0 } else { 1.0 };
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    let cofactors = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
    check_vertices(primitive.positions.len()).map_err(|error| error.in_file(path))?;
    let turned = |points: &[Vec3], by: &dyn Fn(Vec3) -> Vec3| {
        collect_cancellable(points.len(), points.iter().map(|&p| by(p)), token)
    };
    let positions = turned(&primitive.positions, &|point| transform.transform_point3(point))?;
    let lists = VertexLists {
        normals: turned(&primitive.normals, &|normal| (cofactors * normal).normalize_or_zero())?,
        uvs: collect_cancellable(primitive.uvs.len(), primitive.uvs.iter().copied(), token)?,
        colors: collect_cancellable(primitive.colors.len(), primitive.colors.iter().copied(), token)?,
    };
    let first = assembly.add_vertices(positions.len(), &lists, token)?;
    assembly.reserve(primitive.triangles.len()).map_err(|error| error.in_file(path))?;
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
