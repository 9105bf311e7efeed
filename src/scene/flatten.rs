//! Scenes made of copies of meshes, and their flat form, in which every copy has triangles of its own.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use super::assemble::{BATCH_SIZE, MAX_TRIANGLES};
use super::attributes::Attributes;
use super::error::LoadError;
use super::model::Scene;
use super::motion::{CopyMotion, Motion};
use super::moving_copies::FlatMover;
use super::placed_meshes::{PlacedMeshes, total};
use super::source::SceneSource;
use super::spread::{Layout, flat_triangles, flat_vectors};
use crate::budget::Budget;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::kernel::parallel::par_tasks;

/// Bytes that a triangle of a flat scene takes with its tree, roughly: that the scene fits does not help where its tree does not.
const TREE_BYTES_PER_TRIANGLE: u64 = 300;

/// The flat scene of copies of meshes: copy by copy, the triangles of each in the order of its mesh.
///
/// Corners are those of [`Placement::triangle`](bvhscope_engine::geometry::Placement::triangle) in the order of the mesh, mirrored copies too, so that rays find the very hits that they
/// find in a tree of two levels. Normals are turned by the inverse transpose and keep their front; surfaces take their outside from
/// normals where there are any, so that only mirrored triangles without normals are seen from their backs, which matters to normal maps
/// alone.
///
/// # Errors
///
/// Before anything is made, if the triangles exceed the memory budget or their indices 32 bits. Also for a copy that [`Copies::new`]
/// refuses, and once `token` is cancelled.
pub(super) fn flatten(
    prototypes: &Scene,
    copies: &PlacedMeshes,
    source: &SceneSource,
    token: &CancelToken,
) -> Result<Scene, LoadError> {
    let path = source.path().map_or_else(|| source.to_string().into(), Path::to_path_buf);
    let placed = &copies.placed;
    let vertices = vertex_ranges(prototypes, &copies.meshes, token)?;
    let counts = [copies.triangle_count(), total(&vertices, placed)];
    check_size(prototypes, counts, Budget::of_process(), &path)?;
    let places = copies.places(&prototypes.triangles, &path, token)?;
    let layout = Layout::new(&copies.meshes, placed, token)?;
    let triangles = flat_triangles(&prototypes.triangles, &copies.meshes, placed, &places, token)?;
    token.set_progress(0.4);
    let of_batch = |batch: &[Triangle], _: &CancelToken| {
        Ok(batch.iter().fold(Aabb::EMPTY, |bounds, triangle| bounds.union(&triangle.bounds())))
    };
    let boxes = par_tasks(triangles.chunks(BATCH_SIZE), token, of_batch)?;
    let bounds = boxes.iter().fold(Aabb::EMPTY, |all, bounds| all.union(bounds));
    let material_indices = layout.copied(&prototypes.material_indices, None, token)?;
    token.set_progress(0.6);
    let attributes = match &prototypes.attributes {
        Some(attributes) => Some(flat_attributes(attributes, &layout, &vertices, token)?),
        None => None,
    };
    token.set_progress(1.0);
    Ok(Scene {
        triangles,
        bounds,
        subject: bounds,
        up: prototypes.up,
        attributes,
        material_indices: material_indices.into(),
        materials: prototypes.materials.clone(),
        textures: prototypes.textures.clone(),
        mesh_count: placed.len(),
        repeats_meshes: true,
        motion: copies.motion.as_ref().map(|motion| moving(prototypes, copies, motion, token)).transpose()?,
        ..Scene::from_triangles(source.clone(), Vec::new())
    })
}

/// How the copies in a flat scene move.
fn moving(
    prototypes: &Scene,
    copies: &PlacedMeshes,
    CopyMotion { clips, rig }: &CopyMotion,
    token: &CancelToken,
) -> Result<Arc<Motion>, Cancelled> {
    let mover = FlatMover {
        triangles: prototypes.triangles.clone(),
        attributes: prototypes.attributes.clone(),
        meshes: copies.meshes.clone(),
        vertices: vertex_ranges(prototypes, &copies.meshes, token)?,
        bounds: copies.bounds(&prototypes.triangles, token)?,
        placed: copies.placed.clone(),
        rig: Arc::clone(rig),
    };
    Ok(Arc::new(Motion::new(clips.clone(), Box::new(mover))))
}

/// Bytes of the flat scene.
pub(super) fn flat_size(prototypes: &Scene, copies: &PlacedMeshes, token: &CancelToken) -> Result<u64, Cancelled> {
    let vertices = total(&vertex_ranges(prototypes, &copies.meshes, token)?, &copies.placed);
    Ok(flat_bytes(prototypes, [copies.triangle_count(), vertices]))
}

/// Whether a flat scene of so many triangles and bytes, and a tree of its triangles, fit into the memory budget.
pub(super) fn fits_flat(triangles: u64, bytes: u64) -> bool {
    let fits = |bytes: u64| Budget::of_process().check("the copies", bytes).is_ok();
    let tree = triangles.saturating_mul(TREE_BYTES_PER_TRIANGLE);
    triangles <= MAX_TRIANGLES as u64 && fits(bytes) && fits(tree)
}

/// The vertices of each mesh; none of one without attributes. Vertex 0, which has default attributes, is shared by all.
fn vertex_ranges(prototypes: &Scene, meshes: &[Range<u32>], token: &CancelToken) -> Result<Vec<Range<u32>>, Cancelled> {
    let Some(Attributes { corners, .. }) = &prototypes.attributes else { return Ok(vec![0..0; meshes.len()]) };
    let range = |mesh: &Range<u32>| {
        let (mut start, mut end) = (u32::MAX, 0);
        for batch in corners[mesh.start as usize..mesh.end as usize].chunks(BATCH_SIZE) {
            token.check()?;
            for &corner in batch.as_flattened().iter().filter(|&&corner| corner != 0) {
                (start, end) = (start.min(corner), end.max(corner + 1));
            }
        }
        Ok(start.min(end)..end)
    };
    meshes.iter().map(range).collect()
}

/// Checks that a flat scene of so many triangles and vertices fits into the budget and into indices of 32 bits.
fn check_size(prototypes: &Scene, counts: [u64; 2], budget: Budget, path: &Path) -> Result<(), LoadError> {
    let bytes = flat_bytes(prototypes, counts);
    budget.check("the triangles of all copies", bytes).map_err(|error| LoadError::over_budget(path, &error))?;
    check_count(counts[0], "triangles", path)?;
    check_count(counts[1], "vertices", path)
}

/// Checks that indices of 32 bits suffice for all copies.
pub(super) fn check_count(count: u64, kind: &str, path: &Path) -> Result<(), LoadError> {
    if count <= MAX_TRIANGLES as u64 {
        return Ok(());
    }
    let problem = format!("its copies have {count} {kind}, and {MAX_TRIANGLES} are the most there may be");
    Err(LoadError::of_file(path, problem, "take fewer copies"))
}

/// Bytes of so many triangles and vertices with the attributes that the prototypes have.
fn flat_bytes(prototypes: &Scene, [triangles, vertices]: [u64; 2]) -> u64 {
    fn item<T>(list: &[T]) -> usize {
        if list.is_empty() { 0 } else { size_of::<T>() }
    }
    let (mut per_triangle, mut per_vertex) = (size_of::<Triangle>() + item(&prototypes.material_indices), 0);
    if let Some(Attributes { normals, uvs, tangents, uvs2, colors, alphas, .. }) = &prototypes.attributes {
        per_triangle += size_of::<[u32; 3]>();
        per_vertex = item(normals) + item(uvs) + item(tangents) + item(uvs2) + item(colors) + item(alphas);
    }
    triangles.saturating_mul(per_triangle as u64).saturating_add(vertices.saturating_mul(per_vertex as u64))
}

/// The attributes of all copies; `vertices` are those of each mesh.
fn flat_attributes(
    attributes: &Attributes,
    triangles: &Layout<'_>,
    vertices: &[Range<u32>],
    token: &CancelToken,
) -> Result<Attributes, Cancelled> {
    let placed = triangles.placed;
    let layout = Layout::new(vertices, placed, token)?;
    let corner = |copy: usize, corner: u32| {
        if corner == 0 { 0 } else { layout.starts[copy] + 1 + (corner - vertices[placed[copy].mesh as usize].start) }
    };
    let corners =
        triangles.spread(&attributes.corners, None, token, |copy, corners| corners.map(|at| corner(copy, at)))?;
    let (normals, tangents) = flat_vectors(attributes, vertices, placed, token)?;
    Ok(Attributes {
        corners: corners.into(),
        normals,
        tangents,
        uvs: layout.copied(&attributes.uvs, attributes.uvs.first(), token)?.into(),
        uvs2: layout.copied(&attributes.uvs2, attributes.uvs2.first(), token)?.into(),
        colors: layout.copied(&attributes.colors, attributes.colors.first(), token)?.into(),
        alphas: layout.copied(&attributes.alphas, attributes.alphas.first(), token)?.into(),
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use bvhscope_engine::Placed;
    use glam::{Affine3A, EulerRot, Quat, Vec3};

    use super::*;
    use crate::budget::MemoryLimit;
    use crate::scene::assemble::{Assembly, VertexLists};
    use crate::scene::error::FileLocation;
    use crate::scene::material::Material;

    /// An octahedron with normals and colours, and a triangle without.
    fn prototypes() -> (Scene, Vec<Range<u32>>) {
        let token = CancelToken::new();
        let mut assembly = Assembly::new();
        assembly.materials = vec![Material::clay(), Material { name: "bare".to_owned(), ..Material::clay() }];
        let points = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
        let colors = points.map(|point| point * 0.5 + 0.5);
        let lists = VertexLists { normals: points.to_vec(), colors: colors.to_vec(), ..VertexLists::default() };
        let bare = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y };
        assembly.push(bare, None, 1, || FileLocation::File);
        let first = assembly.add_vertices(6, &lists, &token).unwrap().unwrap();
        for corners in [[0, 1, 2], [1, 0, 5], [3, 1, 5], [1, 3, 2], [4, 0, 2], [0, 4, 5], [4, 3, 5], [3, 4, 2]] {
            let [a, b, c] = corners.map(|corner| points[corner]);
            let corners = corners.map(|corner| first + corner as u32);
            assembly.push(Triangle { a, b, c }, Some(corners), 0, || FileLocation::File);
        }
        (assembly.finish(&SceneSource::default_builtin(), Vec3::Y, &token).unwrap(), vec![0..1, 1..9])
    }

    fn flat(placed: Vec<Placed>) -> (Scene, Scene) {
        let (scene, meshes) = prototypes();
        let flat = flatten(&scene, &PlacedMeshes { meshes, placed, motion: None }, &scene.source, &CancelToken::new())
            .unwrap();
        (scene, flat)
    }

    #[test]
    fn attributes_follow_their_copies_and_fronts_stay_in_front() {
        let turn = Quat::from_euler(EulerRot::XYZ, 0.4, -1.1, 2.0);
        let scales = [Vec3::ONE, Vec3::new(-1.0, 3.0, 0.2), Vec3::new(1e-4, -1e-4, -2e-4), Vec3::new(-5e3, -1e3, -1e3)];
        let transforms =
            scales.map(|scale| Affine3A::from_scale_rotation_translation(scale, turn, Vec3::new(3.0, -2.0, 7.0)));
        let placed = transforms.iter().flat_map(|&transform| [1, 0].map(|mesh| Placed { mesh, transform }));
        let (scene, flat) = flat(placed.collect());
        assert_eq!(flat.triangles.len(), 4 * 9);
        assert_eq!(flat.mesh_count, 8);
        assert_eq!(flat.materials, scene.materials);
        let [of_meshes, of_copies] = [&scene, &flat].map(|scene| scene.attributes.as_ref().unwrap());
        assert_eq!(of_copies.normals.len(), 1 + 4 * 6);
        for (copy, transform) in transforms.iter().enumerate() {
            for index in 0..8 {
                let (at, from) = (9 * copy + index, 1 + index);
                let normals = of_copies.corners[at].map(|corner| of_copies.normals[corner as usize]);
                let triangle = &flat.triangles[at];
                for (corner, normal) in [triangle.a, triangle.b, triangle.c].into_iter().zip(normals) {
                    let out = corner - Vec3::from(transform.translation);
                    assert!(normal.is_normalized() && normal.dot(out) > 0.0, "copy {copy}: {normal} at {out}");
                }
                for (own, of_mesh) in of_copies.corners[at].into_iter().zip(of_meshes.corners[from]) {
                    assert_eq!(of_copies.colors[own as usize], of_meshes.colors[of_mesh as usize]);
                }
                assert_eq!(flat.material_indices[at], 0);
            }
            assert_eq!((of_copies.corners[9 * copy + 8], flat.material_indices[9 * copy + 8]), ([0; 3], 1));
        }
        assert_eq!((of_copies.normals[0], of_copies.colors[0]), (Vec3::ZERO, Vec3::ONE));
    }

    #[test]
    fn a_copy_without_a_place_is_refused_by_its_index() {
        let (scene, meshes) = prototypes();
        let placed = [Vec3::ONE, Vec3::new(1.0, 0.0, 1.0)].map(Affine3A::from_scale);
        let placed = placed.map(|transform| Placed { mesh: 1, transform }).to_vec();
        let error = flatten(&scene, &PlacedMeshes { meshes, placed, motion: None }, &scene.source, &CancelToken::new())
            .unwrap_err();
        assert!(error.to_string().contains("copy 1 cannot be placed: its transform is singular"), "{error}");
    }

    #[test]
    fn flat_scenes_beyond_the_budget_or_32_bits_are_refused() {
        let (scene, _) = prototypes();
        let check = |counts: [u64; 2], limit: u64| {
            let limit = Budget::limited(MemoryLimit::Bytes(limit));
            check_size(&scene, counts, limit, Path::new("builtin:forest:4")).map_err(|error| error.to_string())
        };
        assert_eq!(check([1_000_000, 500_000], 1 << 40), Ok(()));
        // A triangle takes 36 bytes, its corners 12, its material 4; a vertex has a normal and a colour, 24 bytes.
        let error = check([10_000_000_000, 20_000_000_000], 1 << 30).unwrap_err();
        assert!(
            error.starts_with("builtin:forest:4: the triangles of all copies would need about 1000.0 GB"),
            "{error}"
        );
        let error = check([4_300_000_000, 3], u64::MAX).unwrap_err();
        assert!(error.contains("its copies have 4300000000 triangles, and 4294967279 are the most"), "{error}");
        let error = check([3, 4_300_000_000], u64::MAX).unwrap_err();
        assert!(error.contains("vertices"), "{error}");
    }
}
