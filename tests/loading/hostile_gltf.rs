//! glTF and GLB files with one fault each: errors say where and why, and what can be loaded is loaded.

use std::path::Path;

use bvhscope::scene::{LoadError, LoadOptions, Scene, WrapMode, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use serde_json::{Value, json};

fn load_at(path: &Path, bytes: &[u8], allow_outside: bool) -> Result<Scene, LoadError> {
    load_bytes(path, bytes, &LoadOptions { allow_outside, ..LoadOptions::default() }, &CancelToken::new())
}

pub fn load(document: &Value) -> Result<Scene, LoadError> {
    load_at(Path::new("/nonexistent/a.gltf"), document.to_string().as_bytes(), false)
}

pub fn refusal(document: &Value) -> String {
    load(document).unwrap_err().to_string()
}

/// `data:` URI of floats followed by shorts.
pub fn data(floats: &[f32], shorts: &[u16]) -> String {
    let bytes = floats.iter().flat_map(|x| x.to_le_bytes()).chain(shorts.iter().flat_map(|x| x.to_le_bytes()));
    let text: String = bytes.map(|byte| format!("%{byte:02x}")).collect();
    format!("data:application/octet-stream,{text}")
}

/// One triangle at (0,0,0), (1,0,0), (0,1,0), with indices.
pub fn triangle() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 6}
        ],
        "buffers": [{"byteLength": 42, "uri": data(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &[0, 1, 2])}]
    })
}

/// The same document with one value replaced.
pub fn with(pointer: &str, value: Value) -> Value {
    let mut document = triangle();
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    match document.pointer_mut(parent).unwrap() {
        Value::Object(fields) => {
            fields.insert(key.to_owned(), value);
        }
        Value::Array(items) => items[key.parse::<usize>().unwrap()] = value,
        other => panic!("{other} has no {key}"),
    }
    document
}

#[test]
fn a_sound_triangle_loads_without_min_and_max() {
    let scene = load(&triangle()).unwrap();
    assert_eq!((scene.triangles.len(), scene.warnings.is_empty()), (1, true));
    assert_eq!(scene.bounds.max, glam::Vec3::new(1.0, 1.0, 0.0));
}

#[test]
fn false_counts_offsets_and_lengths_are_refused() {
    let cases = [
        (
            "/accessors/0/count",
            json!(1_u64 << 40),
            "accessors[0]: needs 1099511627776 elements, more than 32 bits can count",
        ),
        ("/accessors/0/count", json!(u64::MAX), "accessors[0]"),
        ("/accessors/0/count", json!(0), "accessors[0]: has no elements"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "accessors[0]: needs"),
        ("/accessors/0/byteOffset", json!(4), "bufferViews[0] has 36 bytes"),
        ("/accessors/0/bufferView", json!(9), "bufferViews[9] does not exist"),
        ("/accessors/0/componentType", json!(5127), "unknown componentType 5127"),
        ("/accessors/0/type", json!("MAT4"), "accessors[0]: has a type that no attribute has"),
        ("/accessors/0/type", json!("VEC9"), "accessors[0].type: unknown type 'VEC9'"),
        ("/accessors/0/type", json!("VEC2"), "POSITION has 2 components of 32 bits instead of 3 floats"),
        ("/accessors/1/componentType", json!(5126), "accessors[1]"),
        ("/accessors/1/type", json!("VEC3"), "accessors[1]"),
        ("/bufferViews/0/byteLength", json!(u64::MAX), "bufferViews[0] needs"),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), "bufferViews[0] needs"),
        ("/bufferViews/0/byteStride", json!(2), "elements of 12 bytes every 2 bytes"),
        ("/bufferViews/0/byteStride", json!(u64::MAX), "accessors[0]: needs"),
        ("/bufferViews/0/buffer", json!(7), "buffers[7] does not exist"),
        ("/buffers/0/uri", json!("data:;base64,####"), "base64"),
        ("/buffers/0/uri", json!("data:nothing"), "no comma"),
        ("/buffers/0/uri", json!("a%FF.bin"), "not UTF-8"),
        ("/buffers/0/uri", json!("a%"), "% sequence"),
        ("/buffers/0/uri", json!("a%00b"), "not a file name"),
        ("/buffers/0/uri", json!("https://example.com/a.bin"), "never uses the network"),
        ("/buffers/0/uri", json!("data:,"), "buffers[0] has 0"),
        ("/meshes/0/primitives/0/attributes", json!({}), "no POSITION"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(5), "accessors[5] does not exist"),
        ("/meshes/0/primitives/0/indices", json!(5), "accessors[5] does not exist"),
        ("/meshes/0/primitives/0/mode", json!(77), "mode: unknown mode 77"),
        ("/meshes/0/primitives/0/mode", json!(0), "points or lines"),
        ("/meshes/0/primitives", json!([]), "no triangles"),
        ("/meshes", json!([]), "no triangles"),
        ("/scenes/0/nodes", json!([]), "no triangles"),
        (
            "/scenes/0/nodes",
            json!([44]),
            "1 node out of range left out (first at scenes[0].nodes[0]: nodes[44] does not exist, there are 1)",
        ),
        ("/nodes/0/matrix", json!([1e39, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]), ""),
        (
            "/meshes",
            json!("no list"),
            "a.gltf: meshes: is the text 'no list' instead of a list; export the model again",
        ),
    ];
    for (pointer, value, part) in cases {
        let message = refusal(&with(pointer, value.clone()));
        assert!(message.contains("a.gltf") && message.contains(part), "{pointer} = {value}: {message}");
    }
    // Interleaved data may start at any byte.
    let scene = load(&with("/accessors/0/count", json!(1))).unwrap_err().to_string();
    assert!(scene.contains("does not exist skipped"), "indices beyond the only vertex: {scene}");
}

#[test]
fn base64_of_every_exporter_is_read() {
    // The corners (0, 0, 0), (1, 0, 0), (0, 1, 0) and the indices 0, 1, 2, whose last two digits depend on the padding.
    let plain = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA";
    let (lines, padded) = (plain.replace("AAAA", "AA\r\nAA"), format!("{plain}AA=="));
    for text in [plain, &lines, &padded, &padded.replace('=', "")] {
        let scene = load(&with("/buffers/0/uri", json!(format!("data:;base64,{text}")))).unwrap();
        assert_eq!(scene.triangles[0].b, glam::Vec3::X, "{text}");
    }
    // Three bytes 0xFF are "////", or "____" in the alphabet for URLs.
    for ones in ["////", "____"] {
        let uri = format!("data:;base64,{ones}{}", &plain[4..]);
        assert!(load(&with("/buffers/0/uri", json!(uri))).is_ok(), "{ones}");
    }
    for (text, part) in [("A", "damaged"), ("AA=AAA", "damaged"), ("AAAA", "bufferViews[0] needs")] {
        let message = refusal(&with("/buffers/0/uri", json!(format!("data:;base64,{text}"))));
        assert!(message.contains(part), "{text}: {message}");
    }
}

#[test]
fn a_bad_primitive_is_skipped_alone() {
    let mut document = triangle();
    let primitives = document.pointer_mut("/meshes/0/primitives").unwrap().as_array_mut().unwrap();
    primitives.insert(0, json!({"attributes": {"POSITION": 1}}));
    primitives.push(json!({"attributes": {"POSITION": 0}, "mode": 1}));
    let scene = load(&document).unwrap();
    assert_eq!(scene.triangles.len(), 1);
    let warnings: Vec<_> = scene.warnings.entries.iter().map(ToString::to_string).collect();
    assert!(
        warnings[0]
            .contains("(first at meshes[0].primitives[0]: POSITION has 1 components of 16 bits instead of 3 floats)"),
        "{warnings:?}"
    );
    assert!(warnings[1].contains("points or lines"), "{warnings:?}");
}

#[test]
fn a_huge_count_without_data_is_refused_before_it_is_filled() {
    let mut document = triangle();
    document["accessors"][0] = json!({"componentType": 5126, "count": 1_u64 << 40, "type": "VEC3"});
    let message = refusal(&document);
    assert!(message.contains("accessors[0]: needs 1099511627776 elements, more than 32 bits can count"), "{message}");
    // Of many vertices only those are read that have a triangle.
    document["accessors"][0]["count"] = json!(u32::MAX);
    assert_eq!(load(&document).unwrap().triangles.len(), 1);
    document["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    let message = refusal(&document);
    assert!(message.contains("contains 1431655765 triangles with all copies, more than 268435456"), "{message}");
    // Without data the accessor holds zeros, as the specification says: a triangle without area.
    document["accessors"][0]["count"] = json!(3);
    assert_eq!(load(&document).unwrap().triangles.len(), 1);
}

/// Each list begins an index later than the one before, so that together they have far more indices than the file has bytes.
#[test]
fn sparse_lists_that_overlap_do_not_cost_their_product() {
    let count = 201;
    let floats: Vec<f32> = (0..3 * count).map(|k| ((k * k) % 97) as f32).collect();
    let shorts: Vec<u16> = (0..count as u16).collect();
    let accessor = |first: usize| {
        let indices = json!({"bufferView": 1, "byteOffset": 2 * first, "componentType": 5123});
        let sparse = json!({"count": count - first, "indices": indices, "values": {"bufferView": 0}});
        json!({"componentType": 5126, "count": count, "type": "VEC3", "sparse": sparse})
    };
    let mut document = triangle();
    document["accessors"] = (0..count).map(accessor).collect();
    document["meshes"][0]["primitives"] = (0..count).map(|k| json!({"attributes": {"POSITION": k}})).collect();
    document["bufferViews"] = json!([
        {"buffer": 0, "byteLength": 12 * count},
        {"buffer": 0, "byteOffset": 12 * count, "byteLength": 2 * count}
    ]);
    document["buffers"] = json!([{"byteLength": 14 * count, "uri": data(&floats, &shorts)}]);
    let scene = load(&document).unwrap();
    let left_out = scene.warnings.entries.iter().find(|entry| entry.what.contains("their lists overlap")).unwrap();
    // Lists of 201, 200, 199 and so on indices are read until they have twice as many as the buffer has bytes.
    let loaded = (0..count)
        .scan(0, |sum, k| {
            *sum += count - k;
            Some(*sum)
        })
        .take_while(|&sum| sum <= 28 * count)
        .count();
    assert_eq!(left_out.count, (count - loaded) as u64, "{:?}", scene.warnings);
}

#[test]
fn sparse_accessors_are_checked_and_applied() {
    let sparse = |count: u64, indices: [u16; 2]| {
        let mut document = triangle();
        let bytes = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0];
        document["buffers"][0] = json!({"byteLength": 70, "uri": data(&bytes, &[0, 1, 2, indices[0], indices[1]])});
        document["bufferViews"] = json!([
            {"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 60, "byteLength": 6},
            {"buffer": 0, "byteOffset": 66, "byteLength": 4}, {"buffer": 0, "byteOffset": 36, "byteLength": 24}
        ]);
        document["accessors"][0]["sparse"] = json!({
            "count": count, "indices": {"bufferView": 2, "componentType": 5123}, "values": {"bufferView": 3}
        });
        document
    };
    let scene = load(&sparse(2, [1, 2])).unwrap();
    assert_eq!(scene.triangles[0].b, glam::Vec3::new(5.0, 6.0, 7.0));
    assert_eq!(scene.triangles[0].c, glam::Vec3::new(8.0, 9.0, 10.0));
    let mut blank = sparse(2, [1, 2]);
    blank["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert_eq!(load(&blank).unwrap().triangles[0].a, glam::Vec3::ZERO);
    for (document, part) in [
        (sparse(0, [1, 2]), "changes 0 of 3"),
        (sparse(4, [1, 2]), "changes 4 of 3"),
        (sparse(2, [2, 1]), "out of order"),
        (sparse(2, [1, 1]), "out of order"),
        (sparse(2, [1, 3]), "index 3"),
        (sparse(3, [0, 1]), "bufferViews[2] has 4 bytes"),
    ] {
        let message = refusal(&document);
        assert!(message.contains("accessors[0]: (sparse)") && message.contains(part), "{message}");
    }
}

#[test]
fn indices_beyond_the_vertices_are_skipped_and_counted() {
    let mut document = triangle();
    document["accessors"][1]["count"] = json!(6);
    document["bufferViews"][1]["byteLength"] = json!(12);
    document["buffers"][0] = json!({
        "byteLength": 48,
        "uri": data(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &[0, 1, 65_535, 0, 1, 2])
    });
    let scene = load(&document).unwrap();
    assert_eq!((scene.triangles.len(), scene.warnings.entries[0].count), (1, 1));
}

#[test]
fn loops_and_shared_nodes_are_refused_and_deep_chains_load() {
    for (nodes, part) in [
        (json!([{"children": [1]}, {"children": [0], "mesh": 0}]), "nodes[0] → nodes[1] → nodes[0] is a loop"),
        (json!([{"children": [0], "mesh": 0}]), "nodes[0] → nodes[0] is a loop"),
        (
            json!([{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {"mesh": 0}]),
            "nodes[3] has two parents, nodes[1] and nodes[2]",
        ),
        (json!([{"children": [1, 1]}, {"mesh": 0}]), "nodes[1] is named twice by nodes[0]"),
    ] {
        let mut document = with("/nodes", nodes);
        for _ in 0..2 {
            let message = refusal(&document).replace(": ", " ");
            assert!(message.contains(part), "{part}: {message}");
            // The loop must be found without scenes too.
            document.as_object_mut().unwrap().remove("scenes");
        }
    }
    let ring: Vec<_> = (1..=1000).map(|next| json!({"children": [next % 1000]})).collect();
    let message = refusal(&with("/nodes", json!(ring)));
    assert!(message.contains("nodes[3] → … → nodes[998] → nodes[999] → nodes[0] is a loop"), "{message}");
    let message = refusal(&with("/scenes/0/nodes", json!([0, 0])));
    assert!(message.contains("named twice by the scene"), "{message}");
    // Two references each, 28 levels: without the rule of one parent 2^28 paths.
    let diamonds: Vec<_> = (0..28).map(|level| json!({"children": [level + 1, level + 1]})).collect();
    assert!(refusal(&with("/nodes", json!(diamonds))).contains("named twice"));

    let length = 200_000;
    let mut nodes: Vec<_> = (1..length).map(|child| json!({"children": [child]})).collect();
    nodes.push(json!({"mesh": 0}));
    let document = with("/nodes", json!(nodes));
    let small_stack = std::thread::Builder::new().stack_size(256 << 10);
    let scene = small_stack.spawn(move || load(&document).map(|scene| scene.triangles.len())).unwrap();
    assert_eq!(scene.join().unwrap().unwrap(), 1);
}

#[test]
fn deeply_nested_json_does_not_end_the_process() {
    let nested = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    let text = triangle().to_string();
    for key in ["extras", "nodes", "unknown"] {
        let text = format!("{{\"{key}\":{nested},{}", &text[1..]);
        // It may be skipped or refused.
        let _ = load_at(Path::new("/nonexistent/a.gltf"), text.as_bytes(), false);
    }
}

/// The specification allows any type; most exporters write objects.
#[test]
fn extras_may_be_of_any_type() {
    for extras in [json!("text"), json!(3), json!([1, {"a": null}]), json!(null), json!(true), json!({"b": [2]})] {
        for place in ["/extras", "/asset/extras", "/nodes/0/extras", "/meshes/0/extras", "/accessors/0/extras"] {
            let (parent, key) = place.rsplit_once('/').unwrap();
            let mut document = triangle();
            document.pointer_mut(parent).unwrap()[key] = extras.clone();
            assert_eq!(load(&document).unwrap().triangles.len(), 1, "{place}: {extras}");
        }
    }
    let message = refusal(&with("/asset", json!("x".repeat(1 << 20))));
    assert!(message.contains("asset: is the text 'xxx") && message.len() < 1000, "{} bytes", message.len());
}

#[test]
fn nodes_out_of_range_are_skipped_and_mirrored_ones_keep_their_front() {
    let mut document = triangle();
    document["nodes"] = json!([
        {"mesh": 0, "scale": [-1, 1, 1]}, {"mesh": 0, "scale": [1, 1, 0]}, {"mesh": 0, "translation": [3e38, 0, 0], "scale": [1e38, 1, 1]}
    ]);
    document["scenes"][0]["nodes"] = json!([0, 1, 2]);
    let scene = load(&document).unwrap();
    // A mirrored triangle swaps two corners, so that its front stays the front.
    assert!(scene.triangles[0].scaled_normal().z > 0.0);
    assert_eq!(scene.triangles.len(), 2, "{:?}", scene.warnings);
    assert_eq!(scene.warnings.entries.len(), 1, "{:?}", scene.warnings);
}

#[test]
fn required_extensions_are_named_with_the_way_to_convert() {
    for name in ["KHR_texture_basisu", "EXT_texture_avif", "MADE_up"] {
        let message = refusal(&with("/extensionsRequired", json!([name])));
        assert!(message.contains(name) && message.contains("gltf-transform"), "{message}");
    }
    for name in ["KHR_mesh_quantization", "KHR_texture_transform", "KHR_materials_clearcoat", "KHR_materials_unlit"] {
        assert!(load(&with("/extensionsRequired", json!([name]))).is_ok(), "{name}");
    }
}

#[test]
fn quantized_positions_of_every_kind_are_read() {
    let quantized = |kind: u32, normalized: bool, bytes: &[u8], stride: usize| {
        let mut document = triangle();
        let text: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
        document["accessors"][0] = json!({
            "bufferView": 0, "componentType": kind, "normalized": normalized, "count": 3, "type": "VEC3"
        });
        document["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
        document["bufferViews"][0] = json!({"buffer": 0, "byteLength": bytes.len(), "byteStride": stride});
        document["buffers"][0] = json!({"byteLength": bytes.len(), "uri": format!("data:,{text}")});
        load(&document).unwrap().triangles[0]
    };
    let at = glam::Vec3::new;
    let bytes = [0, 0, 0, 9, 127, 0, 0, 9, 0, 129, 0];
    assert_eq!(quantized(5120, true, &bytes, 4).b, at(1.0, 0.0, 0.0));
    assert_eq!(quantized(5120, true, &bytes, 4).c, at(0.0, -1.0, 0.0));
    assert_eq!(quantized(5121, false, &bytes, 4).c, at(0.0, 129.0, 0.0));
    let shorts: Vec<u8> = [0_i16, 0, 0, 0, 32_767, 0, 0, 0, 0, -300, 0].iter().flat_map(|x| x.to_le_bytes()).collect();
    assert_eq!(quantized(5122, false, &shorts, 8).c, at(0.0, -300.0, 0.0));
    assert_eq!(quantized(5122, true, &shorts, 8).b, at(1.0, 0.0, 0.0));
    assert_eq!(quantized(5123, true, &shorts, 8).c, at(0.0, 65_236.0 / 65_535.0, 0.0));
}

#[test]
fn textures_keep_their_wrapping_and_transform() {
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_fn(2, 1, |x, _| image::Rgba([(255 * x) as u8, 0, 0, 255]))
        .write_to(&mut png, image::ImageFormat::Png)
        .unwrap();
    let text: String = png.get_ref().iter().map(|byte| format!("%{byte:02x}")).collect();
    let mut document = triangle();
    document["images"] = json!([{"uri": format!("data:image/png,{text}")}]);
    document["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648}]);
    document["textures"] = json!([{"source": 0, "sampler": 0}]);
    document["materials"] = json!([{
        "alphaMode": "MASK", "alphaCutoff": 0.25, "extensions": {"KHR_materials_unlit": {}},
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions":
            {"KHR_texture_transform": {"offset": [0.5, 0.0], "scale": [2.0, 1.0]}}}}
    }]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    let scene = load(&document).unwrap();
    let material = scene.material(0);
    assert!(material.unlit && material.alpha_cutoff == 0.25);
    let texture = &scene.textures[material.base_color_texture.unwrap() as usize];
    assert_eq!(texture.wrap, [WrapMode::ClampToEdge, WrapMode::MirroredRepeat]);
    let moved = texture.uv_transform.transform_point2(glam::Vec2::new(0.1, 0.3));
    assert!(moved.distance(glam::Vec2::new(0.7, 0.3)) < 1e-6, "{moved}");
    // Scaled by two and clamped, the last texel covers everything beyond one quarter.
    assert_eq!(texture.sample(glam::Vec2::new(0.9, 0.0)).x, 1.0);

    document["images"] = json!([{"uri": "missing.png"}]);
    let scene = load(&document).unwrap();
    assert!(scene.material(0).base_color_texture.is_none());
    assert!(scene.warnings.entries[0].to_string().contains("images[0]"), "{:?}", scene.warnings);
}

/// A GLB of these chunks, each with its kind. `length` is the excess of the length in the header over the true one.
fn glb(version: u32, extra: i64, chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, data) in chunks {
        body.extend((data.len() as u32).to_le_bytes());
        body.extend_from_slice(*kind);
        body.extend_from_slice(data);
    }
    let mut file = b"glTF".to_vec();
    file.extend(version.to_le_bytes());
    file.extend(((12 + body.len()) as i64 + extra).clamp(0, i64::from(u32::MAX)).to_le_bytes()[..4].to_vec());
    file.extend(body);
    file
}

#[test]
fn glb_headers_and_chunks_are_checked() {
    let mut document = triangle();
    let uri = document["buffers"][0].as_object_mut().unwrap().remove("uri").unwrap();
    let text = uri.as_str().unwrap().split_once(',').unwrap().1;
    let hex = text.split('%').skip(1).map(|digits| u8::from_str_radix(digits, 16).unwrap());
    let binary: Vec<u8> = hex.collect();
    let json = document.to_string().into_bytes();
    let (json, binary) = ((b"JSON", &json[..]), (b"BIN\0", &binary[..]));
    let load = |bytes: &[u8]| load_at(Path::new("/nonexistent/a.glb"), bytes, false);
    assert_eq!(load(&glb(2, 0, &[json, binary])).unwrap().triangles.len(), 1);
    let mut trailing = glb(2, 0, &[json, binary]);
    trailing.extend(b"trailing");
    assert_eq!(load(&trailing).unwrap().triangles.len(), 1);
    for (bytes, part) in [
        (glb(1, 0, &[json]), "version 1, only version 2 is read; convert it with 'gltf-pipeline"),
        (glb(2, 1 << 40, &[json]), "declares 4294967295 bytes"),
        (glb(2, -1_000_000, &[json]), "declares 0 bytes"),
        (glb(2, 5, &[json]), "declares"),
        (glb(2, 0, &[binary, json]), "first chunk is not JSON"),
        (glb(2, 0, &[json, json]), "second JSON chunk"),
        (glb(2, 0, &[(b"NOPE", b"1234")]), "first chunk is 'NOPE' instead of JSON"),
        (glb(2, 0, &[(b"JSON", b"{}")]), "asset.version: is missing, so this is not glTF 2.0"),
        (glb(2, 0, &[json]), "neither data nor a uri"),
        (b"glTF".to_vec(), "ends too early"),
        (b"glTF\x02\0\0\0".to_vec(), "ends too early"),
        (b"glTF\x02\0\0\0\x14\0\0\0\xff\xff\xff\xffJSON".to_vec(), "declares 4294967295 bytes, 0 follow"),
    ] {
        let message = load(&bytes).unwrap_err().to_string();
        assert!(message.contains(part), "{part}: {message}");
    }
    let complete = glb(2, 0, &[json, binary]);
    for length in 0..complete.len() {
        assert!(load(&complete[..length]).is_err(), "cut to {length} bytes");
    }
}

#[test]
fn files_outside_the_folder_are_read_only_when_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("inside");
    std::fs::create_dir(&inside).unwrap();
    let bytes: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let canary = folder.path().join("canary.bin");
    std::fs::write(&canary, &bytes).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(&canary, inside.join("link.bin")).unwrap();
    let mut document = triangle();
    document["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    let mut names = vec!["../canary.bin".to_owned(), "..%2Fcanary.bin".to_owned(), canary.display().to_string()];
    if cfg!(unix) {
        names.push("link.bin".to_owned());
    }
    for name in &names {
        document["buffers"][0] = json!({"byteLength": 36, "uri": name});
        let path = inside.join("a.gltf");
        let message = load_at(&path, document.to_string().as_bytes(), false).unwrap_err().to_string();
        assert!(message.contains("--allow-outside"), "{name}: {message}");
        assert_eq!(load_at(&path, document.to_string().as_bytes(), true).unwrap().triangles.len(), 1, "{name}");
    }
    for name in [format!("file://{}", canary.display()), "\\\\server\\share\\a.bin".into(), "C:\\a.bin".into()] {
        document["buffers"][0] = json!({"byteLength": 36, "uri": name});
        for allowed in [false, true] {
            assert!(load_at(&inside.join("a.gltf"), document.to_string().as_bytes(), allowed).is_err(), "{name}");
        }
    }
    std::fs::write(inside.join("short.bin"), &bytes[..20]).unwrap();
    document["buffers"][0] = json!({"byteLength": 36, "uri": "short.bin"});
    let message = load_at(&inside.join("a.gltf"), document.to_string().as_bytes(), false).unwrap_err().to_string();
    assert!(message.contains("20 of 36 bytes 'short.bin'"), "{message}");
}
