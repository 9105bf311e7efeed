//! Tests of rays and costs of two small trees, counted by hand.

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Ray, Sphere, Triangle};
use bvhscope_engine::tree::node_metrics::{empty_space, intersections_of_children, overlap};
use bvhscope_engine::tree::overlap::end_point_overlap;
use bvhscope_engine::tree::statistics::{collapsed_sah_cost, tree_stats};
use bvhscope_engine::tree::traverse::{RayEvent, RayLog, TestCounts, Traversal, any_hit_with, closest_hit};
use bvhscope_engine::tree::validate::validate;
use bvhscope_engine::tree::{AnyTree, Container, Node, Tree};
use glam::Vec3;

use crate::by_hand::{boxes, half_square, triangles};

fn around(x: [f32; 2], yz: [f32; 2]) -> Aabb {
    Aabb { min: Vec3::new(x[0], yz[0], yz[0]), max: Vec3::new(x[1], yz[1], yz[1]) }
}

fn leaf<C>(container: C, first: u32, count: u32) -> Node<C> {
    Node { container, first, count }
}

/// The root has four children: leaf 1 of two triangles, leaf 2, node 3 and leaf 4; node 3 has the leaves 5, 6 and 7.
fn four() -> (Tree<Aabb>, [Triangle; 7]) {
    let at = [0.0, 1.0, 3.0, 4.0, 5.0, 7.0, 2.0];
    let triangles =
        std::array::from_fn(|i| if i == 2 { half_square(3.0, 0.5, 0.5) } else { half_square(at[i], 0.0, 1.0) });
    let nodes = vec![
        Node::interior(around([0.0, 7.0], [0.0, 1.0]), 1, 4),
        leaf(around([0.0, 1.0], [0.0, 1.0]), 0, 2),
        leaf(around([3.0, 3.0], [0.5, 1.0]), 2, 1),
        Node::interior(around([4.0, 7.0], [0.0, 1.0]), 5, 3),
        leaf(around([2.0, 2.0], [0.0, 1.0]), 6, 1),
        leaf(around([4.0, 4.0], [0.0, 1.0]), 3, 1),
        leaf(around([5.0, 5.0], [0.0, 1.0]), 4, 1),
        leaf(around([7.0, 7.0], [0.0, 1.0]), 5, 1),
    ];
    (Tree { nodes, primitive_indices: (0..7).collect(), max_depth: 2 }, triangles)
}

/// Container and primitive tests of the closest hit in both orders and of any hit, and the triangle that is hit.
fn tests<C: Container>(tree: &Tree<C>, triangles: &[Triangle], ray: &Ray) -> ([[u64; 2]; 3], Option<u32>) {
    let leaf_triangles = tree.leaf_triangles(triangles, &CancelToken::new()).unwrap();
    let mut counts = [TestCounts::default(); 3];
    let hits = [Traversal::Ordered, Traversal::Paper].map(|traversal| {
        let count = &mut counts[usize::from(traversal == Traversal::Paper)];
        closest_hit(tree, &leaf_triangles, ray, traversal, count).map(|hit| hit.primitive_index)
    });
    assert_eq!(hits[0], hits[1], "{ray:?}");
    assert_eq!(any_hit_with(tree, &leaf_triangles, ray, &mut counts[2]), hits[0].is_some(), "{ray:?}");
    (counts.map(|count| [count.containers, count.primitives]), hits[0])
}

#[test]
fn rays_through_four_children_take_exactly_the_tests_on_paper() {
    let (tree, triangles) = four();
    assert_eq!(validate(&tree.clone().into(), &triangles), Ok(()));
    // [container tests, primitive tests]: ordered, as in the paper, any hit. Ordered: the root and its four children, of which
    // leaf 2 is missed; two triangles of leaf 1. Leaf 4 and node 3 are beyond. Paper: besides the three leaves of node 3 and
    // their triangles, and that of leaf 4. Any hit: node 3 is farthest; of its three leaves the last, whose triangle is enough.
    let forward = Ray::new(Vec3::new(-1.0, 0.25, 0.25), Vec3::X);
    assert_eq!(tests(&tree, &triangles, &forward), ([[5, 2], [8, 6], [8, 1]], Some(0)));
    // Ordered: node 3 is nearest, and of its leaves the last. Any hit: leaf 1 is farthest, and its first triangle enough.
    let backward = Ray::new(Vec3::new(9.0, 0.25, 0.25), Vec3::NEG_X);
    assert_eq!(tests(&tree, &triangles, &backward), ([[8, 1], [8, 6], [5, 1]], Some(5)));
    // From above, down through leaf 2 alone: the root and its four children; its triangle is seen edge-on and missed.
    let down = Ray::new(Vec3::new(3.0, 2.0, 0.75), Vec3::NEG_Y);
    assert_eq!(tests(&tree, &triangles, &down), ([[5, 1]; 3], None));
    let past = Ray::new(Vec3::new(-9.0, 9.0, 9.0), Vec3::X);
    assert_eq!(tests(&tree, &triangles, &past), ([[1, 0]; 3], None));
}

#[test]
fn the_steps_through_four_children_are_those_on_paper() {
    let (tree, triangles) = four();
    let forward = Ray::new(Vec3::new(-1.0, 0.25, 0.25), Vec3::X);
    let steps = |traversal| {
        let mut log = RayLog::default();
        let leaf_triangles = tree.leaf_triangles(&triangles, &CancelToken::new()).unwrap();
        closest_hit(&tree, &leaf_triangles, &forward, traversal, &mut log);
        log.events().to_vec()
    };
    let enter = |node, t| RayEvent::Enter { node, t };
    let opened = [
        enter(0, 1.0),
        RayEvent::Visit { node: 0 },
        enter(1, 1.0),
        RayEvent::Miss { node: 2 },
        enter(3, 5.0),
        enter(4, 3.0),
    ];
    let first_leaf = [
        RayEvent::Visit { node: 1 },
        RayEvent::Triangle { index: 0, t: Some(1.0) },
        RayEvent::Nearer { t: 1.0 },
        RayEvent::Triangle { index: 1, t: None },
    ];
    // Near to far: leaf 4 before node 3, which therefore is pushed first.
    let ordered = [
        &opened[..],
        &[RayEvent::Push { node: 3 }, RayEvent::Push { node: 4 }],
        &first_leaf,
        &[RayEvent::Pop { node: 4 }, RayEvent::Cull { node: 4, t: 3.0 }],
        &[RayEvent::Pop { node: 3 }, RayEvent::Cull { node: 3, t: 5.0 }],
    ];
    assert_eq!(steps(Traversal::Ordered), ordered.concat());
    // In the order of the nodes: 3 before 4, and nothing is culled.
    let paper = steps(Traversal::Paper);
    assert_eq!(paper[..6], opened);
    assert_eq!(paper[6..12], [&[RayEvent::Push { node: 4 }, RayEvent::Push { node: 3 }], &first_leaf[..]].concat());
    let visits = paper.iter().filter_map(|event| if let RayEvent::Visit { node } = event { Some(*node) } else { None });
    assert_eq!(visits.collect::<Vec<_>>(), [0, 1, 3, 5, 6, 7, 4]);
}

/// Eight leaves, in no order along the ray. The triangles at 0 and 1 are small.
fn eight<C: Container>() -> (Tree<C>, [Triangle; 8]) {
    let at = [3.0, 0.0, 7.0, 1.0, 6.0, 2.0, 5.0, 4.0];
    let triangles: [Triangle; 8] = at.map(|x| half_square(x, 0.0, if x < 2.0 { 1.0 } else { 2.0 }));
    let own = triangles.map(|triangle| C::of_triangle(&triangle));
    let root = own.iter().fold(C::EMPTY, |all, own| all.union(own));
    let leaves = own.iter().zip(0..).map(|(&container, first)| leaf(container, first, 1));
    let nodes = std::iter::once(Node::interior(root, 1, 8)).chain(leaves).collect();
    (Tree { nodes, primitive_indices: (0..8).collect(), max_depth: 1 }, triangles)
}

#[test]
fn rays_through_eight_children_take_exactly_the_tests_on_paper() {
    // It enters the containers of the small triangles at 0 and 1, passes both, and hits that at 2, which is number 5.
    let ray = Ray::new(Vec3::new(-3.0, 0.75, 0.75), Vec3::X);
    let (boxes, triangles) = eight::<Aabb>();
    assert_eq!(validate(&boxes.clone().into(), &triangles), Ok(()));
    // The root and its eight children. Ordered: three triangles; the other leaves begin behind the hit. Any hit: the farthest.
    assert_eq!(tests(&boxes, &triangles, &ray), ([[9, 3], [9, 8], [9, 1]], Some(5)));
    // The sphere at 3 has radius √2 and its centre at a distance of √⅛ from the ray: it begins √1.875 = 1.37 before 3, before
    // the hit. The one at 4 begins at 2.63, behind it.
    let (spheres, triangles) = eight::<Sphere>();
    assert_eq!(validate(&spheres.clone().into(), &triangles), Ok(()));
    assert_eq!(tests(&spheres, &triangles, &ray), ([[9, 4], [9, 8], [9, 1]], Some(5)));
    // Shorter than the distance of the third: three triangles are left for boxes, none is hit.
    let short = Ray { t_max: 4.5, ..ray };
    assert_eq!(tests(&boxes, &triangles, &short), ([[9, 2]; 3], None));
}

#[test]
fn children_at_equal_distances_keep_their_order() {
    let unit = around([0.0, 1.0], [0.0, 1.0]);
    let nodes = std::iter::once(Node::interior(unit, 1, 5)).chain((0..5).map(|slot| leaf(unit, slot, 1))).collect();
    let tree = Tree { nodes, primitive_indices: (0..5).collect(), max_depth: 1 };
    let beside = vec![half_square(9.0, 9.0, 1.0); 5];
    let ray = Ray::new(Vec3::new(-1.0, 0.25, 0.25), Vec3::X);
    let visits = |log: &RayLog| {
        let visited = log.events().iter().filter_map(|event| match event {
            RayEvent::Visit { node } => Some(*node),
            _ => None,
        });
        visited.collect::<Vec<_>>()
    };
    for traversal in Traversal::ALL {
        let mut log = RayLog::default();
        assert_eq!(closest_hit(&tree, &beside, &ray, traversal, &mut log), None);
        assert_eq!(visits(&log), [0, 1, 2, 3, 4, 5], "{traversal:?}");
    }
    let mut log = RayLog::default();
    any_hit_with(&tree, &beside, &ray, &mut log);
    assert_eq!(visits(&log), [0, 1, 2, 3, 4, 5], "any hit");
}

#[test]
fn a_child_that_sticks_out_of_its_parent_is_missed_outside_of_it() {
    let (mut tree, triangles) = four();
    tree.nodes[3].container.max.y = 0.1;
    let along = |y: f32| Ray::new(Vec3::new(3.5, y, 0.05), Vec3::X);
    // The root, its children, the three leaves of node 3: the nearest triangle. Above, node 3 is missed with all below.
    assert_eq!(tests(&tree, &triangles, &along(0.05)), ([[8, 1], [8, 3], [8, 1]], Some(3)));
    assert_eq!(tests(&tree, &triangles, &along(0.5)), ([[5, 0]; 3], None));
}

#[test]
fn costs_are_those_on_paper() {
    let close = |value: f64, expected: f64, what: &str| {
        assert!((value - expected).abs() < 1e-5 * expected, "{what}: {value} instead of {expected}");
    };
    let (tree, _) = four();
    let any = AnyTree::Aabb(tree.clone());
    let stats = tree_stats(&any, &CancelToken::new()).unwrap();
    // Half areas: root 7 + 1 + 7 = 15, leaf 1 has 3, leaf 2 a quarter, node 3 has 7, all other leaves 1.
    // Interior nodes cost 15 + 7, leaves 3·2 + ¼ + 1 + 3·1.
    close(stats.sah_cost.into(), 32.25 / 15.0, "SAH cost");
    // Node 3 as a leaf would cost 7·3 instead of 7 + 3.
    close(collapsed_sah_cost(&any), 32.25 / 15.0, "collapsed SAH cost");
    assert_eq!((stats.nodes, stats.leaves, stats.max_depth, stats.mean_leaf_depth), (8, 6, 2, 1.5));
    assert_eq!((stats.mean_arity, stats.max_arity, stats.is_binary()), (3.5, 4, false));
    assert_eq!(stats.arity_histogram, [0, 0, 0, 1, 1]);
    assert_eq!((stats.nodes_per_depth, stats.leaf_size_histogram), (vec![1, 4, 3], vec![0, 5, 1]));
    assert_eq!(empty_space(&tree, 0), Some(1.0 - (3.0 + 0.25 + 7.0 + 1.0) / (4.0 * 15.0)));
    assert_eq!(empty_space(&tree, 3), Some(1.0 - 3.0 / (3.0 * 7.0)));
    assert_eq!((overlap(&tree, 0), intersections_of_children(&tree, 0).count()), (Some(0.0), 0));
    // A binary tree has two children each, and no other numbers than before.
    let stats = tree_stats(&boxes().into(), &CancelToken::new()).unwrap();
    assert_eq!((stats.mean_arity, stats.max_arity, stats.is_binary()), (2.0, 2, true));
    assert_eq!(stats.arity_histogram, [0, 0, 3]);
}

#[test]
fn overlap_adds_up_over_all_pairs_of_children() {
    // Three cubes of 2 in a row, each half in the next: half areas 12, of the root 20. Pairs of neighbours have a slab of 8 in
    // common, the first and the last a face of 4.
    let cube = |x: f32| around([x, x + 2.0], [0.0, 2.0]);
    let root = around([0.0, 4.0], [0.0, 2.0]);
    let family = |children: &[Aabb]| {
        let leaves = children.iter().zip(0..).map(|(&container, first)| leaf(container, first, 1));
        let arity = children.len() as u32;
        let nodes = std::iter::once(Node::interior(root, 1, arity)).chain(leaves).collect();
        Tree { nodes, primitive_indices: (0..arity).collect(), max_depth: 1 }
    };
    let row = family(&[0.0, 1.0, 2.0].map(cube));
    let close = |value: Option<f32>, expected: f32| assert!((value.unwrap() - expected).abs() < 1e-6, "{value:?}");
    close(overlap(&row, 0), (8.0 + 4.0 + 8.0) / 20.0);
    close(empty_space(&row, 0), 1.0 - 36.0 / 60.0);
    let common: Vec<Aabb> = intersections_of_children(&row, 0).collect();
    let slab = |x: [f32; 2]| around(x, [0.0, 2.0]);
    assert_eq!(common, [slab([1.0, 2.0]), slab([2.0, 2.0]), slab([2.0, 3.0])], "first, outer and second pair");
    assert_eq!((overlap(&row, 1), empty_space(&row, 1), intersections_of_children(&row, 1).count()), (None, None, 0));
    // As large as the node: each of six pairs overlaps wholly.
    let full = family(&[root; 4]);
    assert_eq!((overlap(&full, 0), empty_space(&full, 0)), (Some(6.0), Some(0.0)));
    let single = family(&[cube(0.0)]);
    assert_eq!(overlap(&single, 0), Some(0.0));
    close(empty_space(&single, 0), 1.0 - 12.0 / 20.0);
}

#[test]
fn the_end_point_overlap_of_four_leaves_is_that_on_paper() {
    // The four leaves of the binary tree directly below its root, without the nodes between.
    let binary = boxes();
    let mut nodes = vec![Node::interior(binary.nodes[0].container, 1, 4)];
    nodes.extend_from_slice(&binary.nodes[3..]);
    let tree = Tree { nodes, max_depth: 1, ..binary };
    assert_eq!(validate(&tree.clone().into(), &triangles()), Ok(()));
    // The third triangle, of B, whole in D (three triangles: ·3); the fourth, of C, too; of the fifth a square of ¼ in B.
    let foreign = 0.125 * 3.0 + 0.5 * 3.0 + 0.25;
    let overlap = end_point_overlap(&tree.into(), &triangles(), 7, &CancelToken::new()).unwrap();
    assert!((overlap.value - foreign / 7.625).abs() < 1e-6, "{overlap:?} instead of {}", foreign / 7.625);
}
