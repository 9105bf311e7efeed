//! Scenes made of copies of meshes, flat or in two levels.

use std::path::Path;
use std::sync::Arc;

use super::error::LoadError;
use super::flatten::{check_count, fits_flat, flat_size, flatten};
use super::model::Scene;
use super::motion::{CopyMotion, Motion};
use super::moving_copies::LevelMover;
use super::options::Instancing;
use super::placed_meshes::PlacedMeshes;
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
    if is_flat(instances, copies.triangle_count(), flat_size(&prototypes, &copies, token)?) {
        let source = prototypes.source.clone();
        return flatten(&prototypes, &copies, &source, token);
    }
    two_levels(prototypes, copies, token)
}

/// Whether a scene of copies is flat, which then has so many triangles and takes so many bytes.
pub(super) fn is_flat(instances: Instancing, triangles: u64, bytes: u64) -> bool {
    match instances {
        Instancing::Auto => fits_flat(triangles, bytes),
        Instancing::Flat => true,
        Instancing::TwoLevel => false,
    }
}

/// Checks that so many copies fit into the memory budget, before any is made.
pub(super) fn check_copies(count: u64, path: &Path) -> Result<(), LoadError> {
    let bytes = BYTES_PER_COPY.saturating_mul(count);
    Budget::of_process().check("the copies", bytes).map_err(|error| LoadError::over_budget(path, &error))
}

/// A scene of two levels of `copies` of the meshes in `scene`.
///
/// # Errors
///
/// If they exceed the memory budget or the triangles of all copies indices of 32 bits, for a copy that has no place, and once `token` is
/// cancelled.
pub(super) fn two_levels(mut scene: Scene, copies: PlacedMeshes, token: &CancelToken) -> Result<Scene, LoadError> {
    let path = scene.source.path().map_or_else(|| scene.source.to_string().into(), Path::to_path_buf);
    check_copies(copies.placed.len() as u64, &path)?;
    let flat_bytes = flat_size(&scene, &copies, token)?;
    check_count(copies.triangle_count(), "triangles", &path)?;
    let places = copies.places(&scene.triangles, &path, token)?;
    let triangles = std::mem::take(&mut scene.triangles);
    let motion = copies.motion;
    let copies = SceneCopies::new(triangles, copies.meshes, places, flat_bytes, token)?;
    scene.motion = motion.map(|CopyMotion { clips, rig }| {
        let mover = LevelMover { still: copies.clone(), rig };
        Arc::new(Motion::new(clips, Box::new(mover)))
    });
    scene.triangles = copies.stand_ins(token)?;
    scene.bounds = copies.bounds(&scene.triangles, token)?;
    scene.mesh_count = copies.mesh_count();
    scene.repeats_meshes = true;
    scene.copies = Some(Arc::new(copies));
    Ok(scene)
}
