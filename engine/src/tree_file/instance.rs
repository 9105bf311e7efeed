//! Instances of meshes, and the scene that has them.

use glam::Affine3A;

use crate::geometry::{Placement, Triangle, transform_of};

/// A copy of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instance {
    /// Number of the mesh.
    pub mesh: u32,
    /// From the coordinates of the mesh to those of the world: by axis of the world the factors of x, y and z, and the translation.
    pub matrix: [[f32; 4]; 3],
}

impl Instance {
    /// Its matrix as a transform.
    pub fn transform(&self) -> Affine3A {
        transform_of(&self.matrix)
    }
}

/// The scene that a file is of, where it is known.
#[derive(Debug, Clone)]
pub struct KnownScene<'a> {
    /// The triangles of each mesh.
    pub meshes: Vec<&'a [Triangle]>,
    /// The mesh of each instance, and where it stands.
    pub instances: Vec<(u32, &'a Placement)>,
}
