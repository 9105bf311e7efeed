//! Files of two levels that are wrong: refused with the line that says where, or shown with a list of faults that names the tree.

use bvhscope_engine::CancelToken;
use bvhscope_engine::geometry::{Placement, Triangle};
use bvhscope_engine::tree_file::serde_json::json;
use bvhscope_engine::tree_file::{KnownScene, TwoLevelFile, TwoLevelModel};

use super::draft::{Draft, NONE, sample, sample_mesh, upright};
use super::file_mutations::damaged;
use super::level_draft::{LevelDraft, around, level_sample, moved_by, placement, read_levels};
use crate::random::Random;
use crate::trees;

fn changed(change: impl FnOnce(&mut LevelDraft)) -> LevelDraft {
    let mut draft = level_sample();
    change(&mut draft);
    draft
}

fn faults(draft: &LevelDraft) -> Vec<String> {
    draft.read().unwrap().faults.iter().map(ToString::to_string).collect()
}

/// Where the instances of the sample stand.
fn sample_places() -> Vec<Placement> {
    let draft = level_sample();
    let meshes = [&sample_mesh()[..], &[upright(0.0)]];
    draft
        .matrices
        .iter()
        .zip(&draft.instances)
        .map(|(matrix, &mesh)| placement(matrix, meshes[mesh as usize]))
        .collect()
}

/// Reads a file of the scene of the sample.
fn read_known(draft: &LevelDraft) -> Result<TwoLevelFile, String> {
    let (places, four, one) = (sample_places(), sample_mesh(), [upright(0.0)]);
    let scene = KnownScene { meshes: vec![&four, &one], instances: [0, 0, 1].into_iter().zip(&places).collect() };
    TwoLevelFile::read(&draft.bytes(), Some(&scene), u64::MAX, &CancelToken::new()).map_err(|error| error.to_string())
}

#[test]
fn broken_files_are_refused_with_their_line() {
    let with = |field: &str, value| changed(|draft| drop(draft.header.insert(field.to_owned(), value)));
    let files = [
        (
            with("trees", json!(1)),
            "the header has 1 as 'trees' where a count from 2 on, meshes and the tree over the instances, is expected",
        ),
        (with("instances", json!(0)), "the header has 0 as 'instances' where a count from 1 on is expected"),
        (
            with("container", json!("sphere")),
            "the header has \"sphere\" as 'container' where \"box\", which trees in two levels have, is expected",
        ),
        (
            with("instances", json!(2)),
            "array 'trees': the last row, of the tree over the instances, has 3 items, and there are 2 instances",
        ),
        (
            with("trees", json!(4_000_000_000_u32)),
            "array 'trees' of 48000000000 bytes begins at byte 652 of the data, which has 856",
        ),
        (
            changed(|draft| draft.trees[0].triangles = 5),
            "array 'trees': all rows together have 6 triangles, the header has 5",
        ),
        (
            changed(|draft| draft.instances[1] = 2),
            "array 'instances': instance 1 is one of mesh 2, but there are 2 meshes, counted from 0",
        ),
        (
            changed(|draft| draft.instances[1] = NONE),
            "array 'instances': instance 1 is one of mesh 4294967295, but there are 2 meshes, counted from 0",
        ),
        (
            changed(|draft| draft.matrices[2] = [0.0; 12]),
            "array 'matrices': instance 2 cannot be placed: its transform is singular, or nearly so",
        ),
        (
            changed(|draft| draft.matrices[2][3] = f32::NAN),
            "array 'matrices': instance 2 cannot be placed: its transform is not finite",
        ),
        (
            changed(|draft| draft.trees[0].children[1][1] = 9),
            "mesh 0: array 'children': node 1 has the child 9, but there are 5 nodes, counted from 0",
        ),
        (
            changed(|draft| draft.trees[1].indices[0] = 1),
            "mesh 1: array 'indices': 1 at 0, in leaf 0, but there are 1 triangles, counted from 0",
        ),
        (
            changed(|draft| draft.trees[2].indices[2] = 3),
            "the tree over the instances: array 'indices': 3 at 2, in leaf 2, but there are 3 instances, counted from 0",
        ),
        (
            changed(|draft| draft.trees[2].indices[1] = 2),
            "array 'indices': instance 2 is in more than one leaf of the tree over the instances",
        ),
        (
            changed(|draft| draft.trees[1].corners.as_mut().unwrap()[0][4] = f32::INFINITY),
            "mesh 1: array 'corners': triangle 0 has inf where a number from -1e18 to 1e18 is expected",
        ),
        (
            changed(|draft| {
                draft.trees[1] = Draft {
                    bounds: Vec::new(),
                    children: Vec::new(),
                    leaves: Vec::new(),
                    indices: Vec::new(),
                    corners: Some(Vec::new()),
                    triangles: 0,
                    ..sample()
                };
            }),
            "array 'trees': mesh 1 has no triangles",
        ),
    ];
    for (mut draft, expected) in files {
        if expected.contains("all rows together") {
            draft.header.insert("triangles".to_owned(), json!(5));
        }
        assert_eq!(draft.read().expect_err(expected), expected);
        let error = TwoLevelFile::read(&draft.bytes(), None, u64::MAX, &CancelToken::new()).unwrap_err();
        assert!(error.advice().len() > 10 && !error.advice().contains('\n'), "{expected}");
    }
}

#[test]
fn files_of_other_scenes_are_refused() {
    let without_one = changed(|draft| {
        draft.instances.pop();
        draft.matrices.pop();
        draft.ids = None;
        draft.trees[2].triangles = 2;
        draft.trees[2].leaves[2] = [0, 0];
        draft.trees[2].children[2] = vec![NONE, NONE];
    });
    assert_eq!(read_known(&without_one).unwrap_err(), "its number of instances is 2, that of the model 3");
    let other_mesh = changed(|draft| draft.instances[1] = 1);
    assert_eq!(
        read_known(&other_mesh).unwrap_err(),
        "array 'instances': instance 1 is one of mesh 1, in the model of mesh 0"
    );
    let swapped = changed(|draft| draft.trees.swap(0, 1));
    assert_eq!(read_known(&swapped).unwrap_err(), "mesh 0: its number of triangles is 1, that of the model 4");
    let longer = changed(|draft| draft.trees.insert(0, draft.trees[1].clone()));
    assert_eq!(read_known(&longer).unwrap_err(), "its number of meshes is 3, that of the model 2");
    assert_eq!(read_known(&level_sample()).unwrap().faults, []);
}

#[test]
fn faults_name_their_trees_and_those_of_meshes_are_counted_together() {
    let draft = changed(|draft| {
        // Node 3 of mesh 0 sticks out below by a quarter; the triangle of mesh 1 does of its leaf, by a half.
        draft.trees[0].bounds[3][1] = -0.25;
        draft.trees[0].bounds[2][5] = 0.75;
        draft.trees[1].bounds[0][5] = 0.5;
        // The first leaf above is too short.
        draft.trees[2].bounds[3][3] = 1.5;
        draft.trees[2].bounds[1][3] = 12.0;
    });
    assert_eq!(
        faults(&draft),
        [
            "1 node sticks out of its parent by up to 1.0, first node 4 of the tree over the instances",
            "1 leaf does not enclose its instances, which stick out by up to 1.5, first node 3 of the tree over the instances",
            "1 node sticks out of its parent by up to 0.25, first node 3 of mesh 0",
            "2 leaves do not enclose their triangles, which stick out by up to 0.5, first node 2 of mesh 0",
        ]
    );
    let found = draft.read().unwrap().faults;
    let nodes: Vec<&[u32]> = found.iter().map(|fault| &fault.nodes[..]).collect();
    assert_eq!(nodes, [&[4][..], &[3], &[], &[]], "nodes of the tree over the instances alone");
}

#[test]
fn instances_in_no_leaf_are_listed() {
    let missing = changed(|draft| {
        draft.trees[2].leaves[3] = [0, 0];
        draft.trees[2].children[3] = vec![NONE, NONE];
    });
    assert_eq!(faults(&missing), ["1 instance is in no leaf, first instance 0"]);
}

#[test]
fn instances_stand_where_the_model_has_them_and_others_are_listed() {
    let moved = changed(|draft| draft.matrices[1] = moved_by(10.0, 0.5, 0.0));
    let found = read_known(&moved).unwrap().faults;
    assert_eq!(found.len(), 1, "compared with the leaves where the model has them: {found:?}");
    assert_eq!(
        found[0].to_string(),
        "1 instance stands elsewhere in the file than in the model, by up to 0.5, first instance 1"
    );
    assert_eq!(found[0].kind.name(), "instance-moved");
    // A last place or two is rounding.
    let rounded = changed(|draft| draft.matrices[1][3] = 10.0_f32.next_up().next_up());
    assert_eq!(read_known(&rounded).unwrap().faults, []);
    let nan = changed(|draft| draft.matrices[1][3] = f32::NAN);
    assert_eq!(read_known(&nan).unwrap().faults[0].excess, f32::INFINITY);
}

/// A mesh with one leaf for each `size` triangles, and one copy of it in a leaf around `bounds`.
fn one_copy(mesh: &[Triangle], matrix: [f32; 12], bounds: &[f32]) -> LevelDraft {
    let around_all = around(&moved_by(0.0, 0.0, 0.0), mesh);
    let around_all = [around_all.min, around_all.max].map(<[f32; 3]>::from).concat();
    let leaves: Vec<[u32; 2]> =
        (0..mesh.len() as u32).step_by(64).map(|first| [first, 64.min(mesh.len() as u32 - first)]).collect();
    let count = leaves.len();
    let first = NONE;
    let mut of_mesh = Draft {
        bounds: vec![around_all; 1 + count],
        children: vec![vec![first; 2]; 1 + count],
        leaves: [&[[0, 0]][..], &leaves].concat(),
        indices: (0..mesh.len() as u32).collect(),
        corners: Some(mesh.iter().map(|triangle| bytemuck::cast(*triangle)).collect()),
        triangles: mesh.len(),
        ..sample()
    };
    // A list: each interior node has a leaf and the next one.
    for at in 0..count {
        let next = of_mesh.bounds.len() as u32;
        let parent = if at == 0 { 0 } else { next as usize - 1 };
        if at + 2 >= count {
            of_mesh.children[parent] = vec![1 + at as u32, if at + 1 < count { 2 + at as u32 } else { NONE }];
            break;
        }
        of_mesh.children[parent] = vec![1 + at as u32, next];
        of_mesh.bounds.push(of_mesh.bounds[0].clone());
        of_mesh.children.push(vec![NONE; 2]);
        of_mesh.leaves.push([0, 0]);
    }
    let top = Draft {
        bounds: vec![bounds.to_vec()],
        children: vec![vec![NONE; 2]],
        leaves: vec![[0, 1]],
        indices: vec![0],
        corners: None,
        triangles: 1,
        ..sample()
    };
    LevelDraft { trees: vec![of_mesh, top], instances: vec![0], matrices: vec![matrix], ids: None, ..level_sample() }
}

#[test]
fn a_leaf_as_close_as_boxes_can_be_is_right_and_a_last_place_less_is_not() {
    // Turned, so that the corners of no box of a node are corners of triangles; and flat along an axis, so that all triangles touch the leaf.
    let turned = [0.8, -0.6, 0.0, 0.3, 0.48, 0.64, -0.6, 1e3, 0.36, 0.48, 0.8, -7.0];
    let few = trees::soup(500, 0.3, 6);
    let many: Vec<Triangle> = trees::grid(80, 1, 0.1);
    assert!(many.len() > 12_000);
    for (mesh, matrix, is_exact) in [(&few, turned, true), (&many, moved_by(0.3, 0.7, 1e3), false)] {
        let bounds = around(&matrix, mesh);
        let bounds = [bounds.min, bounds.max].map(<[f32; 3]>::from).concat();
        let read = |bounds: &[f32]| faults(&one_copy(mesh, matrix, bounds));
        assert_eq!(read(&bounds), [""; 0]);
        for side in 0..6 {
            let mut closer = bounds.clone();
            let inwards = if side < 3 { closer[side].next_up() } else { closer[side].next_down() };
            // Of more triangles than are compared one by one, what is within rounding is passed over.
            closer[side] = if is_exact { inwards } else { closer[side] + if side < 3 { 0.01 } else { -0.01 } };
            if closer[side % 3] > closer[side % 3 + 3] {
                continue;
            }
            let found = read(&closer);
            assert!(
                found.len() == 1 && found[0].starts_with("1 leaf does not enclose its instances"),
                "{side}: {found:?}"
            );
        }
    }
}

/// Reads damaged bytes in every way.
fn survive(bytes: &[u8]) -> bool {
    let (token, limit) = (CancelToken::new(), 1 << 24);
    let _ = TwoLevelModel::read(bytes, limit, &token);
    let (places, four, one) = (sample_places(), sample_mesh(), [upright(0.0)]);
    let scene = KnownScene { meshes: vec![&four, &one], instances: [0, 0, 1].into_iter().zip(&places).collect() };
    [None, Some(&scene)].into_iter().any(|scene| TwoLevelFile::read(bytes, scene, limit, &token).is_ok())
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    let bytes = level_sample().bytes();
    for end in 0..bytes.len() {
        let error = read_levels(&bytes[..end]).expect_err("a part of a file is none");
        assert!(!error.contains('\n'), "{error}");
    }
    assert!(survive(&bytes));
}

#[test]
fn changed_bytes_are_refused_or_read() {
    let (mut random, whole) = (Random(72), level_sample().bytes());
    let (mut read, mut refused) = (0, 0);
    for _ in 0..6_000 {
        let bytes = damaged(&whole, &mut random);
        *if survive(&bytes) { &mut read } else { &mut refused } += 1;
    }
    assert!(read > 300 && refused > 3_000, "{read} read, {refused} refused");
}

#[test]
fn sizes_that_the_file_does_not_bear_out_cost_nothing() {
    for field in ["nodes", "indices", "triangles", "trees", "instances"] {
        let mut draft = level_sample();
        draft.header.insert(field.to_owned(), u32::MAX.into());
        // No limit: the sizes alone must lead to the refusal.
        let error = draft.read().unwrap_err();
        assert!(error.contains("of the data, which has"), "{field}: {error}");
    }
    // A row of the array beyond the others.
    for tree in 0..3 {
        let mut draft = level_sample();
        draft.trees[tree].triangles = u32::MAX as usize;
        draft.header.insert("triangles".to_owned(), 5.into());
        let error = draft.read().unwrap_err();
        assert!(error.starts_with("array 'trees': "), "{error}");
    }
}
