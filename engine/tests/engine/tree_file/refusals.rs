//! Broken files of every kind, each with the line that it is refused with.

use bvhscope_engine::tree_file::serde_json::{Value, json};
use bvhscope_engine::tree_file::{TreeFile, TreeFileError};
use bvhscope_engine::{CancelToken, Triangle};

use super::draft::{Draft, NONE, header, sample, sample_mesh};

/// The sample after a change.
fn changed(change: impl FnOnce(&mut Draft)) -> Vec<u8> {
    let mut draft = sample();
    change(&mut draft);
    draft.bytes()
}

/// The sample with another value of a field.
fn with(field: &str, value: Value) -> Vec<u8> {
    changed(|draft| drop(draft.header.insert(field.to_owned(), value)))
}

/// The sample without a field.
fn without(field: &str) -> Vec<u8> {
    let text = sample().bytes();
    let lines: Vec<&[u8]> = text.splitn(3, |&byte| byte == b'\n').collect();
    let mut fields = header(bvhscope_engine::tree_file::serde_json::from_slice(lines[1]).unwrap());
    fields.remove(field).unwrap();
    [lines[0], b"\n", Value::Object(fields).to_string().as_bytes(), b"\n", lines[2]].concat()
}

/// The sample with other places of its arrays; 360 bytes of data as they are.
fn arrays(arrays: Value) -> Vec<u8> {
    with("arrays", arrays)
}

/// The sample of spheres with these bounds of node 3.
fn sphere(bounds: [f32; 4]) -> Vec<u8> {
    changed(|draft| {
        draft.header.insert("container".to_owned(), "sphere".into());
        draft.bounds = vec![vec![0.0, 0.0, 0.0, 9.0]; 5];
        draft.bounds[3] = bounds.to_vec();
    })
}

/// Every broken file, with its message.
fn broken() -> Vec<(Vec<u8>, &'static str)> {
    let magic = |magic: &str| changed(|draft| magic.clone_into(&mut draft.magic));
    let line = |text: &str| format!("bvhscope tree 1\n{text}\n").into_bytes();
    let whole = json!({"bounds": 0, "children": 120, "leaves": 160, "indices": 200});
    let at = |name: &str, begin: Value| {
        let mut places = whole.clone();
        places[name] = begin;
        arrays(places)
    };
    let lacking = |name: &str| {
        let mut places = whole.clone();
        places.as_object_mut().unwrap().remove(name).unwrap();
        arrays(places)
    };
    vec![
        // The first line.
        (Vec::new(), "the file is empty"),
        (vec![0; 300], "the file holds only zero bytes"),
        (b"v 0 0 0\nf 1 1 1\n".to_vec(), "does not begin with the line 'bvhscope tree 1'"),
        (b"bvhscope tree 1".to_vec(), "does not begin with the line 'bvhscope tree 1'"),
        (magic("bvhscope tree 3"), "is a tree file of version '3', neither 1 nor 2"),
        (magic("bvhscope tree 2"), "the header has no 'trees'"),
        (magic("bvhscope tree 1\r"), "was written in text mode: the first line ends in CR LF"),
        // The second.
        (
            with("builder", "n".repeat(1001).into()),
            "the header has \"nnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnn…\" as 'builder' where a text of at most 1000 characters is expected",
        ),
        (
            b"bvhscope tree 1\n{\"container\": \"box\"".to_vec(),
            "the header, its second line, does not end within 1048576 bytes, nor before the file does",
        ),
        (
            line(&" ".repeat(1 << 20 | 1)),
            "the header, its second line, does not end within 1048576 bytes, nor before the file does",
        ),
        (line(""), "the header, its second line, is no JSON object: EOF while parsing a value at line 1 column 0"),
        (
            line("{container: 1}"),
            "the header, its second line, is no JSON object: key must be a string at line 1 column 2",
        ),
        (
            line("[1, 2]"),
            "the header, its second line, is no JSON object: invalid type: sequence, expected a map at line 1 column 0",
        ),
        // Its fields.
        (without("container"), "the header has no 'container'"),
        (without("nodes"), "the header has no 'nodes'"),
        (without("arrays"), "the header has no 'arrays'"),
        (
            with("container", json!("kdop")),
            "the header has \"kdop\" as 'container' where \"box\", \"sphere\", \"dop\" or \"oriented\" is expected",
        ),
        (with("arity", json!(1)), "the header has 1 as 'arity' where a whole number from 2 to 32 is expected"),
        (with("arity", json!(33)), "the header has 33 as 'arity' where a whole number from 2 to 32 is expected"),
        (with("nodes", json!(-5)), "the header has -5 as 'nodes' where a count below 4294967296 is expected"),
        (with("nodes", json!(5.5)), "the header has 5.5 as 'nodes' where a count below 4294967296 is expected"),
        (
            with("indices", json!(1_u64 << 32)),
            "the header has 4294967296 as 'indices' where a count below 4294967296 is expected",
        ),
        (
            with("builder", json!(7)),
            "the header has 7 as 'builder' where a text of at most 1000 characters is expected",
        ),
        (with("settings", json!(true)), "the header has true as 'settings' where a text or an object is expected"),
        (with("build_ms", json!(-1)), "the header has -1 as 'build_ms' where a number from 0 on is expected"),
        (with("arrays", json!([0])), "the header has [0] as 'arrays' where an object of names and bytes is expected"),
        // Where the arrays are.
        (lacking("bounds"), "'arrays' in the header has no 'bounds'"),
        (lacking("indices"), "'arrays' in the header has no 'indices'"),
        (
            at("children", json!("120")),
            "'arrays' in the header has \"120\" as 'children' where bytes from the start of the data are expected",
        ),
        (at("leaves", json!(330)), "array 'leaves' of 40 bytes begins at byte 330 of the data, which has 360"),
        (
            at("corners", json!(u64::MAX)),
            "array 'corners' of 144 bytes begins at byte 18446744073709551615 of the data, which has 360",
        ),
        (
            with("nodes", json!(4_000_000_000_u32)),
            "array 'bounds' of 96000000000 bytes begins at byte 0 of the data, which has 360",
        ),
        (
            at("leaves", json!(100)),
            "array 'bounds' ends at byte 120 of the data, array 'leaves' begins at 100: they overlap",
        ),
        // Links.
        (
            changed(|draft| draft.children[1][1] = 5),
            "array 'children': node 1 has the child 5, but there are 5 nodes, counted from 0",
        ),
        (
            changed(|draft| draft.children[1][1] = NONE - 1),
            "array 'children': node 1 has the child 4294967294, but there are 5 nodes, counted from 0",
        ),
        (
            changed(|draft| draft.children[1][0] = 2),
            "array 'children': node 2 is a child of node 0 and again of node 1",
        ),
        (
            changed(|draft| draft.children[1] = vec![3, 3]),
            "array 'children': node 3 is a child of node 1 and again of node 1",
        ),
        (
            changed(|draft| draft.children[1][1] = 0),
            "array 'children': node 1 has the child 0, which it is below: a cycle",
        ),
        (
            changed(|draft| draft.children[1][1] = 1),
            "array 'children': node 1 has the child 1, which it is below: a cycle",
        ),
        (
            changed(|draft| {
                draft.leaves[3] = [0, 0];
                draft.children[3] = vec![NONE, 1];
            }),
            "array 'children': node 3 has the child 1, which it is below: a cycle",
        ),
        // Leaves.
        (
            changed(|draft| draft.leaves[2] = [2, 3]),
            "array 'leaves': leaf 2 holds 3 indices from 2 on, but there are 4",
        ),
        (
            changed(|draft| draft.leaves[2] = [NONE, NONE]),
            "array 'leaves': leaf 2 holds 4294967295 indices from 4294967295 on, but there are 4",
        ),
        (
            changed(|draft| draft.leaves[4] = [0, 2]),
            "array 'leaves': leaf 4 holds the index 0, which another leaf holds too",
        ),
        (
            changed(|draft| draft.indices[3] = 4),
            "array 'indices': 4 at 3, in leaf 2, but there are 4 triangles, counted from 0",
        ),
        (
            changed(|draft| draft.leaves = vec![[0, 0]; 5]),
            "array 'children': node 3 has the child 0, which it is below: a cycle",
        ),
        (
            changed(|draft| {
                draft.leaves = vec![[0, 0]; 5];
                draft.children = vec![vec![NONE; 2]; 5];
            }),
            "array 'leaves': none of the nodes that the root reaches is a leaf, and there are 4 triangles",
        ),
        // Bounds.
        (
            changed(|draft| draft.bounds[4][2] = f32::NAN),
            "array 'bounds': node 4 has NaN where a number from -1e18 to 1e18 is expected",
        ),
        (
            changed(|draft| draft.bounds[1][3] = f32::INFINITY),
            "array 'bounds': node 1 has inf where a number from -1e18 to 1e18 is expected",
        ),
        (
            changed(|draft| draft.bounds[0][0] = -2e18),
            "array 'bounds': node 0 has -2000000000000000000 where a number from -1e18 to 1e18 is expected",
        ),
        (
            changed(|draft| draft.bounds[2] = vec![2.0, 0.0, 0.0, 3.0, -1.5, 1.0]),
            "array 'bounds': node 2 has a box inside out: its min y is 0, its max y -1.5",
        ),
        (sphere([0.0, 0.0, 0.0, -0.5]), "array 'bounds': node 3 has the negative radius -0.5"),
        (
            sphere([0.0, f32::NEG_INFINITY, 0.0, 1.0]),
            "array 'bounds': node 3 has -inf where a number from -1e18 to 1e18 is expected",
        ),
        // Triangles.
        (
            changed(|draft| draft.corners.as_mut().unwrap()[2][7] = f32::NAN),
            "array 'corners': triangle 2 has NaN where a number from -1e18 to 1e18 is expected",
        ),
    ]
}

#[test]
fn broken_files_are_refused_with_their_line() {
    let files = broken();
    assert!(files.len() >= 40, "{} files", files.len());
    for (bytes, expected) in files {
        let error = super::draft::read(&bytes, None).expect_err(expected);
        assert_eq!(error, expected);
    }
}

#[test]
fn every_refusal_is_one_line_with_advice() {
    for (bytes, expected) in broken() {
        let error = TreeFile::read(&bytes, None, u64::MAX, &CancelToken::new()).unwrap_err();
        let (text, advice) = (error.to_string(), error.advice());
        assert!(!format!("{text}{advice}").contains('\n') && advice.len() > 10, "{expected}: {advice}");
    }
}

#[test]
fn a_mesh_with_another_number_of_triangles_is_refused() {
    let mesh = sample_mesh();
    for (mesh, count) in [(&mesh[..3], 3), (&[][..], 0)] {
        let error = TreeFile::read(&sample().bytes(), Some(mesh), u64::MAX, &CancelToken::new()).unwrap_err();
        assert_eq!(error, TreeFileError::OtherMesh { file: 4, model: count });
        assert_eq!(error.to_string(), format!("its number of triangles is 4, that of the model {count}"));
    }
    let longer: Vec<Triangle> = mesh.iter().chain(&mesh).copied().collect();
    assert!(sample().read(Some(&longer)).unwrap_err().ends_with("that of the model 8"));
}

#[test]
fn corners_that_are_not_finite_are_refused_beside_a_mesh_too() {
    let bytes = changed(|draft| draft.corners.as_mut().unwrap()[2][7] = f32::NAN);
    let found = super::draft::read(&bytes, Some(&sample_mesh())).unwrap_err();
    assert!(found.starts_with("array 'corners': triangle 2 has NaN"), "{found}");
}
