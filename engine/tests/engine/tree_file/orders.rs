//! Trees whose nodes stand in another order than ours, in exact numbers.

use bvhscope_engine::AnyTree;
use bvhscope_engine::geometry::Aabb;
use bvhscope_engine::tree::{Node, Tree};
use bvhscope_engine::tree_file::serde_json::json;
use glam::Vec3;

use super::draft::{Draft, NONE, header, sample, sample_mesh};

fn around(from: f32, to: f32) -> Aabb {
    Aabb { min: Vec3::new(from, 0.0, 0.0), max: Vec3::new(to, 1.0, 1.0) }
}

#[test]
fn nodes_in_our_order_keep_their_numbers() {
    let file = sample().read(None).unwrap();
    let leaf = |container, first, count| Node { container, first, count };
    let nodes = vec![
        Node::interior(around(0.0, 3.0), 1, 2),
        Node::interior(around(0.0, 1.0), 3, 2),
        leaf(around(2.0, 3.0), 2, 2),
        leaf(around(0.0, 0.0), 0, 1),
        leaf(around(1.0, 1.0), 1, 1),
    ];
    let expected = Tree { nodes, primitive_indices: vec![0, 1, 2, 3], max_depth: 2 };
    assert_eq!(file.tree, AnyTree::Aabb(expected));
    assert_eq!((file.numbers, file.faults, file.empty_nodes), (None, Vec::new(), 0));
    assert_eq!(file.corners.as_deref(), Some(&sample_mesh()[..]));
}

#[test]
fn siblings_are_put_together_behind_their_parents() {
    // The sample in reverse but for the root, and the children of the root exchanged.
    let plain = sample();
    let new = [0, 4, 3, 2, 1_usize];
    let mut draft = plain.clone();
    for (old, &new) in new.iter().enumerate() {
        draft.bounds[new].clone_from(&plain.bounds[old]);
        draft.leaves[new] = plain.leaves[old];
        draft.children[new] = vec![0, 0];
    }
    draft.children[0] = vec![3, 4];
    draft.children[4] = vec![2, 1];
    let file = draft.read(None).unwrap();
    let leaf = |container, first, count| Node { container, first, count };
    // The first child of the root is the leaf now, so that its primitives come first.
    let nodes = vec![
        Node::interior(around(0.0, 3.0), 1, 2),
        leaf(around(2.0, 3.0), 0, 2),
        Node::interior(around(0.0, 1.0), 3, 2),
        leaf(around(0.0, 0.0), 2, 1),
        leaf(around(1.0, 1.0), 3, 1),
    ];
    let expected = Tree { nodes, primitive_indices: vec![2, 3, 0, 1], max_depth: 2 };
    assert_eq!(file.tree, AnyTree::Aabb(expected));
    assert_eq!(file.numbers, Some(vec![0, 3, 4, 2, 1]));
    assert_eq!(file.faults, []);
}

#[test]
fn empty_nodes_are_left_out_and_counted() {
    let mut draft = sample();
    draft.header.insert("arity".to_owned(), 4.into());
    draft.children = vec![vec![5, 1, NONE, 2], vec![3, NONE, 4, NONE], vec![0; 4], vec![0; 4], vec![0; 4]];
    // A node whose only children are empty is empty too; its bounds and theirs may be anything.
    draft.children.extend([vec![6, NONE, 7, NONE], vec![NONE; 4], vec![NONE; 4]]);
    draft.bounds.extend(vec![vec![f32::NAN, 1.0, 1.0, 0.0, f32::INFINITY, 0.0]; 3]);
    draft.leaves.extend([[9, 0]; 3]);
    let file = draft.read(None).unwrap();
    assert_eq!(file.empty_nodes, 3);
    assert_eq!(file.tree, sample().read(None).unwrap().tree);
    assert_eq!((file.numbers, file.faults), (Some(vec![0, 1, 2, 3, 4]), Vec::new()));
}

#[test]
fn nodes_with_one_child_stay() {
    let mut draft = sample();
    draft.children = vec![vec![1, NONE], vec![NONE, 2], vec![3, 4], vec![0, 0], vec![0, 0]];
    draft.bounds = [(0.0, 3.0), (0.0, 3.0), (0.0, 3.0), (0.0, 1.0), (2.0, 3.0)]
        .map(|(from, to)| vec![from, 0.0, 0.0, to, 1.0, 1.0])
        .to_vec();
    draft.leaves = vec![[0, 0], [0, 0], [0, 0], [0, 2], [2, 2]];
    let file = draft.read(None).unwrap();
    let AnyTree::Aabb(tree) = &file.tree else { panic!("boxes") };
    assert_eq!(tree.nodes.iter().map(Node::arity).collect::<Vec<_>>(), [1, 1, 2, 0, 0]);
    assert_eq!((tree.max_depth, file.numbers, file.faults), (3, None, Vec::new()));
}

#[test]
fn a_root_may_be_a_leaf_and_a_tree_may_be_empty() {
    let mut draft = sample();
    (draft.bounds, draft.children, draft.leaves) = (vec![draft.bounds[0].clone()], vec![vec![0, 0]], vec![[0, 4]]);
    let file = draft.read(None).unwrap();
    let nodes = vec![Node { container: around(0.0, 3.0), first: 0, count: 4 }];
    let expected = Tree { nodes, primitive_indices: vec![0, 1, 2, 3], max_depth: 0 };
    assert_eq!(file.tree, AnyTree::Aabb(expected));
    let empty = Draft {
        header: header(json!({"container": "sphere", "arity": 2})),
        bounds: Vec::new(),
        children: Vec::new(),
        leaves: Vec::new(),
        indices: Vec::new(),
        corners: None,
        triangles: 0,
        ..draft
    };
    assert_eq!(empty.read(Some(&[])).unwrap().tree, AnyTree::Sphere(Tree::EMPTY));
    // A root that holds nothing, over no triangles.
    let hollow = Draft { bounds: vec![vec![0.0; 4]], children: vec![vec![NONE; 2]], leaves: vec![[0, 0]], ..empty };
    let file = hollow.read(Some(&[])).unwrap();
    assert_eq!((file.tree, file.empty_nodes), (AnyTree::Sphere(Tree::EMPTY), 1));
}

#[test]
fn a_chain_of_a_million_nodes_is_read() {
    // Each interior node has a leaf and the rest of the chain; numbered from the far end, but for the root.
    let depth = 500_000_u32;
    let count = 2 * depth + 1;
    let number = |step: u32| if step == 0 { 0 } else { count - step };
    let mut draft = sample();
    draft.corners = None;
    draft.triangles = depth as usize + 1;
    draft.bounds = vec![vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0]; count as usize];
    draft.children = vec![vec![NONE; 2]; count as usize];
    draft.leaves = vec![[0, 0]; count as usize];
    draft.indices = (0..=depth).collect();
    for step in 0..depth {
        draft.children[number(2 * step) as usize] = vec![number(2 * step + 2), number(2 * step + 1)];
        draft.leaves[number(2 * step + 1) as usize] = [step, 1];
    }
    draft.leaves[number(2 * depth) as usize] = [depth, 1];
    let file = draft.read(None).unwrap();
    assert_eq!((file.tree.max_depth(), file.tree.node_count()), (depth, count as usize));
    assert_eq!((file.empty_nodes, file.faults), (0, Vec::new()));
    // Depth first: the deepest leaf is the first.
    assert_eq!(file.tree.primitive_indices().first(), Some(&depth));
}
