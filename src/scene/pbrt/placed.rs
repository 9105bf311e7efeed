//! The shapes of a PBRT scene and the copies of its objects, put into the scene.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};

use glam::{Affine3A, DMat4, DVec3, Vec3};

use super::files::READ_UNTIL;
use super::mesh::{Mesh, is_mirrored, normal_transform};
use crate::scene::assemble::{
    Assembly, BATCH_SIZE, BYTES_PER_TRIANGLE, BYTES_PER_VERTEX, VertexLists, check_vertices, collect_cancellable,
    offset_corners,
};
use crate::scene::error::{FileLocation, LoadError};
use crate::scene::flatten::check_count;
use crate::scene::offset::Extent;
use crate::scene::options::{Instancing, LoadOptions};
use crate::scene::placed_meshes::KeptCopies;
use crate::scene::read::ModelFile;
use crate::scene::two_levels::{check_copies, is_flat};
use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::Triangle;

/// Maximum number of triangles that are made; more are taken for a mistake or an attack.
const MAX_TRIANGLES: u64 = 1 << 28;

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

    /// Appends all triangles, or those of each object once and its copies apart.
    pub(super) fn finish(self, file: &ModelFile<'_>, assembly: &mut Assembly) -> Result<(), LoadError> {
        let ModelFile { path, options: &LoadOptions { instances, .. }, token, .. } = *file;
        let (all, once) = (self.counts(false, token)?, self.counts(true, token)?);
        let is_flat = match instances {
            Instancing::Auto if once == all => true,
            _ => all.triangles <= MAX_TRIANGLES && is_flat(instances, all.triangles, all.bytes()),
        };
        let made = if is_flat || instances == Instancing::Flat { &all } else { &once };
        if made.triangles > MAX_TRIANGLES {
            let count = all.triangles;
            let problem = format!("contains {count} triangles with all copies, more than {MAX_TRIANGLES}");
            return Err(LoadError::of_file(path, problem, "take a part of the scene"));
        }
        let of_system = |count: u64| usize::try_from(count).unwrap_or(usize::MAX);
        check_vertices(of_system(made.vertices)).map_err(|error| error.in_file(path))?;
        assembly.reserve(of_system(made.triangles)).map_err(|error| error.in_file(path))?;
        if !is_flat {
            check_count(all.triangles, "triangles", path)?;
            check_copies(self.items.len() as u64, path)?;
        }
        let (offset, objects) = self.offsets(token)?;
        assembly.offset = offset;
        assembly.mesh_count = self.items.len();
        assembly.repeats_meshes = once != all;
        let mut kept = (!is_flat).then(KeptCopies::new);
        self.append(&objects, kept.as_mut(), assembly, token)?;
        if let Some((copies, reach)) = kept.map(KeptCopies::finish) {
            (assembly.copies, assembly.reach) = (Some(copies), Some(reach));
        }
        Ok(())
    }

    /// Numbers of triangles and vertices of all copies, or of each object once.
    fn counts(&self, is_once: bool, token: &CancelToken) -> Result<Counts, Cancelled> {
        let (mut counts, mut known) = (Counts::default(), HashSet::new());
        for item in &self.items {
            token.check()?;
            if let Item::Copy { object, .. } = item
                && !known.insert(object)
                && is_once
            {
                continue;
            }
            for mesh in self.meshes(item) {
                counts.triangles = counts.triangles.saturating_add(mesh.triangles.len() as u64);
                counts.vertices = counts.vertices.saturating_add(mesh.positions.len() as u64);
            }
        }
        Ok(counts)
    }

    /// The offset of the scene, and that of each object in its own coordinates.
    fn offsets(&self, token: &CancelToken) -> Result<(DVec3, Vec<DVec3>), Cancelled> {
        let mut extent = Extent::EMPTY;
        let mut boxes: Vec<Option<[DVec3; 8]>> = vec![None; self.objects.len()];
        for item in &self.items {
            token.check()?;
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
        let own = |corners: Option<[DVec3; 8]>| corners.map_or(DVec3::ZERO, |all| Extent::around(all).offset());
        Ok((extent.offset(), boxes.into_iter().map(own).collect()))
    }

    /// Appends all copies, or keeps them apart. `objects` are the offsets of the objects. Shapes in a row that are no copies are one mesh.
    fn append(
        &self,
        objects: &[DVec3],
        mut kept: Option<&mut KeptCopies>,
        assembly: &mut Assembly,
        token: &CancelToken,
    ) -> Result<(), Cancelled> {
        let to_scene = DMat4::from_translation(-assembly.offset);
        let (mut first, mut known) = (assembly.triangle_count(), HashMap::new());
        for (index, item) in self.items.iter().enumerate() {
            token.check()?;
            token.set_progress(READ_UNTIL + (0.95 - READ_UNTIL) * index as f32 / self.items.len() as f32);
            let (object, transform, place) = match item {
                Item::Mesh(mesh) => {
                    add(mesh, &InWorld(to_scene), false, mesh.place.as_ref(), assembly, token)?;
                    continue;
                }
                Item::Copy { object, transform, place } => (*object, *transform, place),
            };
            let offset = objects.get(object).copied().unwrap_or_default();
            let is_mirrored = is_mirrored(transform);
            let affine = (to_scene * transform * DMat4::from_translation(offset)).as_mat4();
            let of_copy =
                OfCopy { offset, transform: Affine3A::from_mat4(affine), normals: normal_transform(transform) };
            let add_object = |as_placed: &OfCopy, assembly: &mut Assembly| {
                let first = assembly.triangle_count();
                for mesh in self.meshes(item) {
                    add(mesh, as_placed, is_mirrored, Some(place), assembly, token)?;
                }
                Ok::<usize, Cancelled>(first)
            };
            let Some(kept) = kept.as_deref_mut() else {
                add_object(&of_copy, assembly)?;
                continue;
            };
            kept.place_here(assembly.triangles(), first, token)?;
            let mesh = match known.entry((object, is_mirrored)) {
                Entry::Occupied(known) => *known.get(),
                Entry::Vacant(new) => {
                    let own = OfCopy { offset, transform: Affine3A::IDENTITY, normals: DMat4::IDENTITY };
                    let start = add_object(&own, assembly)?;
                    *new.insert(kept.add_mesh(assembly.triangles(), start, token)?)
                }
            };
            if mesh.is_some_and(|mesh| !kept.place(mesh, of_copy.transform)) {
                let start = add_object(&of_copy, assembly)?;
                kept.place_here(assembly.triangles(), start, token)?;
            }
            first = assembly.triangle_count();
        }
        if let Some(kept) = kept {
            kept.place_here(assembly.triangles(), first, token)?;
        }
        Ok(())
    }
}

/// Numbers of triangles and vertices.
#[derive(Default, PartialEq)]
struct Counts {
    triangles: u64,
    vertices: u64,
}

impl Counts {
    /// Bytes of so many in a scene, at most.
    fn bytes(&self) -> u64 {
        let vertices = self.vertices.saturating_mul(BYTES_PER_VERTEX);
        self.triangles.saturating_mul(BYTES_PER_TRIANGLE).saturating_add(vertices)
    }
}

/// Where the vertices of a mesh are put.
trait Place {
    fn point(&self, point: DVec3) -> Vec3;
    fn normal(&self, normal: Vec3) -> Vec3;
}

/// A mesh in the coordinates of the scene's file.
struct InWorld(DMat4);

impl Place for InWorld {
    fn point(&self, point: DVec3) -> Vec3 {
        self.0.transform_point3(point).as_vec3()
    }

    fn normal(&self, normal: Vec3) -> Vec3 {
        normal.normalize_or_zero()
    }
}

/// A mesh of an object less its offset, in single precision, and then moved, as two levels have it: so both have the same hits.
struct OfCopy {
    offset: DVec3,
    transform: Affine3A,
    normals: DMat4,
}

impl Place for OfCopy {
    fn point(&self, point: DVec3) -> Vec3 {
        self.transform.transform_point3((point - self.offset).as_vec3())
    }

    fn normal(&self, normal: Vec3) -> Vec3 {
        self.normals.transform_vector3(normal.as_dvec3()).as_vec3().normalize_or_zero()
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

/// Appends a mesh where `at` puts it, with its triangles turned around where that mirrors it.
fn add(
    mesh: &Mesh,
    at: &impl Place,
    is_mirrored: bool,
    place: Option<&FileLocation>,
    assembly: &mut Assembly,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let lists = VertexLists {
        normals: collect_cancellable(mesh.normals.len(), mesh.normals.iter().map(|&normal| at.normal(normal)), token)?,
        uvs: collect_cancellable(mesh.uvs.len(), mesh.uvs.iter().copied(), token)?,
        ..VertexLists::default()
    };
    let first = assembly.add_vertices(mesh.positions.len(), &lists, token)?;
    for batch in mesh.triangles.chunks(BATCH_SIZE) {
        token.check()?;
        for &[a, b, c] in batch {
            let corners = if is_mirrored { [a, c, b] } else { [a, b, c] };
            let point =
                |corner: u32| mesh.positions.get(corner as usize).map_or(Vec3::NAN, |&position| at.point(position));
            let [a, b, c] = corners.map(point);
            let location = || place.cloned().unwrap_or(FileLocation::File);
            assembly.push(Triangle { a, b, c }, offset_corners(corners, first), mesh.material, location);
        }
    }
    Ok(())
}
