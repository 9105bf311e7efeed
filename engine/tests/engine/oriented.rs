//! Oriented boxes as a pass over trees of any builder: the same hits as a scan, the same topology, and smaller boxes.

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::geometry::{Aabb, OrientedBox, OrientedKind, Ray, Triangle};
use bvhscope_engine::tree::Tree;
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::validate::validate;
use bvhscope_engine::{AnyTree, BuildSettings, CancelToken, ContainerKind, Pass, Passes, fingerprint, orient};
use glam::{Mat3, Vec3};

use crate::any_arity::{ARITIES, irregular, widened};
use crate::brute_force::check;
use crate::random::Random;
use crate::trees::{self, scan};

fn oriented(tree: AnyTree, triangles: &[Triangle]) -> AnyTree {
    orient(&tree, triangles, &CancelToken::new()).unwrap()
}

fn nodes(tree: &AnyTree) -> &Tree<OrientedBox> {
    let AnyTree::Oriented(tree) = tree else { panic!("a tree of {:?}", tree.container_kind()) };
    tree
}

/// Strands of thin triangles in all directions, `scale` long, around a point `offset` scales away.
fn strands(count: usize, scale: f32, offset: f32, seed: u64) -> Vec<Triangle> {
    let mut random = Random(seed);
    let mut all = Vec::new();
    for _ in 0..count {
        let (mut at, along, side) =
            (random.vector() + Vec3::splat(offset), random.vector() * 0.2, random.vector() * 0.01);
        for _ in 0..6 {
            let next = at + along + random.vector() * 0.02;
            all.push(Triangle { a: at, b: next, c: at + side });
            all.push(Triangle { a: next, b: next + side, c: at + side });
            at = next;
        }
    }
    all.iter().map(|t| Triangle { a: t.a * scale, b: t.b * scale, c: t.c * scale }).collect()
}

/// A room of grids, turned.
fn turned_room() -> Vec<Triangle> {
    let (_, room) = trees::nasty_scenes().into_iter().find(|(name, _)| *name == "room of grids").unwrap();
    let turn = Mat3::from_rotation_y(0.4) * Mat3::from_rotation_x(0.7);
    room.iter().map(|t| Triangle { a: turn * t.a, b: turn * t.b, c: turn * t.c }).collect()
}

/// Scenes of all sizes, near the origin and far from it, degenerate ones among them.
fn scenes() -> Vec<(String, Vec<Triangle>)> {
    let mut all: Vec<(String, Vec<Triangle>)> =
        trees::nasty_scenes().into_iter().map(|(name, triangles)| (name.to_owned(), triangles)).collect();
    for (at, (scale, offset)) in
        [(1.0, 0.0), (1.0, 100.0), (1e-3, 1e5), (1e6, 1.0), (1e-12, 0.0), (1e-21, 0.0), (1e17, 0.0), (2e18, 0.0)]
            .into_iter()
            .enumerate()
    {
        all.push((format!("strands of {scale}, {offset} away"), strands(12, scale, offset, at as u64)));
    }
    all.push(("turned room".to_owned(), turned_room()));
    all
}

/// Rays in the planes and along the edges of oriented boxes, whose tests are all about rounding.
fn rays_along(tree: &Tree<OrientedBox>, count: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random(seed);
    let mut rays = Vec::new();
    for _ in 0..count {
        let container = &tree.nodes[random.below(tree.nodes.len())].container;
        let corners = container.corners().map(|corner| corner.as_vec3());
        let [a, b, c] = [0; 3].map(|_| corners[random.below(8)]);
        let size = container.bounds.extent().length().max(f32::MIN_POSITIVE);
        let along = (b - a).normalize_or(Vec3::X);
        // Along an edge or a diagonal of the box or of a side, from outside, and in a side.
        rays.push(Ray::new(a - along * size, along));
        rays.push(Ray::new(c, along));
        rays.push(Ray::new(a.lerp(c, 0.3) - along * size * 3.0, along));
        let normal = container.normals[random.below(3)].normalize();
        rays.push(Ray::new(a - normal * size, normal));
    }
    rays.into_iter().filter(|ray| ray.origin.is_finite() && ray.direction.is_finite()).collect()
}

#[test]
fn oriented_trees_hit_what_a_scan_hits() {
    for (seed, (name, triangles)) in scenes().into_iter().enumerate() {
        for (leaf_size, most) in [(1, 160), (4, 80)] {
            let tree = oriented(trees::halved::<Aabb>(&triangles, leaf_size), &triangles);
            let mut rays = trees::rays(&triangles, most, 40 + seed as u64);
            rays.extend(rays_along(nodes(&tree), 40, seed as u64));
            let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
            check(&format!("{name}, leaves of {leaf_size}"), &triangles, &tree, &rays, &expected);
        }
        let built = BuildSettings { optimize: Passes::FINISHED.with(Pass::Orient), ..BuildSettings::default() };
        let (tree, times) = build_binary(&triangles, &built, &CancelToken::new()).unwrap();
        assert_eq!(tree.container_kind(), ContainerKind::Oriented, "{name}");
        assert_eq!(times.stages.last().map(|(name, _)| *name), Some("orient"));
        let rays = trees::rays(&triangles, 80, seed as u64);
        let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
        check(&format!("{name}, built"), &triangles, &tree, &rays, &expected);
    }
}

#[test]
fn trees_of_any_arity_are_oriented_and_hit_the_same() {
    let triangles = strands(30, 1.0, 3.0, 5);
    let binary = trees::halved::<Aabb>(&triangles, 2);
    let rays = trees::rays(&triangles, 120, 6);
    let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
    for arity in ARITIES {
        for tree in [widened(&binary, arity), irregular(&binary, arity, 9)] {
            let tree = oriented(tree, &triangles);
            check(&format!("arity {arity}"), &triangles, &tree, &rays, &expected);
        }
    }
}

#[test]
fn split_triangles_are_still_hit_once_and_a_chain_is_no_trouble() {
    let triangles = [turned_room(), trees::soup(60, 1.5, 4)].concat();
    let rays = trees::rays(&triangles, 160, 3);
    let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
    let passes = Passes::NONE.with(Pass::Split).with(Pass::Orient);
    let settings = BuildSettings { optimize: passes, ..BuildSettings::default() };
    let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
    assert!(tree.primitive_indices().len() > triangles.len(), "something is split");
    check("split", &triangles, &tree, &rays, &expected);
    let chain = oriented(trees::chain::<Aabb>(&triangles), &triangles);
    check("chain", &triangles, &chain, &rays, &expected);
    // The looks that fitting takes are bounded: the large nodes of a long chain are not turned, though that would pay.
    let at = |i: u16| Vec3::new(5.0, 3.0, 1.0) * f32::from(i);
    let long: Vec<Triangle> =
        (0..4_000).map(|i| Triangle { a: at(i), b: at(i + 1), c: at(i) + Vec3::X * 0.1 }).collect();
    let chain = oriented(trees::chain::<Aabb>(&long), &long);
    let kind = |node: usize| nodes(&chain).nodes[node].container.kind();
    assert_ne!(kind(0), OrientedKind::Fitted, "of 4,000 triangles");
    assert_eq!(kind(2 * 3_800), OrientedKind::Fitted, "of 200 triangles");
}

#[test]
fn nodes_stay_and_boxes_shrink() {
    let of = |triangles: &[Triangle]| {
        let plain = trees::halved::<Aabb>(triangles, 2);
        let tree = oriented(plain.clone(), triangles);
        let AnyTree::Aabb(plain) = plain else { unreachable!("halved to boxes") };
        let tree = nodes(&tree).clone();
        assert_eq!((&tree.primitive_indices, tree.max_depth), (&plain.primitive_indices, plain.max_depth));
        for (own, other) in tree.nodes.iter().zip(&plain.nodes) {
            assert_eq!((own.first, own.count, own.container.bounds), (other.first, other.count, other.container));
            let share = own.container.half_area() / other.container.half_area();
            match own.container.kind() {
                OrientedKind::Plain => assert_eq!(own.container, OrientedBox::plain(other.container)),
                _ => assert!(share < 0.98, "{share}: {:?}", own.container),
            }
        }
        assert_eq!(tree.to_plain(&CancelToken::new()).unwrap(), plain);
        let share = |kind| tree.nodes.iter().filter(|node| node.container.kind() == kind).count() as f32;
        OrientedKind::ALL.map(|kind| share(kind) / tree.nodes.len() as f32)
    };
    let [plain, fitted, skewed] = of(&strands(200, 1.0, 0.0, 8));
    assert!(plain < 0.1 && fitted > 0.5 && skewed > 0.01, "{plain} {fitted} {skewed}");
    let (_, room) = trees::nasty_scenes().into_iter().find(|(name, _)| *name == "room of grids").unwrap();
    let [plain, ..] = of(&room);
    assert!(plain > 0.85, "walls along the axes have their boxes: {plain}");
    let [plain, ..] = of(&turned_room());
    assert!(plain < 0.2, "turned ones have not: {plain}");
}

#[test]
fn a_tree_is_the_same_on_any_number_of_threads_and_other_trees_are_let_be() {
    let triangles = strands(900, 1.0, 2.0, 3);
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| oriented(trees::halved::<Aabb>(&triangles, 1), &triangles))
    };
    let one = with_threads(1);
    let hash = |tree: &AnyTree| fingerprint::of_tree(tree, &CancelToken::new()).unwrap();
    for threads in [2, 5] {
        let other = with_threads(threads);
        assert!(other == one && hash(&other) == hash(&one), "{threads} threads");
    }
    let spheres = trees::halved::<bvhscope_engine::Sphere>(&triangles, 1);
    assert!(oriented(spheres.clone(), &triangles) == spheres);
    assert_eq!(oriented(trees::halved::<Aabb>(&[], 1), &[]).node_count(), 0);
    let again = oriented(one.clone(), &triangles);
    assert!(again == one, "a second time changes nothing");
}

#[test]
fn the_pass_needs_boxes_and_no_builder_makes_oriented_ones() {
    let all = Passes::NONE.with(Pass::Orient);
    for container in [ContainerKind::Sphere, ContainerKind::Dop14] {
        let settings = BuildSettings { container, optimize: all, ..BuildSettings::default() };
        assert_eq!((settings.passes(), settings.tree_container()), (Passes::NONE, container));
    }
    let settings = BuildSettings { optimize: all, ..BuildSettings::default() };
    assert_eq!(settings.tree_container(), ContainerKind::Oriented);
    let settings = BuildSettings { container: ContainerKind::Oriented, ..settings };
    assert!(settings.refusal(1).is_some_and(|text| text.contains("'orient'")), "{:?}", settings.refusal(1));
    assert!(build_binary(&trees::soup(4, 0.1, 1), &settings, &CancelToken::new()).is_err());
    assert!(!Passes::ALL.contains(Pass::Orient), "the finest tree has boxes along the axes");
}

#[test]
fn a_box_that_cuts_a_triangle_far_below_it_is_found_out() {
    let triangles = strands(4, 1.0, 0.0, 2);
    let tree = oriented(trees::halved::<Aabb>(&triangles, 1), &triangles);
    let mut broken = nodes(&tree).clone();
    let root = &mut broken.nodes[0].container;
    assert_ne!(root.kind(), OrientedKind::Plain, "or the test tests nothing");
    root.high[2] = root.low[2] + (root.high[2] - root.low[2]) * 0.9;
    let problem = validate(&AnyTree::Oriented(broken), &triangles).unwrap_err();
    assert!(problem.starts_with("node 0 does not hold corner"), "{problem}");
}

#[test]
fn costs_count_a_test_as_one_and_a_half() {
    let triangles = strands(20, 1.0, 0.0, 2);
    let tree = oriented(trees::halved::<Aabb>(&triangles, 1), &triangles);
    let list = &nodes(&tree).nodes;
    let area = |node: &bvhscope_engine::tree::Node<OrientedBox>| f64::from(node.container.half_area());
    let cost: f64 = list.iter().map(|node| area(node) * if node.is_leaf() { f64::from(node.count) } else { 1.5 }).sum();
    let found = f64::from(tree_stats(&tree, &CancelToken::new()).unwrap().sah_cost);
    assert!((found * area(&list[0]) / cost - 1.0).abs() < 1e-5, "{found}");
}

/// Rays of the picture and random ones alike need fewer tests of boxes where things lie askew.
#[test]
fn strands_take_fewer_tests() {
    use bvhscope_engine::tree::traverse::{TestCounts, Traversal};
    let triangles = strands(1_000, 1.0, 0.0, 4);
    let plain = trees::halved::<Aabb>(&triangles, 1);
    let rays = trees::rays(&triangles, 2_000, 9);
    let tests = |tree: &AnyTree| {
        let leaf_triangles = tree.leaf_triangles(&triangles, &CancelToken::new()).unwrap();
        let mut counts = TestCounts::default();
        for ray in &rays {
            tree.closest_hit(&leaf_triangles, ray, Traversal::Ordered, &mut counts);
        }
        counts.containers + counts.primitives
    };
    let [before, after] = [tests(&plain), tests(&oriented(plain, &triangles))];
    // Measured: 0.76.
    assert!(after < before * 8 / 10, "{after} instead of {before}");
}
