//! A tree of four leaves and seven triangles, small enough for paper: its costs, its bytes, and each test of a few rays.

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Ray, Sphere, Triangle};
use bvhscope_engine::tree::overlap::end_point_overlap;
use bvhscope_engine::tree::statistics::{collapsed_sah_cost, tree_stats};
use bvhscope_engine::tree::traverse::{TestCounts, Traversal, any_hit_with, closest_hit};
use bvhscope_engine::tree::validate::validate;
use bvhscope_engine::tree::{AnyTree, Container, Node, Tree};
use bvhscope_engine::{BuildSettings, ContainerKind, build};
use glam::Vec3;

/// Half a square of edge `size` that looks along x, its right angle at (`x`, `at`, `at`). Its area is `size`² / 2.
pub fn half_square(x: f32, at: f32, size: f32) -> Triangle {
    let a = Vec3::new(x, at, at);
    Triangle { a, b: a + Vec3::Y * size, c: a + Vec3::Z * size }
}

/// Leaf A has the first two, B the third, C the fourth, D the last three.
pub fn triangles() -> [Triangle; 7] {
    [
        half_square(0.0, 0.0, 1.0),
        half_square(1.0, 0.0, 1.0),
        half_square(3.0, 0.5, 0.5),
        half_square(4.0, 0.0, 1.0),
        half_square(3.0, 0.0, 2.0),
        half_square(5.0, 0.0, 2.0),
        half_square(6.0, 0.0, 2.0),
    ]
}

/// The root 0 has the children 1 (above the leaves A and B) and 2 (above C and D).
fn tree<C>(containers: [C; 7]) -> Tree<C> {
    let [root, left, right, a, b, c, d] = containers;
    let node = |container, first, count| Node { container, first, count };
    let nodes = vec![
        node(root, 1, 0),
        node(left, 3, 0),
        node(right, 5, 0),
        node(a, 0, 2),
        node(b, 2, 1),
        node(c, 3, 1),
        node(d, 4, 3),
    ];
    Tree { nodes, primitive_indices: (0..7).collect(), max_depth: 2 }
}

pub fn boxes() -> Tree<Aabb> {
    let around =
        |x: [f32; 2], yz: [f32; 2]| Aabb { min: Vec3::new(x[0], yz[0], yz[0]), max: Vec3::new(x[1], yz[1], yz[1]) };
    tree([
        around([0.0, 6.0], [0.0, 2.0]),
        around([0.0, 3.0], [0.0, 1.0]),
        around([3.0, 6.0], [0.0, 2.0]),
        around([0.0, 1.0], [0.0, 1.0]),
        around([3.0, 3.0], [0.5, 1.0]),
        around([4.0, 4.0], [0.0, 1.0]),
        around([3.0, 6.0], [0.0, 2.0]),
    ])
}

fn spheres() -> Tree<Sphere> {
    let around = |x: f32, yz: f32, radius: f32| Sphere { center: Vec3::new(x, yz, yz), radius };
    tree([
        around(2.5, 1.0, 4.5),
        around(1.5, 0.5, 2.0),
        around(4.5, 1.0, 2.25),
        around(0.5, 0.5, 1.0),
        around(3.0, 0.75, 0.4),
        around(4.0, 0.5, 0.75),
        around(4.5, 1.0, 2.25),
    ])
}

#[test]
fn both_trees_are_sound() {
    assert_eq!(validate(&boxes().into(), &triangles()), Ok(()));
    assert_eq!(validate(&spheres().into(), &triangles()), Ok(()));
}

/// Tests of the closest hit in both orders and of any hit, and the triangle that is hit.
fn tests<C: Container>(tree: &Tree<C>, ray: &Ray) -> ([[u64; 2]; 3], Option<u32>) {
    let triangles = triangles();
    let mut counts = [TestCounts::default(); 3];
    let hits = [Traversal::Ordered, Traversal::Paper].map(|traversal| {
        let count = &mut counts[usize::from(traversal == Traversal::Paper)];
        closest_hit(tree, &triangles[..], ray, traversal, count).map(|hit| hit.primitive_index)
    });
    assert_eq!(hits[0], hits[1], "{ray:?}");
    assert_eq!(any_hit_with(tree, &triangles[..], ray, &mut counts[2]), hits[0].is_some(), "{ray:?}");
    (counts.map(|count| [count.containers, count.primitives]), hits[0])
}

fn check_tests<C: Container>(tree: &Tree<C>) {
    // Through A, C and D, and past B. [container tests, primitive tests]: ordered, as in the paper, any hit.
    let forward = Ray::new(Vec3::new(-1.0, 0.25, 0.25), Vec3::X);
    // Ordered: the root, its two children, A and B; two triangles of A. The right child is entered beyond the hit.
    // Paper: besides C and D, and their four triangles.
    // Any hit: the root, its children, the farther one's children C and D; the one triangle of C, which is the farther.
    assert_eq!(tests(tree, &forward), ([[5, 2], [7, 6], [5, 1]], Some(0)), "{:?}", C::KIND);
    // Ordered: the root, its children, C and D; the three triangles of D, which is nearer. C and the left child are beyond.
    // Any hit: the left child is farther; of A and B only A is met, and its first triangle is enough.
    let backward = Ray::new(Vec3::new(7.0, 0.25, 0.25), Vec3::NEG_X);
    assert_eq!(tests(tree, &backward), ([[5, 3], [7, 6], [5, 1]], Some(6)), "{:?}", C::KIND);
    // Past the root: it alone is tested.
    let past = Ray::new(Vec3::new(-9.0, 9.0, 9.0), Vec3::X);
    assert_eq!(tests(tree, &past), ([[1, 0]; 3], None), "{:?}", C::KIND);
    // It ends before the root.
    let short = Ray { t_max: 0.5, ..Ray::new(Vec3::new(-3.0, 0.25, 0.25), Vec3::X) };
    assert_eq!(tests(tree, &short), ([[1, 0]; 3], None), "{:?}", C::KIND);
}

#[test]
fn rays_take_exactly_the_tests_on_paper() {
    check_tests(&boxes());
    check_tests(&spheres());
}

#[test]
fn a_root_that_is_a_leaf_is_not_tested() {
    let mut tree = boxes();
    tree.nodes = vec![Node { container: tree.nodes[0].container, first: 0, count: 7 }];
    tree.max_depth = 0;
    let forward = Ray::new(Vec3::new(-1.0, 0.25, 0.25), Vec3::X);
    assert_eq!(tests(&tree, &forward), ([[0, 7], [0, 7], [0, 1]], Some(0)));
}

#[test]
fn costs_are_those_on_paper() {
    let close = |value: f64, expected: f64, what: &str| {
        assert!((value - expected).abs() < 1e-5 * expected, "{what}: {value} instead of {expected}");
    };
    let (boxes, spheres) = (AnyTree::Aabb(boxes()), AnyTree::Sphere(spheres()));
    let token = CancelToken::new();
    let stats = tree_stats(&boxes, &token).unwrap();
    // Half areas: root 6·2 + 2·2 + 2·6 = 28, left 3 + 1 + 3 = 7, right 6 + 4 + 6 = 16; A 3, B ¼, C 1, D 16.
    // Interior nodes cost 28 + 7 + 16, leaves 3·2 + ¼·1 + 1·1 + 16·3, together 106.25 of 28.
    close(stats.sah_cost.into(), 106.25 / 28.0, "SAH cost of boxes");
    // With D and C as one leaf of four, 16·4 instead of 16 + 1 + 48: one less.
    close(collapsed_sah_cost(&boxes), 105.25 / 28.0, "collapsed SAH cost");
    assert_eq!((stats.nodes, stats.leaves, stats.max_depth, stats.mean_leaf_depth), (7, 4, 2, 2.0));
    assert_eq!((stats.min_leaf_size, stats.mean_leaf_size, stats.max_leaf_size), (1, 1.75, 3));
    assert_eq!((stats.nodes_per_depth, stats.leaf_size_histogram), (vec![1, 2, 4], vec![0, 2, 1, 1]));
    // Squared radii: 20.25 + 4 + 5.0625 for interior nodes; 1·2 + 0.16·1 + 0.5625·1 + 5.0625·3 for leaves.
    let stats = tree_stats(&spheres, &token).unwrap();
    close(stats.sah_cost.into(), (29.3125 + 17.91) / 20.25, "SAH cost of spheres");
}

#[test]
fn the_overlap_is_that_on_paper() {
    // Areas: 0.5 twice, 0.125, 0.5, 2 three times: 7.625. What lies in nodes that do not hold it:
    // - the third triangle, of B, whole in the right child (an interior node: ·1) and in D (three triangles: ·3);
    // - the fourth, of C, whole in D (·3);
    // - the fifth, of D, with a square of 1 in the left child (·1) and with one of ¼ in B (one triangle: ·1).
    let foreign = 0.125 * (1.0 + 3.0) + 0.5 * 3.0 + 1.0 + 0.25;
    let overlap = end_point_overlap(&boxes().into(), &triangles(), 7, &CancelToken::new()).unwrap();
    assert!((overlap.value - foreign / 7.625).abs() < 1e-6, "{overlap:?} instead of {}", foreign / 7.625);
    assert_eq!((overlap.sampled, overlap.triangles, overlap.is_exact()), (7, 7, true));
    // From three triangles, which stand for a third of the surface each: the fourth, at a sixth of it, the sixth and the seventh,
    // which lie in no other node.
    let estimate = end_point_overlap(&boxes().into(), &triangles(), 3, &CancelToken::new()).unwrap();
    assert!((estimate.value - 3.0 / 3.0).abs() < 1e-6, "{estimate:?}");
    // Costs 3, 0 and 0: a standard deviation of √3, and 1.96 of its √3-th part.
    assert!(estimate.margin.is_some_and(|margin| (margin - 1.96).abs() < 1e-5), "{estimate:?}");
    assert_eq!(estimate.estimate_note().as_deref(), Some("±2.0 with 95 % confidence, from 3 of 7 triangles"));
}

#[test]
fn the_overlap_of_a_split_triangle_is_that_on_paper() {
    let [a, b, third, _, fifth, sixth, seventh] = triangles();
    let list = [a, b, third, fifth, sixth, seventh];
    // The fifth triangle above is in C and in D.
    let tree = Tree { primitive_indices: vec![0, 1, 2, 3, 3, 4, 5], ..boxes() };
    let overlap = end_point_overlap(&tree.into(), &list, 7, &CancelToken::new()).unwrap();
    let (foreign, area) = (0.125 * (1.0 + 3.0) + 1.0 + 0.25, 0.5 * 2.0 + 0.125 + 2.0 * 3.0);
    assert!((overlap.value - foreign / area).abs() < 1e-6, "{overlap:?} instead of {}", foreign / area);
    assert_eq!((overlap.sampled, overlap.triangles), (6, 6));
}

#[test]
fn bytes_are_those_of_nodes_and_indices() {
    // A box has six floats, a sphere four, a polytope fourteen; then two numbers per node, and one index per triangle.
    assert_eq!(boxes().bytes(), 7 * (6 + 2) * 4 + 7 * 4);
    assert_eq!(spheres().bytes(), 7 * (4 + 2) * 4 + 7 * 4);
    for container in ContainerKind::ALL {
        let settings = BuildSettings { container, ..BuildSettings::default() };
        let bvh = build(&triangles(), &settings, &CancelToken::new()).unwrap();
        let node = match container {
            ContainerKind::Aabb => 32,
            ContainerKind::Sphere => 24,
            ContainerKind::Dop14 => 64,
            ContainerKind::Oriented => unreachable!("no builder makes them"),
        };
        assert_eq!(bvh.statistics().nodes, 13, "one triangle per leaf");
        assert_eq!(bvh.report().tree_bytes, 13 * node + 7 * 4, "{container:?}");
        assert_eq!(bvh.report().triangle_bytes, 7 * 36, "{container:?}");
        assert_eq!(bvh.report().bytes_per_triangle(), (13 * node + 7 * 4) as f64 / 7.0 + 36.0, "{container:?}");
        let wide = bvh.wide();
        let bytes = (wide.tree.node_bytes() + wide.tree.leaf_bytes()) as f64;
        assert_eq!(wide.bytes_per_triangle(), bytes / 7.0, "{container:?}");
        // Four triangles to a block: their corners, and the index of each.
        assert!(wide.tree.leaf_bytes() >= 2 * 4 * 40 && wide.tree.node_bytes() > 0, "{container:?}");
    }
}
