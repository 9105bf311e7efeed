//! Attributes of the vertices of a model, and the surface of a frame that has its own.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};

use super::material::{Material, Texture};

/// Vertex attributes, shared by index. All moments of a model share those that do not move.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Attributes {
    /// Vertex indices of the corners of each triangle, into the lists below.
    pub corners: Arc<Vec<[u32; 3]>>,
    /// Unit normals; empty if the file has none. A zero normal stands for the geometric normal of the triangle.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, v down as in glTF; empty if the file has none.
    pub uvs: Arc<Vec<Vec2>>,
    /// Unit tangents along u with the sign of the bitangent as w, as in glTF; empty if the file has none or no surface needs them. A
    /// zero tangent stands for the direction of u on the triangle.
    pub tangents: Vec<Vec4>,
    /// The second set of texture coordinates, of textures whose `uv_set` is 1; empty if none needs it.
    pub uvs2: Arc<Vec<Vec2>>,
    /// Linear RGB colours that multiply the material's; empty if the file has none.
    pub colors: Arc<Vec<Vec3>>,
    /// Opacities that multiply the material's; empty if the file has none or no surface has holes.
    pub alphas: Arc<Vec<f32>>,
}

/// Everything about the triangles of one frame but their places, where each frame of a model is a file of its own.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Surface {
    pub(super) attributes: Option<Attributes>,
    /// Index into `materials` for each triangle; empty if every triangle has material 0.
    pub(super) material_indices: Arc<Vec<u32>>,
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<Texture>,
}

impl Surface {
    /// Shares the lists that are equal to those of `other`, so that a sequence of frames holds them once.
    pub(super) fn share_with(&mut self, other: &Self) {
        if self.textures == other.textures {
            self.textures.clone_from(&other.textures);
        }
        share(&mut self.material_indices, &other.material_indices);
        if let (Some(own), Some(other)) = (&mut self.attributes, &other.attributes) {
            share(&mut own.corners, &other.corners);
            share(&mut own.uvs, &other.uvs);
            share(&mut own.uvs2, &other.uvs2);
            share(&mut own.colors, &other.colors);
            share(&mut own.alphas, &other.alphas);
        }
    }

    /// Bytes of the lists that are not shared with `other`.
    pub(super) fn bytes_beside(&self, other: &Self) -> usize {
        fn list<T>(own: &Arc<Vec<T>>, other: Option<&Arc<Vec<T>>>) -> usize {
            if other.is_some_and(|other| Arc::ptr_eq(own, other)) { 0 } else { size_of_val(&own[..]) }
        }
        let textures = self
            .textures
            .iter()
            .filter(|texture| !other.textures.iter().any(|other| Arc::ptr_eq(&texture.texels, &other.texels)));
        let textures = textures.map(|texture| texture.bytes() as usize).sum::<usize>();
        let attributes = self.attributes.as_ref().map_or(0, |own| {
            let of = other.attributes.as_ref();
            size_of_val(&own.normals[..])
                + size_of_val(&own.tangents[..])
                + list(&own.corners, of.map(|of| &of.corners))
                + list(&own.uvs, of.map(|of| &of.uvs))
                + list(&own.uvs2, of.map(|of| &of.uvs2))
                + list(&own.colors, of.map(|of| &of.colors))
                + list(&own.alphas, of.map(|of| &of.alphas))
        });
        textures + attributes + list(&self.material_indices, Some(&other.material_indices))
    }
}

/// Shares a list that is equal to another.
fn share<T: PartialEq>(own: &mut Arc<Vec<T>>, other: &Arc<Vec<T>>) {
    if own == other {
        *own = Arc::clone(other);
    }
}
