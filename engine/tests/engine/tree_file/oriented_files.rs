//! Oriented boxes in tree files: directions and planes may be anything, and those above the leaves enclose all triangles below.

use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::tree_file::serde_json::json;
use bvhscope_engine::tree_file::{FaultKind, TreeFile};
use bvhscope_engine::{AnyTree, CancelToken, Ray, WideBvh, with_tree};
use glam::Vec3;

use super::draft::{Draft, header, sample, sample_mesh, upright};

/// The sample with oriented boxes: those along the axes, between planes across the axes.
fn plain() -> Draft {
    let mut draft = sample();
    draft.header = header(json!({"container": "oriented", "arity": 2}));
    for bounds in &mut draft.bounds {
        let (min, max) = (bounds[..3].to_vec(), bounds[3..].to_vec());
        bounds.extend([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        bounds.extend(min);
        bounds.extend(max);
    }
    draft
}

/// Columns of a node: the first coordinate of each direction, then the lower and the upper planes.
const NORMALS: usize = 6;
const LOW: usize = 15;
const HIGH: usize = 18;

fn kinds(file: &TreeFile) -> Vec<(FaultKind, u64, u32)> {
    file.faults.iter().map(|fault| (fault.kind, fault.count, fault.first)).collect()
}

#[test]
fn planes_above_the_leaves_that_cut_off_triangles_are_faults() {
    assert_eq!(plain().read(None).unwrap().faults, []);
    // Node 1 holds the triangles at x = 0 and x = 1, node 0 all four.
    let mut draft = plain();
    draft.bounds[1][HIGH] = 0.75;
    let file = draft.read(None).unwrap();
    assert_eq!(kinds(&file), [(FaultKind::NodeCuts, 1, 1)]);
    assert_eq!(
        file.faults[0].to_string(),
        "1 node cuts off triangles below it, which stick out by up to 0.25, first node 1"
    );
    assert_eq!(file.faults[0].nodes, [1]);
    // Along a direction askew, of half the length: the excess is in world units.
    let mut draft = plain();
    draft.bounds[0][NORMALS..NORMALS + 3].copy_from_slice(&[0.3, 0.4, 0.0]);
    (draft.bounds[0][LOW], draft.bounds[0][HIGH]) = (0.0, 0.9);
    let file = draft.read(None).unwrap();
    assert_eq!(kinds(&file), [(FaultKind::NodeCuts, 1, 0)]);
    // The corner at (3, 1) is at 1.3 / 0.5.
    assert!((file.faults[0].excess - 0.8).abs() < 1e-6, "{file:?}");
    draft.bounds[0][HIGH] = 1.300_001;
    assert_eq!(draft.read(None).unwrap().faults, []);
    // Without triangles nothing is known of it.
    draft.bounds[0][HIGH] = 0.9;
    assert_eq!(Draft { corners: None, ..draft.clone() }.read(None).unwrap().faults, []);
    assert_eq!(kinds(&Draft { corners: None, ..draft }.read(Some(&sample_mesh())).unwrap())[0].0, FaultKind::NodeCuts);
}

#[test]
fn a_node_above_all_parts_of_a_split_triangle_encloses_it_and_others_need_not() {
    let mut draft = plain();
    // The first triangle in two leaves of node 1, the second one in one of these and in node 2.
    draft.indices = vec![0, 1, 0, 1, 2, 3];
    draft.leaves = vec![[0, 0], [0, 0], [3, 3], [0, 2], [2, 1]];
    let whole =
        [0.0, 0.0, 0.0, 3.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 3.0, 1.0, 1.0];
    draft.bounds = vec![whole.to_vec(); 5];
    assert_eq!(draft.read(None).unwrap().faults, []);
    draft.bounds[1][HIGH + 2] = 0.5;
    assert_eq!(kinds(&draft.read(None).unwrap()), [(FaultKind::NodeCuts, 1, 1)], "by the first triangle");
    let mut draft = Draft { indices: vec![1, 1, 0, 0, 2, 3], ..draft };
    draft.leaves = vec![[0, 0], [0, 0], [2, 4], [0, 1], [1, 1]];
    // The second triangle is whole below node 1, and reaches up to z = 1.
    assert_eq!(kinds(&draft.read(None).unwrap()), [(FaultKind::NodeCuts, 1, 1)]);
    draft.indices = vec![1, 0, 1, 0, 2, 3];
    assert_eq!(draft.read(None).unwrap().faults, [], "parts of both");
}

#[test]
fn directions_that_are_too_short_are_refused() {
    for (length, is_refused) in [(3.59e-43_f32, true), (1e-30, true), (1e-10, true), (1e-6, false), (0.1, false)] {
        let mut draft = plain();
        draft.bounds[1][NORMALS + 4] = length;
        // Planes across it at the dot products.
        (draft.bounds[1][LOW + 1], draft.bounds[1][HIGH + 1]) = (0.0, length);
        match draft.read(None) {
            Err(error) => {
                assert!(is_refused && error.contains("node 1 has a direction of length"), "{length}: {error}")
            }
            Ok(file) => assert!(!is_refused && file.faults.is_empty(), "{length}: {:?}", file.faults),
        }
    }
}

/// The wide tree of a file, which must end and hit what is there.
fn hits_all(file: &TreeFile, triangles: &[Triangle]) {
    let wide = WideBvh::new(&file.tree, triangles, &CancelToken::new()).unwrap();
    for (index, triangle) in (0..).zip(triangles) {
        let middle = (triangle.a + triangle.b + triangle.c) / 3.0;
        let hit = wide.closest_hit(&Ray::new(middle - Vec3::X * 0.25, Vec3::X));
        assert_eq!(hit.map(|hit| hit.primitive_index), Some(index), "{triangle:?}");
    }
}

#[test]
fn areas_of_oriented_boxes_are_those_of_their_boxes_along_the_axes_at_most() {
    // Planes as far away as they may be, across short and nearly parallel directions.
    for (directions, plane) in [
        ([1e-5_f32, 0.0, 0.0, 0.0, 1e-5, 0.0, 0.0, 0.0, 1e-5], 3.9e18_f32),
        ([1.0, 0.0, 0.0, 1.0, 2e-3, 0.0, 1.0, 0.0, 2e-3], 3.9e18),
    ] {
        let mut draft = plain();
        for bounds in &mut draft.bounds {
            bounds[NORMALS..LOW].copy_from_slice(&directions);
            bounds[LOW..HIGH].fill(-plane);
            bounds[HIGH..].fill(plane);
        }
        let file = draft.read(None).unwrap();
        assert_eq!(file.faults, []);
        let AnyTree::Oriented(tree) = &file.tree else { panic!("{:?}", file.tree.container_kind()) };
        for node in &tree.nodes {
            assert!(node.container.half_area() <= node.container.bounds.half_area(), "{node:?}");
        }
        hits_all(&file, &sample_mesh());
    }
}

#[test]
fn boxes_whose_areas_add_up_to_infinity_become_a_wide_tree() {
    // 64 triangles, each in a box as large as there may be.
    let triangles: Vec<Triangle> = (0..64).map(|k| upright(k as f32)).collect();
    let reach = 1e18_f32;
    let mut draft = sample();
    draft.triangles = triangles.len();
    draft.corners = Some(triangles.iter().map(|triangle| bytemuck::cast(*triangle)).collect());
    draft.indices = (0..64).collect();
    draft.bounds = vec![vec![-reach, -reach, -reach, reach, reach, reach]; 127];
    draft.leaves = vec![[0, 0]; 63];
    draft.leaves.extend((0..64).map(|k| [k, 1]));
    draft.children = (0..63).map(|node| vec![2 * node + 1, 2 * node + 2]).collect();
    draft.children.resize(127, vec![0; 2]);
    let file = draft.read(None).unwrap();
    with_tree!(&file.tree, tree => assert_eq!(tree.nodes.len(), 127));
    hits_all(&file, &triangles);
}

#[test]
fn a_list_of_oriented_boxes_is_compared_as_far_as_time_allows() {
    // A node for each triangle, one below the other.
    let count = 30_000_u32;
    let triangles: Vec<Triangle> = (0..count).map(|k| upright(k as f32)).collect();
    let mut draft = plain();
    let row = |from: u32| {
        let (from, to) = (from as f32, (count - 1) as f32);
        [from, 0.0, 0.0, to, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, from, 0.0, 0.0, to, 1.0, 1.0]
            .to_vec()
    };
    draft.triangles = count as usize;
    draft.corners = Some(triangles.iter().map(|triangle| bytemuck::cast(*triangle)).collect());
    draft.indices = (0..count).collect();
    // Node 2k is an interior one with the leaf 2k + 1 and the node 2k + 2; the last is a leaf.
    (draft.bounds, draft.leaves, draft.children) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..count - 1 {
        draft.bounds.extend([row(k), row(k)]);
        draft.leaves.extend([[0, 0], [k, 1]]);
        draft.children.extend([vec![2 * k + 1, 2 * k + 2], vec![0, 0]]);
    }
    draft.bounds.push(row(count - 1));
    draft.leaves.push([count - 1, 1]);
    draft.children.push(vec![0, 0]);
    // One of the last nodes cuts off its triangles, and is found.
    let cut = draft.bounds.len() - 21;
    draft.bounds[cut][HIGH + 1] = 0.5;
    let file = draft.read(None).unwrap();
    let [cuts, unchecked] = [&file.faults[0], &file.faults[1]];
    assert_eq!((cuts.kind, cuts.count, cuts.first), (FaultKind::NodeCuts, 1, cut as u32));
    assert_eq!((unchecked.kind, unchecked.first), (FaultKind::NodeUnchecked, 0));
    let expected = format!(
        "{} nodes were not compared with the triangles below, as there are too many levels, first node 0",
        unchecked.count
    );
    assert_eq!(unchecked.to_string(), expected);
    assert!((1_000..29_999).contains(&unchecked.count), "{expected}");
}
