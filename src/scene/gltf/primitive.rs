//! Meshes: their triangles and attributes before any node moves them.

use glam::{Vec2, Vec3};
use serde_json::Value;

use super::accessor::{self, Elements};
use super::container::{Document, number};

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
pub(super) fn read(json: &Value, document: &Document, uv_sets: &[usize]) -> Result<Option<Primitive>, String> {
    let mode = number(json, "mode").unwrap_or(4);
    if !(4..=6).contains(&mode) {
        return Ok(None);
    }
    let attribute = |name: &str| -> Result<Option<Elements>, String> {
        number(&json["attributes"], name).map(|index| accessor::read(document, index)).transpose()
    };
    let Some(elements) = attribute("POSITION")? else { return Err("it has no POSITION".to_owned()) };
    if elements.width != 3 {
        return Err("POSITION is not VEC3".to_owned());
    }
    let positions = vectors(&elements);
    let fallback = uv_sets.len() - 1;
    let material = number(json, "material").filter(|&material| material < fallback).unwrap_or(fallback);
    // Looks that cannot be read are left out; the shape counts.
    let optional = |name: &str, widths: &[usize]| {
        attribute(name).ok().flatten().filter(|elements| widths.contains(&elements.width))
    };
    let mut normals: Vec<Vec3> = optional("NORMAL", &[3]).map(|elements| vectors(&elements)).unwrap_or_default();
    let mut uvs: Vec<Vec2> = optional(&format!("TEXCOORD_{}", uv_sets[material]), &[2])
        .map(|elements| elements.floats().as_chunks().0.iter().copied().map(Vec2::from_array).collect())
        .unwrap_or_default();
    let mut colors: Vec<Vec3> = optional("COLOR_0", &[3, 4]).map(|elements| vectors(&elements)).unwrap_or_default();
    if normals.len() != positions.len() {
        normals.clear();
    }
    if uvs.len() != positions.len() {
        uvs.clear();
    }
    if colors.len() != positions.len() {
        colors.clear();
    }
    let indices: Vec<u32> = match number(json, "indices") {
        Some(index) => {
            accessor::read(document, index)?.indices().ok_or_else(|| format!("accessors[{index}] holds no indices"))?
        }
        None => (0..u32::try_from(positions.len()).map_err(|_| "it has too many vertices")?).collect(),
    };
    let all: Vec<[u32; 3]> = match mode {
        4 => indices.as_chunks().0.to_vec(),
        5 => indices
            .windows(3)
            .enumerate()
            .map(|(k, w)| if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
            .collect(),
        _ => indices.get(1..).unwrap_or_default().windows(2).map(|w| [w[0], w[1], indices[0]]).collect(),
    };
    let before = all.len();
    let mut triangles = all;
    triangles.retain(|corners| corners.iter().all(|&corner| (corner as usize) < positions.len()));
    let out_of_range = before - triangles.len();
    Ok(Some(Primitive { positions, normals, uvs, colors, triangles, material, out_of_range }))
}

/// The first three numbers of every element.
pub(super) fn vectors(elements: &Elements) -> Vec<Vec3> {
    elements.floats().chunks_exact(elements.width).map(|e| Vec3::new(e[0], e[1], e[2])).collect()
}
