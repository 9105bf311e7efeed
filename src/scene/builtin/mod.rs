//! Scenes that need no file.

mod classics;
mod shapes;
mod teapot;
mod terrain;

use std::path::PathBuf;

use glam::Vec3;

use super::assemble::Assembly;
use super::read::unusable;
use super::{LoadError, Scene, SceneSource};
use bvhscope_engine::cancel::CancelToken;

/// A scene made in code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltinScene {
    /// As in `builtin:NAME`.
    pub name: &'static str,
    /// For menus.
    pub label: &'static str,
    /// One line that says what it shows.
    pub description: &'static str,
    /// What the size parameter means and its smallest, default and largest value; `None` where there is none.
    pub size: Option<(&'static str, u32, u32, u32)>,
}

/// Every built-in scene, in the order in which menus list them.
pub const BUILTIN_SCENES: [BuiltinScene; 6] = [
    BuiltinScene {
        name: "teapot",
        label: "Utah teapot",
        description: "Newell's 32 bicubic patches, 1975",
        size: Some(("segments along each patch edge", 1, 10, 200)),
    },
    BuiltinScene {
        name: "cornell",
        label: "Cornell box",
        description: "Two boxes in a room with coloured walls",
        size: None,
    },
    BuiltinScene {
        name: "sphereflake",
        label: "Sphere flake",
        description: "Spheres on spheres on spheres",
        size: Some(("levels", 0, 3, 5)),
    },
    BuiltinScene {
        name: "terrain",
        label: "Terrain",
        description: "A fractal height field of any size",
        size: Some(("triangles", 2, 200_000, 10_000_000)),
    },
    BuiltinScene {
        name: "slivers",
        label: "Soup of slivers",
        description: "Long thin triangles in all directions: the classic bad case",
        size: Some(("triangles", 1, 20_000, 2_000_000)),
    },
    BuiltinScene {
        name: "clusters",
        label: "Clustered spheres",
        description: "Dense groups far apart: hard for a regular grid",
        size: Some(("spheres", 1, 240, 20_000)),
    },
];

/// Makes a built-in scene; a size out of range is brought into it.
pub(super) fn build(
    name: &str,
    size: Option<u32>,
    source: &SceneSource,
    token: &CancelToken,
) -> Result<Scene, LoadError> {
    let known = BUILTIN_SCENES.iter().find(|scene| scene.name == name);
    let size =
        known.and_then(|scene| scene.size).map_or(0, |(_, min, default, max)| size.unwrap_or(default).clamp(min, max));
    let mut assembly = Assembly::new();
    let path: PathBuf = source.to_string().into();
    assembly.reserve(most_triangles(name, size)).map_err(|error| error.in_file(&path))?;
    match name {
        "teapot" => teapot::build(size, &mut assembly, token)?,
        "cornell" => classics::cornell(&mut assembly),
        "sphereflake" => classics::flake(size, &mut assembly, token)?,
        "terrain" => terrain::build(size, &mut assembly, token)?,
        "slivers" => classics::slivers(size, &mut assembly, token)?,
        "clusters" => classics::clusters(size, &mut assembly, token)?,
        _ => {
            let names: Vec<_> = BUILTIN_SCENES.iter().map(|scene| scene.name).collect();
            return Err(unusable(&path, format!("there is no such built-in scene; there are: {}", names.join(", "))));
        }
    }
    token.check()?;
    token.set_progress(1.0);
    assembly.finish(source, Vec3::Y, token)
}

/// As many triangles as a scene may have, for the memory that it needs.
fn most_triangles(name: &str, size: u32) -> usize {
    let size = size as usize;
    match name {
        "teapot" => 64 * size * size,
        "terrain" | "slivers" => size,
        "clusters" => 256 * size,
        // 2,208 triangles in the middle, and from level to level at most five times as many.
        "sphereflake" => 4096 * 5_usize.pow(size as u32),
        _ => 0,
    }
}
