//! Pictures of models in formats that other tests only take numbers from, compared with those in `tests/picture/golden`.

use std::io::Write as _;
use std::path::Path;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::render::{Frame, Light, RenderRequest, RenderSettings, render};
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::BuildSettings;
use serde_json::{Value, json};

use crate::golden_images::{HEIGHT, ONE_SAMPLE, SAMPLED, WIDTH, check};
use crate::support::models;

/// A picture from the first camera of the file, if it has one.
fn picture(path: &Path, light: Light, samples: u32) -> Frame {
    let token = CancelToken::new();
    let scene = Arc::new(load(&SceneSource::File(path.to_owned()), &LoadOptions::default(), &token).unwrap());
    assert!(scene.warnings.is_empty(), "{}: {:?}", path.display(), scene.warnings);
    let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &token).unwrap());
    let camera = CameraChoice { of_file: Some(0), ..CameraChoice::default() }.camera(&scene);
    let settings = RenderSettings { light, samples, ..RenderSettings::default() };
    render(&RenderRequest::new(&accel, camera, settings, [WIDTH, HEIGHT]), &token, &|_| {}).unwrap()
}

const PBRT: &str = r#"
Scale -1 1 1
LookAt 0 -6 3.2  0 0 0.9  0 0 1
Camera "perspective" "float fov" 36
WorldBegin
# A floor with a texture in WebP.
Texture "squares" "spectrum" "imagemap" "string filename" "squares.webp"
Material "diffuse" "texture reflectance" "squares"
Shape "trianglemesh" "point3 P" [-3 -3 0  3 -3 0  3 3 0  -3 3 0] "point2 uv" [0 0 1 0 1 1 0 1] "integer indices" [0 1 2 0 2 3]
MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [0.7 0.1 0.1]
NamedMaterial "red"
AttributeBegin
  Translate -1.5 0 0.8
  Shape "sphere" "float radius" 0.8
AttributeEnd
Material "conductor" "rgb reflectance" [0.9 0.7 0.3] "float roughness" 0.2
AttributeBegin
  Translate 0.3 1 0
  Shape "cylinder" "float radius" 0.5 "float zmin" 0 "float zmax" 1.8
  Shape "disk" "float radius" 0.5 "float height" 1.8
AttributeEnd
Material "diffuse" "rgb reflectance" [0.2 0.5 0.3]
ObjectBegin "pyramid"
  Shape "plymesh" "string filename" "pyramid.ply.gz"
ObjectEnd
AttributeBegin
  Translate 1.7 -0.5 0
  ObjectInstance "pyramid"
  Translate 0.2 -1.2 0
  Rotate 30 0 0 1
  Scale 0.5 0.5 0.5
  ObjectInstance "pyramid"
AttributeEnd
"#;

const PYRAMID: &str = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
    element face 5\nproperty list uchar int vertex_indices\nend_header\n\
    -0.7 -0.7 0\n0.7 -0.7 0\n0.7 0.7 0\n-0.7 0.7 0\n0 0 1.6\n4 3 2 1 0\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n";

#[test]
fn a_pbrt_scene_with_packed_meshes_and_webp() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let texel = |x: u32, y: u32| {
        image::Rgba(if (x / 2 + y / 2).is_multiple_of(2) { [230, 225, 210, 255] } else { [60, 80, 120, 255] })
    };
    image::RgbaImage::from_fn(12, 12, texel).save(path("squares.webp")).unwrap();
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packed.write_all(PYRAMID.as_bytes()).unwrap();
    std::fs::write(path("pyramid.ply.gz"), packed.finish().unwrap()).unwrap();
    std::fs::write(path("scene.pbrt"), PBRT).unwrap();
    check("format-pbrt", &picture(&path("scene.pbrt"), Light::Sun, 1), &ONE_SAMPLE);
}

/// A floor and a box below a spot light, a point light and a weak light from far away, with a camera.
fn stage() -> Value {
    let corners = |size: f32| -> Vec<f32> {
        (0..8).flat_map(|k| [0, 1, 2].map(|axis| if k >> axis & 1 == 0 { -size } else { size })).collect()
    };
    let floor: [f32; 12] = [-4.0, 0.0, 4.0, 4.0, 0.0, 4.0, 4.0, 0.0, -4.0, -4.0, 0.0, -4.0];
    let faces: [u8; 36] =
        [0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5];
    let mut bytes: Vec<u8> = floor.into_iter().chain(corners(0.7)).flat_map(f32::to_le_bytes).collect();
    bytes.extend([0, 1, 2, 0, 2, 3]);
    bytes.extend([0, 0]);
    bytes.extend(faces);
    let text: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    let floats =
        |view: u32, count: u32| json!({"bufferView": view, "componentType": 5126, "count": count, "type": "VEC3"});
    let indices =
        |view: u32, count: u32| json!({"bufferView": view, "componentType": 5121, "count": count, "type": "SCALAR"});
    let light = |index: u32| json!({"KHR_lights_punctual": {"light": index}});
    // Turned by −90° around x: -z becomes -y.
    let down = [-(0.5_f32.sqrt()), 0.0, 0.0, 0.5_f32.sqrt()];
    json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2, 3, 4, 5]}],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "spot", "intensity": 300.0, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.45}},
            {"type": "point", "intensity": 60.0, "color": [1.0, 0.4, 0.1]},
            {"type": "directional", "intensity": 4.0, "color": [0.3, 0.5, 1.0]}
        ]}},
        "nodes": [
            {"mesh": 0}, {"mesh": 1, "translation": [0.0, 0.7, 0.0], "rotation": [0.0, 0.3826834, 0.0, 0.9238795]},
            {"camera": 0, "translation": [0.0, 5.0, 9.0], "rotation": [-0.2249511, 0.0, 0.0, 0.9743701]},
            {"translation": [0.8, 6.0, 0.5], "rotation": down, "extensions": light(0)},
            {"translation": [-2.5, 1.5, 2.0], "extensions": light(1)},
            {"rotation": down, "extensions": light(2)}
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]},
            {"primitives": [{"attributes": {"POSITION": 2}, "indices": 3, "material": 0}]}
        ],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.6, 0.6, 1.0], "metallicFactor": 0.0}}],
        "accessors": [floats(0, 4), indices(2, 6), floats(1, 8), indices(3, 36)],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 96},
            {"buffer": 0, "byteOffset": 144, "byteLength": 6}, {"buffer": 0, "byteOffset": 152, "byteLength": 36}
        ],
        "buffers": [{"byteLength": bytes.len(), "uri": format!("data:,{text}")}]
    })
}

#[test]
fn the_lights_of_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stage.gltf");
    std::fs::write(&path, stage().to_string()).unwrap();
    check("format-gltf-lights", &picture(&path, Light::File, 16), &SAMPLED);
}

/// Quantised positions move edges by less than a pixel.
#[test]
fn a_model_compressed_by_draco_looks_like_its_twin() {
    let Some(folder) = models() else { return };
    let [plain, draco] = ["Duck-Embedded", "Duck-Draco"]
        .map(|twin| picture(&folder.join("gltf").join(twin).join("Duck.gltf"), Light::Sun, 1));
    let differs = |(a, b): (&[u8; 4], &[u8; 4])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 24);
    let different = plain.rgba.iter().zip(&draco.rgba).filter(|&pair| differs(pair)).count();
    assert!(
        plain.stats.hits > 300 && different < plain.stats.hits as usize / 50,
        "{different} of {}",
        plain.stats.hits
    );
}
