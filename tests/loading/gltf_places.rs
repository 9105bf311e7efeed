//! Where glTF models stand and what of them is there: coordinates far from the origin, skins, holes, and buffers by odd names.

use bvhscope::scene::{LoadOptions, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use glam::{DVec3, Vec3};
use serde_json::{Value, json};

use crate::hostile_gltf::{load, triangle};

pub fn uri(bytes: &[u8]) -> String {
    let text: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    format!("data:application/octet-stream,{text}")
}

/// Adds an accessor with a buffer of its own, and returns its index.
pub fn add(document: &mut Value, code: u32, shape: &str, normalized: bool, count: usize, bytes: &[u8]) -> usize {
    let push = |document: &mut Value, list: &str, entry: Value| {
        let entries = document[list].as_array_mut().unwrap();
        entries.push(entry);
        entries.len() - 1
    };
    let buffer = push(document, "buffers", json!({"byteLength": bytes.len(), "uri": uri(bytes)}));
    let view = push(document, "bufferViews", json!({"buffer": buffer, "byteLength": bytes.len()}));
    let accessor =
        json!({"bufferView": view, "componentType": code, "count": count, "type": shape, "normalized": normalized});
    push(document, "accessors", accessor)
}

/// An image of one texel: the normal of the surface.
pub fn png() -> Vec<u8> {
    let mut png = std::io::Cursor::new(Vec::new());
    let texel = image::RgbaImage::from_pixel(1, 1, image::Rgba([128, 128, 255, 255]));
    texel.write_to(&mut png, image::ImageFormat::Png).unwrap();
    png.into_inner()
}

pub fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

pub fn corners(scene: &Scene) -> Vec<Vec3> {
    scene.triangles.iter().flat_map(|triangle| [triangle.a, triangle.b, triangle.c]).collect()
}

/// A wall as in a national grid, whose thickness single precision would round away.
#[test]
fn nodes_far_from_the_origin_keep_their_decimals() {
    let mut document = triangle();
    document["nodes"] = json!([
        {"children": [1, 2], "translation": [408201.58, 4080928.0, 0.0]},
        {"mesh": 0}, {"mesh": 0, "translation": [0.0, 0.1, 0.0]}
    ]);
    let scene = load(&document).unwrap();
    assert_eq!(scene.offset, DVec3::new(408_202.0, 4_080_928.0, 0.0));
    let [first, second] = [scene.triangles[0].a, scene.triangles[1].a].map(|corner| scene.in_file(corner));
    assert!((first - DVec3::new(408_201.58, 4_080_928.0, 0.0)).length() < 1e-7, "{first}");
    assert!((second - first - DVec3::new(0.0, 0.1, 0.0)).length() < 1e-7, "{second}");
    // Copies near the origin make the model so large that nothing is lost.
    document["scenes"][0]["nodes"] = json!([0, 3]);
    document["nodes"].as_array_mut().unwrap().push(json!({"mesh": 0}));
    assert_eq!(load(&document).unwrap().offset, DVec3::ZERO);
    // Decimals that the file's floats have lost do not come back.
    let mut coarse = triangle();
    coarse["buffers"][0]["uri"] =
        json!(crate::hostile_gltf::data(&[4e6, 4e6, 0.0, 4e6 + 1.0, 4e6, 0.0, 4e6, 4e6 + 1.0, 0.0], &[0, 1, 2]));
    assert_eq!(load(&coarse).unwrap().offset, DVec3::ZERO);
}

/// One joint that moves by 3 along y and one that stays, both below nodes of their own.
pub fn skinned(weights: [[f32; 4]; 3]) -> Value {
    let mut document = triangle();
    let joints = add(&mut document, 5121, "VEC4", false, 3, &[0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0]);
    let weights = add(&mut document, 5126, "VEC4", false, 3, &floats(weights.as_flattened()));
    // The second joint was bound where it moved by 1 along x.
    let bind: Vec<f32> = (0..2)
        .flat_map(|joint| {
            (0..16).map(move |k| {
                if k % 5 == 0 {
                    1.0
                } else if joint == 1 && k == 12 {
                    -1.0
                } else {
                    0.0
                }
            })
        })
        .collect();
    let bind = add(&mut document, 5126, "MAT4", false, 2, &floats(&bind));
    document["skins"] = json!([{"joints": [2, 3], "inverseBindMatrices": bind}]);
    document["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
    document["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
    document["nodes"] = json!([
        {"children": [1], "translation": [7.0, 0.0, 0.0]}, {"mesh": 0, "skin": 0, "scale": [100.0, 100.0, 100.0]},
        {"translation": [0.0, 3.0, 0.0]}, {"translation": [1.0, 0.0, 0.0]}
    ]);
    document["scenes"][0]["nodes"] = json!([0, 2, 3]);
    document
}

#[test]
fn skinned_meshes_stand_where_their_joints_are() {
    let first = [1.0, 0.0, 0.0, 0.0];
    let scene = load(&skinned([first, [0.5, 0.5, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]])).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    // (0, 0, 0) by the first joint, (1, 0, 0) by half of each, (0, 1, 0) by the second, which is where it was bound.
    assert_eq!(corners(&scene), [Vec3::new(0.0, 3.0, 0.0), Vec3::new(1.0, 1.5, 0.0), Vec3::new(0.0, 1.0, 0.0)]);
    // Weights that do not sum up to one are shares all the same.
    let scene = load(&skinned([[0.25, 0.25, 0.0, 0.0]; 3])).unwrap();
    assert_eq!(corners(&scene)[0], Vec3::new(0.0, 1.5, 0.0));
    // A joint that the scene does not show, or no joints: the mesh stands where its node is.
    let mut lost = skinned([first; 3]);
    lost["scenes"][0]["nodes"] = json!([0, 2]);
    let scene = load(&lost).unwrap();
    assert_eq!(corners(&scene)[1], Vec3::new(107.0, 0.0, 0.0));
    assert!(
        scene.warnings.entries[0].to_string().contains("joints outside the scene (first at skins[0])"),
        "{:?}",
        scene.warnings
    );
    lost["skins"][0]["joints"] = json!([2, 77]);
    let scene = load(&lost).unwrap();
    assert!(scene.warnings.entries[0].to_string().contains("skins[0].joints[1]: nodes[77]"), "{:?}", scene.warnings);
}

#[test]
fn opacities_of_material_and_vertices_decide_about_holes() {
    let mut document = triangle();
    let colors = add(&mut document, 5121, "VEC4", true, 3, &[255, 0, 0, 255, 255, 0, 0, 51, 255, 0, 0, 0]);
    document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    document["materials"] = json!([{"alphaMode": "MASK", "alphaCutoff": 0.25, "pbrMetallicRoughness": {"baseColorFactor": [1.0, 1.0, 1.0, 0.5]}}]);
    let scene = load(&document).unwrap();
    assert_eq!((scene.material(0).alpha, scene.material(0).alpha_cutoff), (0.5, 0.25));
    let attributes = scene.attributes.unwrap();
    let alphas = attributes.corners[0].map(|corner| attributes.alphas[corner as usize]);
    assert_eq!(alphas, [1.0, 0.2, 0.0]);
    // Nothing is kept of opacities that decide about nothing.
    document["materials"][0]["alphaMode"] = json!("OPAQUE");
    assert!(load(&document).unwrap().attributes.unwrap().alphas.is_empty());
}

#[test]
fn a_material_is_added_only_for_surfaces_without_one() {
    let mut document = triangle();
    document["materials"] = json!([{"pbrMetallicRoughness": {"metallicFactor": 1.0}}, {}]);
    let added = load(&document).unwrap();
    assert_eq!((added.materials.len(), added.material(0).metallic), (3, 0.0));
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    let own = load(&document).unwrap();
    assert_eq!((own.materials.len(), own.material(0).metallic), (2, 1.0));
}

#[test]
fn names_that_exporters_forget_to_encode_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = [floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]), vec![0, 0, 1, 0, 2, 0]].concat();
    for name in ["example 10%.bin", "a%20b.bin", "100%25.bin", "c d.bin"] {
        std::fs::write(folder.path().join(name), &bytes).unwrap();
    }
    let triangles = |uri: &str| {
        let mut document = triangle();
        document["buffers"][0]["uri"] = json!(uri);
        let path = folder.path().join("a.gltf");
        let scene = load_bytes(&path, document.to_string().as_bytes(), &LoadOptions::default(), &CancelToken::new());
        scene.map_or(0, |scene| scene.triangles.len())
    };
    for uri in ["example 10%.bin", "a%20b.bin", "100%25.bin", "c%20d.bin", "c d.bin"] {
        assert_eq!(triangles(uri), 1, "{uri}");
    }
    assert_eq!(triangles("e%20f.bin"), 0);
    let digits = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA";
    for kind in ["data:;base64,", "data:application/octet-stream;BASE64,", "DATA:; base64,", "Data:x;y=z; Base64 ,"] {
        assert_eq!(triangles(&format!("{kind}{digits}")), 1, "{kind}");
    }
}

/// Normals are turned by products of three numbers, which leave the range of single precision.
#[test]
fn normals_survive_any_scale() {
    for scale in [1e-30_f32, 1e-15, 1.0, 1e12] {
        let mut document = triangle();
        let normals = add(&mut document, 5126, "VEC3", false, 3, &floats(&[0.0, 0.0, 1.0].repeat(3)));
        document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
        document["nodes"][0]["scale"] = json!([scale, scale, 2.0 * scale]);
        let scene = load(&document).unwrap();
        assert_eq!(scene.bounds.max, Vec3::new(scale, scale, 0.0));
        assert_eq!(scene.attributes.unwrap().normals[1..], [Vec3::Z; 3], "{scale}");
    }
}

#[test]
fn any_scene_of_a_file_can_be_shown() {
    let mut document = triangle();
    document["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "translation": [5.0, 0.0, 0.0]}]);
    document["scenes"] = json!([{"nodes": [0]}, {"nodes": [1]}, {"nodes": [1, 0]}]);
    let loaded = |scene: Option<usize>| {
        let options = LoadOptions { scene, ..LoadOptions::default() };
        let path = std::path::Path::new("/nonexistent/a.gltf");
        load_bytes(path, document.to_string().as_bytes(), &options, &CancelToken::new()).unwrap()
    };
    for (scene, triangles, x) in
        [(None, 1, 0.0), (Some(0), 1, 0.0), (Some(1), 1, 5.0), (Some(2), 2, 5.0), (Some(3), 1, 0.0)]
    {
        let loaded = loaded(scene);
        assert_eq!((loaded.triangles.len(), loaded.triangles[0].a.x), (triangles, x), "{scene:?}");
        let is_missing = loaded.warnings.entries[0].to_string().contains("scene 3 does not exist, there are 3");
        assert_eq!(is_missing, scene == Some(3), "{:?}", loaded.warnings);
    }
}

#[test]
fn webp_textures_are_read() {
    let mut webp = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_pixel(2, 1, image::Rgba([255, 0, 51, 255]))
        .write_to(&mut webp, image::ImageFormat::WebP)
        .unwrap();
    let mut document = triangle();
    // The second image is for readers that know no WebP.
    document["images"] = json!([{"uri": uri(webp.get_ref()), "mimeType": "image/webp"}, {"uri": "none.png"}]);
    document["textures"] = json!([{"source": 1, "extensions": {"EXT_texture_webp": {"source": 0}}}]);
    document["extensionsRequired"] = json!(["EXT_texture_webp"]);
    document["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
    let scene = load(&document).unwrap();
    assert_eq!(scene.textures[0].texels[..], [[255, 0, 51, 255]; 2]);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    document["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = json!(9);
    let warnings = load(&document).unwrap().warnings;
    assert!(
        format!("{warnings:?}").contains("textures[0].extensions.EXT_texture_webp.source: images[9]"),
        "{warnings:?}"
    );
}

#[test]
fn cameras_stand_where_their_nodes_are() {
    let mut document = triangle();
    document["cameras"] = json!([
        {"type": "perspective", "name": "door", "perspective": {"yfov": 0.75, "znear": 0.1, "aspectRatio": 1.5}},
        {"type": "orthographic", "orthographic": {"xmag": 3.0, "ymag": 2.0, "znear": 0.0, "zfar": 9.0}}
    ]);
    document["nodes"] = json!([
        {"mesh": 0, "children": [1]},
        {"camera": 0, "translation": [0.0, 0.5, 4.0]},
        // Turned by 90° around y: -z becomes -x.
        {"camera": 1, "translation": [8.0, 0.0, 0.0], "rotation": [0.0, 0.5_f32.sqrt(), 0.0, 0.5_f32.sqrt()]},
        {"camera": 0}
    ]);
    document["scenes"][0]["nodes"] = json!([0, 2]);
    let scene = load(&document).unwrap();
    assert!(scene.warnings.is_empty() && scene.cameras.len() == 2, "{:?} {:?}", scene.cameras, scene.warnings);
    let [door, side] = [&scene.cameras[0], &scene.cameras[1]];
    let toward = |camera: &bvhscope::scene::FileCamera| (camera.target - camera.eye).normalize();
    assert_eq!(
        (door.name.as_str(), door.eye, door.fov_y, door.orthographic),
        ("door", Vec3::new(0.0, 0.5, 4.0), 0.75, false)
    );
    assert!((toward(door) - Vec3::NEG_Z).length() < 1e-6 && (toward(side) - Vec3::NEG_X).length() < 1e-6);
    let half = (side.target - side.eye).length() * (side.fov_y * 0.5).tan();
    assert!(side.orthographic && (half - 2.0).abs() < 1e-5 && (side.up - Vec3::Y).length() < 1e-6, "{side:?}");
    let choice = bvhscope::view::CameraChoice { of_file: Some(0), ..Default::default() };
    assert_eq!(choice.camera(&scene).eye, door.eye);
    // Without one, the view is as it was.
    assert_ne!(bvhscope::view::CameraChoice::default().camera(&scene).eye, door.eye);
}

#[test]
fn lights_stand_where_their_nodes_are() {
    let mut document = triangle();
    document["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "spot", "name": "lamp", "color": [1.0, 0.5, 0.0], "intensity": 40.0, "spot": {"outerConeAngle": 0.5}},
        {"type": "directional", "intensity": 3.0},
        {"type": "point", "intensity": 0.0}
    ]}});
    let carrying = |light: u64| json!({"KHR_lights_punctual": {"light": light}});
    document["nodes"] = json!([
        {"mesh": 0, "children": [1, 2, 3, 4]},
        {"translation": [0.25, 0.25, 4.0], "extensions": carrying(0)},
        // Turned by 90° around y: -z becomes -x.
        {"rotation": [0.0, 0.5_f32.sqrt(), 0.0, 0.5_f32.sqrt()], "extensions": carrying(1)},
        {"translation": [0.25, 0.25, -4.0], "extensions": carrying(0)},
        {"extensions": carrying(2)}
    ]);
    let scene = load(&document).unwrap();
    assert_eq!(scene.lights.len(), 3);
    assert!(format!("{:?}", scene.warnings).contains("lights without strength"), "{:?}", scene.warnings);
    let [lamp, sun, behind] = [0, 1, 2].map(|index| &scene.lights[index]);
    assert_eq!((lamp.name.as_str(), lamp.position), ("lamp", Some(Vec3::new(0.25, 0.25, 4.0))));
    assert!((lamp.direction - Vec3::NEG_Z).length() < 1e-6 && (sun.direction - Vec3::NEG_X).length() < 1e-6);
    assert!(sun.position.is_none() && (lamp.color.y / lamp.color.x - 0.5).abs() < 1e-6);
    let center = Vec3::new(0.25, 0.25, 0.0);
    assert!(lamp.at(center).2.x > 0.1 && behind.at(center).2 == Vec3::ZERO, "a cone shines along -z");
}

#[test]
fn tangents_are_read_where_a_map_of_normals_needs_them() {
    let mut document = triangle();
    // Mirrored along x, which mirrors the bitangent, too.
    document["nodes"][0]["scale"] = json!([-2.0, 1.0, 1.0]);
    let tangents = floats(&[0.6, 0.8, 0.0, 1.0, 0.6, 0.8, 0.0, 1.0, 0.6, 0.8, 0.0, -1.0]);
    let index = add(&mut document, 5126, "VEC4", false, 3, &tangents);
    let normals = add(&mut document, 5126, "VEC3", false, 3, &floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]));
    let uvs = add(&mut document, 5126, "VEC2", false, 3, &floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]));
    let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
    (attributes["TANGENT"], attributes["NORMAL"], attributes["TEXCOORD_0"]) =
        (json!(index), json!(normals), json!(uvs));
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    document["materials"] = json!([{}]);
    assert!(load(&document).unwrap().attributes.unwrap().tangents.is_empty());
    document["images"] = json!([{"uri": uri(&png())}]);
    document["textures"] = json!([{"source": 0}]);
    document["materials"] = json!([{"normalTexture": {"index": 0}}]);
    let scene = load(&document).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let attributes = scene.attributes.unwrap();
    let of_file = attributes.corners[0].map(|corner| attributes.tangents[corner as usize]);
    // A mirrored triangle has its corners in another order.
    for (tangent, sign) in of_file.into_iter().zip([-1.0, 1.0, -1.0]) {
        let expected = glam::Vec4::new(-1.2, 0.8, 0.0, 0.0).normalize() + glam::Vec4::W * sign;
        assert!((tangent - expected).length() < 1e-6, "{tangent}");
    }
}
