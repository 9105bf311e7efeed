//! Coordinates, colours and winding for each mode, index type and transform of glTF, with values worked out by hand.

use glam::{Vec2, Vec3};
use serde_json::{Value, json};

use crate::hostile_gltf::{load, triangle};

const P: [Vec3; 5] = [
    Vec3::new(0.0, 0.0, 0.0),
    Vec3::new(1.0, 0.0, 0.0),
    Vec3::new(0.0, 1.0, 0.0),
    Vec3::new(1.0, 1.0, 0.0),
    Vec3::new(0.0, 2.0, 0.0),
];

fn uri(bytes: &[u8]) -> String {
    let text: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    format!("data:application/octet-stream,{text}")
}

/// Points `P`, with the indices in `kind` bytes, or none.
fn document(mode: u32, indices: &[u8], kind: usize) -> Value {
    let mut bytes: Vec<u8> = P.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes).collect();
    bytes.extend(indices.iter().flat_map(|&index| u32::from(index).to_le_bytes()[..kind].to_vec()));
    let code = [0, 5121, 5123, 0, 5125][kind];
    let mut primitive = json!({"attributes": {"POSITION": 0}, "mode": mode});
    if kind > 0 {
        primitive["indices"] = json!(1);
    }
    json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"},
            {"bufferView": 1, "componentType": code, "count": indices.len(), "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 60}, {"buffer": 0, "byteOffset": 60, "byteLength": indices.len() * kind}
        ],
        "buffers": [{"byteLength": bytes.len(), "uri": uri(&bytes)}]
    })
}

#[test]
fn each_mode_and_index_type_has_its_triangles_in_order() {
    let check = |mode: u32, indices: &[u8], kind: usize, expected: &[[usize; 3]]| {
        let scene = load(&document(mode, indices, kind)).unwrap();
        let found: Vec<_> = scene.triangles.iter().map(|t| [t.a, t.b, t.c]).collect();
        let expected: Vec<_> = expected.iter().map(|corners| corners.map(|k| P[k])).collect();
        assert_eq!(found, expected, "mode {mode}, indices of {kind} bytes");
    };
    for kind in [1, 2, 4] {
        check(4, &[2, 1, 3, 0, 1, 2], kind, &[[2, 1, 3], [0, 1, 2]]);
        // The specification: strips alternate, (i, i + 1 + i % 2, i + 2 - i % 2); up to rotation that is b, a, c.
        check(5, &[4, 2, 3, 1], kind, &[[4, 2, 3], [3, 2, 1]]);
        check(6, &[0, 1, 3, 4], kind, &[[1, 3, 0], [3, 4, 0]]);
    }
    check(4, &[], 0, &[[0, 1, 2]]);
    check(5, &[], 0, &[[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
    check(6, &[], 0, &[[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
    // All triangles of a strip face the same way.
    for triangle in &load(&document(5, &[], 0)).unwrap().triangles {
        assert!(triangle.scaled_normal().z > 0.0);
    }
}

#[test]
fn transforms_apply_from_the_vertex_outwards() {
    // The corner (1, 0, 0).
    let moved = |nodes: Value| load(&crate::hostile_gltf::with("/nodes", nodes)).unwrap().triangles[0].b;
    let close = |found: Vec3, x: f32, y: f32, z: f32| assert!(found.distance(Vec3::new(x, y, z)) < 1e-5, "{found}");
    let quarter = json!([0.0, 0.0, 0.707_106_77, 0.707_106_77]);
    // Scaled to (2, 0, 0), turned about z to (0, 2, 0), moved.
    close(
        moved(json!([{"mesh": 0, "translation": [5, 0, 1], "rotation": quarter, "scale": [2, 1, 1]}])),
        5.0,
        2.0,
        1.0,
    );
    // Columns: x becomes y, y becomes -x.
    close(moved(json!([{"mesh": 0, "matrix": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1]}])), 7.0, 9.0, 9.0);
    // The child moves first: (1 + 3, 0, 0), turned by its parent.
    close(moved(json!([{"rotation": quarter, "children": [1]}, {"mesh": 0, "translation": [3, 0, 0]}])), 0.0, 4.0, 0.0);
    close(moved(json!([{"translation": [3, 0, 0], "children": [1]}, {"mesh": 0, "rotation": quarter}])), 3.0, 1.0, 0.0);
}

#[test]
fn copies_are_made_before_the_node_is_placed() {
    let mut document = triangle();
    document["bufferViews"] = json!([{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}, {"buffer": 1, "byteLength": 24}]);
    let moves: Vec<u8> = [3.0_f32, 0.0, 0.0, 0.0, 0.0, 4.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    document["buffers"].as_array_mut().unwrap().push(json!({"byteLength": 24, "uri": uri(&moves)}));
    document["accessors"]
        .as_array_mut()
        .unwrap()
        .push(json!({"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}));
    document["nodes"] = json!([{"mesh": 0, "rotation": [0.0, 0.0, 0.707_106_77, 0.707_106_77],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}}}]);
    let scene = load(&document).unwrap();
    // (1, 0, 0) moves to (4, 0, 0) and turns to (0, 4, 0).
    assert!(scene.triangles[0].b.distance(Vec3::new(0.0, 4.0, 0.0)) < 1e-5, "{}", scene.triangles[0].b);
    assert!(scene.triangles[1].b.distance(Vec3::new(0.0, 1.0, 4.0)) < 1e-5, "{}", scene.triangles[1].b);
    assert_eq!(scene.triangles.len(), 2);
}

#[test]
fn colours_and_normals_of_each_type_are_read() {
    let attribute = |name: &str, code: u32, shape: &str, bytes: &[u8], stride: usize| {
        let mut document = triangle();
        document["buffers"].as_array_mut().unwrap().push(json!({"byteLength": bytes.len(), "uri": uri(bytes)}));
        document["bufferViews"]
            .as_array_mut()
            .unwrap()
            .push(json!({"buffer": 1, "byteLength": bytes.len(), "byteStride": stride}));
        let view =
            json!({"bufferView": 2, "componentType": code, "count": 3, "type": shape, "normalized": code != 5126});
        document["accessors"].as_array_mut().unwrap().push(view);
        document["meshes"][0]["primitives"][0]["attributes"][name] = json!(2);
        let scene = load(&document).unwrap();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        scene.attributes.unwrap()
    };
    // Entry 0 is the default vertex.
    let bytes = [255, 0, 51, 9, 0, 255, 102, 9, 0, 0, 255, 9];
    let colors = attribute("COLOR_0", 5121, "VEC4", &bytes, 4).colors;
    assert_eq!(colors[1..], [Vec3::new(1.0, 0.0, 0.2), Vec3::new(0.0, 1.0, 0.4), Vec3::Z]);
    let shorts: Vec<u8> =
        [65_535_u16, 0, 13_107, 0, 0, 0, 0, 0, 0, 0, 0, 0].iter().flat_map(|x| x.to_le_bytes()).collect();
    assert_eq!(attribute("COLOR_0", 5123, "VEC3", &shorts, 8).colors[1], Vec3::new(1.0, 0.0, 0.2));
    let floats: Vec<u8> =
        [0.25_f32, 0.5, 0.75, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    assert_eq!(attribute("COLOR_0", 5126, "VEC3", &floats, 12).colors[1], Vec3::new(0.25, 0.5, 0.75));
    let normals = [0, 0, 129, 0, 127, 0, 0, 0, 0, 127, 0, 0];
    assert_eq!(attribute("NORMAL", 5120, "VEC3", &normals, 4).normals[1..], [Vec3::NEG_Z, Vec3::X, Vec3::Y]);
    let coordinates: Vec<u8> = [0_u16, 65_535, 13_107, 0, 0, 0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let uvs = attribute("TEXCOORD_0", 5123, "VEC2", &coordinates, 4).uvs;
    assert_eq!(uvs[1..], [Vec2::new(0.0, 1.0), Vec2::new(0.2, 0.0), Vec2::ZERO]);
}

/// The specification's matrix: with v down, a rotation by an angle takes (u, v) to (u cos + v sin, -u sin + v cos).
#[test]
fn a_texture_transform_rotates_counter_clockwise() {
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbaImage::new(1, 1).write_to(&mut png, image::ImageFormat::Png).unwrap();
    let mut document = triangle();
    document["images"] = json!([{"uri": uri(png.get_ref())}]);
    document["textures"] = json!([{"source": 0}]);
    document["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions":
        {"KHR_texture_transform": {"rotation": std::f32::consts::FRAC_PI_2, "scale": [2, 3], "offset": [0.5, 0.25]}}}}}]);
    let scene = load(&document).unwrap();
    let texture = &scene.textures[scene.materials[0].base_color_texture.unwrap() as usize];
    // Scaled to (2, 0), turned to (0, -2), moved; and scaled to (0, 3), turned to (3, 0), moved.
    for (from, to) in [(Vec2::X, Vec2::new(0.5, -1.75)), (Vec2::Y, Vec2::new(3.5, 0.25))] {
        let found = texture.uv_transform.transform_point2(from);
        assert!(found.distance(to) < 1e-5, "{from}: {found} instead of {to}");
    }
}

#[test]
fn textures_of_one_material_may_have_two_sets_of_coordinates() {
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbaImage::new(1, 1).write_to(&mut png, image::ImageFormat::Png).unwrap();
    let mut document = triangle();
    document["images"] = json!([{"uri": uri(png.get_ref())}]);
    document["textures"] = json!([{"source": 0}]);
    document["materials"] = json!([{
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 3}},
        "normalTexture": {"index": 0, "texCoord": 3, "scale": 0.25},
        "occlusionTexture": {"index": 0, "texCoord": 1, "strength": 0.5},
        "emissiveTexture": {"index": 0, "texCoord": 0}
    }]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    let accessors = document["accessors"].as_array_mut().unwrap();
    let first = accessors.len();
    // Without a buffer view the coordinates are zeros.
    accessors.extend((0..2).map(|_| json!({"componentType": 5126, "count": 3, "type": "VEC2"})));
    document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_3"] = json!(first);
    document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(first + 1);
    let scene = load(&document).unwrap();
    let attributes = scene.attributes.as_ref().unwrap();
    assert_eq!((attributes.uvs.len(), attributes.uvs2.len()), (4, 4), "the default vertex and three");
    let material = scene.material(0);
    assert_eq!((material.normal_scale, material.occlusion_strength), (0.25, 0.5));
    let of = |texture: Option<u32>| &scene.textures[texture.unwrap() as usize];
    let [color, normal, occlusion] =
        [material.base_color_texture, material.normal_texture, material.occlusion_texture].map(of);
    assert_eq!(
        [color, normal, occlusion].map(|texture| (texture.uv_set, texture.is_linear)),
        [(0, false), (0, true), (1, true)]
    );
    assert!(std::sync::Arc::ptr_eq(&color.texels, &occlusion.texels), "the texels are there once");
    assert_eq!(scene.image_count(), 1);
    // A third set is left out, and said so.
    assert!(material.emissive_texture.is_none());
    let warnings = scene.warnings.entries.iter().map(ToString::to_string).collect::<Vec<_>>();
    assert!(warnings.iter().any(|warning| warning.contains("materials[0].emissiveTexture.texCoord")), "{warnings:?}");
}

/// Many primitives that share one list of vertices read only their own.
#[test]
fn of_shared_vertices_only_those_in_use_are_kept() {
    let mut shared = document(4, &[4, 2, 3], 1);
    shared["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(0);
    let scene = load(&shared).unwrap();
    assert_eq!([scene.triangles[0].a, scene.triangles[0].b, scene.triangles[0].c], [P[4], P[2], P[3]]);
    let attributes = scene.attributes.unwrap();
    assert_eq!(attributes.normals.len(), 4, "the default vertex and three of five");
    let normals = attributes.corners[0].map(|corner| attributes.normals[corner as usize]);
    assert_eq!(normals, [P[4].normalize(), P[2], P[3].normalize()]);
}
