//! Procedurally generated scenes.

mod classics;
mod moving;
mod shapes;
mod teapot;
mod terrain;
mod thin;
mod walker;

use std::path::PathBuf;

use glam::Vec3;

use super::assemble::Assembly;
use super::error::LoadError;
use super::model::Scene;
use super::source::BUILTIN_SCENES;
use super::source::SceneSource;
use bvhscope_engine::cancel::CancelToken;

/// Generates a built-in scene, whose `size` must be within its range.
pub(super) fn build(
    name: &str,
    size: Option<u32>,
    source: &SceneSource,
    token: &CancelToken,
) -> Result<Scene, LoadError> {
    let path: PathBuf = source.to_string().into();
    let Some(scene) = BUILTIN_SCENES.iter().find(|scene| scene.name == name) else {
        let names: Vec<_> = BUILTIN_SCENES.iter().map(|scene| scene.name).collect();
        return Err(LoadError::of_file(
            &path,
            "there is no such built-in scene",
            format!("there are: {}", names.join(", ")),
        ));
    };
    if let Some(size) = size.filter(|&size| !scene.takes(size)) {
        return Err(LoadError::of_file(&path, format!("{size} is not a size of this scene"), scene.sizes()));
    }
    let size = size.or(scene.size.map(|(_, _, default, _)| default)).unwrap_or(0);
    let mut assembly = Assembly::new();
    assembly.reserve(max_triangles(name, size)).map_err(|error| error.in_file(&path))?;
    match name {
        "teapot" => teapot::build(size, &mut assembly, token)?,
        "cornell" => classics::cornell(&mut assembly),
        "sphereflake" => classics::flake(size, &mut assembly, token)?,
        "terrain" => terrain::build(size, &mut assembly, token)?,
        "walker" => walker::build(size, &mut assembly, token)?,
        "cloth" => moving::cloth(size, &mut assembly, token)?,
        "explosion" => moving::explosion(size, &mut assembly, token)?,
        "slivers" => classics::slivers(size, &mut assembly, token)?,
        "hair" => thin::hair(size, &mut assembly, token)?,
        "foliage" => thin::foliage(size, &mut assembly, token)?,
        "tilted" => thin::tilted(size, &mut assembly, token)?,
        _ => classics::clusters(size, &mut assembly, token)?,
    }
    token.check()?;
    token.set_progress(1.0);
    assembly.finish(source, Vec3::Y, token)
}

/// Upper bound of the triangle count of a scene, for reserving memory.
fn max_triangles(name: &str, size: u32) -> usize {
    let size = size as usize;
    match name {
        "teapot" => 64 * size * size,
        "terrain" | "slivers" | "walker" | "cloth" | "explosion" | "hair" | "foliage" => size,
        // The room has 12 triangles, and each board six sides.
        "tilted" => 12 + 12 * size,
        "clusters" => 256 * size,
        // The central sphere has 2,208 triangles, and each level has at most five times as many as the one before.
        "sphereflake" => 4096 * 5_usize.pow(size as u32),
        _ => 0,
    }
}
