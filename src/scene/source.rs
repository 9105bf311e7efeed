//! Where a scene comes from: the path of a model file, or the name of a built-in scene.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

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
