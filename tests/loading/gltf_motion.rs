//! Animated glTF with values worked out on paper: each way in which other programs go wrong is a test.

use bvhscope::scene::{Moment, Scene};
use bvhscope_engine::cancel::CancelToken;
use glam::Vec3;
use serde_json::{Value, json};

use crate::gltf_places::{add, corners, floats, png, skinned, uri};
use crate::hostile_gltf::{load, triangle};

/// The model at a time of one of its clips.
fn at(scene: &Scene, clip: usize, seconds: f32) -> Scene {
    scene.at(Moment { clip, seconds }, &CancelToken::new()).unwrap()
}

/// The first corner of the model at these times of its first clip.
fn path<const N: usize>(scene: &Scene, times: [f32; N]) -> [Vec3; N] {
    times.map(|time| at(scene, 0, time).triangles[0].a)
}

fn close(found: Vec3, x: f32, y: f32, z: f32) {
    assert!(found.distance(Vec3::new(x, y, z)) < 1e-5, "{found} instead of ({x}, {y}, {z})");
}

/// Adds a clip of one channel; `values` are floats of this shape.
fn animate(document: &mut Value, target: Value, interpolation: &str, times: &[f32], values: &[f32], shape: &str) {
    let width = match shape {
        "SCALAR" => 1,
        "VEC3" => 3,
        _ => 4,
    };
    let input = add(document, 5126, "SCALAR", false, times.len(), &floats(times));
    let output = add(document, 5126, shape, false, values.len() / width, &floats(values));
    add_clip(document, target, interpolation, input, output);
}

fn add_clip(document: &mut Value, target: Value, interpolation: &str, input: usize, output: usize) {
    if document["animations"].is_null() {
        document["animations"] = json!([]);
    }
    let clips = document["animations"].as_array_mut().unwrap();
    clips.push(json!({
        "name": format!("clip {}", clips.len()),
        "channels": [{"sampler": 0, "target": target}],
        "samplers": [{"input": input, "output": output, "interpolation": interpolation}]
    }));
}

fn node(node: usize, path: &str) -> Value {
    json!({"node": node, "path": path})
}

fn silent(scene: &Scene) {
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn nodes_move_by_steps_lines_and_splines_and_stand_still_outside_their_keys() {
    let moved = |interpolation: &str, values: &[f32]| {
        let mut document = triangle();
        animate(&mut document, node(0, "translation"), interpolation, &[1.0, 3.0], values, "VEC3");
        let scene = load(&document).unwrap();
        silent(&scene);
        path(&scene, [0.0, 1.0, 2.0, 3.0, 9.0]).map(|corner| corner.x)
    };
    let line = [2.0, 0.0, 0.0, 6.0, 0.0, 0.0];
    assert_eq!(moved("STEP", &line), [2.0, 2.0, 2.0, 6.0, 6.0]);
    assert_eq!(moved("LINEAR", &line), [2.0, 2.0, 4.0, 6.0, 6.0]);
    // In-tangent, value, out-tangent; out of the first key with 1 a second: 2 seconds · (1/8 - 2/4 + 1/2) · 1 above the middle.
    let spline = [9.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 6.0, 0.0, 0.0, 9.0, 0.0, 0.0];
    assert_eq!(moved("CUBICSPLINE", &spline), [2.0, 2.0, 4.25, 6.0, 6.0]);
}

#[test]
fn clips_have_names_and_spans_and_a_single_key_is_one() {
    let mut document = triangle();
    animate(&mut document, node(0, "translation"), "LINEAR", &[0.5, 2.0], &[0.0; 6], "VEC3");
    animate(&mut document, node(0, "translation"), "LINEAR", &[4.0], &[7.0, 0.0, 0.0], "VEC3");
    let scene = load(&document).unwrap();
    let clips = &scene.motion.as_ref().unwrap().clips;
    let found: Vec<_> = clips.iter().map(|clip| (&clip.name[..], clip.start, clip.end)).collect();
    assert_eq!(found, [("clip 0", 0.5, 2.0), ("clip 1", 4.0, 4.0)]);
    let motion = scene.motion.as_ref().unwrap();
    assert_eq!(
        ["clip 1", "1", "clip 2", "2", "-1"].map(|name| motion.choose(Some(name)).ok()),
        [Some(1), Some(1), None, None, None]
    );
    // Without a clip, the model is as its nodes say; a clip without duration shows its pose all the same.
    assert_eq!(scene.triangles[0].a, Vec3::ZERO);
    assert_eq!([0.0, 4.0, 9.0].map(|time| at(&scene, 1, time).triangles[0].a.x), [7.0; 3]);
    assert!(load(&triangle()).unwrap().motion.is_none());
}

#[test]
fn rotations_of_short_integers_turn_by_the_shorter_arc() {
    let mut document = triangle();
    // No turn, and a quarter turn about z by the quaternion of the opposite sign.
    let half = (-32_767.0_f32 * std::f32::consts::FRAC_1_SQRT_2).round() as i16;
    let quaternions: Vec<u8> = [0, 0, 0, i16::MAX, 0, 0, half, half].iter().flat_map(|x| x.to_le_bytes()).collect();
    let input = add(&mut document, 5126, "SCALAR", false, 2, &floats(&[0.0, 2.0]));
    let output = add(&mut document, 5122, "VEC4", true, 2, &quaternions);
    add_clip(&mut document, node(0, "rotation"), "LINEAR", input, output);
    let scene = load(&document).unwrap();
    silent(&scene);
    let b = |time: f32| at(&scene, 0, time).triangles[0].b;
    let diagonal = std::f32::consts::FRAC_1_SQRT_2;
    let near = |found: Vec3, x: f32, y: f32| assert!(found.distance(Vec3::new(x, y, 0.0)) < 1e-4, "{found}");
    near(b(1.0), diagonal, diagonal);
    near(b(2.0), 0.0, 1.0);
}

#[test]
fn keys_may_be_sparse_and_channels_share_them() {
    let mut document = triangle();
    let input = add(&mut document, 5126, "SCALAR", false, 3, &floats(&[0.0, 1.0, 2.0]));
    let values = add(&mut document, 5126, "VEC3", false, 1, &floats(&[0.0, 8.0, 0.0]));
    let indices = add(&mut document, 5121, "SCALAR", false, 1, &[1]);
    let [values, indices] = [values, indices].map(|accessor| document["accessors"][accessor]["bufferView"].clone());
    let output = document["accessors"].as_array().unwrap().len();
    document["accessors"]
        .as_array_mut()
        .unwrap()
        .push(json!({"componentType": 5126, "count": 3, "type": "VEC3", "sparse":
        {"count": 1, "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}}}));
    add_clip(&mut document, node(0, "translation"), "LINEAR", input, output);
    let scene = load(&document).unwrap();
    silent(&scene);
    assert_eq!(path(&scene, [0.0, 0.5, 1.0, 1.75]).map(|corner| corner.y), [0.0, 4.0, 8.0, 2.0]);
}

#[test]
fn joints_move_a_skinned_mesh_and_its_own_node_does_not() {
    let [first, second] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]];
    let mut document = skinned([first, [0.5, 0.5, 0.0, 0.0], second]);
    animate(&mut document, node(2, "translation"), "LINEAR", &[0.0, 1.0], &[0.0, 3.0, 0.0, 0.0, 5.0, 0.0], "VEC3");
    animate(&mut document, node(1, "translation"), "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 99.0, 99.0, 99.0], "VEC3");
    let scene = load(&document).unwrap();
    silent(&scene);
    let rest = [Vec3::new(0.0, 3.0, 0.0), Vec3::new(1.0, 1.5, 0.0), Vec3::new(0.0, 1.0, 0.0)];
    assert_eq!(corners(&at(&scene, 0, 0.0)), rest);
    let moved = [Vec3::new(0.0, 5.0, 0.0), Vec3::new(1.0, 2.5, 0.0), Vec3::new(0.0, 1.0, 0.0)];
    assert_eq!(corners(&at(&scene, 0, 1.0)), moved);
    assert_eq!(corners(&at(&scene, 1, 1.0)), rest);
    // The box is that of the pose, and the one to frame that of the whole clip.
    let posed = at(&scene, 0, 1.0);
    assert_eq!((posed.bounds.min, posed.bounds.max), (Vec3::new(0.0, 1.0, 0.0), Vec3::new(1.0, 5.0, 0.0)));
    assert_eq!((posed.subject.min, posed.subject.max), (Vec3::new(0.0, 1.0, 0.0), Vec3::new(1.0, 5.0, 0.0)));
    assert_eq!(at(&scene, 0, 0.0).subject, posed.subject);
}

#[test]
fn inverse_bind_matrices_may_be_missing_too_many_or_too_few() {
    let held = [[0.0, 1.0, 0.0, 0.0]; 3];
    let mut document = skinned(held);
    document["skins"][0].as_object_mut().unwrap().remove("inverseBindMatrices");
    animate(&mut document, node(3, "translation"), "STEP", &[0.0], &[4.0, 0.0, 0.0], "VEC3");
    let scene = load(&document).unwrap();
    silent(&scene);
    assert_eq!([&scene, &at(&scene, 0, 0.0)].map(|scene| scene.triangles[0].a.x), [1.0, 4.0]);
    let mut document = skinned([[1.0, 0.0, 0.0, 0.0]; 3]);
    document["skins"][0]["joints"] = json!([2]);
    let scene = load(&document).unwrap();
    silent(&scene);
    assert_eq!(scene.triangles[0].a.y, 3.0);
    let mut document = skinned(held);
    document["skins"][0]["joints"] = json!([2, 3, 2]);
    let scene = load(&document).unwrap();
    // The third joint, at the place of the first, was not bound elsewhere: the identity stands for its matrix.
    let warning = scene.warnings.entries[0].to_string();
    let expected = "1 joint without an inverse bind matrix, in place of which stands the identity (first at skins[0].inverseBindMatrices: \
                    2 matrices for 3 joints)";
    assert_eq!((warning.as_str(), scene.triangles[0].a.x), (expected, 0.0));
    document["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] =
        json!(add(&mut document, 5121, "VEC4", false, 3, &[2, 2, 2, 2].repeat(3)));
    assert_eq!(corners(&load(&document).unwrap())[1], Vec3::new(1.0, 3.0, 0.0));
    // A matrix that flattens is a matrix; one of infinities is none.
    for (number, warnings) in [(0.0, 0), (f32::INFINITY, 1)] {
        let mut document = skinned([[1.0, 0.0, 0.0, 0.0]; 3]);
        let bind = add(&mut document, 5126, "MAT4", false, 2, &floats(&[number; 32]));
        document["skins"][0]["inverseBindMatrices"] = json!(bind);
        animate(&mut document, node(2, "scale"), "STEP", &[0.0], &[0.0; 3], "VEC3");
        let scene = load(&document).unwrap();
        assert_eq!(scene.warnings.entries.len(), warnings, "{:?}", scene.warnings);
        assert!(corners(&at(&scene, 0, 0.0)).iter().all(|corner| corner.is_finite()));
    }
}

#[test]
fn weights_of_bytes_and_joints_of_shorts_hold_by_eight_joints() {
    let mut document = skinned([[1.0, 0.0, 0.0, 0.0]; 3]);
    let attributes = ["JOINTS_0", "WEIGHTS_0", "JOINTS_1", "WEIGHTS_1"];
    let shorts: Vec<u8> = [0_u16, 0, 0, 0].repeat(3).iter().flat_map(|joint| joint.to_le_bytes()).collect();
    let second: Vec<u8> = [1_u16, 0, 0, 0].repeat(3).iter().flat_map(|joint| joint.to_le_bytes()).collect();
    let lists = [
        add(&mut document, 5123, "VEC4", false, 3, &shorts),
        add(&mut document, 5121, "VEC4", true, 3, &[51, 0, 0, 0].repeat(3)),
        add(&mut document, 5123, "VEC4", false, 3, &second),
        // Together half of what they should be.
        add(&mut document, 5121, "VEC4", true, 3, &[51, 0, 0, 0].repeat(3)),
    ];
    for (name, list) in attributes.iter().zip(lists) {
        document["meshes"][0]["primitives"][0]["attributes"][name] = json!(list);
    }
    let scene = load(&document).unwrap();
    assert_eq!(kinds(&scene), [(3, "vertices whose joint weights do not add up to 1 held by each in proportion")]);
    // Half by the joint at 3, half by the one that stays.
    close(scene.triangles[0].a, 0.0, 1.5, 0.0);
}

#[test]
fn joints_out_of_range_are_counted_and_the_others_hold() {
    let mut document = skinned([[0.5, 0.5, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0; 4]]);
    let joints = add(&mut document, 5121, "VEC4", false, 3, &[0, 7, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0]);
    document["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
    let scene = load(&document).unwrap();
    let warning = scene.warnings.entries[1].to_string();
    assert_eq!(warning, "2 vertices held by joints that do not exist (first at nodes[1].skin)");
    // By the joint that exists, and by the first one where there is none: all are moved by 3.
    assert_eq!(corners(&scene), [Vec3::new(0.0, 3.0, 0.0), Vec3::new(1.0, 3.0, 0.0), Vec3::new(0.0, 4.0, 0.0)]);
}

/// Number and kind of each warning.
fn kinds(scene: &Scene) -> Vec<(u64, &str)> {
    scene.warnings.entries.iter().map(|warning| (warning.count, &warning.what[..])).collect()
}

#[test]
fn joint_weights_that_are_none_are_counted_and_the_others_hold() {
    const BAD: &str = "vertices with joint weights that are negative or no numbers, which count as 0";
    const NONE: &str = "vertices without a joint weight held by the first joint";
    const UNEVEN: &str = "vertices whose joint weights do not add up to 1 held by each in proportion";
    let good = [1.0, 0.0, 0.0, 0.0];
    for (weights, expected, y) in [
        ([f32::NAN, 1.0, 0.0, 0.0], vec![(1, BAD)], 0.0),
        ([f32::INFINITY, 1.0, 0.0, 0.0], vec![(1, BAD)], 0.0),
        ([-1.0, 1.0, 0.0, 0.0], vec![(1, BAD)], 0.0),
        ([f32::NAN; 4], vec![(1, BAD)], 3.0),
        ([0.0; 4], vec![(1, NONE)], 3.0),
        ([1e30, 1e30, 0.0, 0.0], vec![(1, UNEVEN)], 1.5),
        ([3e38, 3e38, 0.0, 0.0], vec![(1, UNEVEN)], 1.5),
        ([0.49, 0.5, 0.0, 0.0], vec![], 1.485),
    ] {
        let scene = load(&skinned([weights, good, good])).unwrap();
        assert_eq!(kinds(&scene), expected, "{weights:?}");
        assert!((scene.triangles[0].a.y - y).abs() < 0.02, "{weights:?}: {}", scene.triangles[0].a);
    }
}

#[test]
fn joints_and_weights_of_a_wrong_type_or_alone_are_counted() {
    let mut document = skinned([[1.0, 0.0, 0.0, 0.0]; 3]);
    let joints = add(&mut document, 5126, "VEC4", false, 3, &floats(&[1.0, 0.0, 0.0, 0.0].repeat(3)));
    document["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
    assert_eq!(kinds(&load(&document).unwrap()), [(1, "primitives shown without joints: numbers of a wrong type")]);
    for alone in ["JOINTS_0", "WEIGHTS_0"] {
        let mut document = skinned([[1.0, 0.0, 0.0, 0.0]; 3]);
        document["meshes"][0]["primitives"][0]["attributes"]
            .as_object_mut()
            .unwrap()
            .retain(|name, _| name == alone || name == "POSITION");
        let scene = load(&document).unwrap();
        assert_eq!(kinds(&scene), [(1, "primitives shown without joints or weights that are there alone")], "{alone}");
    }
}

#[test]
fn triangles_that_a_clip_moves_out_of_sight_are_counted_at_their_moment() {
    const LOST: &str = "triangles left out at this moment: coordinates that are not numbers or beyond 1e18";
    // By morph targets, and by the node.
    for number in [f32::NAN, f32::INFINITY, 3e38, 1e30] {
        let mut document = triangle();
        let target =
            add(&mut document, 5126, "VEC3", false, 3, &floats(&[0.0, 0.0, 0.0, number, 0.0, 0.0, 0.0, 0.0, 0.0]));
        document["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
        animate(&mut document, node(0, "weights"), "STEP", &[0.0, 1.0], &[0.0, 1.0], "SCALAR");
        let scene = load(&document).unwrap();
        silent(&scene);
        let lost = at(&scene, 0, 1.0);
        assert_eq!(kinds(&lost), [(1, LOST)], "{number}");
        // As a point where it was, not a triangle that reaches to somewhere else.
        assert_eq!(corners(&lost), [Vec3::ZERO; 3]);
        silent(&at(&lost, 0, 0.0));
    }
    let mut document = triangle();
    animate(&mut document, node(0, "translation"), "STEP", &[0.0, 1.0], &[0.0, 0.0, 0.0, -1e30, 0.0, 0.0], "VEC3");
    let scene = load(&document).unwrap();
    assert_eq!(kinds(&at(&scene, 0, 1.0)), [(1, LOST)]);
    assert_eq!(kinds(&at(&at(&scene, 0, 1.0), 0, 1.0)), [(1, LOST)], "once");
}

#[test]
fn channels_with_another_number_of_weights_than_targets_are_counted() {
    let mut document = morphed();
    animate(&mut document, node(0, "weights"), "STEP", &[0.0, 1.0], &[0.0, 1.0], "SCALAR");
    let scene = load(&document).unwrap();
    let expected = "1 channel of animations with another number of weights than the mesh has morph targets (first at \
                    animations[0].channels[0]: 1 for 2 targets)";
    assert_eq!(scene.warnings.entries[0].to_string(), expected);
    assert_eq!(at(&scene, 0, 1.0).triangles[0].a, Vec3::Y);
}

#[test]
fn one_mesh_stands_under_two_skeletons() {
    let mut document = skinned([[1.0, 0.0, 0.0, 0.0]; 3]);
    document["skins"].as_array_mut().unwrap().push(json!({"joints": [3]}));
    document["nodes"].as_array_mut().unwrap().push(json!({"mesh": 0, "skin": 1}));
    document["scenes"][0]["nodes"] = json!([0, 2, 3, 4]);
    animate(&mut document, node(3, "translation"), "STEP", &[0.0], &[0.0, 0.0, 6.0], "VEC3");
    let moved = at(&load(&document).unwrap(), 0, 0.0);
    assert_eq!([moved.triangles[0].a, moved.triangles[1].a], [Vec3::new(0.0, 3.0, 0.0), Vec3::new(0.0, 0.0, 6.0)]);
}

/// The triangle with two morph targets: its first corner along y, and all along z, with normals that turn from z to x.
fn morphed() -> Value {
    let mut document = triangle();
    let first = add(&mut document, 5126, "VEC3", false, 3, &floats(&[0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    let second = add(&mut document, 5126, "VEC3", false, 3, &floats(&[0.0, 0.0, 1.0].repeat(3)));
    let normals = add(&mut document, 5126, "VEC3", false, 3, &floats(&[0.0, 0.0, 1.0].repeat(3)));
    let turned = add(&mut document, 5126, "VEC3", false, 3, &floats(&[1.0, 0.0, -1.0].repeat(3)));
    let primitive = &mut document["meshes"][0]["primitives"][0];
    primitive["attributes"]["NORMAL"] = json!(normals);
    primitive["targets"] = json!([{"POSITION": first}, {"POSITION": second, "NORMAL": turned}]);
    document
}

#[test]
fn weights_of_a_node_count_before_those_of_its_mesh() {
    let mut document = morphed();
    assert_eq!(load(&document).unwrap().triangles[0].a, Vec3::ZERO, "all are 0 unless given");
    document["meshes"][0]["weights"] = json!([0.5, 2.0]);
    assert_eq!(load(&document).unwrap().triangles[0].a, Vec3::new(0.0, 0.5, 2.0));
    document["nodes"][0]["weights"] = json!([1.0]);
    let scene = load(&document).unwrap();
    let expected =
        "1 node with another number of weights than the mesh has morph targets (first at nodes[0]: 1 for 2 targets)";
    assert_eq!(scene.warnings.entries[0].to_string(), expected);
    assert_eq!(scene.triangles[0].a, Vec3::new(0.0, 1.0, 0.0), "a missing one is 0");
}

#[test]
fn clips_morph_positions_and_normals() {
    let mut document = morphed();
    // A second primitive with but one target has no second one to move.
    let mut other = document["meshes"][0]["primitives"][0].clone();
    other["targets"].as_array_mut().unwrap().pop();
    document["meshes"][0]["primitives"].as_array_mut().unwrap().push(other);
    animate(&mut document, node(0, "weights"), "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 1.0, 1.0], "SCALAR");
    let scene = load(&document).unwrap();
    silent(&scene);
    let end = at(&scene, 0, 1.0);
    assert_eq!([end.triangles[0].a, end.triangles[1].a], [Vec3::new(0.0, 1.0, 1.0), Vec3::new(0.0, 1.0, 0.0)]);
    let normal = |scene: &Scene, triangle: usize| {
        let attributes = scene.attributes.as_ref().unwrap();
        attributes.normals[attributes.corners[triangle][0] as usize]
    };
    assert_eq!([0, 1].map(|triangle| normal(&end, triangle)), [Vec3::X, Vec3::Z]);
    let middle = normal(&at(&scene, 0, 0.5), 0);
    close(middle, std::f32::consts::FRAC_1_SQRT_2, 0.0, std::f32::consts::FRAC_1_SQRT_2);
    // Three values for each target: 2 · (1/8 - 2/4 + 1/2) of the second, none of the first.
    let mut document = morphed();
    let spline = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    animate(&mut document, node(0, "weights"), "CUBICSPLINE", &[0.0, 2.0], &spline, "SCALAR");
    assert_eq!(at(&load(&document).unwrap(), 0, 1.0).triangles[0].a, Vec3::new(0.0, 0.0, 0.25));
}

#[test]
fn pointers_move_nodes_and_others_are_counted() {
    let pointer =
        |pointer: &str| json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}});
    let mut document = triangle();
    document["extensionsRequired"] = json!(["KHR_animation_pointer"]);
    animate(&mut document, pointer("/nodes/0/translation"), "STEP", &[0.0], &[5.0, 0.0, 0.0], "VEC3");
    animate(&mut document, pointer("/materials/0/emissiveFactor"), "STEP", &[0.0], &[5.0, 0.0, 0.0], "VEC3");
    animate(&mut document, pointer("/cameras/0/perspective/yfov"), "STEP", &[0.0], &[5.0], "SCALAR");
    let scene = load(&document).unwrap();
    assert_eq!(scene.motion.as_ref().unwrap().clips.len(), 1);
    assert_eq!(at(&scene, 0, 0.0).triangles[0].a.x, 5.0);
    let found: Vec<String> = scene.warnings.entries.iter().map(ToString::to_string).collect();
    assert_eq!(
        found,
        [
            "2 properties that are animated not shown (first at animations[1].channels[0]: '/materials/0/emissiveFactor')",
            "2 clips without keys for the scene left out (first at animations[1])",
        ]
    );
}

#[test]
fn hidden_nodes_are_left_out_unless_a_clip_shows_them() {
    let hidden = json!({"KHR_node_visibility": {"visible": false}});
    let mut document = triangle();
    document["extensionsRequired"] = json!(["KHR_node_visibility"]);
    document["nodes"] = json!([{"mesh": 0, "children": [1]}, {"children": [2], "extensions": hidden},
        {"mesh": 0, "translation": [3.0, 0.0, 0.0]}]);
    let scene = load(&document).unwrap();
    assert_eq!(scene.triangles.len(), 1);
    let warning = scene.warnings.entries[0].to_string();
    assert_eq!(warning, "1 node with a mesh that the file hides left out (first at nodes[2])");
    let target = json!({"path": "pointer", "extensions":
        {"KHR_animation_pointer": {"pointer": "/nodes/1/extensions/KHR_node_visibility/visible"}}});
    let input = add(&mut document, 5126, "SCALAR", false, 2, &floats(&[0.0, 1.0]));
    let output = add(&mut document, 5121, "SCALAR", false, 2, &[0, 1]);
    add_clip(&mut document, target, "STEP", input, output);
    let scene = load(&document).unwrap();
    silent(&scene);
    let areas = |scene: &Scene| -> Vec<f32> {
        scene.triangles.iter().map(|triangle| triangle.scaled_normal().length()).collect()
    };
    assert_eq!(areas(&scene), [1.0, 0.0]);
    assert_eq!([0.5, 1.0].map(|time| areas(&at(&scene, 0, time))), [[1.0, 0.0], [1.0, 1.0]]);
}

#[test]
fn broken_channels_are_counted_and_the_others_play() {
    let mut document = triangle();
    let times = add(&mut document, 5126, "SCALAR", false, 3, &floats(&[2.0, f32::NAN, 1.0]));
    let values = add(&mut document, 5126, "VEC3", false, 3, &floats(&[20.0, 0.0, 0.0, 9.0, 9.0, 9.0, 10.0, 0.0, 0.0]));
    let few = add(&mut document, 5126, "VEC3", false, 1, &floats(&[0.0; 3]));
    let nothing = add(&mut document, 5126, "SCALAR", false, 1, &floats(&[f32::INFINITY]));
    let channel = |sampler: usize, target: Value| json!({"sampler": sampler, "target": target});
    document["animations"] = json!([
        {"channels": [channel(0, node(0, "translation")), channel(0, node(0, "translation")), channel(1, node(0, "scale")),
            channel(7, node(0, "scale")), channel(0, node(8, "scale")), channel(0, node(0, "colour")), channel(0, json!({})),
            channel(2, node(0, "scale")), channel(3, node(0, "scale")), channel(4, node(0, "rotation")), {}, 5, null],
         "samplers": [{"input": times, "output": values}, {"input": times, "output": few}, {"input": nothing, "output": few},
            {"input": times, "output": values, "interpolation": "SMOOTH"}, {"input": times, "output": values}]},
        {"channels": 7}, {"channels": []}, null
    ]);
    let scene = load(&document).unwrap();
    assert_eq!(path(&scene, [0.0, 1.5, 3.0]).map(|corner| corner.x), [10.0, 15.0, 20.0]);
    let found: Vec<(u64, &str)> =
        scene.warnings.entries.iter().map(|warning| (warning.count, &warning.what[..])).collect();
    let left_out = |kind: &str| format!("channels of animations left out: {kind}");
    let kinds = [
        "another moves the same",
        "fewer values than keys",
        "something named that does not exist",
        "an unknown path",
        "no node is named",
        "no keys",
        "an unknown interpolation",
        "numbers of a wrong type",
    ]
    .map(left_out);
    assert_eq!(
        found,
        [
            (2, "keys of animations that are not numbers left out"),
            (1, "channels of animations whose keys were out of order sorted"),
            (1, &kinds[0][..]),
            (1, &kinds[1][..]),
            (2, &kinds[2][..]),
            (1, &kinds[3][..]),
            (4, &kinds[4][..]),
            (1, &kinds[5][..]),
            (1, &kinds[6][..]),
            (1, &kinds[7][..]),
            (3, "clips without keys for the scene left out"),
        ]
    );
}

#[test]
fn ten_thousand_clips_load_and_keys_without_data_are_limited() {
    let mut document = triangle();
    animate(&mut document, node(0, "translation"), "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0], "VEC3");
    let clip = document["animations"][0].clone();
    document["animations"] = json!(vec![clip; 10_000]);
    let scene = load(&document).unwrap();
    silent(&scene);
    assert_eq!(at(&scene, 9_999, 0.5).triangles[0].a.x, 0.5);
    // Four thousand million keys of zeros, of which the file has no bytes.
    let zeros = |kind: &str| json!({"componentType": 5126, "count": u32::MAX, "type": kind});
    let accessors = document["accessors"].as_array_mut().unwrap();
    let first = accessors.len();
    accessors.extend([zeros("SCALAR"), zeros("VEC3")]);
    document["animations"] = json!([]);
    add_clip(&mut document, node(0, "translation"), "STEP", first, first + 1);
    let scene = load(&document).unwrap();
    assert!(scene.motion.is_none());
    assert_eq!(scene.warnings.entries[0].what, "channels of animations left out: too many keys");
}

#[test]
fn poses_are_the_same_on_any_number_of_threads_and_in_any_order() {
    let mut document = skinned([[1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]);
    animate(&mut document, node(2, "translation"), "LINEAR", &[0.0, 1.0], &[0.0, 3.0, 0.0, 0.0, 5.0, 0.0], "VEC3");
    let scene = load(&document).unwrap();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| [0.7, 0.1, 0.7].map(|time| at(&scene, 0, time).triangles))
    };
    assert_eq!(on(1), on(3));
    assert_eq!(on(2)[0], on(2)[2]);
}

#[test]
fn cameras_and_lights_that_clips_move_are_counted() {
    let mut document = triangle();
    document["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]);
    document["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    document["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}});
    let carried = json!({"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}});
    // One stands still, the other is below the node that moves.
    let nodes = document["nodes"].as_array_mut().unwrap();
    nodes.extend([carried.clone(), carried]);
    document["nodes"][0]["children"] = json!([2]);
    document["scenes"][0]["nodes"] = json!([0, 1]);
    silent(&load(&document).unwrap());
    animate(&mut document, node(0, "translation"), "LINEAR", &[0.0, 1.0], &[0.0; 6], "VEC3");
    let scene = load(&document).unwrap();
    let found: Vec<String> = scene.warnings.entries.iter().map(ToString::to_string).collect();
    let of = |what: &str| format!("1 {what} that clips move shown where the file has them (first at nodes[2])");
    assert_eq!(found, [of("camera"), of("light")]);
}

#[test]
fn tangents_turn_with_the_surface() {
    let mut document = triangle();
    let tangents = add(&mut document, 5126, "VEC4", false, 3, &floats(&[1.0, 0.0, 0.0, 1.0].repeat(3)));
    let normals = add(&mut document, 5126, "VEC3", false, 3, &floats(&[0.0, 0.0, 1.0].repeat(3)));
    let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
    (attributes["TANGENT"], attributes["NORMAL"]) = (json!(tangents), json!(normals));
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    document["images"] = json!([{"uri": uri(&png())}]);
    document["textures"] = json!([{"source": 0}]);
    document["materials"] = json!([{"normalTexture": {"index": 0}}]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turns = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half];
    animate(&mut document, node(0, "rotation"), "LINEAR", &[0.0, 1.0], &turns, "VEC4");
    let scene = load(&document).unwrap();
    let tangent = |seconds: f32| {
        let posed = at(&scene, 0, seconds);
        let attributes = posed.attributes.unwrap();
        attributes.tangents[attributes.corners[0][0] as usize]
    };
    assert_eq!(tangent(0.0), glam::Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert!(tangent(1.0).distance(glam::Vec4::new(0.0, 1.0, 0.0, 1.0)) < 1e-6, "{}", tangent(1.0));
}
