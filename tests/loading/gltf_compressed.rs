//! glTF data compressed by Draco and meshopt: sound, damaged, and with counts that lie.

use bvhscope::scene::{LoadError, LoadOptions, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use serde_json::{Value, json};

use crate::hostile_gltf::{load, triangle};
use crate::random::Random;
use crate::support::models;

fn uri(bytes: &[u8]) -> String {
    let text: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    format!("data:,{text}")
}

/// Indices 0, 1, 2 by the codec of indices: a header, each as the difference from the one before, and a tail of four bytes.
const PACKED: [u8; 8] = [0xd1, 0, 4, 4, 0, 0, 0, 0];

/// A triangle whose indices are compressed by meshopt; the uncompressed buffer has no data.
fn packed(bytes: &[u8]) -> Value {
    let mut document = triangle();
    let buffers = document["buffers"].as_array_mut().unwrap();
    buffers.push(json!({"byteLength": bytes.len(), "uri": uri(bytes)}));
    buffers.push(json!({"byteLength": 6, "extensions": {"EXT_meshopt_compression": {"fallback": true}}}));
    document["bufferViews"][1] = json!({"buffer": 2, "byteLength": 6, "extensions": {"EXT_meshopt_compression": {
        "buffer": 1, "byteLength": bytes.len(), "byteStride": 2, "count": 3, "mode": "INDICES"
    }}});
    document["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    document
}

#[test]
fn meshopt_data_are_read_or_the_primitive_is_left_out() {
    let scene = load(&packed(&PACKED)).unwrap();
    assert_eq!((scene.triangles[0].b, scene.warnings.is_empty()), (glam::Vec3::X, true), "{:?}", scene.warnings);
    for length in 0..PACKED.len() {
        let message = load(&packed(&PACKED[..length])).unwrap_err().to_string();
        assert!(message.contains("compressed by meshopt"), "{length} bytes: {message}");
    }
    for (field, value) in [
        ("count", json!(1_u64 << 40)),
        ("count", json!(u64::MAX)),
        ("count", json!(2)),
        ("count", json!(-1)),
        ("byteStride", json!(0)),
        ("byteStride", json!(3)),
        ("byteLength", json!(1 << 20)),
        ("byteOffset", json!(u64::MAX)),
        ("buffer", json!(77)),
        ("buffer", json!("one")),
        ("mode", json!("TRIANGLES")),
        ("mode", json!("ATTRIBUTES")),
        ("mode", json!("HAIR")),
        ("filter", json!("OCTAHEDRAL")),
        ("filter", json!(7)),
    ] {
        let mut document = packed(&PACKED);
        document["bufferViews"][1]["extensions"]["EXT_meshopt_compression"][field] = value.clone();
        let result = load(&document);
        assert!(result.is_err() || field == "filter" && value == 7, "{field} = {value}");
    }
}

/// A compressed model, with its binary file changed.
fn compressed(folder: &str, name: &str, change: impl FnOnce(&mut Vec<u8>)) -> Option<Result<Scene, LoadError>> {
    let path = models()?.join("gltf").join(folder).join(name);
    let mut bytes = std::fs::read(&path).unwrap();
    if name.ends_with(".glb") {
        change(&mut bytes);
    } else {
        let mut document: Value = serde_json::from_slice(&bytes).unwrap();
        let mut binary = std::fs::read(path.with_file_name(document["buffers"][0]["uri"].as_str().unwrap())).unwrap();
        change(&mut binary);
        document["buffers"][0]["uri"] = json!(uri(&binary));
        bytes = document.to_string().into_bytes();
    }
    Some(load_bytes(&path, &bytes, &LoadOptions::default(), &CancelToken::new()))
}

#[test]
fn damaged_compressed_models_do_not_end_the_process() {
    let mut random = Random(0xD8AC0);
    for (folder, name) in [("Duck-Draco", "Duck.gltf"), ("pirate-meshopt", "pirate.glb")] {
        for round in 0..40 {
            let change = |bytes: &mut Vec<u8>| {
                // The JSON of a GLB file is left alone.
                let start = if name.ends_with(".glb") { bytes.len() / 5 } else { 0 };
                for _ in 0..1 + random.below(4) {
                    let at = start + random.below(bytes.len() - start);
                    bytes[at] = random.next() as u8;
                }
                if round % 8 == 7 && start == 0 {
                    bytes.truncate(random.below(bytes.len()));
                }
            };
            let Some(result) = compressed(folder, name, change) else { return };
            if let Ok(scene) = result {
                crate::entry_points::check(&scene);
            }
        }
    }
}

/// The number of triangles in the JSON bounds the work, whatever the compressed data hold.
#[test]
fn draco_data_with_more_triangles_than_declared_are_refused() {
    let Some(folder) = models() else { return };
    let folder = folder.join("gltf/Duck-Draco");
    let text = std::fs::read_to_string(folder.join("Duck.gltf")).unwrap();
    let mut document: Value = serde_json::from_str(&text).unwrap();
    let indices = document["meshes"][0]["primitives"][0]["indices"].as_u64().unwrap() as usize;
    for count in [3, 12_633, 12_639, 1_u64 << 40] {
        document["accessors"][indices]["count"] = json!(count);
        let result = load_bytes(
            &folder.join("Duck.gltf"),
            document.to_string().as_bytes(),
            &LoadOptions::default(),
            &CancelToken::new(),
        );
        assert!(result.is_err(), "{count}");
    }
}

/// A texture in WebP, sound, cut at every byte and changed at random: the model loads in any case, with a warning where the picture
/// is lost.
#[test]
fn damaged_webp_textures_leave_the_model() {
    let mut webp = std::io::Cursor::new(Vec::new());
    let texel = |x: u32, y: u32| image::Rgba([(x * 16) as u8, (y * 16) as u8, (x * y) as u8, 255]);
    image::RgbaImage::from_fn(16, 16, texel).write_to(&mut webp, image::ImageFormat::WebP).unwrap();
    let sound = webp.into_inner();
    let with = |bytes: &[u8]| {
        let mut document = triangle();
        document["images"] = json!([{"uri": uri(bytes), "mimeType": "image/webp"}]);
        document["textures"] = json!([{"extensions": {"EXT_texture_webp": {"source": 0}}}]);
        document["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
        document["meshes"][0]["primitives"][0]["material"] = json!(0);
        let scene = load(&document).unwrap();
        crate::entry_points::check(&scene);
        // The other warning is about the missing coordinates of the texture.
        (scene.textures.len(), scene.warnings.entries.iter().any(|warning| warning.what.starts_with("images left out")))
    };
    assert_eq!(with(&sound), (1, false));
    for length in 0..sound.len() - 1 {
        let (textures, warned) = with(&sound[..length]);
        assert!(textures == 1 || warned, "{length} of {} bytes pass silently", sound.len());
    }
    let mut random = Random(0x3EB9);
    for _ in 0..60 {
        let mut bytes = sound.clone();
        for _ in 0..1 + random.below(4) {
            let at = random.below(bytes.len());
            bytes[at] = random.next() as u8;
        }
        let (textures, warned) = with(&bytes);
        assert!(textures == 1 || warned, "{bytes:?} passes silently");
    }
}
