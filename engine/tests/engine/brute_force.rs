//! Every builder, container and traversal against a plain linear scan over all triangles, which an oracle in double precision
//! judges.

use bvhscope_engine::WideBvh;
use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Dop14, Hit, Ray, Sphere, Triangle};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Preset};
use bvhscope_engine::tree::traverse::{NoProbe, Traversal, any_hit, closest_hit};
use bvhscope_engine::tree::validate::validate;
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind, Node, Tree};
use bvhscope_engine::wide::{AnyWideTree, NodeForm, collapse};
use bvhscope_engine::with_tree;
use glam::Vec3;
use proptest::prelude::*;

use crate::random::Random;
use crate::trees::{self, scan};

/// Requires the very same hits from `tree` as from a scan.
pub fn check(name: &str, triangles: &[Triangle], tree: &AnyTree, rays: &[Ray], expected: &[Option<Hit>]) {
    validate(tree, triangles).unwrap_or_else(|broken| panic!("{name}: {broken}"));
    with_tree!(tree, tree => {
        let leaf_triangles: Vec<_> = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
        for (ray, expected) in rays.iter().zip(expected) {
            for traversal in [Traversal::Ordered, Traversal::Paper] {
                let hit = closest_hit(tree, &leaf_triangles, ray, traversal, &mut NoProbe);
                assert_eq!(hit, *expected, "{name}, {traversal:?}, {ray:?}");
            }
            assert_eq!(any_hit(tree, &leaf_triangles, ray), expected.is_some(), "{name}, any hit, {ray:?}");
        }
    });
    check_wide(name, triangles, tree, rays, expected);
}

/// Every SIMD level of this machine.
fn levels() -> impl Iterator<Item = SimdLevel> {
    SimdLevel::ALL.into_iter().filter(|level| level.is_available())
}

/// Requires the same hits from the wide tree at every SIMD level, ray by ray and all together.
fn check_wide(name: &str, triangles: &[Triangle], tree: &AnyTree, rays: &[Ray], expected: &[Option<Hit>]) {
    for form in [NodeForm::Full, NodeForm::Compact] {
        let wide = AnyWideTree::new(tree, triangles, form, &CancelToken::new()).expect("never cancelled");
        check_form(&format!("{name}, {form:?}"), &wide, rays, expected);
    }
}

pub fn check_form(name: &str, wide: &AnyWideTree, rays: &[Ray], expected: &[Option<Hit>]) {
    for simd in levels() {
        for (ray, expected) in rays.iter().zip(expected) {
            assert_eq!(wide.closest_hit(simd.level(), ray), *expected, "{name}, wide, {simd:?}, {ray:?}");
            assert_eq!(wide.any_hit(simd.level(), ray), expected.is_some(), "{name}, wide, any hit, {simd:?}, {ray:?}");
        }
        let mut hits = vec![None; rays.len()];
        wide.closest_hits(simd.level(), rays, &mut hits);
        // Values that must be overwritten.
        let mut blocked = vec![true; rays.len()];
        wide.any_hits(simd.level(), rays, &mut blocked);
        for (index, expected) in expected.iter().enumerate() {
            assert_eq!(hits[index], *expected, "{name}, together, {simd:?}, {:?}", rays[index]);
            assert_eq!(blocked[index], expected.is_some(), "{name}, any hit together, {simd:?}, {:?}", rays[index]);
        }
    }
}

/// Rays from one point in similar directions, such as those of a camera's tile.
fn bundle(from: Vec3, to: Vec3, spread: f32, count: usize) -> Vec<Ray> {
    let forward = (to - from).normalize_or(Vec3::X);
    let (right, up) = forward.any_orthonormal_pair();
    let edge = (count as f32).sqrt();
    (0..count)
        .map(|index| {
            let (x, y) = ((index as f32 % edge) / edge - 0.5, (index as f32 / edge).floor() / edge - 0.5);
            Ray::new(from, (forward + (right * x + up * y) * spread).normalize_or(forward))
        })
        .collect()
}

#[test]
fn bundles_of_rays_find_what_a_scan_finds() {
    let mut random = Random(5);
    for (name, triangles) in trees::nasty_scenes() {
        let bounds = Aabb::around(triangles.iter().flat_map(|triangle| [triangle.a, triangle.b, triangle.c]));
        if !(bounds.extent().is_finite() && bounds.extent().length().is_finite()) {
            continue;
        }
        let trees = [
            trees::halved::<Aabb>(&triangles, 1),
            trees::halved::<Sphere>(&triangles, 3),
            trees::halved::<Dop14>(&triangles, 3),
        ];
        // Wide and narrow bundles, full and not, and one along an axis, whose rays disagree in their signs.
        for (spread, count) in [(0.02, 256), (0.3, 131), (0.3, 7), (2.0, 300)] {
            let target = triangles.get(random.below(triangles.len().max(1))).map_or(Vec3::ZERO, |triangle| triangle.a);
            let from = target + random.vector() * bounds.extent().length().max(1e-3);
            for from in [from, target + Vec3::Z * bounds.extent().length().max(1e-3)] {
                let rays = bundle(from, target, spread, count);
                let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
                for tree in &trees {
                    check_wide(&format!("{name}, bundle of {count}"), &triangles, tree, &rays, &expected);
                }
            }
        }
    }
}

#[test]
fn fragments_of_one_triangle_hide_no_other() {
    let at = |z: f32| Triangle { a: Vec3::new(-1.0, -1.0, z), b: Vec3::new(1.0, -1.0, z), c: Vec3::new(0.0, 1.0, z) };
    let triangles = [at(0.0), at(1.0)];
    // As after splitting: two references to one triangle in a leaf, then another triangle.
    let root = Node { container: Aabb::around(triangles.iter().flat_map(|t| [t.a, t.b, t.c])), first: 0, count: 3 };
    let tree = AnyTree::Aabb(Tree { nodes: vec![root], primitive_indices: vec![0, 0, 1], max_depth: 0 });
    let rays = bundle(Vec3::new(0.5, 0.4, 3.0), Vec3::ZERO, 0.1, 64);
    let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
    assert!(expected.iter().all(|hit| hit.is_some_and(|hit| hit.primitive_index == 1)));
    check_wide("fragments", &triangles, &tree, &rays, &expected);
}

#[test]
fn rays_end_at_finite_distances() {
    let triangles =
        [Triangle { a: Vec3::new(-1.0, -1.0, 0.0), b: Vec3::new(1.0, -1.0, 0.0), c: Vec3::new(0.0, 1.0, 0.0) }];
    let tree = trees::halved::<Aabb>(&triangles, 1);
    // In multiples of such a direction the triangle is farther away than any number.
    let rays = [Ray::new(Vec3::Z * 1e30, Vec3::NEG_Z * 1e-18)];
    check("far", &triangles, &tree, &rays, &[None]);
}

#[test]
fn a_wide_tree_holds_every_triangle_once_within_its_bytes() {
    let triangles = trees::ball(Vec3::ONE, 2.0, 64);
    let builders = [
        BuilderKind::Aac,
        BuilderKind::Swift,
        BuilderKind::Ploc,
        BuilderKind::Hploc,
        BuilderKind::BinnedSah,
        BuilderKind::Sweep,
        BuilderKind::None,
    ];
    let forms = [(NodeForm::Full, 60), (NodeForm::Compact, 52)];
    for (builder, (form, most_bytes)) in builders.into_iter().flat_map(|builder| forms.map(|form| (builder, form))) {
        let settings = BuildSettings { builder, ..BuildSettings::preset(Preset::Fast, ContainerKind::Aabb) };
        let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).expect("nothing to refuse");
        let AnyTree::Aabb(tree) = tree else { panic!("spheres instead of boxes") };
        let wide = collapse(&tree, &triangles, form, &CancelToken::new()).expect("never cancelled");
        let is_compact = form == NodeForm::Compact && builder != BuilderKind::None;
        assert_eq!(!wide.compact_nodes.is_empty(), is_compact, "{builder:?}, {form:?}");
        assert_eq!(!wide.nodes.is_empty(), builder != BuilderKind::None, "{builder:?}, {form:?}");
        let leaves = wide.all_nodes().flat_map(|node| wide.children_of(node));
        let leaves = wide.root.into_iter().chain(leaves).filter(|child| child.is_leaf());
        let mut seen = Vec::new();
        for leaf in leaves {
            for block in wide.leaves.blocks(leaf) {
                assert!((1..=4).contains(&block.count()));
                for lane in 0..block.count() {
                    let index = block.primitive_index(lane);
                    assert_eq!(block.triangle(lane), triangles[index as usize]);
                    seen.push(index);
                }
            }
        }
        seen.sort_unstable();
        assert!(seen.iter().copied().eq(0..triangles.len() as u32), "{builder:?}, {form:?}");
        let bytes = (wide.node_bytes() + wide.leaf_bytes()) / triangles.len();
        assert!(bytes <= most_bytes, "{builder:?}, {form:?}: {bytes} bytes per triangle");
    }
}

#[test]
fn a_large_tree_takes_less_memory_and_hits_the_same() {
    let edge = 1_100;
    let point = |x: usize, z: usize| Vec3::new(x as f32, ((x * 7919 + z * 104_729) % 13) as f32 / 9.0, z as f32);
    let cell = |(x, z): (usize, usize)| {
        let [a, b, c, d] = [point(x, z), point(x, z + 1), point(x + 1, z), point(x + 1, z + 1)];
        [Triangle { a, b, c }, Triangle { a: d, b: c, c: b }]
    };
    let triangles: Vec<Triangle> = (0..edge).flat_map(|x| (0..edge).map(move |z| (x, z))).flat_map(cell).collect();
    let settings =
        BuildSettings { builder: BuilderKind::Lbvh, ..BuildSettings::preset(Preset::Fast, ContainerKind::Aabb) };
    let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).expect("nothing to refuse");
    let chosen = WideBvh::new(&tree, &triangles, &CancelToken::new()).expect("never cancelled").tree;
    let full = AnyWideTree::new(&tree, &triangles, NodeForm::Full, &CancelToken::new()).expect("never cancelled");
    assert_eq!(chosen.leaf_bytes(), full.leaf_bytes());
    let [bytes, full_bytes] = [&chosen, &full].map(|wide| wide.node_bytes() as f64);
    assert!((0.43..0.7).contains(&(bytes / full_bytes)), "{bytes} bytes of nodes instead of {full_bytes}");
    let rays = trees::rays(&triangles[edge * edge..][..2_000], 3_000, 9);
    let level = SimdLevel::of_builds().level();
    let mut hits = [vec![None; rays.len()], vec![None; rays.len()]];
    for (wide, hits) in [&chosen, &full].into_iter().zip(&mut hits) {
        wide.closest_hits(level, &rays, hits);
    }
    assert_eq!(hits[0], hits[1]);
    assert!(hits[0].iter().flatten().count() > 100);
}

fn check_hand_made<C: Container>(name: &str, triangles: &[Triangle], rays: &[Ray], expected: &[Option<Hit>])
where
    AnyTree: From<Tree<C>>,
{
    for leaf_size in [1, 5] {
        let tree = trees::halved::<C>(triangles, leaf_size);
        check(&format!("{name}, {:?} halved to {leaf_size}", C::KIND), triangles, &tree, rays, expected);
    }
    if triangles.len() > 1 {
        check(&format!("{name}, {:?} chain", C::KIND), triangles, &trees::chain::<C>(triangles), rays, expected);
    }
}

#[test]
fn hand_made_trees_find_what_a_scan_finds() {
    for (seed, (name, triangles)) in trees::nasty_scenes().into_iter().enumerate() {
        let rays = trees::rays(&triangles, 160, seed as u64);
        let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
        check_hand_made::<Aabb>(name, &triangles, &rays, &expected);
        check_hand_made::<Sphere>(name, &triangles, &rays, &expected);
        check_hand_made::<Dop14>(name, &triangles, &rays, &expected);
    }
}

#[test]
fn every_builder_finds_what_a_scan_finds() {
    for (seed, (name, triangles)) in trees::nasty_scenes().into_iter().enumerate() {
        let rays = trees::rays(&triangles, 160, 100 + seed as u64);
        let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
        for builder in BuilderKind::ALL {
            for container in ContainerKind::ALL {
                for (threshold, epsilon) in [(2, 0.0), (6, 0.2), (20, 0.1), (64, 0.5)] {
                    let settings = BuildSettings { builder, container, threshold, epsilon, ..BuildSettings::default() };
                    if settings.refusal(triangles.len()).is_some() || !builder.is_aac() && threshold != 6 {
                        continue;
                    }
                    let (tree, _) =
                        build_binary(&triangles, &settings, &CancelToken::new()).expect("nothing to refuse");
                    check(&format!("{name}, {settings:?}"), &triangles, &tree, &rays, &expected);
                    for curve in [Curve::Hilbert, Curve::Extended].into_iter().filter(|_| threshold == 6) {
                        let settings = BuildSettings { curve, ..settings };
                        let (tree, _) =
                            build_binary(&triangles, &settings, &CancelToken::new()).expect("nothing to refuse");
                        check(&format!("{name}, {settings:?}"), &triangles, &tree, &rays, &expected);
                    }
                }
            }
        }
    }
}

#[test]
fn rays_at_triangles_do_hit() {
    // Guards the comparisons above against a scan that never finds anything.
    let expected = [("small triangles", 0.4), ("flat grid", 0.3), ("room of grids", 0.7), ("closed ball", 0.7)];
    for (name, least) in expected {
        let (_, triangles) = trees::nasty_scenes().into_iter().find(|(n, _)| *n == name).expect("a known scene");
        let rays = trees::rays(&triangles, 400, 7);
        let hits = rays.iter().filter(|ray| scan(&triangles, ray).is_some()).count();
        assert!(hits as f32 >= least * rays.len() as f32, "{name}: {hits} of {} rays hit", rays.len());
    }
}

#[test]
fn no_ray_slips_into_a_closed_ball() {
    // From inside, far from the origin, exactly at corners and edges too.
    for center in [Vec3::ZERO, Vec3::new(1000.0, -2000.0, 3000.0), Vec3::splat(1e5)] {
        let triangles = trees::ball(center, 10.0, 24);
        let tree = trees::halved::<Aabb>(&triangles, 2);
        let mut random = Random(11);
        with_tree!(&tree, tree => {
            let leaf_triangles: Vec<_> = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
            for i in 0..20_000 {
                let target = &triangles[random.below(triangles.len())];
                let origin = center + random.vector();
                let point = match i % 4 {
                    0 => target.a,
                    1 => (target.a + target.b) * 0.5,
                    2 => target.b + (target.c - target.b) * random.signed().abs(),
                    _ => origin + random.vector(),
                };
                let ray = Ray::new(origin, (point - origin).normalize_or(Vec3::X));
                let hit = closest_hit(tree, &leaf_triangles, &ray, Traversal::Ordered, &mut NoProbe);
                assert!(hit.is_some(), "{ray:?} slips through the ball around {center}");
            }
        });
    }
}

#[test]
fn rays_along_slab_planes_hit_the_grid() {
    // Every whole coordinate is a face of some box.
    let triangles = trees::grid(8, 2, 0.0);
    for (tree, kind) in [
        (trees::halved::<Aabb>(&triangles, 1), "box"),
        (trees::halved::<Sphere>(&triangles, 1), "sphere"),
        (trees::halved::<Dop14>(&triangles, 1), "dop"),
    ] {
        with_tree!(&tree, tree => {
            let leaf_triangles: Vec<_> = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
            for x in 0..=8 {
                for y in 0..=8 {
                    for direction in [Vec3::Z, Vec3::NEG_Z, Vec3::new(-0.0, 0.0, 1.0), Vec3::new(0.0, -0.0, -1.0)] {
                        let ray = Ray::new(Vec3::new(x as f32, y as f32, 0.0) - direction * 3.0, direction);
                        let hit = closest_hit(tree, &leaf_triangles, &ray, Traversal::Ordered, &mut NoProbe);
                        assert_eq!(hit.map(|hit| hit.t), Some(3.0), "{kind}, {ray:?}");
                        assert!(any_hit(tree, &leaf_triangles, &ray), "{kind}, {ray:?}");
                    }
                }
            }
        });
    }
}

#[test]
fn a_chain_deeper_than_any_fixed_stack_is_traced() {
    let triangles: Vec<_> = (0..10_000)
        .map(|i| {
            let a = Vec3::new(i as f32, 0.0, 0.0);
            Triangle { a, b: a + Vec3::Y, c: a + Vec3::Z }
        })
        .collect();
    let tree = trees::chain::<Aabb>(&triangles);
    assert_eq!(tree.max_depth(), 9_999);
    with_tree!(&tree, tree => {
        for (origin, direction, expected) in [
            (Vec3::new(-1.0, 0.25, 0.25), Vec3::X, Some(0)),
            (Vec3::new(20_000.0, 0.25, 0.25), Vec3::NEG_X, Some(9_999)),
            (Vec3::new(5_000.5, 0.25, 0.25), Vec3::X, Some(5_001)),
            (Vec3::new(-1.0, 2.0, 0.25), Vec3::X, None),
        ] {
            for traversal in [Traversal::Ordered, Traversal::Paper] {
                let hit = closest_hit(tree, &triangles, &Ray::new(origin, direction), traversal, &mut NoProbe);
                assert_eq!(hit.map(|hit| hit.primitive_index), expected, "{traversal:?} from {origin}");
            }
        }
    });
}

#[test]
fn many_rays_at_once_end_in_a_tree_deeper_than_their_stacks() {
    let triangles: Vec<_> = (0..2_000)
        .map(|i| {
            let a = Vec3::new(i as f32, 0.0, 0.0);
            Triangle { a, b: a + Vec3::Y, c: a + Vec3::Z }
        })
        .collect();
    // Through all boxes: past every triangle, and through them.
    let ray = |at: f32| Ray::new(Vec3::new(-1.0, at, at), Vec3::X);
    let rays: Vec<_> = (0..100).map(|i| ray(if i % 3 == 0 { 0.25 } else { 0.75 })).collect();
    let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
    check_wide("chain", &triangles, &trees::chain::<Aabb>(&triangles), &rays, &expected);
    check_wide("chain", &triangles, &trees::chain::<Sphere>(&triangles), &rays, &expected);
    check_wide("chain", &triangles, &trees::chain::<Dop14>(&triangles), &rays, &expected);
}

#[test]
fn any_number_of_rays_can_be_asked_at_once() {
    let triangles = trees::ball(Vec3::ONE, 2.0, 16);
    let tree = trees::halved::<Aabb>(&triangles, 1);
    let mut rays = trees::rays(&triangles, 300, 7);
    // Some that can hit nothing, among the first and at the end.
    for index in [0, 5, 64, 299] {
        rays[index].direction = Vec3::ZERO;
    }
    let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
    for count in [0, 1, 7, 8, 9, 31, 32, 33, 63, 65, 128, 300] {
        check_wide(&format!("{count} rays"), &triangles, &tree, &rays[..count], &expected[..count]);
    }
}

/// The parts of a large tree are planned apart and put together.
#[test]
fn a_wide_tree_of_many_parts_finds_what_the_binary_tree_finds() {
    let triangles = trees::ball(Vec3::ONE, 2.0, 128);
    let rays: Vec<_> = trees::rays(&triangles, 300, 3);
    for tree in [
        trees::halved::<Aabb>(&triangles, 1),
        trees::halved::<Sphere>(&triangles, 1),
        trees::halved::<Dop14>(&triangles, 1),
    ] {
        let expected: Vec<_> = with_tree!(&tree, tree => {
            let leaf_triangles = tree.leaf_triangles(&triangles, &CancelToken::new()).expect("never cancelled");
            let hit = |ray| closest_hit(tree, &leaf_triangles, ray, Traversal::Ordered, &mut NoProbe);
            rays.iter().map(hit).collect()
        });
        assert!(tree.node_count() > 100_000 && expected.iter().flatten().count() > 200);
        check_wide("many parts", &triangles, &tree, &rays, &expected);
    }
}

#[test]
fn an_empty_tree_is_missed() {
    let tree = trees::halved::<Aabb>(&[], 1);
    with_tree!(&tree, tree => {
        let ray = Ray::new(Vec3::ZERO, Vec3::X);
        assert_eq!(closest_hit(tree, &[][..], &ray, Traversal::Ordered, &mut NoProbe), None);
        assert!(!any_hit(tree, &[][..], &ray));
    });
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn random_coordinates_of_any_size(
        coordinates in prop::collection::vec(prop::array::uniform9(-1.0_f32..1.0), 1..40),
        exponent in -40_i32..40,
        offset in prop::array::uniform3(-100.0_f32..100.0),
        snap in any::<bool>(),
        seed in any::<u64>(),
    ) {
        let scale = 2.0_f32.powi(exponent);
        let place = |x: &[f32]| {
            let point = Vec3::new(x[0], x[1], x[2]);
            // Whole numbers make shared corners, edges and planes.
            let point = if snap { (point * 3.0).round() } else { point };
            (point + Vec3::from(offset).round()) * scale
        };
        let triangles: Vec<_> = coordinates
            .iter()
            .map(|x| Triangle { a: place(&x[0..3]), b: place(&x[3..6]), c: place(&x[6..9]) })
            .collect();
        let rays = trees::rays(&triangles, 40, seed);
        let together = bundle(rays[0].origin, triangles[0].a, 0.3, 40);
        for rays in [rays, together] {
            let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
            check_hand_made::<Aabb>("random", &triangles, &rays, &expected);
            check_hand_made::<Sphere>("random", &triangles, &rays, &expected);
            check_hand_made::<Dop14>("random", &triangles, &rays, &expected);
        }
    }
}
