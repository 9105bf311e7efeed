//! The shapes of a PBRT scene and the copies of its objects, put into the scene.

use std::path::Path;

use glam::{DMat4, DVec3};

use super::files::READ_UNTIL;
use super::mesh::{Mesh, is_mirrored, normal_transform};
use crate::scene::assemble::{Assembly, BATCH_SIZE, VertexLists, check_vertices, collect_cancellable, offset_corners};
use crate::scene::error::{FileLocation, LoadError};
use crate::scene::offset::Extent;
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// Maximum number of triangles, copies included; more are taken for a mistake or an attack.
const MAX_TRIANGLES: usize = 1 << 28;

/// A part of the scene.
pub(super) enum Item {
    Mesh(Mesh),
    /// A copy of an object.
    Copy {
        object: usize,
        transform: DMat4,
        place: FileLocation,
    },
}

/// All objects of the scene, in the order of the file.
#[derive(Default)]
pub(super) struct Placed {
    pub(super) items: Vec<Item>,
    objects: Vec<Vec<Mesh>>,
}

impl Placed {
    /// Index of a new object.
    pub(super) fn begin_object(&mut self) -> usize {
        self.objects.push(Vec::new());
        self.objects.len().saturating_sub(1)
    }

    pub(super) fn add_to(&mut self, object: usize, mesh: Mesh) {
        if let Some(meshes) = self.objects.get_mut(object) {
            meshes.push(mesh);
        }
    }

    /// The meshes of an item.
    fn meshes<'a>(&'a self, item: &'a Item) -> &'a [Mesh] {
        match item {
            Item::Mesh(mesh) => std::slice::from_ref(mesh),
            Item::Copy { object, .. } => self.objects.get(*object).map_or(&[], Vec::as_slice),
        }
    }

    /// Appends all triangles.
    pub(super) fn finish(self, path: &Path, assembly: &mut Assembly, token: &CancelToken) -> Result<(), LoadError> {
        let (mut triangles, mut vertices) = (0_usize, 0_usize);
        let mut extent = Extent::EMPTY;
        let mut boxes: Vec<Option<[DVec3; 8]>> = vec![None; self.objects.len()];
        for item in &self.items {
            token.check()?;
            for mesh in self.meshes(item) {
                triangles = triangles.saturating_add(mesh.triangles.len());
                vertices = vertices.saturating_add(mesh.positions.len());
            }
            match item {
                Item::Mesh(mesh) => mesh.positions.iter().for_each(|&point| extent.add(point)),
                Item::Copy { object, transform, .. } => {
                    let Some(known) = boxes.get_mut(*object) else { continue };
                    let corners = known.get_or_insert_with(|| corners(self.meshes(item)));
                    for &corner in corners.iter() {
                        extent.add(transform.transform_point3(corner));
                    }
                }
            }
        }
        if triangles > MAX_TRIANGLES {
            let problem = format!("contains {triangles} triangles with all copies, more than {MAX_TRIANGLES}");
            return Err(LoadError::of_file(path, problem, "take a part of the scene"));
        }
        check_vertices(vertices).map_err(|error| error.in_file(path))?;
        assembly.reserve(triangles).map_err(|error| error.in_file(path))?;
        assembly.offset = extent.offset();
        assembly.mesh_count = self.items.len();
        let to_scene = DMat4::from_translation(-assembly.offset);
        let mut done = 0_usize;
        for item in &self.items {
            let fraction = done as f32 / triangles.max(1) as f32;
            token.set_progress(READ_UNTIL + (0.95 - READ_UNTIL) * fraction);
            let transform = match item {
                Item::Mesh(_) => DMat4::IDENTITY,
                Item::Copy { transform, .. } => *transform,
            };
            for mesh in self.meshes(item) {
                token.check()?;
                let place = match item {
                    Item::Mesh(mesh) => mesh.place.as_ref(),
                    Item::Copy { place, .. } => Some(place),
                };
                add(mesh, to_scene * transform, is_mirrored(transform), place, assembly, token)?;
                done = done.saturating_add(mesh.triangles.len());
            }
        }
        Ok(())
    }
}

/// The corners of the box around meshes.
fn corners(meshes: &[Mesh]) -> [DVec3; 8] {
    let points = meshes.iter().flat_map(|mesh| &mesh.positions).filter(|point| point.is_finite());
    let (low, high) =
        points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &point| (low.min(point), high.max(point)));
    std::array::from_fn(|k| {
        let side = |axis: usize| if k >> axis & 1 == 0 { low[axis] } else { high[axis] };
        DVec3::new(side(0), side(1), side(2))
    })
}

/// Appends a mesh, moved by a transform.
fn add(
    mesh: &Mesh,
    transform: DMat4,
    is_mirrored: bool,
    place: Option<&FileLocation>,
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let to_scene = normal_transform(transform);
    let normals =
        mesh.normals.iter().map(|&normal| to_scene.transform_vector3(normal.as_dvec3()).as_vec3().normalize_or_zero());
    let lists = VertexLists {
        normals: collect_cancellable(mesh.normals.len(), normals, token)?,
        uvs: collect_cancellable(mesh.uvs.len(), mesh.uvs.iter().copied(), token)?,
        ..VertexLists::default()
    };
    let first = assembly.add_vertices(mesh.positions.len(), &lists, token)?;
    for batch in mesh.triangles.chunks(BATCH_SIZE) {
        token.check()?;
        for &[a, b, c] in batch {
            let corners = if is_mirrored { [a, c, b] } else { [a, b, c] };
            let point = |corner: u32| {
                let found = mesh.positions.get(corner as usize).copied().unwrap_or(DVec3::NAN);
                transform.transform_point3(found).as_vec3()
            };
            let [a, b, c] = corners.map(point);
            let location = || place.cloned().unwrap_or(FileLocation::File);
            assembly.push(Triangle { a, b, c }, offset_corners(corners, first), mesh.material, location);
        }
    }
    Ok(())
}
