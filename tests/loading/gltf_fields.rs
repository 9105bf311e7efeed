//! Every number of a glTF document that has everything, replaced by numbers that it cannot be: the table of fields in the reader is
//! complete only if none of them reaches the crate `gltf`, which panics, and none passes silently.

use serde_json::{Value, json};

use crate::hostile_gltf::load;

/// A document with every field that holds an index, a count, a length or a code; all other numbers have decimals.
fn document() -> Value {
    let mut bytes: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    // Indices 0, 1, 2, a sparse index, padding, joints, and the weights 1, 0, 0, 0 of three vertices.
    bytes.extend([0, 1, 2, 1]);
    bytes.extend([0; 12]);
    bytes.extend((0..3).flat_map(|_| [255, 0, 0, 0]));
    // The inverse of a joint's transform: no motion.
    bytes.extend((0..16).flat_map(|k| if k % 5 == 0 { 1.0_f32 } else { 0.0 }.to_le_bytes()));
    // Times of two keys.
    bytes.extend([0.0_f32, 1.0].iter().flat_map(|x| x.to_le_bytes()));
    let image_start = bytes.len();
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_pixel(1, 1, image::Rgba([255; 4])).write_to(&mut png, image::ImageFormat::Png).unwrap();
    bytes.extend(png.get_ref());
    let image_length = bytes.len() - image_start;
    let text: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    let map = |set: u32| json!({"index": 0, "texCoord": set});
    let moved = |set: u32| json!({"index": 0, "extensions": {"KHR_texture_transform": {"texCoord": set}}});
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 2, 3]}],
        "nodes": [
            {"mesh": 0, "children": [1]}, {"mesh": 0, "skin": 0, "camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}, {"translation": [0.5, 0.5, 0.5]},
            {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0, "ROTATION": 7, "SCALE": 0}}}}
        ],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 2.5}]}},
        "cameras": [{"name": "front", "perspective": {"yfov": 0.8}}],
        "skins": [{"inverseBindMatrices": 6, "joints": [2]}],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0, "NORMAL": 2, "TANGENT": 5, "TEXCOORD_0": 3, "TEXCOORD_1": 3, "JOINTS_0": 4, "WEIGHTS_0": 5},
            "indices": 1, "material": 0, "mode": 4, "targets": [{"POSITION": 2, "NORMAL": 2}]
        }]}],
        "animations": [{
            "channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}],
            "samplers": [{"input": 8, "output": 9}]
        }],
        "accessors": [
            {"bufferView": 0, "byteOffset": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "byteOffset": 0, "componentType": 5121, "count": 3, "type": "SCALAR", "sparse": {
                "count": 1, "indices": {"bufferView": 2, "byteOffset": 0, "componentType": 5121},
                "values": {"bufferView": 2, "byteOffset": 0}
            }},
            {"componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 0, "byteOffset": 0, "componentType": 5126, "count": 3, "type": "VEC2"},
            {"bufferView": 3, "byteOffset": 0, "componentType": 5121, "count": 3, "type": "VEC4"},
            {"bufferView": 4, "byteOffset": 0, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC4"},
            {"bufferView": 5, "byteOffset": 0, "componentType": 5126, "count": 1, "type": "MAT4"},
            {"bufferView": 5, "byteOffset": 0, "componentType": 5126, "count": 3, "type": "VEC4"},
            {"bufferView": 6, "byteOffset": 0, "componentType": 5126, "count": 2, "type": "SCALAR"},
            {"bufferView": 0, "byteOffset": 0, "componentType": 5126, "count": 2, "type": "VEC3"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36, "byteStride": 12},
            {"buffer": 0, "byteOffset": 36, "byteLength": 3},
            {"buffer": 0, "byteOffset": 39, "byteLength": 1},
            {"buffer": 0, "byteOffset": 40, "byteLength": 12},
            {"buffer": 0, "byteOffset": 52, "byteLength": 12},
            {"buffer": 0, "byteOffset": 64, "byteLength": 64},
            {"buffer": 0, "byteOffset": 128, "byteLength": 8},
            {"buffer": 0, "byteOffset": image_start, "byteLength": image_length}
        ],
        "buffers": [{"byteLength": bytes.len(), "uri": format!("data:,{text}")}],
        "materials": [{
            "pbrMetallicRoughness": {"baseColorTexture": map(0), "metallicRoughnessTexture": moved(0)},
            "normalTexture": moved(0), "occlusionTexture": map(1), "emissiveTexture": moved(1)
        }],
        "textures": [{"source": 0, "sampler": 0, "extensions": {"EXT_texture_webp": {"source": 0}}}],
        "samplers": [{"wrapS": 10497, "wrapT": 33071}],
        "images": [{"bufferView": 7}]
    })
}

/// The pointers to all whole numbers below `value`.
fn whole_numbers(value: &Value, pointer: &str, found: &mut Vec<String>) {
    match value {
        Value::Number(number) if number.is_u64() => found.push(pointer.to_owned()),
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(k, item)| whole_numbers(item, &format!("{pointer}/{k}"), found));
        }
        Value::Object(fields) => {
            fields.iter().for_each(|(name, field)| whole_numbers(field, &format!("{pointer}/{name}"), found));
        }
        _ => {}
    }
}

#[test]
fn no_whole_number_of_a_document_is_trusted() {
    let sound = document();
    let scene = load(&sound).unwrap();
    assert!(scene.warnings.is_empty() && scene.triangles.len() == 5, "{:?}", scene.warnings);
    let mut pointers = Vec::new();
    whole_numbers(&sound, "", &mut pointers);
    assert!(pointers.len() > 105, "{pointers:?}");
    for pointer in pointers {
        let with = |value: Value| {
            let mut document = sound.clone();
            *document.pointer_mut(&pointer).unwrap() = value;
            load(&document)
        };
        for wrong in [json!(-1), json!(0.5), json!("one"), json!([1]), json!({})] {
            match with(wrong.clone()) {
                // Channels that cannot be played are left out, each by itself.
                Ok(scene) if pointer.starts_with("/animations") => {
                    assert!(!scene.warnings.is_empty(), "{pointer} = {wrong} passes silently");
                }
                Ok(_) => panic!("{pointer} = {wrong} is taken"),
                Err(error) => {
                    let message = error.to_string();
                    let is_told = message.contains("instead of a whole number of at least 0");
                    assert!(is_told, "{pointer} = {wrong}: {message}");
                }
            }
        }
        for number in [0, 1, 2, 3, 4, 5, 7, 8, 100, u64::from(u32::MAX), 1 << 32] {
            let _ = with(json!(number));
        }
        let _ = with(json!(null));
        for huge in [1_u64 << 40, u64::MAX] {
            if let Ok(scene) = with(json!(huge)) {
                assert!(!scene.warnings.is_empty(), "{pointer} = {huge} passes silently");
            }
        }
    }
}
