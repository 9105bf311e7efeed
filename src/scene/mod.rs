//! Triangles with their looks, and where they come from: files (one format a module) and built-in scenes.

// Whatever a file says, no sum and no product of it wraps or panics.
#![warn(clippy::arithmetic_side_effects)]

mod assemble;
#[allow(clippy::arithmetic_side_effects, reason = "reads no file; the sizes are held within the bounds of its table")]
mod builtin;
mod error;
mod gltf;
mod images;
mod load;
mod material;
mod obj;
mod ply;
mod read;
mod stl;

use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use bvhscope_engine::geometry::{Aabb, Triangle};

pub use builtin::{BUILTIN_SCENES, BuiltinScene};
pub use error::{FileLocation, LoadError, Warning, Warnings};
pub use load::{LoadOptions, load, load_bytes};
pub use material::{Material, Texture, WrapMode};

/// Where a scene comes from: a file, or `builtin:NAME` with an optional size parameter, as in `builtin:terrain:1000000`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum SceneSource {
    /// A model file.
    File(PathBuf),
    /// One of [`BUILTIN_SCENES`], by name, with its size parameter where it has one.
    Builtin {
        /// Its name.
        name: String,
        /// Its size parameter; `None` for the default.
        size: Option<u32>,
    },
}

impl SceneSource {
    /// The Utah teapot that the program starts with.
    pub fn default_builtin() -> Self {
        Self::Builtin { name: "teapot".to_owned(), size: None }
    }

    /// Understands a path or `builtin:NAME[:SIZE]`. The error says what is wrong and lists the names.
    pub fn parse(text: &std::ffi::OsStr) -> Result<Self, String> {
        let Some(rest) = text.to_str().and_then(|text| text.strip_prefix("builtin:")) else {
            return Ok(Self::File(PathBuf::from(text)));
        };
        let (name, size) = match rest.split_once(':') {
            None => (rest, None),
            Some((name, size)) => {
                let size = size
                    .parse()
                    .map_err(|_| format!("'{size}' in 'builtin:{rest}' is not a size: a whole number is expected"))?;
                (name, Some(size))
            }
        };
        if BUILTIN_SCENES.iter().any(|scene| scene.name == name) {
            Ok(Self::Builtin { name: name.to_owned(), size })
        } else {
            let names: Vec<_> = BUILTIN_SCENES.iter().map(|scene| scene.name).collect();
            Err(format!("there is no built-in scene '{name}'; there are: {}", names.join(", ")))
        }
    }

    /// The file, where it is one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            Self::Builtin { .. } => None,
        }
    }

    /// A short name for titles: the file's name, or the built-in scene's.
    pub fn label(&self) -> String {
        match self {
            Self::File(path) => {
                path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
            }
            Self::Builtin { name, size: None } => name.clone(),
            Self::Builtin { name, size: Some(size) } => format!("{name} {size}"),
        }
    }
}

impl std::fmt::Display for SceneSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Builtin { name, size: None } => write!(f, "builtin:{name}"),
            Self::Builtin { name, size: Some(size) } => write!(f, "builtin:{name}:{size}"),
        }
    }
}

/// A loaded model: triangles in world space, with what is needed to shade them. Never empty, all coordinates finite.
#[derive(Debug)]
pub struct Scene {
    /// Where it came from.
    pub source: SceneSource,
    /// The triangles, in file order.
    pub triangles: Vec<Triangle>,
    /// The smallest box around all triangles.
    pub bounds: Aabb,
    /// The direction that is up in this scene; a unit axis.
    pub up: Vec3,
    /// Looks at the corners; `None` where the file has neither normals, texture coordinates nor colours.
    pub attributes: Option<Attributes>,
    /// For each triangle its material, as an index into `materials`; empty where every triangle has material 0.
    pub material_indices: Vec<u32>,
    /// At least one.
    pub materials: Vec<Material>,
    /// What materials refer to.
    pub textures: Vec<Texture>,
    /// Number of meshes, objects or solids in the file; 1 where the format has no such thing.
    pub mesh_count: usize,
    /// What was skipped or repaired while loading.
    pub warnings: Warnings,
}

/// Vertex attributes, shared by index.
#[derive(Debug, Default)]
pub struct Attributes {
    /// For each triangle the vertices of its corners, as indices into the lists below.
    pub corners: Vec<[u32; 3]>,
    /// Unit normals; empty where the file has none. A zero normal asks for the geometric one.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, v down as in glTF; empty where the file has none.
    pub uvs: Vec<Vec2>,
    /// Linear RGB colours that multiply the material's; empty where the file has none.
    pub colors: Vec<Vec3>,
}

impl Scene {
    /// Bare triangles of one plain material, with y up.
    pub fn of_triangles(source: SceneSource, triangles: Vec<Triangle>) -> Self {
        let bounds = triangles.iter().fold(Aabb::EMPTY, |all, one| all.union(&one.bounds()));
        Self {
            source,
            triangles,
            bounds,
            up: Vec3::Y,
            attributes: None,
            material_indices: Vec::new(),
            materials: vec![Material::clay()],
            textures: Vec::new(),
            mesh_count: 1,
            warnings: Warnings::default(),
        }
    }

    /// The material of a triangle.
    pub fn material(&self, triangle_index: u32) -> &Material {
        let index = self.material_indices.get(triangle_index as usize).copied().unwrap_or(0);
        &self.materials[index as usize]
    }

    /// Bytes of triangles, attributes and textures.
    pub fn bytes(&self) -> usize {
        let attributes = self.attributes.iter().flat_map(|a| {
            [
                size_of_val(&a.corners[..]),
                size_of_val(&a.normals[..]),
                size_of_val(&a.uvs[..]),
                size_of_val(&a.colors[..]),
            ]
        });
        let textures = self.textures.iter().map(|texture| texture.bytes() as usize);
        let own = [size_of_val(&self.triangles[..]), size_of_val(&self.material_indices[..])];
        own.into_iter().chain(attributes).chain(textures).sum()
    }
}
