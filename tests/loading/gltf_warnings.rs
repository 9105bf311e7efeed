//! Announcements of a glTF file that the scene does not hold: each kind is counted, with its number and its first place.

use serde_json::{Value, json};

use crate::hostile_gltf::{load, refusal, triangle, with};

/// A sound triangle with a material and a texture that is never read, and one value replaced or added.
fn changed(pointer: &str, value: Value) -> Value {
    with(pointer, value)
}

#[test]
fn each_kind_is_counted_with_its_first_place() {
    let texture = |texture: Value| {
        let mut document = changed("/textures", json!([texture]));
        document["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
        document
    };
    let attribute = |name: &str, accessor: Value| {
        let mut document = triangle();
        document["accessors"].as_array_mut().unwrap().push(accessor);
        document["meshes"][0]["primitives"][0]["attributes"][name] = json!(2);
        document
    };
    let floats = |count: u32, shape: &str| json!({"componentType": 5126, "count": count, "type": shape});
    let mut left_over = changed("/accessors/1/count", json!(5));
    left_over["bufferViews"][1] = json!({"buffer": 0, "byteOffset": 32, "byteLength": 10});
    let mut fan = triangle();
    let primitives = fan.pointer_mut("/meshes/0/primitives").unwrap().as_array_mut().unwrap();
    primitives.push(json!({"attributes": {"POSITION": 2}, "mode": 6}));
    fan["accessors"].as_array_mut().unwrap().push(floats(2, "VEC3"));
    let mut scenes = triangle();
    scenes["scenes"] = json!([{"nodes": []}, {"nodes": [0]}, {}]);
    scenes["scene"] = json!(1);
    let mut nodes = changed("/nodes", json!([{"mesh": 0, "children": [1]}, {"mesh": 99}, {"mesh": 0}]));
    nodes["scenes"][0]["nodes"] = json!([0, 7]);
    let mut second = triangle();
    let primitives = second.pointer_mut("/meshes/0/primitives").unwrap().as_array_mut().unwrap();
    primitives.push(json!({"attributes": {"POSITION": 9}}));
    let mut instances = triangle();
    let copies = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0, "SCALE": 1, "ROTATION": 44}}});
    instances["nodes"].as_array_mut().unwrap()[0]["extensions"] = copies;
    let cases: Vec<(Value, u64, &str, &str)> = vec![
        (left_over, 2, "indices left over after the last triangle", "meshes[0].primitives[0].indices: 5 of them"),
        (fan, 2, "indices left over after the last triangle", "meshes[0].primitives[1].attributes.POSITION: 2 of them"),
        (
            changed("/scene", json!(7)),
            1,
            "scenes out of range replaced",
            "scene: scenes[7] does not exist, there are 1",
        ),
        (scenes, 2, "scenes other than the default one not shown", "scenes[0]"),
        (nodes.clone(), 1, "nodes of a mesh", "nodes[1].mesh: meshes[99] does not exist, there are 1"),
        (nodes.clone(), 1, "nodes out of range left out", "scenes[0].nodes[1]: nodes[7] does not exist, there are 3"),
        (nodes, 1, "nodes with a mesh outside the scene left out", "nodes[2]"),
        (
            changed("/nodes/0/children", json!([5, 6])),
            2,
            "nodes out of range left out",
            "nodes[0].children[0]: nodes[5]",
        ),
        (
            second,
            1,
            "primitives left out: something named that does not exist",
            "meshes[0].primitives[1].attributes.POSITION: accessors[9]",
        ),
        (
            changed("/meshes/0/primitives/0/material", json!(3)),
            1,
            "primitives whose material does not exist",
            "meshes[0].primitives[0].material: materials[3] does not exist, there are 0",
        ),
        (
            attribute("NORMAL", floats(2, "VEC3")),
            1,
            "without normals: fewer than vertices",
            "meshes[0].primitives[0].attributes.NORMAL: accessors[2]: 2 for 3",
        ),
        (
            attribute("NORMAL", floats(4, "VEC3")),
            1,
            "primitives with more normals than vertices",
            "meshes[0].primitives[0].attributes.NORMAL",
        ),
        (
            attribute("NORMAL", floats(3, "VEC2")),
            1,
            "without normals: numbers of a wrong type",
            "meshes[0].primitives[0].attributes.NORMAL",
        ),
        (
            attribute("TEXCOORD_0", floats(3, "VEC3")),
            1,
            "without texture coordinates: numbers",
            "meshes[0].primitives[0].attributes.TEXCOORD_0",
        ),
        (
            attribute("COLOR_0", floats(1, "VEC3")),
            1,
            "without colours: fewer",
            "meshes[0].primitives[0].attributes.COLOR_0",
        ),
        (
            attribute("COLOUR", floats(3, "VEC3")),
            1,
            "attributes of unknown names",
            "meshes[0].primitives[0].attributes: 'COLOUR'",
        ),
        (
            texture(json!({"source": 4})),
            1,
            "textures without an image",
            "textures[0].source: images[4] does not exist, there are 0",
        ),
        (texture(json!({})), 1, "textures without an image", "textures[0]: it has no source"),
        (
            texture(json!({"extensions": {"EXT_texture_webp": {"source": 4}}})),
            1,
            "textures without an image",
            "textures[0].extensions.EXT_texture_webp.source: images[4] does not exist, there are 0",
        ),
        (
            texture(json!({"extensions": {"KHR_texture_basisu": {"source": 0}}})),
            1,
            "textures without an image",
            "textures[0]: it is a KTX2 file; convert them with 'gltf-transform ktxdecompress",
        ),
        (
            changed("/materials", json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 8}}}])),
            1,
            "materials shown without a texture that does not exist",
            "materials[0].pbrMetallicRoughness.baseColorTexture.index: textures[8] does not exist, there are 0",
        ),
        (
            changed("/materials", json!([{"alphaMode": "BLEND"}, {"alphaMode": "BLEND"}])),
            2,
            "materials with transparency",
            "materials[0].alphaMode",
        ),
        (
            changed("/materials", json!([{"emissiveTexture": {"index": 0}}, {"normalTexture": {"index": 3}}])),
            2,
            "materials shown without a texture that does not exist",
            "materials[0].emissiveTexture.index: textures[0] does not exist, there are 0",
        ),
        (changed("/animations", json!([{}, {}, {}])), 3, "clips without keys for the scene left out", "animations[0]"),
        (changed("/cameras", json!([{}])), 1, "cameras without a view or a place in the scene left out", "cameras[0]"),
        (
            changed(
                "/materials",
                json!([{"extensions": {"KHR_materials_transmission": {"transmissionTexture": {"index": 0}}}}]),
            ),
            1,
            "materials shown as glass everywhere instead of by their texture",
            "materials[0].extensions.KHR_materials_transmission.transmissionTexture",
        ),
        (
            changed("/nodes/0/camera", json!(3)),
            1,
            "nodes with a camera that does not exist",
            "nodes[0].camera: cameras[3]",
        ),
        (
            changed("/extensions", json!({"KHR_lights_punctual": {"lights": [{}, {}]}})),
            2,
            "lights of an unknown type left out",
            "extensions.KHR_lights_punctual.lights[0].type: unknown type null",
        ),
        (
            changed("/extensions", json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}})),
            1,
            "lights without a place in the scene left out",
            "extensions.KHR_lights_punctual.lights[0]",
        ),
        (
            changed("/nodes/0/extensions", json!({"KHR_lights_punctual": {"light": 2}})),
            1,
            "nodes with a light that does not exist",
            "nodes[0].extensions.KHR_lights_punctual.light: lights[2] does not exist, there are 0",
        ),
        (changed("/nodes/0/skin", json!(0)), 1, "meshes with a skeleton", "nodes[0].skin"),
        (
            changed("/meshes/0/primitives/0/targets", json!([{"POSITION": 9}])),
            1,
            "morph targets left out: something named that does not exist",
            "meshes[0].primitives[0].targets[0].POSITION: accessors[9]",
        ),
        (
            changed("/meshes/0/primitives/0/targets", json!([{"NORMAL": 1}])),
            1,
            "morph targets left out: numbers of a wrong type",
            "meshes[0].primitives[0].targets[0].NORMAL: accessors[1]",
        ),
        (changed("/asset/version", json!("2.1")), 1, "versions other than 2.0", "asset.version: '2.1'"),
        (changed("/buffers/0/byteLength", json!(50)), 1, "buffers shorter than declared", "buffers[0]: 42 of 50 bytes"),
        (
            instances.clone(),
            1,
            "lists of instances left out: something",
            "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes.ROTATION: accessors[44]",
        ),
        (
            instances,
            1,
            "lists of instances left out: numbers",
            "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes.SCALE: accessors[1]",
        ),
    ];
    for (document, count, what, first) in cases {
        let scene = load(&document).unwrap_or_else(|error| panic!("{what}: {error}"));
        let found = scene.warnings.entries.iter().find(|warning| warning.what.contains(what));
        let found = found.unwrap_or_else(|| panic!("{what}: {:?}", scene.warnings));
        assert_eq!(found.count, count, "{found}");
        assert!(found.to_string().contains(&format!("(first at {first}")), "{found}");
    }
    assert!(load(&triangle()).unwrap().warnings.is_empty());
}

#[test]
fn indices_of_more_than_32_bits_do_not_wrap() {
    let wrapped = json!(1_u64 << 32);
    for pointer in [
        "/nodes/0/mesh",
        "/scenes/0/nodes/0",
        "/meshes/0/primitives/0/attributes/POSITION",
        "/meshes/0/primitives/0/indices",
        "/accessors/0/bufferView",
        "/bufferViews/0/buffer",
    ] {
        let message = refusal(&with(pointer, wrapped.clone()));
        assert!(message.contains("[4294967296] does not exist"), "{pointer}: {message}");
    }
    let mut children = with("/nodes/0/children", json!([1_u64 << 32]));
    children["scene"] = wrapped.clone();
    children["meshes"][0]["primitives"][0]["material"] = wrapped.clone();
    let shown = format!("{:?}", load(&children).unwrap().warnings);
    for name in ["nodes", "scenes", "materials"] {
        assert!(shown.contains(&format!("{name}[4294967296] does not exist")), "{name}: {shown}");
    }
    let mut texture = with("/textures", json!([{"source": 1_u64 << 32}]));
    texture["images"] = json!([{"uri": "data:,"}]);
    texture["materials"] = json!([
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 1_u64 << 32}}}
    ]);
    let shown = format!("{:?}", load(&texture).unwrap().warnings);
    assert!(shown.contains("images[4294967296]") && shown.contains("textures[4294967296]"), "{shown}");
}

#[test]
fn whole_numbers_may_be_written_as_floats() {
    let text = triangle().to_string().replace("\"count\":3", "\"count\":3.0").replace(":36", ":3.6e1");
    assert!(text.contains("3.0") && text.contains("3.6e1"));
    let path = std::path::Path::new("/nonexistent/a.gltf");
    let options = bvhscope::scene::LoadOptions::default();
    let scene = bvhscope::scene::load_bytes(path, text.as_bytes(), &options, &Default::default()).unwrap();
    assert_eq!((scene.triangles.len(), scene.warnings.is_empty()), (1, true));
}

#[test]
fn refusals_name_place_found_and_expected() {
    for (pointer, value, message) in [
        ("/accessors/0/count", json!(-1), "accessors[0].count: is -1 instead of a whole number of at least 0; export"),
        (
            "/accessors/0/count",
            json!(1.5),
            "accessors[0].count: is 1.5 instead of a whole number of at least 0; export",
        ),
        ("/nodes/0", json!([1, 2]), "nodes[0]: is a list instead of an object; export"),
        ("/nodes/0/scale", json!([1, 2]), "nodes[0].scale: has 2 numbers instead of 3; export"),
        (
            "/nodes/0/mesh",
            json!("one"),
            "nodes[0].mesh: is the text 'one' instead of a whole number of at least 0; export",
        ),
        (
            "/asset/version",
            json!("1.0"),
            "asset.version: is '1.0', only glTF 2.0 is read; convert it with 'gltf-pipeline",
        ),
        ("/asset/version", json!("3.0"), "asset.version: is '3.0', only glTF 2.0 is read; export"),
        ("/asset/minVersion", json!("3.0"), "asset.minVersion: is '3.0': a reader of at least that version is needed"),
        (
            "/extensionsRequired",
            json!(["KHR_texture_basisu"]),
            "extensionsRequired[0]: the extension 'KHR_texture_basisu' is required but not supported: KTX2 textures; convert",
        ),
    ] {
        let found = refusal(&with(pointer, value));
        assert!(found.contains(message), "{message}: {found}");
    }
    // In version 1.0 lists are objects: the version is what counts.
    let mut old = triangle();
    old["asset"]["version"] = json!(1.0);
    old["meshes"] = json!({"one": {}});
    assert!(refusal(&old).contains("asset.version: is '1.0', only glTF 2.0 is read"));
}

/// Billions of copies are refused before the first is made.
#[test]
fn too_many_copies_are_refused_by_their_number() {
    let mut document = triangle();
    document["accessors"]
        .as_array_mut()
        .unwrap()
        .push(json!({"componentType": 5126, "count": 4_000_000_000_u64, "type": "VEC3"}));
    document["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}});
    let message = refusal(&document);
    assert!(message.contains("the copies would need about 1"), "{message}");
}
