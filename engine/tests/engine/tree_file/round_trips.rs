//! Trees that were written and read again.

use bvhscope_engine::geometry::{Aabb, Dop14, OrientedBox, Sphere, Triangle};
use bvhscope_engine::settings::{BuilderKind, Passes};
use bvhscope_engine::tree::{Container, ContainerKind, Tree};
use bvhscope_engine::tree_file::serde_json::{Value, json};
use bvhscope_engine::tree_file::{Header, TreeFile, read_corners, read_header, write_corners, write_tree};
use bvhscope_engine::wide::{WideContainer, WideTree};
use bvhscope_engine::{AnyTree, BuildSettings, CancelToken, Cancelled, Preset, WideBvh, with_tree};
use proptest::prelude::*;

use super::draft::{Draft, header, is_cancelled, read, sample, sample_mesh, written};
use super::n_ary::{random_tree, scrambled};
use crate::random::Random;
use crate::trees;

/// Writes and reads `tree`, with and without its triangles, and expects it back without faults.
fn assert_comes_back(tree: &AnyTree, triangles: &[Triangle], what: &str) {
    let about = Header::new(triangles.len());
    for corners in [None, Some(triangles)] {
        let bytes = written(tree, &about, corners);
        for mesh in [None, Some(triangles)] {
            let file = read(&bytes, mesh).unwrap_or_else(|error| panic!("{what}: {error}"));
            assert!(file.tree == *tree, "{what}: another tree");
            assert_eq!(file.faults, [], "{what}");
            assert_eq!((file.numbers, file.empty_nodes), (None, 0), "{what}");
            let kept = corners.filter(|_| mesh.is_none());
            assert_eq!(file.corners.as_deref(), kept, "{what}");
        }
    }
}

#[test]
fn trees_of_every_builder_come_back_node_for_node() {
    let scenes = [("soup", trees::soup(700, 0.2, 3)), ("one", trees::soup(1, 0.5, 4)), ("none", Vec::new())];
    for (name, triangles) in &scenes {
        for builder in BuilderKind::ALL {
            for container in ContainerKind::ALL {
                for optimize in [Passes::NONE, Passes::ALL] {
                    let settings =
                        BuildSettings { builder, container, optimize, rounds: 6, ..BuildSettings::default() };
                    if settings.refusal(triangles.len()).is_some() {
                        continue;
                    }
                    let bvh = bvhscope_engine::build(triangles, &settings, &CancelToken::new()).unwrap();
                    let what = format!("{name}, {} {} {optimize}", builder.name(), container.name());
                    assert_comes_back(bvh.tree(), triangles, &what);
                    let wide = bvh.wide().tree.to_tree(bvh.tree(), &CancelToken::new()).unwrap().unwrap();
                    assert_comes_back(&wide, triangles, &format!("{what}, wide"));
                }
            }
        }
    }
}

#[test]
fn an_exported_wide_tree_has_the_nodes_of_the_wide_tree() {
    let triangles = trees::soup(3_000, 0.1, 9);
    for container in ContainerKind::ALL {
        let settings = BuildSettings::preset(Preset::Fast, container);
        let bvh = bvhscope_engine::build(&triangles, &settings, &CancelToken::new()).unwrap();
        let wide: &WideBvh = bvh.wide();
        let exported = wide.tree.to_tree(bvh.tree(), &CancelToken::new()).unwrap().unwrap();
        with_tree!(&exported, tree => {
            let [interior, leaves]: [Vec<_>; 2] = [
                tree.nodes.iter().filter(|node| !node.is_leaf()).collect(),
                tree.nodes.iter().filter(|node| node.is_leaf()).collect(),
            ];
            bvhscope_engine::with_wide_tree!(&wide.tree, wide => assert_same_nodes(wide, interior.len(), leaves.len()));
            let arities: Vec<u32> = interior.iter().map(|node| node.arity()).collect();
            assert!(arities.iter().all(|arity| (2..=8).contains(arity)) && arities.contains(&8), "{arities:?}");
            let mut primitives = tree.primitive_indices.clone();
            primitives.sort_unstable();
            assert!(primitives.into_iter().eq(0..3_000), "each triangle once");
        });
        let file = read(&written(&exported, &Header::new(3_000), None), Some(&triangles)).unwrap();
        assert_eq!((file.header.arity, file.faults), (8, Vec::new()));
    }
}

fn assert_same_nodes<C: WideContainer>(wide: &WideTree<C>, interior: usize, leaves: usize) {
    let leaf_children = wide.all_nodes().flat_map(|node| wide.children_of(node)).filter(|child| child.is_leaf());
    assert_eq!((wide.all_nodes().count(), leaf_children.count()), (interior, leaves));
}

#[test]
fn what_a_file_says_of_its_tree_is_kept() {
    let mut draft = sample();
    draft.header.extend(header(json!({
        "builder": "mine", "settings": {"bins": 8}, "build_ms": 12.5, "arity": 5, "x_note": ["a", 1], "unit": "m",
    })));
    draft.children.iter_mut().for_each(|row| row.resize(5, u32::MAX));
    let file = draft.read(None).unwrap();
    assert_eq!(file.header.builder.as_deref(), Some("mine"));
    assert_eq!(file.header.settings_text().as_deref(), Some("{\"bins\":8}"));
    assert_eq!((file.header.build_ms, file.header.arity, file.header.triangles), (Some(12.5), 5, 4));
    assert_eq!(Value::Object(file.header.other.clone()), json!({"x_note": ["a", 1], "unit": "m"}));
    let again = read(&written(&file.tree, &file.header, file.corners.as_deref()), None).unwrap();
    assert_eq!(again, file);
    assert_eq!(read_header(&draft.bytes()).unwrap(), file.header);
    // A text is a text, and null is as good as nothing.
    draft.header.extend(header(json!({"settings": "bins 8", "builder": null, "build_ms": null})));
    let file = draft.read(None).unwrap();
    assert_eq!(file.header.settings_text().as_deref(), Some("bins 8"));
    assert_eq!((file.header.builder, file.header.build_ms), (None, None));
}

#[test]
fn times_are_kept_to_the_last_digit() {
    let mut draft = sample();
    for step in 1..2000 {
        let build_ms = f64::from(step) * 0.006_289_813;
        draft.header.extend(header(json!({ "build_ms": build_ms })));
        assert_eq!(read_header(&draft.bytes()).unwrap().build_ms, Some(build_ms));
    }
}

#[test]
fn fields_of_the_format_are_not_taken_from_the_others() {
    let file = sample().read(None).unwrap();
    let other = header(json!({"nodes": 7, "arrays": {}, "container": "sphere", "builder": "not this"}));
    let bytes = written(&file.tree, &Header { other, ..file.header.clone() }, None);
    assert_eq!(read(&bytes, None).unwrap().header, file.header);
}

#[test]
fn arrays_may_stand_anywhere() {
    let draft = sample();
    let expected = draft.read(None).unwrap();
    let bytes = draft.bytes();
    let data = bytes.len() - 4 * (5 * 6 + 5 * 2 + 5 * 2 + 4 + 4 * 9);
    let part = |from: usize, count: usize| &bytes[data + 4 * from..data + 4 * (from + count)];
    let parts = [
        ("leaves", part(40, 10)),
        ("corners", part(54, 36)),
        ("bounds", part(0, 30)),
        ("indices", part(50, 4)),
        ("children", part(30, 10)),
    ];
    // In another order, with gaps, at odd places.
    let (mut begins, mut moved) = (json!({}), vec![0xAA; 3]);
    for (name, bytes) in parts {
        begins[name] = moved.len().into();
        moved.extend(bytes);
        moved.extend([0xFF; 5]);
    }
    let fields = json!({
        "container": "box", "arity": 2, "nodes": 5, "indices": 4, "triangles": 4, "arrays": begins,
    });
    let mut file = format!("bvhscope tree 1\n{fields}\n").into_bytes();
    file.extend(moved);
    assert_eq!(read(&file, None).unwrap(), expected);
}

#[test]
fn triangles_can_be_read_and_written_alone() {
    let mesh = sample_mesh();
    let token = CancelToken::new();
    assert_eq!(read_corners(&sample().bytes(), 1_000, &token).unwrap(), mesh);
    let error = read_corners(&sample().bytes(), 100, &token).unwrap_err();
    assert_eq!(error.to_string(), "the tree would need about 144 bytes of memory, 100 are allowed");
    let mut bytes = Vec::new();
    write_corners(&mesh, &mut bytes, &token).unwrap();
    let expected: Vec<u8> = sample().corners.unwrap().concat().into_iter().flat_map(f32::to_le_bytes).collect();
    assert_eq!(bytes, expected);
    let without = Draft { corners: None, ..sample() };
    let error = read_corners(&without.bytes(), 1_000, &token).unwrap_err().to_string();
    assert_eq!(error, "is a tree without its triangles: it has no array 'corners'");
}

#[test]
fn a_cancelled_token_ends_reading_and_writing() {
    let token = CancelToken::new();
    token.cancel();
    let error = TreeFile::read(&sample().bytes(), None, u64::MAX, &token).unwrap_err();
    assert_eq!(error, Cancelled.into());
    let file = sample().read(None).unwrap();
    let error = write_tree(&file.tree, &file.header, None, &mut Vec::new(), &token).unwrap_err();
    assert!(is_cancelled(&error), "{error}");
}

#[test]
fn the_memory_limit_is_obeyed_before_anything_is_allocated() {
    let triangles = trees::soup(1_000, 0.1, 5);
    let bvh = bvhscope_engine::build(&triangles, &BuildSettings::default(), &CancelToken::new()).unwrap();
    let bytes = written(bvh.tree(), &Header::new(1_000), Some(&triangles));
    let with = |limit: u64| TreeFile::read(&bytes, None, limit, &CancelToken::new()).map(|file| file.tree);
    let error = with(50_000).unwrap_err().to_string();
    assert!(error.ends_with("50000 are allowed"), "{error}");
    let needed: u64 = error.split_whitespace().find_map(|word| word.parse().ok()).unwrap();
    // The tree, its triangles, and as much again while it is put together.
    let result = bvh.tree().bytes() as u64 + 36_000;
    assert!((result..4 * result).contains(&needed), "{needed} for {result}");
    assert_eq!(with(needed - 1).unwrap_err().to_string().split_whitespace().last(), Some("allowed"));
    assert_eq!(with(needed).unwrap(), *bvh.tree());
}

/// Round trips of random trees with containers of kind `C`, in our order and in any other.
fn check_random<C: Container + bytemuck::Pod>(triangles: &[Triangle], arity: u32, seed: u64)
where
    AnyTree: From<Tree<C>>,
{
    let mut random = Random(seed);
    let tree = random_tree::<C>(triangles, arity, &mut random);
    let any = AnyTree::from(tree.clone());
    assert_comes_back(&any, triangles, "in our order");
    let empty = random.below(20);
    let (draft, numbers) = scrambled(&tree, triangles, arity, empty, &mut random);
    let file = draft.read(Some(triangles)).unwrap();
    assert!(file.tree == any, "the same tree from another order");
    let unused = draft.header["unused"].as_u64().unwrap();
    assert_eq!(u64::from(file.empty_nodes), empty as u64 - unused);
    let in_file = file.numbers.unwrap_or_else(|| (0..tree.nodes.len() as u32).collect());
    assert_eq!(in_file, numbers);
    let unreached: Vec<u64> = file.faults.iter().map(|fault| fault.count).collect();
    assert_eq!(unreached, if unused > 0 { vec![unused] } else { vec![] }, "{:?}", file.faults);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(2), ..ProptestConfig::default() })]

    #[test]
    fn random_trees_of_any_arity_and_order(
        count in 1_usize..200,
        arity in prop::sample::select(vec![2_u32, 3, 8, 32]),
        seed in any::<u64>(),
    ) {
        let triangles = trees::soup(count, 0.3, seed);
        check_random::<Aabb>(&triangles, arity, seed);
        check_random::<Sphere>(&triangles, arity, seed);
        check_random::<Dop14>(&triangles, arity, seed);
        check_random::<OrientedBox>(&triangles, arity, seed);
    }
}
