//! Scenes made of copies of meshes, flat or in two levels.

use std::path::PathBuf;
use std::sync::Arc;

use super::error::LoadError;
use super::flatten::{PlacedMeshes, check_count, flat_size, flatten};
use super::model::Scene;
use super::options::Instancing;
use super::scene_copies::SceneCopies;
use crate::budget::Budget;
use bvhscope_engine::Placed;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;

/// Bytes of a copy: where it stands twice while that is checked, and its stand-in.
const BYTES_PER_COPY: u64 = (size_of::<Placed>() + 160 + size_of::<Triangle>()) as u64;

/// The scene of `copies` of the meshes in `prototypes`, flat or in two levels.
pub(super) fn of_copies(
    prototypes: Scene,
    copies: PlacedMeshes,
    instances: Instancing,
    token: &CancelToken,
) -> Result<Scene, LoadError> {
    let (flat_bytes, fits) = flat_size(&prototypes, &copies, token)?;
    if instances == Instancing::Flat || instances == Instancing::Auto && fits {
        let source = prototypes.source.clone();
        return flatten(&prototypes, &copies, &source, token);
    }
    two_levels(prototypes, copies, flat_bytes, token)
}

/// A scene of two levels of `copies` of the meshes in `scene`.
///
/// # Errors
///
/// If they exceed the memory budget or the triangles of all copies indices of 32 bits, for a copy that has no place, and once `token` is
/// cancelled.
fn two_levels(
    mut scene: Scene,
    copies: PlacedMeshes,
    flat_bytes: u64,
    token: &CancelToken,
) -> Result<Scene, LoadError> {
    let path = PathBuf::from(scene.source.to_string());
    let bytes = BYTES_PER_COPY.saturating_mul(copies.placed.len() as u64);
    Budget::of_process().check("the copies", bytes).map_err(|error| LoadError::over_budget(&path, &error))?;
    check_count(copies.triangle_count(), "triangles", &path)?;
    let places = copies.places(&scene.triangles, &path, token)?;
    let triangles = std::mem::take(&mut scene.triangles);
    let copies = SceneCopies::new(triangles, copies.meshes, places, flat_bytes, token)?;
    scene.triangles = copies.stand_ins(token)?;
    scene.bounds = copies.bounds(&scene.triangles);
    scene.mesh_count = copies.mesh_count();
    scene.copies = Some(Arc::new(copies));
    Ok(scene)
}
