//! Where a scene comes from: the path of a model file, or the name of a built-in scene.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::row::FileRow;
use crate::text::{file_name, path_text, quoted};

/// The source of a scene: a file, or `builtin:NAME` with an optional size parameter, as in `builtin:terrain:1000000`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum SceneSource {
    /// A model file, or a row of numbered ones, see [`FileRow`].
    File(PathBuf),
    /// One of [`BUILTIN_SCENES`].
    Builtin {
        /// The name in [`BUILTIN_SCENES`].
        name: String,
        /// The size parameter; `None` for the default.
        size: Option<u32>,
    },
}

impl SceneSource {
    /// The Utah teapot, the scene that the program starts with.
    pub fn default_builtin() -> Self {
        Self::Builtin { name: "teapot".to_owned(), size: None }
    }

    /// Parses a path or `builtin:NAME[:SIZE]`. The error message lists the known names.
    ///
    /// ```
    /// use bvhscope::scene::SceneSource;
    ///
    /// let terrain = SceneSource::Builtin { name: "terrain".to_owned(), size: Some(1_000_000) };
    /// assert_eq!(SceneSource::parse("builtin:terrain:1000000".as_ref()), Ok(terrain));
    /// assert!(SceneSource::parse("bunny.obj".as_ref()).is_ok_and(|source| source.path().is_some()));
    /// assert!(SceneSource::parse("builtin:bunny".as_ref()).is_err());
    /// ```
    pub fn parse(text: &std::ffi::OsStr) -> Result<Self, String> {
        let Some(rest) = text.to_str().and_then(|text| text.strip_prefix("builtin:")) else {
            return Ok(Self::File(PathBuf::from(text)));
        };
        let (name, size) = match rest.split_once(':') {
            None => (rest, None),
            Some((name, size)) => (name, Some(size)),
        };
        let Some(scene) = BUILTIN_SCENES.iter().find(|scene| scene.name == name) else {
            let names: Vec<_> = BUILTIN_SCENES.iter().map(|scene| scene.name).collect();
            return Err(format!("there is no built-in scene {}; there are: {}", quoted(name), names.join(", ")));
        };
        let size = size
            .map(|text| {
                let size = text.parse().ok().filter(|&size| scene.takes(size));
                size.ok_or_else(|| format!("{} is not a size of builtin:{name}: {}", quoted(text), scene.sizes()))
            })
            .transpose()?;
        Ok(Self::Builtin { name: name.to_owned(), size })
    }

    /// The path of a file; `None` for a built-in scene.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            Self::Builtin { .. } => None,
        }
    }

    /// True if there is no such file, and no row of files.
    pub fn is_missing(&self) -> bool {
        self.path().is_some_and(|path| !path.exists() && FileRow::of(path).is_none_or(|row| row.is_missing()))
    }

    /// The same with an absolute path, by which it is known in another current folder.
    #[must_use]
    pub fn absolute(&self) -> Self {
        match self {
            Self::File(path) => Self::File(std::path::absolute(path).unwrap_or_else(|_| path.clone())),
            Self::Builtin { .. } => self.clone(),
        }
    }

    /// A short name for titles: the file name, or the name of the built-in scene with its size.
    pub fn label(&self) -> String {
        match self {
            Self::File(path) => file_name(path).into_owned(),
            Self::Builtin { name, size: None } => name.clone(),
            Self::Builtin { name, size: Some(size) } => format!("{name} {size}"),
        }
    }
}

impl std::fmt::Display for SceneSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(path) => f.write_str(&path_text(path)),
            Self::Builtin { name, size: None } => write!(f, "builtin:{name}"),
            Self::Builtin { name, size: Some(size) } => write!(f, "builtin:{name}:{size}"),
        }
    }
}

/// A procedurally generated scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltinScene {
    /// The name, as in `builtin:NAME`.
    pub name: &'static str,
    /// The name in menus.
    pub label: &'static str,
    /// Description in one line.
    pub description: &'static str,
    /// Meaning, minimum, default and maximum of the size parameter; `None` if there is none.
    pub size: Option<(&'static str, u32, u32, u32)>,
}

impl BuiltinScene {
    /// Whether `size` is within the range of the size parameter.
    pub fn takes(&self, size: u32) -> bool {
        self.size.is_some_and(|(_, min, _, max)| (min..=max).contains(&size))
    }

    /// The available sizes, as worded in messages: "choose 1 to 200 segments along each patch edge".
    pub fn sizes(&self) -> String {
        match self.size {
            Some((meaning, min, _, max)) => format!("choose {min} to {max} {meaning}"),
            None => "it has but one; leave the size out".to_owned(),
        }
    }
}

/// Every built-in scene, in menu order.
pub const BUILTIN_SCENES: [BuiltinScene; 16] = [
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
        name: "hair",
        label: "Hair",
        description: "Curled strands of three sides: slanted and thin everywhere",
        size: Some(("triangles", 96, 200_000, 5_000_000)),
    },
    BuiltinScene {
        name: "foliage",
        label: "Foliage",
        description: "A meadow of bent blades of grass",
        size: Some(("triangles", 9, 150_000, 5_000_000)),
    },
    BuiltinScene {
        name: "tilted",
        label: "Tilted boards",
        description: "The room of the Cornell box full of boards, each turned its own way",
        size: Some(("boards", 1, 400, 100_000)),
    },
    BuiltinScene {
        name: "clusters",
        label: "Clustered spheres",
        description: "Dense groups far apart: hard for a regular grid",
        size: Some(("spheres", 1, 240, 20_000)),
    },
    BuiltinScene {
        name: "forest",
        label: "Forest",
        description: "Copies of five plants, each of about 2,000 triangles, on hills",
        size: Some(("plants", 1, 500, 4_000_000)),
    },
    BuiltinScene {
        name: "village",
        label: "Village",
        description: "Copies of six houses along streets, on one mesh of ground",
        size: Some(("houses", 1, 120, 1_000_000)),
    },
    BuiltinScene {
        name: "stack",
        label: "Stack of crates",
        description: "Copies of three crates of boards, each turned its own way, some out of true",
        size: Some(("crates", 1, 217, 1_000_000)),
    },
    BuiltinScene {
        name: "traffic",
        label: "Traffic",
        description: "Copies of three vehicles on round lanes, of which neighbours go opposite ways",
        size: Some(("vehicles", 1, 400, 1_000_000)),
    },
    BuiltinScene {
        name: "walker",
        label: "Walker",
        description: "A figure of 13 joints that walks and jumps",
        size: Some(("triangles", 500, 100_000, 10_000_000)),
    },
    BuiltinScene {
        name: "cloth",
        label: "Cloth",
        description: "A flag in the wind: every triangle moves, none far",
        size: Some(("triangles", 2, 100_000, 10_000_000)),
    },
    BuiltinScene {
        name: "explosion",
        label: "Explosion",
        description: "A ball that flies apart: neighbours separate, the worst case for refitting",
        size: Some(("triangles", 8, 50_000, 5_000_000)),
    },
];
