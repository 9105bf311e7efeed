//! Copies in files, flat and kept in two levels: the same triangles, corner by corner and bit by bit, in the same order.

use std::path::Path;
use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::scene::{Instancing, LoadError, LoadOptions, Moment, Scene, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Ray, Triangle};
use bvhscope_engine::settings::BuildSettings;
use glam::Vec3;
use serde_json::{Value, json};

use crate::gltf_places::{add, floats, skinned};
use crate::hostile_gltf::triangle;
use crate::random::Random;
use crate::sound_gltf::{Choices, generate};

fn read(name: &str, bytes: &[u8], instances: Instancing) -> Result<Scene, LoadError> {
    let options = LoadOptions { instances, ..LoadOptions::default() };
    load_bytes(Path::new(name), bytes, &options, &CancelToken::new())
}

/// A scene flat and in two levels, whose triangles are compared; `None` for a file without triangles.
fn both(name: &str, bytes: &[u8]) -> Option<[Scene; 2]> {
    let [flat, kept] = [Instancing::Flat, Instancing::TwoLevel].map(|instances| read(name, bytes, instances));
    let (flat, kept) = match (flat, kept) {
        (Ok(flat), Ok(kept)) => (flat, kept),
        (Err(flat), Err(kept)) => {
            assert_eq!(flat.to_string(), kept.to_string());
            return None;
        }
        (flat, kept) => panic!("{:?} {:?}", flat.err(), kept.err()),
    };
    compare(&flat, &kept);
    Some([flat, kept])
}

/// Compares a flat scene with one in two levels.
fn compare(flat: &Scene, kept: &Scene) {
    assert!(flat.copies.is_none() && kept.copies.is_some());
    assert_eq!(kept.triangle_count(), flat.triangles.len() as u64);
    assert_eq!((kept.bounds, kept.offset), (flat.bounds, flat.offset));
    let bits = |triangle: Triangle| {
        [triangle.a, triangle.b, triangle.c].map(|corner| (corner + 0.0).to_array().map(f32::to_bits))
    };
    for (index, triangle) in flat.triangles.iter().enumerate() {
        let index = index as u32;
        assert_eq!(
            bits(kept.triangle(index)),
            bits(*triangle),
            "triangle {index}: {:?} {triangle:?}",
            kept.triangle(index)
        );
        assert_eq!(kept.material(index).name, flat.material(index).name);
    }
}

#[test]
fn copies_of_gltf_have_the_triangles_of_the_flat_scene() {
    let (mut random, mut shared, mut singular) = (Random(20), 0, 0);
    for _ in 0..400 {
        let text = generate(&mut Choices::new(&mut || random.next()));
        let Some([_, kept]) = both("a.gltf", text.as_bytes()) else { continue };
        let copies = kept.copies.unwrap();
        let nodes = serde_json::from_str::<Value>(&text).unwrap()["nodes"].as_array().unwrap().len();
        shared += usize::from(copies.copies().len() > copies.mesh_count());
        // A mesh and its mirror image of each copy at most, and flattened by a node once more.
        singular += usize::from(copies.mesh_count() > copies.copies().len());
        assert!(copies.copies().len() <= nodes);
    }
    assert!(
        shared > 50 && singular > 5,
        "{shared} files with shared meshes, {singular} with copies that are flattened"
    );
}

#[test]
fn instances_of_a_node_are_copies() {
    let numbers = [3.0_f32, 0.0, 0.0, 0.0, 0.0, 4.0, 1e3, 1e4, 1e5];
    let moves: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    let hex: String = moves.iter().map(|byte| format!("%{byte:02x}")).collect();
    let uri = format!("data:application/octet-stream,{hex}");
    let mut document = triangle();
    document["buffers"].as_array_mut().unwrap().push(json!({"byteLength": moves.len(), "uri": uri}));
    document["bufferViews"].as_array_mut().unwrap().push(json!({"buffer": 1, "byteLength": moves.len()}));
    let list = json!({"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC3"});
    document["accessors"].as_array_mut().unwrap().push(list);
    document["nodes"] = json!([{"mesh": 0, "scale": [0.3, -0.7, 1.1], "rotation": [0.6, 0.0, 0.0, 0.8],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}}}]);
    let [_, kept] = both("a.gltf", document.to_string().as_bytes()).unwrap();
    let copies = kept.copies.unwrap();
    assert_eq!((copies.copies().len(), copies.mesh_count(), copies.triangles().len()), (3, 1, 1));
}

#[test]
fn copies_of_pbrt_have_the_triangles_of_the_flat_scene() {
    let mesh =
        "Shape \"trianglemesh\" \"point3 P\" [0.1 0.2 0 1 0 0.3 0 1 0 1 1.7 1] \"integer indices\" [0 1 2 1 3 2]\n";
    let moves =
        ["Translate 7 8 9 Rotate 33 1 2 3", "Scale -1 0.3 2 Rotate 70 3 2 1", "Scale 1 0 1", "Scale 0.001 1000 3"];
    let copies: String =
        moves.iter().map(|place| format!("AttributeBegin {place} ObjectInstance \"a\" AttributeEnd\n{mesh}")).collect();
    for around in ["", "Translate 408201.58 4080928.25 0.125\n", "Translate -408201.58 0 77\n"] {
        let object = format!("AttributeBegin {around}ObjectBegin \"a\"\n{mesh}{mesh}ObjectEnd AttributeEnd\n");
        for outside in ["", "Translate 4080928 0 408201\n"] {
            let text = format!("{object}{outside}{copies}");
            let [flat, kept] = both("a.pbrt", text.as_bytes()).unwrap();
            let copies = kept.copies.unwrap();
            // The object, its mirror image, the one that is flattened, and the shapes after each of four.
            assert_eq!((copies.copies().len(), copies.mesh_count()), (8, 7), "{text}");
            assert_eq!(flat.triangles.len(), 4 * 4 + 4 * 2);
        }
    }
}

#[test]
fn what_is_too_large_when_flat_has_two_levels() {
    let object = format!("ObjectBegin \"a\"\n{}ObjectEnd\n", "Shape \"sphere\"\n".repeat(100));
    let text = object + &"ObjectInstance \"a\"\n".repeat(2800);
    // 960 triangles for each sphere.
    let scene = read("a.pbrt", text.as_bytes(), Instancing::Auto).unwrap();
    let copies = scene.copies.as_ref().unwrap();
    assert_eq!((scene.triangle_count(), copies.triangles().len()), (268_800_000, 96_000));
    // Few copies are flat unless two levels are wanted.
    let scene =
        read("a.pbrt", &text.as_bytes()[..text.find("ObjectInstance").unwrap() + 37], Instancing::Auto).unwrap();
    assert!(scene.copies.is_none() && scene.triangles.len() == 2 * 96_000);
}

/// A channel of an animation of two keys, a second apart.
fn channel(document: &mut Value, node: usize, path: &str, values: &[f32]) -> (Value, Value) {
    let shape = ["SCALAR", "VEC3", "VEC4"][[2, 6, 8].iter().position(|count| *count == values.len()).unwrap()];
    let input = add(document, 5126, "SCALAR", false, 2, &floats(&[0.0, 1.0]));
    let output = add(document, 5126, shape, false, 2, &floats(values));
    (json!({"input": input, "output": output}), json!({"target": {"node": node, "path": path}}))
}

/// The document with one clip of these channels.
fn animated(mut document: Value, channels: &[(usize, &str, &[f32])]) -> String {
    let (mut samplers, mut list) = (Vec::new(), Vec::new());
    for (node, path, values) in channels {
        let (sampler, mut channel) = channel(&mut document, *node, path, values);
        channel["sampler"] = samplers.len().into();
        samplers.push(sampler);
        list.push(channel);
    }
    document["animations"] = json!([{"samplers": samplers, "channels": list}]);
    document.to_string()
}

/// Below a node that moves, turns and is stretched: a copy, a mirrored one, one that is turned and so sheared, one that grows from a point and
/// becomes its mirror image, one that is pressed flat, and one that flies beyond all coordinates. Another stands still.
fn carousel() -> String {
    let mut document = triangle();
    document["nodes"] = json!([
        {"children": [1, 2, 3, 4, 5, 6]},
        {"mesh": 0, "translation": [2, 0, 0]},
        {"mesh": 0, "translation": [0.1, 0.2, 3], "scale": [-1, 1, 1]},
        {"mesh": 0, "translation": [0, 3, 0.3], "rotation": [0.6, 0.0, 0.0, 0.8]},
        {"mesh": 0, "translation": [0, -3, 0.1], "scale": [0, 0, 0]},
        {"mesh": 0, "translation": [-2, 0.3, 0]},
        {"mesh": 0, "translation": [-2, 0.3, 2]},
        {"mesh": 0, "translation": [5.5, 4.3, 1.7], "rotation": [0.0, 0.6, 0.0, 0.8]}
    ]);
    document["scenes"] = json!([{"nodes": [0, 7]}]);
    let channels: [(usize, &str, &[f32]); 6] = [
        (0, "translation", &[0.0, 0.0, 0.0, 7.3, 1.1, -0.7]),
        (0, "rotation", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8]),
        (0, "scale", &[1.0, 1.0, 1.0, 1.0, 2.5, 0.5]),
        (4, "scale", &[0.0, 0.0, 0.0, -1.0, 1.0, 1.0]),
        (5, "scale", &[1.0, 1.0, 1.0, 1.0, 1.0, -1.0]),
        (6, "scale", &[1.0, 1.0, 1.0, 1e30, 1.0, 1.0]),
    ];
    animated(document, &channels)
}

#[test]
fn copies_that_move_have_the_triangles_of_the_flat_scene() {
    let text = carousel();
    let [flat, kept] = both("a.gltf", text.as_bytes()).unwrap();
    let copies = kept.copies.as_ref().unwrap();
    assert_eq!((copies.copies().len(), copies.mesh_count(), copies.triangles().len()), (7, 2, 2));
    assert!(flat.form() == Instancing::Flat && kept.form() == Instancing::TwoLevel);
    let token = CancelToken::new();
    let (settings, mut hits) = (BuildSettings::default(), 0);
    let mut random = Random(7);
    for step in 0..=8 {
        let moment = Moment { clip: 0, seconds: step as f32 / 8.0 };
        let [flat, kept] = [&flat, &kept].map(|scene| Arc::new(scene.at(moment, &token).unwrap()));
        compare(&flat, &kept);
        assert_eq!((kept.subject, &kept.warnings), (flat.subject, &flat.warnings), "{moment:?}");
        assert_eq!(flat.lost_at_moment().is_some(), step > 0);
        let own = kept.copies.as_ref().unwrap();
        assert!(Arc::ptr_eq(own.meshes(), copies.meshes()), "no mesh is made again");
        assert!(
            own.copies().place(4).is_singular() == (step == 4) && own.copies().place(3).is_singular() == (step == 0)
        );
        let [of_flat, of_kept] = [&flat, &kept].map(|scene| Accel::build(scene, &settings, &token).unwrap());
        for index in 0..200 {
            let target = flat.triangles[index % 7];
            let away = Vec3::from_array([(); 3].map(|()| (random.next() as f32 / u64::MAX as f32 - 0.5) * 6.0));
            let ray = Ray::new((target.a + target.b + target.c) / 3.0 + away, -away);
            let expected = of_flat.closest_hit(&ray);
            assert_eq!(of_kept.closest_hit(&ray), expected, "{moment:?} {ray:?}");
            hits += usize::from(expected.is_some());
        }
    }
    assert!(hits > 1000, "{hits}");
    // Back in the pose of the file.
    compare(&flat, &kept);
}

#[test]
fn meshes_that_move_in_themselves_are_flat() {
    let turns: &[(usize, &str, &[f32])] = &[(1, "translation", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0])];
    let skinned = animated(skinned([[1.0, 0.0, 0.0, 0.0]; 3]), turns);
    let mut morphed = triangle();
    morphed["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": 0}]);
    let morphed = animated(morphed, &[(0, "weights", &[0.0, 1.0])]);
    for text in [skinned, morphed] {
        let scene = read("a.gltf", text.as_bytes(), Instancing::TwoLevel).unwrap();
        assert!(scene.copies.is_none() && scene.motion.is_some());
        assert_eq!(scene.form(), Instancing::Auto);
        let what = "copies of a model whose meshes move in themselves flattened";
        assert_eq!(scene.warnings.entries[0].what, what, "{:?}", scene.warnings);
        assert!(read("a.gltf", text.as_bytes(), Instancing::Auto).unwrap().warnings.is_empty());
    }
}
