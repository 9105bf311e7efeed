//! Measured scenes: triangles, and a camera.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bvhscope::camera::Camera;
use bvhscope::scene::{Instancing, LoadOptions, Scene, SceneCopies, SceneSource, load};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Triangle};
use glam::Vec3;

/// Scenes that are measured unless others are named.
pub const DEFAULT: [&str; 8] = ["bunny", "sponza", "conference", "car", "buddha", "dragon", "san-miguel", "terrain"];

/// Name, source below the folder of models, and eye and target for scenes that are seen from inside.
const SCENES: [(&str, &str, Option<[Vec3; 2]>); 9] = [
    ("bunny", "bunny/bun_zipper.ply", None),
    ("sponza", "sponza-crytek/sponza.obj", Some([Vec3::new(-1100.0, 250.0, 60.0), Vec3::new(1000.0, 300.0, -60.0)])),
    (
        "conference",
        "conference/conference.obj",
        Some([Vec3::new(1200.0, 350.0, 300.0), Vec3::new(200.0, 130.0, -300.0)]),
    ),
    ("car", "car/pontiac-gto67.glb", None),
    ("buddha", "buddha/buddha.obj", None),
    ("dragon", "dragon/dragon.ply", None),
    // The courtyard, with tree and tables.
    ("san-miguel", "san-miguel/san-miguel-instanced.glb", Some([Vec3::new(22.0, 3.5, 9.0), Vec3::new(8.0, 2.0, 0.0)])),
    // A blank wall there, from the middle of the scene's box: what rays begin on is what they must get away from.
    (
        "san-miguel-wall",
        "san-miguel/san-miguel-instanced.glb",
        Some([Vec3::new(4.4, 26.53, 0.0), Vec3::new(5.4, 26.53, 0.0)]),
    ),
    ("terrain", "builtin:terrain:10000000", None),
];

/// A scene, seen from somewhere.
pub struct Subject {
    /// Name from the command line.
    pub name: String,
    /// Its triangles, without those that have no area.
    pub triangles: Vec<Triangle>,
    /// The number of each in the file.
    pub source_indices: Vec<u32>,
    /// Number of triangles in the file.
    pub source_triangles: usize,
    /// Around them.
    pub bounds: Aabb,
    /// Where it is seen from.
    pub camera: Camera,
}

/// Where the models are: `given`, the folder that the environment names, or the default.
pub fn model_folder(given: Option<PathBuf>) -> PathBuf {
    let named = || std::env::var_os("BVHSCOPE_MODELS").map(PathBuf::from);
    given.or_else(named).unwrap_or_else(|| PathBuf::from("../shared/models"))
}

impl Subject {
    /// Loads a scene by its short name, its path or its built-in name; copies of meshes flat.
    pub fn load(name: &str, folder: &Path, token: &CancelToken) -> anyhow::Result<Self> {
        let known = SCENES.iter().find(|scene| scene.0 == name);
        let scene = load_as(name, folder, Instancing::Flat, token)?;
        let source_triangles = scene.triangles.len();
        let (source_indices, triangles): (Vec<u32>, Vec<Triangle>) =
            (0..).zip(scene.triangles).filter(|(_, t)| t.scaled_normal().length_squared() > 0.0).unzip();
        let bounds = triangles.iter().fold(Aabb::EMPTY, |all, triangle| all.union(&triangle.bounds()));
        let mut camera = Camera::framing(&bounds, scene.up);
        if let Some([eye, target]) = known.and_then(|scene| scene.2) {
            (camera.eye, camera.target, camera.fov_y) = (eye, target, 60_f32.to_radians());
        }
        Ok(Self { name: name.to_owned(), triangles, source_indices, source_triangles, bounds, camera })
    }
}

/// The copies of meshes of a scene; `None` where it has none.
pub fn load_copies(name: &str, folder: &Path, token: &CancelToken) -> anyhow::Result<Option<Arc<SceneCopies>>> {
    Ok(load_as(name, folder, Instancing::TwoLevel, token)?.copies)
}

fn load_as(name: &str, folder: &Path, instances: Instancing, token: &CancelToken) -> anyhow::Result<Scene> {
    let known = SCENES.iter().find(|scene| scene.0 == name);
    let source = match known {
        Some((_, source, _)) if source.starts_with("builtin:") => SceneSource::parse(OsStr::new(source)),
        Some((_, source, _)) => Ok(SceneSource::File(folder.join(source))),
        None => SceneSource::parse(OsStr::new(name)),
    }
    .map_err(anyhow::Error::msg)?;
    Ok(load(&source, &LoadOptions { instances, ..LoadOptions::default() }, token)?)
}
