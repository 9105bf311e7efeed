//! Loader of the triangles of a tree file, in two levels with the copies of its meshes. Its trees are read where trees are built.

use std::io::Read as _;
use std::path::Path;

use super::assemble::{Assembly, BATCH_SIZE};
use super::error::{FileLocation, LoadError};
use super::options::Instancing;
use super::placed_meshes::PlacedMeshes;
use super::read::ModelFile;
use super::two_levels::check_copies;
use crate::budget::Budget;
use bvhscope_engine::tree_file::{TwoLevelModel, has_corners, is_two_levels, read_corners};
use bvhscope_engine::{Placed, Triangle};

/// Loads the triangles of a tree file from memory; a file without them is refused.
pub(super) fn load(file: &ModelFile<'_>, assembly: &mut Assembly) -> Result<(), LoadError> {
    let ModelFile { path, bytes, token, .. } = *file;
    if is_two_levels(bytes) {
        return load_copies(file, assembly);
    }
    let triangles = read_corners(bytes, Budget::of_process().allowance(), token)
        .map_err(|error| LoadError::of_tree_file(path, &error))?;
    assembly.mesh_count = 1;
    assembly.has_tree = true;
    append(&triangles, file, assembly)
}

/// Loads the meshes of a tree file in two levels, and the copies of them, which are kept apart.
fn load_copies(file: &ModelFile<'_>, assembly: &mut Assembly) -> Result<(), LoadError> {
    let ModelFile { path, bytes, options, token } = *file;
    let model = TwoLevelModel::read(bytes, Budget::of_process().allowance(), token)
        .map_err(|error| LoadError::of_tree_file(path, &error))?;
    let TwoLevelModel { triangles, meshes, instances } = model;
    check_copies(instances.len() as u64, path)?;
    assembly.mesh_count = meshes.len();
    assembly.repeats_meshes = instances.len() > meshes.len();
    // The trees are those of two levels.
    assembly.has_tree = options.instances != Instancing::Flat;
    let placed = instances.iter().map(|instance| Placed { mesh: instance.mesh, transform: instance.transform() });
    assembly.copies = Some(PlacedMeshes { meshes, placed: placed.collect(), motion: None });
    append(&triangles, file, assembly)
}

fn append(triangles: &[Triangle], file: &ModelFile<'_>, assembly: &mut Assembly) -> Result<(), LoadError> {
    let ModelFile { path, token, .. } = *file;
    assembly.reserve(triangles.len()).map_err(|error| error.in_file(path))?;
    for batch in triangles.chunks(BATCH_SIZE) {
        token.check()?;
        for &triangle in batch {
            // None is left out, so that the tree's numbers are theirs: reading has refused what cannot be shown.
            assembly.push(triangle, None, 0, || FileLocation::File);
        }
    }
    Ok(())
}

/// Bytes that hold the first two lines of any tree file.
const HEAD: u64 = (1 << 20) + 64;

/// Whether the file at `path` holds a tree without triangles, which is no model.
pub fn is_tree_alone(path: &Path) -> bool {
    let mut head = Vec::new();
    let is_file = std::fs::metadata(path).is_ok_and(|metadata| metadata.is_file());
    let read = is_file.then(|| std::fs::File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head)));
    read.is_some_and(|read| read.is_ok()) && has_corners(&head) == Ok(false)
}
