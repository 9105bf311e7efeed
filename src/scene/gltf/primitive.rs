//! Meshes: their triangles and attributes before any node moves them.

use glam::{Vec2, Vec3};
use gltf::json::mesh::{Mode, Primitive as JsonPrimitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::{self, Elements};
use super::container::Document;

/// A decoded primitive.
pub(super) struct Primitive {
    pub(super) positions: Vec<Vec3>,
    /// These lists are empty or as long as `positions`.
    pub(super) normals: Vec<Vec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) colors: Vec<Vec3>,
    /// Only with vertices that exist.
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) material: usize,
    /// Triangles with vertices that do not exist.
    pub(super) out_of_range: usize,
}

/// Decodes a primitive; `None` for points and lines, which have no surface.
pub(super) fn read(json: &JsonPrimitive, document: &Document, uv_sets: &[u32]) -> Result<Option<Primitive>, String> {
    let mode = match json.mode {
        Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
        Checked::Valid(_) => return Ok(None),
        Checked::Invalid => return Err("its mode is unknown".to_owned()),
    };
    let attribute = |semantic: Semantic| -> Result<Option<Elements>, String> {
        let index = json.attributes.get(&Checked::Valid(semantic));
        index.map(|index| accessor::read(document, index.value())).transpose()
    };
    let Some(elements) = attribute(Semantic::Positions)? else { return Err("it has no POSITION".to_owned()) };
    if elements.width != 3 {
        return Err("POSITION is not VEC3".to_owned());
    }
    let positions = vectors(&elements);
    let fallback = uv_sets.len() - 1;
    let material = json.material.map(|material| material.value()).filter(|&material| material < fallback);
    let material = material.unwrap_or(fallback);
    // Looks that cannot be read are left out; the shape counts.
    let optional = |semantic: Semantic, widths: &[usize]| {
        attribute(semantic).ok().flatten().filter(|elements| widths.contains(&elements.width))
    };
    let mut normals: Vec<Vec3> =
        optional(Semantic::Normals, &[3]).map(|elements| vectors(&elements)).unwrap_or_default();
    let mut uvs: Vec<Vec2> = optional(Semantic::TexCoords(uv_sets[material]), &[2])
        .map(|elements| elements.numbers.as_chunks().0.iter().copied().map(Vec2::from_array).collect())
        .unwrap_or_default();
    let mut colors: Vec<Vec3> =
        optional(Semantic::Colors(0), &[3, 4]).map(|elements| vectors(&elements)).unwrap_or_default();
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
        Some(index) => accessor::read_indices(document, index.value())?,
        None => (0..u32::try_from(positions.len()).map_err(|_| "it has too many vertices")?).collect(),
    };
    let mut triangles: Vec<[u32; 3]> = match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .map(|(k, w)| if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
            .collect(),
        Mode::TriangleFan => {
            indices.get(1..).unwrap_or_default().windows(2).map(|w| [w[0], w[1], indices[0]]).collect()
        }
        _ => indices.as_chunks().0.to_vec(),
    };
    let before = triangles.len();
    triangles.retain(|corners| corners.iter().all(|&corner| (corner as usize) < positions.len()));
    let out_of_range = before - triangles.len();
    Ok(Some(Primitive { positions, normals, uvs, colors, triangles, material, out_of_range }))
}

/// The first three numbers of every element.
pub(super) fn vectors(elements: &Elements) -> Vec<Vec3> {
    elements.numbers.chunks_exact(elements.width).map(|e| Vec3::new(e[0], e[1], e[2])).collect()
}
