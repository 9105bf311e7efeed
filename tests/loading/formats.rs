//! Every real model of the manifest loads with the number of triangles and the bounds that an independent reader found;
//! small generated files test one feature or fault each.

use std::path::Path;

use bvhscope::scene::{LoadError, LoadOptions, Scene, SceneSource, load};
use bvhscope_engine::cancel::CancelToken;

use crate::support::{Lack, models, skip};

pub fn load_path(path: &Path) -> Result<Scene, LoadError> {
    load(&SceneSource::File(path.to_path_buf()), &LoadOptions::default(), &CancelToken::new())
}

/// Writes a file into a fresh folder and loads it.
pub fn load_bytes(name: &str, bytes: &[u8]) -> Result<Scene, LoadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    load_path(&path)
}

/// File, number of triangles and bounds (minimum, maximum) in each row of the manifest.
fn manifest(folder: &Path) -> Vec<(String, usize, [f32; 6])> {
    let text = std::fs::read_to_string(folder.join("MANIFEST.md")).unwrap();
    let rows = text.lines().filter_map(|line| {
        let cells: Vec<_> = line.split('|').map(str::trim).collect();
        let triangles = cells.get(2)?.replace(',', "").parse().ok()?;
        let numbers: Vec<f32> = cells.get(4)?.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        Some((cells[1].to_owned(), triangles, numbers.try_into().ok()?))
    });
    rows.collect()
}

/// Bounds of models for which the manifest's reader turned the boxes of meshes instead of their vertices, or left instances, skins
/// or morph targets out, from a reader of its own in double precision; of the Draco file, whose declared box is wider than its vertices,
/// those of its uncompressed twin.
const TRUE_BOUNDS: [(&str, [f32; 6]); 6] = [
    ("2CylinderEngine.glb", [-371.692, -180.972, -140.0, 371.692, 92.0416, 128.0]),
    ("CesiumMilkTruck.glb", [-1.396, 0.001_451_9, -2.430_91, 1.396, 2.584_37, 2.438]),
    ("Duck-Draco/Duck.gltf", [-0.692_985, 0.099_293_7, -0.613_282, 0.961_799, 1.639_7, 0.539_252]),
    ("MorphPrimitivesTest.glb", [-0.5, 0.0, -0.5, 0.5, 0.1, 0.5]),
    ("RecursiveSkeletons.glb", [-30.0, 0.0, -30.0, 30.0, 125.1, 30.0]),
    ("SimpleInstancing.glb", [-1.666_67, -1.666_67, -1.666_67, 12.7317, 12.7317, 12.7317]),
];

fn check_manifest(extensions: &[&str]) {
    let Some(folder) = models() else { return };
    let (mut checked, mut missing) = (0, Vec::new());
    for (file, triangles, bounds) in manifest(&folder) {
        let path = folder.join(&file);
        if !extensions.iter().any(|extension| file.ends_with(extension)) {
            continue;
        }
        if !path.exists() {
            missing.push(file);
            continue;
        }
        checked += 1;
        let scene = load_path(&path).unwrap();
        // Of a concave polygon with two corners in one place, a triangle without area is left out: four in Crytek Sponza.
        let left_out = if file.ends_with("sponza-crytek/sponza.obj") { 4 } else { 0 };
        assert_eq!(scene.triangles.len(), triangles - left_out, "{file}");
        let found = [scene.bounds.min.to_array(), scene.bounds.max.to_array()].concat();
        let size = scene.bounds.extent().max_element();
        let bounds = TRUE_BOUNDS.iter().find(|(name, _)| file.ends_with(name)).map_or(bounds, |row| row.1);
        for (found, expected) in found.iter().zip(bounds) {
            // Half of the last of five digits, and the rounding of transforms in f32.
            let slack = 5.1e-5 * expected.abs() + 1.1e-5 * size;
            // Draco rounds positions to 11 bits.
            let slack = if file.contains("Draco") { slack + 0.5 * size / 2047.0 } else { slack };
            assert!((found - expected).abs() <= slack, "{file}: {:?} instead of {bounds:?}", scene.bounds);
        }
    }
    if !missing.is_empty() {
        skip(Lack::Models, format_args!("missing: {}", missing.join(", ")));
    }
    assert!(checked > 0, "no {extensions:?} in the manifest");
}

#[test]
fn obj_models_match_the_manifest() {
    check_manifest(&[".obj"]);
}

#[test]
fn ply_and_stl_models_match_the_manifest() {
    check_manifest(&[".ply", ".stl"]);
}

#[test]
fn gltf_models_match_the_manifest() {
    check_manifest(&[".gltf", ".glb"]);
}

#[test]
fn stl_of_every_kind_loads() {
    let facet = |x: &str| {
        format!("FACET NORMAL 0 0 0\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX {x} 0 0\nVERTEX 0 1 0\nENDLOOP\nENDFACET\n")
    };
    let text = format!("SOLID a\n{}ENDSOLID\nsolid b\n{}{}", facet("1"), facet("2"), facet("nan"));
    let scene = load_bytes("a.stl", text.as_bytes()).unwrap();
    // One for the triangle with NaN, one for the second solid, which does not end.
    assert_eq!((scene.triangles.len(), scene.mesh_count, scene.warnings.entries.len()), (2, 2, 2));
    let complete = load_bytes("a.stl", format!("{text}ENDSOLID\n").as_bytes()).unwrap();
    assert_eq!(complete.warnings.entries.len(), 1);
    let mut binary = b"solid but binary".to_vec();
    binary.resize(80, 0);
    binary.extend(2_u32.to_le_bytes());
    for x in [0.0_f32, 3.0] {
        let values = [0.0, 0.0, 0.0, x, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        binary.extend(values.iter().flat_map(|value: &f32| value.to_le_bytes()));
        binary.extend([0, 0]);
    }
    assert_eq!(load_bytes("no-extension", &binary).unwrap().triangles.len(), 2);
    binary.truncate(140);
    // One complete facet of the two that the header declares. With wrong lengths only a text file may begin with "solid".
    binary[0] = b'_';
    let scene = load_bytes("short.stl", &binary[..134]).unwrap();
    assert_eq!((scene.triangles.len(), scene.warnings.is_empty()), (1, false));
}

#[test]
fn ply_of_every_kind_loads() {
    let text = "ply\r\nformat ascii 1.0\r\nelement face 2\r\nproperty list uchar int vertex_indices\r\nelement vertex 4\r\n\
        property uchar red\r\nproperty uchar green\r\nproperty uchar blue\r\nproperty double z\r\nproperty float y\r\n\
        property float x\r\nend_header\r\n4 0 1 2 3\r\n3 0 1 9\r\n255 0 0 0 0 0\r\n255 0 0 0 0 1\r\n255 0 0 0 1 1\r\n0 0 0 0 1 0";
    let scene = load_bytes("a.ply", text.as_bytes()).unwrap();
    assert_eq!((scene.triangles.len(), scene.warnings.entries.len()), (2, 1));
    assert!(scene.attributes.unwrap().colors.contains(&glam::Vec3::X));
    let mut big =
        b"ply\nformat binary_big_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
            .to_vec();
    for value in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0] {
        big.extend(value.to_be_bytes());
    }
    for value in [8, 0, 1, 2, 3, -1, 0, 1, 3] {
        big.extend(i32::to_be_bytes(value));
    }
    assert_eq!(load_bytes("big.ply", &big).unwrap().triangles.len(), 3);
    for length in 0..big.len() {
        assert!(load_bytes("cut.ply", &big[..length]).is_err());
    }
}

#[test]
fn ply_counts_are_not_trusted() {
    for element in ["vertex 18446744073709551615", "nothing 4000000000"] {
        let text = format!(
            "ply\nformat ascii 1.0\nelement {element}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
        );
        let message = load_bytes("a.ply", text.as_bytes()).unwrap_err().to_string();
        assert!(message.contains("are declared"), "{message}");
    }
    let flat = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n0 0\n";
    let message = load_bytes("a.ply", flat.as_bytes()).unwrap_err().to_string();
    assert!(message.contains("the vertices have no property 'z'"), "{message}");
    let points = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n";
    let message = load_bytes("a.ply", points).unwrap_err().to_string();
    assert!(message.contains("contains 1 point but no triangles"), "{message}");
}

#[test]
fn unusable_files_are_explained() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bunny.obj"), "v 0 0 0").unwrap();
    let message = load_path(&folder.path().join("buny.obj")).unwrap_err().to_string();
    assert!(message.contains("no such file; did you mean 'bunny.obj'?"), "{message}");
    for name in ["a", "b"] {
        std::fs::write(folder.path().join(name), "").unwrap();
    }
    let message = load_path(&folder.path().join("c")).unwrap_err().to_string();
    assert!(message.contains("check the spelling and the folder"), "names of one letter are not similar: {message}");
    let message = load_path(Path::new("-")).unwrap_err().to_string();
    assert!(message.contains("standard input cannot be read; write the model to a file"), "{message}");
    let message = load_path(folder.path()).unwrap_err().to_string();
    assert!(message.contains("is a folder; name a model in it: bunny.obj"), "{message}");
    let message = load_bytes("a.obj", b"").unwrap_err().to_string();
    assert!(message.contains("empty"), "{message}");
    if cfg!(unix) {
        let message = load_path(Path::new("/dev/zero")).unwrap_err().to_string();
        assert!(message.contains("not a regular file"), "{message}");
    }
}

#[test]
fn a_cancelled_load_stops() {
    let token = CancelToken::new();
    token.cancel();
    let source = SceneSource::default_builtin();
    let result = load(&source, &LoadOptions::default(), &token);
    assert!(matches!(result, Err(LoadError::Cancelled(_))));
}

/// A glTF square of four corners, in the order of a strip, with a colour each: drawn as `mode`, with indices of
/// `component_type`, under the node `node`.
fn gltf_square(mode: u32, component_type: u32, indices: &[u32], node: &serde_json::Value) -> Scene {
    let mut bytes: Vec<u8> = Vec::new();
    for corner in [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]] {
        bytes.extend(corner.iter().flat_map(|x| x.to_le_bytes()));
    }
    // RGBA in bytes, as many exporters write it.
    bytes.extend([[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 255_u8]].as_flattened());
    let index_bytes = match component_type {
        5121 => 1,
        5123 => 2,
        _ => 4,
    };
    bytes.extend(indices.iter().flat_map(|index| index.to_le_bytes()[..index_bytes].to_vec()));
    let text: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    let document = serde_json::json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "mode": mode}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC4"},
            {"bufferView": 2, "componentType": component_type, "count": indices.len(), "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 16},
            {"buffer": 0, "byteOffset": 64, "byteLength": indices.len() * index_bytes}
        ],
        "buffers": [{"byteLength": bytes.len(), "uri": format!("data:application/octet-stream,{text}")}]
    });
    let scene = load_bytes("square.gltf", document.to_string().as_bytes()).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene
}

/// Twice the area of each triangle, along z: positive where it turns to the left.
fn turns(scene: &Scene) -> Vec<f32> {
    scene.triangles.iter().map(|t| (t.b - t.a).cross(t.c - t.a).z).collect()
}

#[test]
fn gltf_lists_strips_and_fans_with_every_index_type_are_the_same_square() {
    let plain = serde_json::json!({"mesh": 0});
    for component_type in [5121, 5123, 5125] {
        for (mode, indices) in [(4, &[0, 1, 2, 2, 1, 3][..]), (5, &[0, 1, 2, 3]), (6, &[0, 1, 3, 2])] {
            let scene = gltf_square(mode, component_type, indices, &plain);
            assert_eq!(turns(&scene), [1.0, 1.0], "mode {mode}, component type {component_type}");
            let attributes = scene.attributes.as_ref().unwrap();
            for (triangle, corners) in scene.triangles.iter().zip(attributes.corners.iter()) {
                for (corner, vertex) in [triangle.a, triangle.b, triangle.c].into_iter().zip(corners) {
                    let expected = match (corner.x > 0.5, corner.y > 0.5) {
                        (false, false) => glam::Vec3::X,
                        (true, false) => glam::Vec3::Y,
                        (false, true) => glam::Vec3::Z,
                        (true, true) => glam::Vec3::ONE,
                    };
                    assert_eq!(attributes.colors[*vertex as usize], expected, "at {corner}");
                }
            }
        }
    }
}

#[test]
fn gltf_nodes_apply_their_transforms_or_matrix() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // A quarter turn about z takes (1, 1) to (-1, 1), then twice as large, then moved by 5 along x.
    let parts = serde_json::json!({
        "mesh": 0, "rotation": [0.0, 0.0, half, half], "scale": [2.0, 2.0, 2.0], "translation": [5.0, 0.0, 0.0]
    });
    let matrix = serde_json::json!({
        "mesh": 0, "matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 5, 0, 0, 1]
    });
    for node in [parts, matrix] {
        let scene = gltf_square(4, 5123, &[0, 1, 2, 2, 1, 3], &node);
        let off = (scene.bounds.min - glam::Vec3::new(3.0, 0.0, 0.0)).length()
            + (scene.bounds.max - glam::Vec3::new(5.0, 2.0, 0.0)).length();
        assert!(off < 1e-5, "{node}: {:?}", scene.bounds);
        assert!(turns(&scene).iter().all(|turn| (turn - 4.0).abs() < 1e-4), "{:?}", turns(&scene));
    }
}

#[test]
fn formats_are_recognised_by_content() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for (name, text, warned) in [
        ("a.ply", ply, false),
        ("no-extension", ply, false),
        ("a.bak", ply, false),
        ("a.OBJ", ply, true),
        ("a.obj", obj, false),
        ("a", obj, false),
    ] {
        let scene = load_bytes(name, text.as_bytes()).unwrap();
        assert_eq!((scene.triangles.len(), scene.warnings.is_empty()), (1, !warned), "{name}: {:?}", scene.warnings);
        if warned {
            assert!(scene.warnings.entries[0].what.contains("PLY"), "{:?}", scene.warnings);
        }
    }
    let message = load_bytes("a.txt", b"hello").unwrap_err().to_string();
    assert!(message.contains("neither OBJ, glTF, GLB, PLY, STL, PBRT nor BVH"), "{message}");
}
