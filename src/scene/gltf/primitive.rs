//! Decodes mesh primitives into triangles and attributes in mesh space.

use glam::{Vec2, Vec3};
use gltf::json::mesh::{Mode, Primitive as JsonPrimitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::{self, AccessorError, Elements};
use super::document::Document;
use crate::scene::assemble::{BATCH_SIZE, collect_cancellable};
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// A decoded primitive in mesh space.
pub(super) struct Primitive {
    pub(super) positions: Vec<Vec3>,
    /// Normals; as the other attributes empty or as long as `positions`.
    pub(super) normals: Vec<Vec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) colors: Vec<Vec3>,
    /// Vertex indices of each triangle, all in range.
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) material: usize,
    /// Number of triangles dropped because of an index out of range.
    pub(super) out_of_range: usize,
}

/// Decodes a primitive; `None` for points and lines, which have no surface.
pub(super) fn read(
    json: &JsonPrimitive,
    document: &Document,
    uv_sets: &[u32],
    token: &CancelToken,
) -> Result<Option<Primitive>, AccessorError> {
    let mode = match json.mode {
        Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
        Checked::Valid(_) => return Ok(None),
        Checked::Invalid => return Err("its mode is unknown".into()),
    };
    let attribute = |semantic: Semantic| -> Result<Option<Elements>, AccessorError> {
        let index = json.attributes.get(&Checked::Valid(semantic));
        index.map(|index| accessor::read(document, index.value(), token)).transpose()
    };
    let Some(elements) = attribute(Semantic::Positions)? else { return Err("it has no POSITION".into()) };
    if elements.width != 3 {
        return Err("POSITION is not VEC3".into());
    }
    let positions = vectors(&elements, token)?;
    // The last material is the default one.
    let fallback = uv_sets.len().saturating_sub(1);
    let material = json.material.map(|material| material.value()).filter(|&material| material < fallback);
    let material = material.unwrap_or(fallback);
    // Optional attributes that cannot be read are dropped.
    let optional = |semantic: Semantic, widths: &[usize]| -> Result<Elements, Cancelled> {
        match attribute(semantic) {
            Ok(Some(elements)) if widths.contains(&elements.width) => Ok(elements),
            Err(AccessorError::Cancelled(cancelled)) => Err(cancelled),
            _ => Ok(Elements { width: widths[0], numbers: Vec::new() }),
        }
    };
    let mut normals = vectors(&optional(Semantic::Normals, &[3])?, token)?;
    let uvs = optional(Semantic::TexCoords(uv_sets[material]), &[2])?;
    let uvs = uvs.numbers.as_chunks().0;
    let mut uvs = collect_cancellable(uvs.len(), uvs.iter().copied().map(Vec2::from_array), token)?;
    let mut colors = vectors(&optional(Semantic::Colors(0), &[3, 4])?, token)?;
    if normals.len() != positions.len() {
        normals.clear();
    }
    if uvs.len() != positions.len() {
        uvs.clear();
    }
    if colors.len() != positions.len() {
        colors.clear();
    }
    let indices: Vec<u32> = match json.indices {
        Some(index) => accessor::read_indices(document, index.value(), token)?,
        None => (0..u32::try_from(positions.len()).map_err(|_| "it has too many vertices")?).collect(),
    };
    let mut triangles: Vec<[u32; 3]> = match mode {
        Mode::TriangleStrip => {
            let strip_triangle =
                |(k, w): (usize, &[u32])| if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] };
            collect_cancellable(indices.len(), indices.windows(3).enumerate().map(strip_triangle), token)?
        }
        Mode::TriangleFan => {
            let rim = indices.get(1..).unwrap_or_default();
            collect_cancellable(indices.len(), rim.windows(2).map(|w| [w[0], w[1], indices[0]]), token)?
        }
        _ => collect_cancellable(indices.len() / 3, indices.as_chunks().0.iter().copied(), token)?,
    };
    let mut out_of_range = 0_usize;
    for part in triangles.chunks(BATCH_SIZE) {
        token.check()?;
        let exists = |corners: &[u32; 3]| corners.iter().all(|&corner| (corner as usize) < positions.len());
        out_of_range = out_of_range.saturating_add(part.iter().filter(|corners| !exists(corners)).count());
    }
    if out_of_range > 0 {
        triangles.retain(|corners| corners.iter().all(|&corner| (corner as usize) < positions.len()));
    }
    Ok(Some(Primitive { positions, normals, uvs, colors, triangles, material, out_of_range }))
}

/// The first three components of every element.
pub(super) fn vectors(elements: &Elements, token: &CancelToken) -> Result<Vec<Vec3>, Cancelled> {
    let all = elements.numbers.chunks_exact(elements.width);
    collect_cancellable(all.len(), all.map(|e| Vec3::new(e[0], e[1], e[2])), token)
}
