//! The OBJ reader against the crate tobj on valid files: the same triangles in the same order, with the same attributes and
//! materials.

use std::path::Path;

use bvhscope::scene::{LoadOptions, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use glam::{DVec3, Vec2, Vec3};

use super::generator::LIBRARY;

/// A corner as both readers give it: position, colour in linear RGB, texture coordinates with v down, unit normal.
type Corner = (Vec3, Vec3, Vec2, Vec3);

/// The triangles that tobj reads, with the red part of each triangle's material; -1 without one.
fn read_plainly(text: &str) -> Vec<([Corner; 3], f32)> {
    let settings = tobj::LoadOptions { triangulate: true, single_index: true, ..tobj::LoadOptions::default() };
    let (models, materials) =
        tobj::load_obj_buf(&mut text.as_bytes(), &settings, |_| tobj::load_mtl_buf(&mut LIBRARY.as_bytes())).unwrap();
    let materials = materials.unwrap();
    let mut triangles = Vec::new();
    for mesh in models.into_iter().map(|model| model.mesh) {
        let red = mesh.material_id.map_or(-1.0, |id| materials[id].diffuse.unwrap()[0] as f32);
        let three = |list: &[f64], at: u32| DVec3::from_slice(&list[3 * at as usize..]).as_vec3();
        let corner = |at: u32| {
            let color = if mesh.vertex_color.is_empty() { Vec3::ONE } else { three(&mesh.vertex_color, at) };
            let uv = if mesh.texcoords.is_empty() {
                Vec2::ZERO
            } else {
                let uv = &mesh.texcoords[2 * at as usize..];
                Vec2::new(uv[0] as f32, (1.0 - uv[1]) as f32)
            };
            let normal =
                if mesh.normals.is_empty() { Vec3::ZERO } else { three(&mesh.normals, at).normalize_or_zero() };
            (three(&mesh.positions, at), color.map(linear), uv, normal)
        };
        triangles.extend(mesh.indices.as_chunks::<3>().0.iter().map(|corners| (corners.map(corner), red)));
    }
    triangles
}

/// IEC 61966-2-1.
fn linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The corners of a triangle of a scene.
pub fn corners(scene: &Scene, index: usize) -> [(Vec3, Vec3, Vec2, Vec3); 3] {
    let triangle = &scene.triangles[index];
    let positions = [triangle.a, triangle.b, triangle.c];
    std::array::from_fn(|k| {
        let Some(attributes) = &scene.attributes else { return (positions[k], Vec3::ONE, Vec2::ZERO, Vec3::ZERO) };
        let vertex = attributes.corners[index][k] as usize;
        let color = attributes.colors.get(vertex).copied().unwrap_or(Vec3::ONE);
        let uv = attributes.uvs.get(vertex).copied().unwrap_or_default();
        (positions[k], color, uv, attributes.normals.get(vertex).copied().unwrap_or_default())
    })
}

/// Asserts that both read the same from a valid file beside `a.mtl` in `folder`.
pub fn compare(folder: &Path, text: &str) {
    let expected = read_plainly(text);
    let scene =
        load_bytes(&folder.join("a.obj"), text.as_bytes(), &LoadOptions::default(), &CancelToken::new()).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}\n{text}", scene.warnings);
    assert_eq!(scene.triangles.len(), expected.len(), "{text}");
    for (index, (expected, red)) in expected.into_iter().enumerate() {
        assert_eq!(corners(&scene, index), expected, "triangle {index} of\n{text}");
        let material = scene.material(index as u32);
        let is_clay = material.name.is_empty();
        assert_eq!(if is_clay { -1.0 } else { material.base_color.x }, red, "triangle {index} of\n{text}");
    }
}
