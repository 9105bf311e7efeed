//! The trees of a file, and the things in their leaves, as messages name them.

use std::fmt::{Display, Formatter, Result};

/// A tree of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum WhichTree {
    /// The only one.
    Only,
    /// In two levels: the one over the instances.
    Instances,
    /// In two levels: that of a mesh, by its number.
    Mesh(u32),
}

impl Display for WhichTree {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::Only => f.write_str("the tree"),
            Self::Instances => f.write_str("the tree over the instances"),
            Self::Mesh(mesh) => write!(f, "mesh {mesh}"),
        }
    }
}

/// Kind of the things in the leaves of a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Items {
    /// Triangles of a mesh.
    Triangles,
    /// Instances of meshes.
    Instances,
}

impl Display for Items {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(match self {
            Self::Triangles => "triangles",
            Self::Instances => "instances",
        })
    }
}
