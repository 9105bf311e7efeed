//! Loader of the triangles of a tree file. Its tree is read where trees are built.

use std::io::Read as _;
use std::path::Path;

use super::assemble::{Assembly, BATCH_SIZE};
use super::error::{FileLocation, LoadError};
use super::read::ModelFile;
use crate::budget::Budget;
use bvhscope_engine::tree_file::{has_corners, read_corners};

/// Loads the triangles of a tree file from memory; a file without them is refused.
pub(super) fn load(file: &ModelFile<'_>, assembly: &mut Assembly) -> Result<(), LoadError> {
    let ModelFile { path, bytes, token, .. } = *file;
    let triangles = read_corners(bytes, Budget::of_process().allowance(), token)
        .map_err(|error| LoadError::of_tree_file(path, &error))?;
    assembly.reserve(triangles.len()).map_err(|error| error.in_file(path))?;
    assembly.mesh_count = 1;
    assembly.has_tree = true;
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
