//! The glTF reader beside the crate `gltf` used plainly, with which it shares no code: as many triangles, and the same bounds.
//! Shared by the tests and fuzzing.

use std::path::Path;

use bvhscope::scene::{LoadOptions, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use glam::{DMat4, DQuat, DVec3};
use gltf::mesh::Mode;

/// Triangles and bounds according to the crate; `data` has the bytes of each buffer.
fn expected(document: &gltf::Document, data: &[Vec<u8>]) -> (usize, [DVec3; 2]) {
    let (mut count, mut bounds) = (0, [DVec3::INFINITY, DVec3::NEG_INFINITY]);
    let scene = document.default_scene().or_else(|| document.scenes().next()).unwrap();
    let mut open: Vec<_> = scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect();
    while let Some((node, parent)) = open.pop() {
        let local = match node.transform() {
            gltf::scene::Transform::Matrix { matrix } => {
                DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)))
            }
            gltf::scene::Transform::Decomposed { translation, rotation, scale } => {
                DMat4::from_scale_rotation_translation(
                    DVec3::from(scale.map(f64::from)),
                    DQuat::from_array(rotation.map(f64::from)).normalize(),
                    DVec3::from(translation.map(f64::from)),
                )
            }
        };
        let world = parent * local;
        open.extend(node.children().map(|child| (child, world)));
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            let reader = primitive.reader(|buffer| data.get(buffer.index()).map(Vec::as_slice));
            let points: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
            let corners: Vec<usize> = match reader.read_indices() {
                Some(indices) => indices.into_u32().map(|index| index as usize).collect(),
                None => (0..points.len()).collect(),
            };
            let shown = match primitive.mode() {
                Mode::Triangles => corners.len() / 3 * 3,
                Mode::TriangleStrip | Mode::TriangleFan if corners.len() >= 3 => corners.len(),
                _ => 0,
            };
            count += if primitive.mode() == Mode::Triangles { shown / 3 } else { shown.saturating_sub(2) };
            for &corner in &corners[..shown] {
                let point = world.transform_point3(DVec3::from(points[corner].map(f64::from)));
                bounds = [bounds[0].min(point), bounds[1].max(point)];
            }
        }
    }
    (count, bounds)
}

/// Asserts that both read as many triangles and the same bounds.
pub fn compare(name: &str, path: &Path, bytes: &[u8], document: &gltf::Document, data: &[Vec<u8>]) {
    let scene = load_bytes(path, bytes, &LoadOptions::default(), &CancelToken::new()).unwrap();
    let (count, [min, max]) = expected(document, data);
    assert_eq!(scene.triangles.len(), count, "{name}");
    let size = (max - min).max_element().max(max.abs().max(min.abs()).max_element());
    let found = [scene.bounds.min.as_dvec3(), scene.bounds.max.as_dvec3()];
    for (found, expected) in found.into_iter().zip([min, max]) {
        assert!((found - expected).abs().max_element() <= 1e-5 * size, "{name}: {found} instead of {expected}");
    }
}

/// The same for a file whose buffers are `data:` URIs of percent-encoded bytes.
pub fn compare_text(name: &str, text: &str) {
    let gltf::Gltf { document, .. } = gltf::Gltf::from_slice(text.as_bytes()).unwrap_or_else(|e| panic!("{e}: {text}"));
    let data: Vec<Vec<u8>> = document
        .buffers()
        .map(|buffer| match buffer.source() {
            gltf::buffer::Source::Uri(uri) => {
                let digits = uri.split_once(',').unwrap().1.split('%').skip(1);
                digits.map(|digits| u8::from_str_radix(digits, 16).unwrap()).collect()
            }
            gltf::buffer::Source::Bin => unreachable!("the text has no binary chunk"),
        })
        .collect();
    compare(name, Path::new("/nonexistent/a.gltf"), text.as_bytes(), &document, &data);
}
