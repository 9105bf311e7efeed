//! Properties of every tree: the validator accepts what builders make and rejects each kind of damage, tests are
//! counted right, statistics are finite.

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Ray, Sphere, Triangle};
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass, Passes};
use bvhscope_engine::tree::node_metrics::{self, area_share, empty_space, sah_share};
use bvhscope_engine::tree::overlap;
use bvhscope_engine::tree::statistics::{collapsed_sah_cost, tree_stats};
use bvhscope_engine::tree::traverse::{NoProbe, Probe, TestCounts, Traversal, any_hit_with, closest_hit};
use bvhscope_engine::tree::validate::validate;
use bvhscope_engine::tree::{AnyTree, ContainerKind, Tree};
use bvhscope_engine::with_tree;
use glam::Vec3;

use crate::trees;

fn end_point_overlap(tree: &AnyTree, triangles: &[Triangle], max_samples: usize) -> f32 {
    overlap::end_point_overlap(tree, triangles, max_samples, &CancelToken::new()).unwrap().value
}

fn built(triangles: &[Triangle], builder: BuilderKind, container: ContainerKind) -> Option<AnyTree> {
    let settings = BuildSettings { builder, container, ..BuildSettings::default() };
    settings
        .refusal(triangles.len())
        .is_none()
        .then(|| build_binary(triangles, &settings, &CancelToken::new()).expect("nothing to refuse").0)
}

/// Tests over all rays.
fn count(tree: &AnyTree, triangles: &[Triangle], rays: &[Ray], traversal: Traversal) -> TestCounts {
    let mut counts = TestCounts::default();
    with_tree!(tree, tree => {
        let leaf_triangles: Vec<_> = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
        for ray in rays {
            let _ = closest_hit(tree, &leaf_triangles, ray, traversal, &mut counts);
        }
    });
    counts
}

#[test]
fn every_builder_makes_valid_trees_with_finite_numbers() {
    for (name, triangles) in trees::nasty_scenes() {
        for builder in BuilderKind::ALL {
            for container in ContainerKind::ALL {
                let Some(tree) = built(&triangles, builder, container) else { continue };
                assert_eq!(validate(&tree, &triangles), Ok(()), "{name}, {builder:?}, {container:?}");
                let stats = tree_stats(&tree, &CancelToken::new()).unwrap();
                let numbers = [stats.mean_leaf_depth, stats.mean_leaf_size, stats.sah_cost];
                assert!(numbers.iter().all(|x| x.is_finite() && *x >= 0.0), "{name}, {builder:?}, {stats:?}");
                assert_eq!(stats.nodes, 2 * stats.leaves - 1, "{name}, {builder:?}");
                assert_eq!(stats.nodes_per_depth.iter().sum::<u32>() as usize, stats.nodes);
                assert_eq!(stats.nodes_per_depth.len(), tree.max_depth() as usize + 1);
                let primitives: usize =
                    stats.leaf_size_histogram.iter().enumerate().map(|(size, &leaves)| size * leaves as usize).sum();
                assert_eq!(primitives, tree.primitive_indices().len(), "{name}, {builder:?}");
                let most = if builder == BuilderKind::Sbvh { 2 } else { 1 } * triangles.len();
                assert!((triangles.len()..=most).contains(&primitives), "{name}, {builder:?}");
                let overlap = end_point_overlap(&tree, &triangles, 50);
                assert!(overlap.is_finite() && overlap >= 0.0, "{name}, {builder:?}: overlap {overlap}");
            }
        }
    }
}

/// The validator's error about a tree of boxes after `damage`.
fn complaint(damage: impl FnOnce(&mut Tree<Aabb>)) -> String {
    let triangles = trees::soup(40, 0.2, 1);
    let AnyTree::Aabb(mut tree) = trees::halved::<Aabb>(&triangles, 3) else { unreachable!("asked for boxes") };
    assert_eq!(validate(&AnyTree::Aabb(tree.clone()), &triangles), Ok(()), "the tree is sound before");
    damage(&mut tree);
    validate(&AnyTree::Aabb(tree), &triangles).expect_err("the damage must be found")
}

fn leaf(tree: &Tree<Aabb>) -> usize {
    tree.nodes.iter().position(|node| node.count > 1).expect("a leaf of two or more")
}

#[test]
fn the_validator_finds_each_kind_of_damage() {
    let found = |damage: fn(&mut Tree<Aabb>), words: &str| {
        let complaint = complaint(damage);
        assert!(complaint.contains(words), "'{complaint}' should say '{words}'");
    };
    found(|tree| tree.nodes.clear(), "no nodes");
    found(|tree| tree.primitive_indices.truncate(39), "in the list");
    found(|tree| tree.max_depth += 1, "deepest");
    found(|tree| tree.primitive_indices[3] = tree.primitive_indices[4], "and in another");
    found(|tree| tree.primitive_indices[3] = 40, "holds primitive 40 of 40");
    found(|tree| tree.nodes[0].first = 5, "not reached");
    found(|tree| tree.nodes[2].first = tree.nodes[1].first, "two parents");
    found(|tree| tree.nodes[1].first = 0, "before its parent");
    found(|tree| tree.nodes[1].first = u32::MAX, "does not exist");
    found(|tree| tree.nodes[1].container.max.x += 10.0, "sticks out");
    found(|tree| tree.nodes[0].container.max.x = f32::INFINITY, "not finite");
    found(|tree| tree.nodes[0].container.min.y = f32::NAN, "not finite");
    found(|tree| tree.nodes.extend_from_within(1..2), "not reached");
    found(
        |tree| {
            let leaf = leaf(tree);
            tree.nodes[leaf].count -= 1;
        },
        "in no leaf",
    );
    found(
        |tree| {
            // Two leaves of equal size are exchanged.
            let size = tree.nodes[leaf(tree)].count;
            let mut leaves = (0..tree.nodes.len()).filter(|&node| tree.nodes[node].count == size);
            let (first, last) = (leaves.next().expect("one"), leaves.next_back().expect("another"));
            for slot in 0..size {
                let [one, other] = [first, last].map(|leaf| (tree.nodes[leaf].first + slot) as usize);
                tree.primitive_indices.swap(one, other);
            }
            let start = tree.nodes[first].first;
            tree.nodes[first].first = std::mem::replace(&mut tree.nodes[last].first, start);
        },
        "no neighbours",
    );
    found(
        |tree| {
            let leaf = leaf(tree);
            tree.nodes[leaf].count = i32::MAX as u32;
        },
        "ends at slot",
    );
    found(
        |tree| {
            let leaf = leaf(tree);
            let center = tree.nodes[leaf].container.center();
            tree.nodes[leaf].container = Aabb { min: center, max: center };
        },
        "does not hold corner",
    );
}

#[test]
fn the_validator_finds_small_spheres() {
    let triangles = trees::soup(40, 0.2, 1);
    let AnyTree::Sphere(sound) = trees::halved::<Sphere>(&triangles, 3) else { unreachable!("asked for spheres") };
    assert_eq!(validate(&AnyTree::Sphere(sound.clone()), &triangles), Ok(()));
    for node in [0, sound.nodes.len() - 1] {
        let mut tree = sound.clone();
        tree.nodes[node].container.radius *= 0.5;
        validate(&AnyTree::Sphere(tree), &triangles).expect_err("half a sphere holds nothing");
    }
}

#[test]
fn an_empty_tree_is_valid_for_no_triangles_only() {
    let tree = trees::halved::<Aabb>(&[], 1);
    assert_eq!(validate(&tree, &[]), Ok(()));
    validate(&tree, &trees::soup(1, 1.0, 1)).expect_err("a triangle is missing");
    assert_eq!(
        tree_stats(&tree, &CancelToken::new()).unwrap(),
        bvhscope_engine::tree::statistics::TreeStats::default()
    );
    assert_eq!(end_point_overlap(&tree, &[], 10), 0.0);
}

#[test]
fn the_paper_traversal_never_tests_less_than_the_ordered_one() {
    for (seed, (name, triangles)) in trees::nasty_scenes().into_iter().enumerate() {
        let rays = trees::rays(&triangles, 120, seed as u64);
        for container in ContainerKind::ALL {
            for builder in [BuilderKind::Aac, BuilderKind::Lbvh] {
                let Some(tree) = built(&triangles, builder, container) else { continue };
                for ray in &rays {
                    let ordered = count(&tree, &triangles, &[*ray], Traversal::Ordered);
                    let paper = count(&tree, &triangles, &[*ray], Traversal::Paper);
                    assert!(
                        paper.containers >= ordered.containers && paper.primitives >= ordered.primitives,
                        "{name}, {container:?}, {builder:?}, {ray:?}: paper {paper:?}, ordered {ordered:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn without_a_bvh_every_ray_tests_every_triangle_and_no_container() {
    let triangles = trees::soup(57, 0.3, 3);
    let rays: Vec<_> = (0..10).map(|i| Ray::new(Vec3::splat(i as f32), Vec3::NEG_ONE)).collect();
    for container in ContainerKind::ALL {
        let tree = built(&triangles, BuilderKind::None, container).expect("no BVH is never refused");
        for traversal in [Traversal::Ordered, Traversal::Paper] {
            let counts = count(&tree, &triangles, &rays, traversal);
            assert_eq!(counts, TestCounts { containers: 0, primitives: 570 }, "{container:?}, {traversal:?}");
        }
    }
}

#[test]
fn spheres_take_more_tests_than_boxes() {
    let scenes = [("ball", trees::ball(Vec3::ZERO, 1.0, 24)), ("soup", trees::soup(2000, 0.05, 4))];
    for (name, triangles) in scenes {
        let rays = trees::rays(&triangles, 500, 5);
        for traversal in [Traversal::Ordered, Traversal::Paper] {
            let tests = ContainerKind::ALL.map(|container| {
                let tree = built(&triangles, BuilderKind::Aac, container).expect("AAC is never refused");
                let counts = count(&tree, &triangles, &rays, traversal);
                counts.containers + counts.primitives
            });
            assert!(tests[1] > tests[0], "{name}, {traversal:?}: boxes {}, spheres {}", tests[0], tests[1]);
        }
    }
}

#[test]
fn counting_is_free_where_nobody_counts() {
    /// A probe from outside the engine.
    struct Sum<'a>(&'a mut u64);
    impl Probe for Sum<'_> {
        fn container_test(&mut self) {
            *self.0 += 1;
        }
        fn primitive_test(&mut self) {
            *self.0 += 1;
        }
    }
    assert_eq!(size_of::<NoProbe>(), 0, "nothing is carried along");
    let triangles = trees::soup(200, 0.2, 9);
    let AnyTree::Aabb(tree) = trees::halved::<Aabb>(&triangles, 2) else { unreachable!("asked for boxes") };
    let leaf_triangles: Vec<_> = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
    for ray in trees::rays(&triangles, 50, 9) {
        let (mut counts, mut sum) = (TestCounts::default(), 0);
        let silent = closest_hit(&tree, &leaf_triangles, &ray, Traversal::Ordered, &mut NoProbe);
        assert_eq!(closest_hit(&tree, &leaf_triangles, &ray, Traversal::Ordered, &mut counts), silent);
        assert_eq!(closest_hit(&tree, &leaf_triangles, &ray, Traversal::Ordered, &mut Sum(&mut sum)), silent);
        assert_eq!(counts.containers + counts.primitives, sum, "every probe sees every test");
    }
}

#[test]
fn broken_rays_test_nothing_and_any_hit_stops_early() {
    let triangles = trees::soup(300, 0.4, 12);
    let AnyTree::Aabb(tree) = trees::halved::<Aabb>(&triangles, 2) else { unreachable!("asked for boxes") };
    let leaf_triangles: Vec<_> = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
    let any = |ray: &Ray| {
        let mut counts = TestCounts::default();
        (any_hit_with(&tree, &leaf_triangles, ray, &mut counts), counts)
    };
    for direction in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
        assert_eq!(any(&Ray::new(Vec3::ZERO, direction)), (false, TestCounts::default()), "{direction}");
    }
    for ray in trees::rays(&triangles, 100, 13) {
        let mut paper = TestCounts::default();
        let hit = closest_hit(&tree, &leaf_triangles, &ray, Traversal::Paper, &mut paper);
        let (found, counts) = any(&ray);
        assert_eq!(found, hit.is_some());
        assert!(counts.primitives <= paper.primitives && counts.containers <= paper.containers, "{ray:?}");
    }
}

#[test]
fn sah_cost_is_the_formula() {
    // Two unit cubes side by side: half areas 3 and 3 in a root of 5, with 1 and 2 primitives.
    let node = |max_x: f32, min_x: f32, first, count| bvhscope_engine::tree::Node {
        container: Aabb { min: Vec3::new(min_x, 0.0, 0.0), max: Vec3::new(max_x, 1.0, 1.0) },
        first,
        count,
    };
    let nodes = vec![node(2.0, 0.0, 1, 0), node(1.0, 0.0, 0, 1), node(2.0, 1.0, 1, 2)];
    let stats =
        tree_stats(&AnyTree::Aabb(Tree { nodes, primitive_indices: vec![0, 1, 2], max_depth: 1 }), &CancelToken::new())
            .unwrap();
    assert!((stats.sah_cost - (5.0 + 3.0 + 6.0) / 5.0).abs() < 1e-6, "{}", stats.sah_cost);
    assert_eq!((stats.min_leaf_size, stats.max_leaf_size, stats.mean_leaf_size), (1, 2, 1.5));
    assert_eq!((stats.leaf_size_histogram, stats.nodes_per_depth), (vec![0, 1, 1], vec![1, 2]));
}

#[test]
fn overlap_counts_the_foreign_surface_in_each_node() {
    // Two right triangles in the plane z = 0. The second's corner reaches into the first's box.
    let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let first = Triangle { a: at(0.0, 0.0), b: at(2.0, 0.0), c: at(0.0, 2.0) };
    let second = Triangle { a: at(1.0, 1.0), b: at(3.0, 1.0), c: at(1.0, 3.0) };
    let triangles = [first, second];
    let overlap = end_point_overlap(&trees::halved::<Aabb>(&triangles, 1), &triangles, 100);
    // The second covers the unit square [1,2]² of the first's box [0,2]², all of it below x + y = 4. The first only touches
    // the second's box. The total area is 4.
    assert!((overlap - 1.0 / 4.0).abs() < 1e-6, "{overlap}");

    // Far apart, nothing overlaps; coinciding, everything does.
    let far = [first, Triangle { a: second.a + 10.0, b: second.b + 10.0, c: second.c + 10.0 }];
    assert_eq!(end_point_overlap(&trees::halved::<Aabb>(&far, 1), &far, 100), 0.0);
    assert_eq!(end_point_overlap(&trees::halved::<Sphere>(&far, 1), &far, 100), 0.0);
    let twice = [first; 2];
    assert!((end_point_overlap(&trees::halved::<Aabb>(&twice, 1), &twice, 100) - 1.0).abs() < 1e-5);
    assert!((end_point_overlap(&trees::halved::<Sphere>(&twice, 1), &twice, 100) - 1.0).abs() < 1e-5);
}

#[test]
fn a_triangle_of_several_leaves_overlaps_none_of_them() {
    let near = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y };
    let far = Triangle { a: near.a + 9.0, b: near.b + 9.0, c: near.c + 9.0 };
    let AnyTree::Aabb(mut tree) = trees::halved::<Aabb>(&[near, far, near], 1) else { unreachable!("asked for boxes") };
    assert!(end_point_overlap(&AnyTree::Aabb(tree.clone()), &[near, far, near], 100) > 0.5);
    tree.primitive_indices.iter_mut().filter(|index| **index == 2).for_each(|index| *index = 0);
    assert_eq!(end_point_overlap(&AnyTree::Aabb(tree), &[near, far], 100), 0.0);
}

#[test]
fn samples_of_a_split_tree_estimate_the_overlap_of_all() {
    let triangles = trees::soup(2000, 0.3, 5);
    let settings = BuildSettings { optimize: Passes::NONE.with(Pass::Split), ..BuildSettings::default() };
    let (tree, _) =
        build_binary(&triangles, &settings, &CancelToken::new()).expect("nothing to refuse, nobody cancels");
    assert!(tree.primitive_indices().len() > triangles.len());
    let exact = end_point_overlap(&tree, &triangles, usize::MAX);
    let estimate = end_point_overlap(&tree, &triangles, 600);
    assert!(exact > 0.0 && (estimate / exact - 1.0).abs() < 0.1, "{estimate} for {exact}");
}

#[test]
fn a_disc_inside_a_large_triangle_has_its_exact_area() {
    // A small ball around a speck lies across a large triangle: what it cuts out is a disc, whole, cut by an edge, and around
    // the corner at the top, where the edges span twice the angle whose tangent is ½.
    let pi = std::f32::consts::PI;
    for (x, y, z, area) in [
        (0.0, 0.0, 0.0, pi),
        (0.0, 0.0, 0.6, 0.64 * pi),
        (0.0, -9.0, 0.0, pi / 2.0),
        // All but a segment of 120°.
        (0.0, -8.5, 0.0, pi - (pi / 3.0 - 0.75_f32.sqrt() / 2.0)),
        (0.0, 9.0, 0.0, 0.5_f32.atan()),
    ] {
        check_disc(Vec3::new(x, y, z), area);
    }
}

fn check_disc(center: Vec3, disc: f32) {
    let speck = |x: f32| Triangle { a: Vec3::new(x, 0.0, 0.0), b: Vec3::new(x, 0.0, 1e-3), c: Vec3::new(x, 1e-3, 0.0) };
    let wall = Triangle { a: Vec3::new(-9.0, -9.0, 0.0), b: Vec3::new(9.0, -9.0, 0.0), c: Vec3::new(0.0, 9.0, 0.0) };
    let triangles = [speck(0.0), wall];
    let AnyTree::Sphere(mut tree) = trees::halved::<Sphere>(&triangles, 1) else { unreachable!("asked for spheres") };
    let leaf = tree.nodes.iter().position(|node| node.is_leaf() && tree.primitive_indices[node.first as usize] == 0);
    tree.nodes[leaf.expect("the speck has a leaf")].container = Sphere { center, radius: 1.0 };
    let tree = AnyTree::Sphere(tree);
    let wall_area = 162.0;
    let overlap = end_point_overlap(&tree, &triangles, 100);
    // The speck lies in the wall's own sphere too, but has no surface worth counting.
    assert!((overlap - disc / wall_area).abs() < 1e-4, "{center}: {overlap} instead of {}", disc / wall_area);
}

#[test]
fn a_sample_estimates_the_overlap_of_all() {
    let triangles = trees::soup(3000, 0.1, 21);
    let tree = built(&triangles, BuilderKind::Aac, ContainerKind::Aabb).expect("AAC is never refused");
    let exact = end_point_overlap(&tree, &triangles, usize::MAX);
    let estimate = end_point_overlap(&tree, &triangles, 600);
    assert!(exact > 0.0 && (estimate / exact - 1.0).abs() < 0.1, "{estimate} for {exact}");
}

#[test]
fn costs_overlap_and_shares_do_not_depend_on_the_size() {
    let triangles = trees::soup(300, 0.4, 17);
    let numbers = |size: f32| {
        let scaled = |t: &Triangle| Triangle { a: t.a * size, b: t.b * size, c: t.c * size };
        let triangles: Vec<Triangle> = triangles.iter().map(scaled).collect();
        ContainerKind::ALL.map(|kind| {
            let tree = built(&triangles, BuilderKind::Aac, kind).unwrap();
            let stats = tree_stats(&tree, &CancelToken::new()).unwrap();
            let of_nodes = with_tree!(&tree, tree => {
                let (share, empty, overlap) = (area_share(tree, 1), empty_space(tree, 0), node_metrics::overlap(tree, 0));
                [share, sah_share(tree, 1, &stats), empty.unwrap(), overlap.unwrap()]
            });
            let costs = [stats.sah_cost, collapsed_sah_cost(&tree) as f32, end_point_overlap(&tree, &triangles, 1000)];
            costs.into_iter().chain(of_nodes).collect::<Vec<f32>>()
        })
    };
    let ordinary = numbers(1.0);
    assert!(ordinary.iter().flatten().all(|&number| number > 0.0), "{ordinary:?}");
    // Powers of two about 1e-30, 1e-20, 1e-9, 1e10 and 1e17.
    for exponent in [-100, -66, -30, 33, 56] {
        let found = numbers((exponent as f32).exp2());
        for (found, ordinary) in found.iter().flatten().zip(ordinary.iter().flatten()) {
            assert!((found - ordinary).abs() <= ordinary * 1e-4, "2^{exponent}: {found} instead of {ordinary}");
        }
    }
}
