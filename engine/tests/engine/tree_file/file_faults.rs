//! Trees that can be shown and are wrong.

use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::tree_file::serde_json::json;
use bvhscope_engine::tree_file::{Fault, FaultKind, WhichTree};

use super::draft::{Draft, NONE, header, sample, sample_mesh, upright};

/// The faults of a file, read without another mesh.
fn faults(draft: &Draft) -> Vec<Fault> {
    draft.read(None).unwrap().faults
}

#[test]
fn nodes_outside_of_their_parents_are_listed_with_the_largest_excess() {
    let mut draft = sample();
    // By a quarter below and by a half above.
    draft.bounds[3] = vec![0.0, -0.25, 0.0, 0.0, 1.0, 1.0];
    draft.bounds[4] = vec![1.0, 0.0, 0.0, 1.0, 1.0, 1.5];
    let expected = Fault {
        kind: FaultKind::NodeOutside,
        tree: WhichTree::Only,
        count: 2,
        first: 3,
        excess: 0.5,
        nodes: vec![3, 4],
    };
    assert_eq!(faults(&draft), std::slice::from_ref(&expected));
    assert_eq!(expected.to_string(), "2 nodes stick out of their parents by up to 0.5, first node 3");
    // The same nodes under other numbers.
    draft.bounds.swap(2, 4);
    draft.leaves.swap(2, 4);
    draft.children[0] = vec![1, 4];
    draft.children[1] = vec![3, 2];
    let found = faults(&draft);
    assert_eq!((found[0].first, &found[0].nodes[..]), (2, &[3, 4][..]));
}

#[test]
fn a_last_place_of_a_box_counts_and_a_last_place_of_a_sphere_does_not() {
    let mut draft = sample();
    draft.bounds[1][3] = 1.0_f32.next_down();
    let found = faults(&draft);
    assert_eq!((found.len(), found[0].kind, found[0].count), (1, FaultKind::NodeOutside, 1));
    assert_eq!(found[0].to_string(), "1 node sticks out of its parent by up to 5.96e-8, first node 4");
    let ball = |x: f32, radius: f32| vec![x, 0.5, 0.5, radius];
    let mut spheres = Draft {
        header: header(json!({"container": "sphere", "arity": 2})),
        bounds: vec![ball(1.5, 1.66), ball(0.5, 0.867), ball(2.5, 0.867), ball(0.0, 0.7072), ball(1.0, 0.7072)],
        ..sample()
    };
    // The distance of 1 and the radius of 0.867 are 0.207 more than 1.66.
    let found = faults(&spheres);
    assert_eq!(found.iter().map(|fault| fault.kind).collect::<Vec<_>>(), [FaultKind::NodeOutside; 1]);
    assert!((found[0].excess - 0.3402).abs() < 1e-4 && found[0].nodes == [1, 2, 3, 4], "{found:?}");
    spheres.bounds[0][3] = 1.0 + 0.867_f32.next_down();
    spheres.bounds[1][3] = 1.21;
    spheres.bounds[2][3] = 0.8671;
    let found = faults(&spheres);
    assert!((found[0].excess - 0.343).abs() < 1e-3 && found[0].nodes == [1], "{found:?}");
}

#[test]
fn leaves_that_do_not_enclose_their_triangles_are_listed() {
    let mut draft = sample();
    draft.bounds[2] = vec![2.0, 0.0, 0.0, 3.0, 1.0, 0.75];
    let expected =
        Fault { kind: FaultKind::LeafOutside, tree: WhichTree::Only, count: 1, first: 2, excess: 0.25, nodes: vec![2] };
    assert_eq!(faults(&draft), std::slice::from_ref(&expected), "both triangles of the leaf count as one leaf");
    assert_eq!(
        expected.to_string(),
        "1 leaf does not enclose its triangles, which stick out by up to 0.25, first node 2"
    );
    // Without triangles nothing is known of it.
    assert_eq!(faults(&Draft { corners: None, ..draft.clone() }), []);
    assert_eq!(Draft { corners: None, ..draft }.read(Some(&sample_mesh())).unwrap().faults, [expected]);
}

#[test]
fn a_triangle_in_several_leaves_needs_them_all_together() {
    // The first triangle split in the middle of z, in two leaves.
    let mut draft = sample();
    draft.indices = vec![0, 0, 1, 2, 3];
    draft.children = vec![vec![1, 2], vec![3, 4], vec![0, 0], vec![0, 0], vec![0, 0]];
    draft.leaves = vec![[0, 0], [0, 0], [2, 3], [0, 1], [1, 1]];
    draft.bounds[1] = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0];
    draft.bounds[2] = vec![1.0, 0.0, 0.0, 3.0, 1.0, 1.0];
    draft.bounds[3] = vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.5];
    draft.bounds[4] = vec![0.0, 0.0, 0.5, 0.0, 0.5, 1.0];
    assert_eq!(faults(&draft), []);
    draft.bounds[4][5] = 0.875;
    let expected = Fault {
        kind: FaultKind::LeafOutside,
        tree: WhichTree::Only,
        count: 2,
        first: 3,
        excess: 0.125,
        nodes: vec![3, 4],
    };
    assert_eq!(faults(&draft), [expected]);
}

#[test]
fn triangles_in_no_leaf_are_counted() {
    let mut draft = sample();
    draft.indices = vec![0, 0, 2, 2];
    draft.bounds[4] = draft.bounds[3].clone();
    let expected = Fault {
        kind: FaultKind::TriangleMissing,
        tree: WhichTree::Only,
        count: 2,
        first: 1,
        excess: 0.0,
        nodes: Vec::new(),
    };
    assert_eq!(faults(&draft), std::slice::from_ref(&expected));
    assert_eq!(expected.to_string(), "2 triangles are in no leaf, first triangle 1");
    // The same without the triangles, whose number nothing bears out.
    assert_eq!(faults(&Draft { corners: None, ..draft.clone() }), [expected]);
    let draft = Draft { corners: None, triangles: 4_000_000_000, indices: vec![0, 1, 2, 3], ..draft };
    assert_eq!(faults(&draft)[0].to_string(), "3999999996 triangles are in no leaf, first triangle 4");
}

#[test]
fn other_corners_than_those_of_the_model_are_found() {
    let mut mesh: Vec<Triangle> = sample_mesh().to_vec();
    assert_eq!(sample().read(Some(&mesh)).unwrap().faults, []);
    mesh.swap(0, 1);
    let file = sample().read(Some(&mesh)).unwrap();
    let kinds: Vec<FaultKind> = file.faults.iter().map(|fault| fault.kind).collect();
    assert_eq!(kinds, [FaultKind::LeafOutside, FaultKind::TriangleMoved]);
    let expected = "2 triangles have other corners in the file than in the model, by up to 1.0, first triangle 0";
    assert_eq!(file.faults[1].to_string(), expected);
    assert_eq!(file.corners, None);
}

#[test]
fn nodes_that_nothing_reaches_are_counted() {
    let mut draft = sample();
    draft.bounds.extend([vec![f32::NAN; 6], vec![0.0; 6]]);
    // Their contents are not examined: children that are taken, a leaf beyond the indices.
    draft.children.extend([vec![1, 1_000], vec![NONE, NONE]]);
    draft.leaves.extend([[0, 0], [70, 70]]);
    let file = draft.read(None).unwrap();
    let expected = Fault {
        kind: FaultKind::NodeUnreached,
        tree: WhichTree::Only,
        count: 2,
        first: 5,
        excess: 0.0,
        nodes: Vec::new(),
    };
    assert_eq!(file.faults, std::slice::from_ref(&expected));
    assert_eq!(expected.to_string(), "2 nodes are not reached, first node 5");
    assert_eq!(file.tree, sample().read(None).unwrap().tree);
}

#[test]
fn faults_of_large_trees_are_the_same_on_any_number_of_threads() {
    // A root with 32 children, each with as many: all leaves reach out to the right.
    let mut draft = sample();
    draft.header.insert("arity".to_owned(), 32.into());
    let parents = 1 + 32 + 32 * 32;
    let count = 1 + 32 * parents;
    draft.triangles = 32_768;
    draft.indices = (0..32_768).collect();
    draft.corners = Some((0..32_768).map(|k| bytemuck::cast(upright(k as f32 / 1e3))).collect());
    draft.bounds = vec![vec![0.0, 0.0, 0.0, 16.0, 1.0, 1.0]; count];
    draft.leaves = vec![[0, 0]; parents];
    draft.leaves.extend((0..32_768).map(|k| [k, 1]));
    draft.children = (0..parents as u32).map(|node| (32 * node + 1..32 * node + 33).collect()).collect();
    draft.children.resize(count, vec![0; 32]);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| draft.read(None).unwrap())
    };
    let one = on(1);
    assert_eq!(one.faults[0].count, 16_767, "beyond 16");
    assert!((one.faults[0].excess - 16.767).abs() < 1e-3);
    assert_eq!(on(4), one);
}
