//! Visits of nodes by many rays, and random lines, by which they are as likely as surface areas say.

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Dop14, Ray, Sphere, Triangle};
use bvhscope_engine::tree::node_metrics::area_share;
use bvhscope_engine::tree::random_lines::RandomLines;
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::traverse::{RayEvent, RayLog, Traversal, any_hit_with, closest_hit};
use bvhscope_engine::tree::visits::{RayQuery, Visits, measure_visits};
use bvhscope_engine::tree::{AnyTree, Container, Tree};
use bvhscope_engine::with_tree;
use glam::Vec3;

use crate::trees;

const QUERIES: [RayQuery; 3] =
    [RayQuery::ClosestHit(Traversal::Ordered), RayQuery::ClosestHit(Traversal::Paper), RayQuery::AnyHit];

fn leaf_triangles<C: Container>(tree: &Tree<C>, triangles: &[Triangle]) -> Vec<Triangle> {
    tree.leaf_triangles(triangles, &CancelToken::new()).unwrap()
}

/// Visits by random lines that no triangle stops.
fn by_lines<C: Container>(tree: &Tree<C>, lines: impl Fn(u32) -> Ray + Sync, count: u32) -> Visits {
    let nothing = vec![Triangle { a: Vec3::ZERO, b: Vec3::ZERO, c: Vec3::ZERO }; tree.primitive_indices.len()];
    measure_visits(tree, &nothing, count, lines, QUERIES[0], &CancelToken::new()).unwrap()
}

#[test]
fn visits_are_those_that_logs_tell() {
    let triangles = trees::soup(3_000, 0.2, 31);
    // More rays than a task has, more nodes than one has slots.
    let rays = trees::rays(&triangles, 1_500, 32);
    for tree in [
        trees::halved::<Aabb>(&triangles, 1),
        trees::halved::<Sphere>(&triangles, 2),
        trees::halved::<Dop14>(&triangles, 2),
    ] {
        with_tree!(&tree, tree => {
            let leaf_triangles = leaf_triangles(tree, &triangles);
            for query in QUERIES {
                let mut expected = vec![0; tree.nodes.len()];
                for ray in &rays {
                    let mut log = RayLog::default();
                    match query {
                        RayQuery::ClosestHit(traversal) => drop(closest_hit(tree, &leaf_triangles, ray, traversal, &mut log)),
                        RayQuery::AnyHit => drop(any_hit_with(tree, &leaf_triangles, ray, &mut log)),
                    }
                    for event in log.events() {
                        if let RayEvent::Visit { node } = event {
                            expected[*node as usize] += 1;
                        }
                    }
                }
                let measured = |threads: usize| {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                    let token = CancelToken::new();
                    let count = rays.len() as u32;
                    let visits = pool.install(|| {
                        measure_visits(tree, &leaf_triangles, count, |index| rays[index as usize], query, &token)
                    });
                    assert_eq!(token.progress(), 1.0);
                    visits.unwrap()
                };
                let visits = measured(1);
                assert_eq!(visits.counts, expected, "{query:?}");
                assert_eq!(visits.rays as usize, rays.len());
                assert_eq!(measured(4), visits, "the same on any number of threads");
            }
        });
    }
}

#[test]
fn what_a_hit_hides_is_visited_less_often_than_predicted() {
    // Two equal walls, one behind the other, and rays from one side.
    let wall = |z: f32| [Vec3::new(-1.0, -1.0, z), Vec3::new(3.0, -1.0, z), Vec3::new(-1.0, 3.0, z)];
    let triangles = [0.0, 1.0].map(wall).map(|[a, b, c]| Triangle { a, b, c });
    let AnyTree::Aabb(tree) = trees::halved::<Aabb>(&triangles, 1) else { unreachable!("asked for boxes") };
    let leaf_triangles = leaf_triangles(&tree, &triangles);
    let ray = |index: u32| Ray::new(Vec3::new(0.01 * index as f32, 0.0, -1.0), Vec3::Z);
    let visits = |query| measure_visits(&tree, &leaf_triangles, 50, ray, query, &CancelToken::new()).unwrap();
    let back = (1..3).find(|&node| tree.nodes[node].container.min.z > 0.5).unwrap();
    let closest = visits(QUERIES[0]);
    assert_eq!((closest.root_hits(), closest.counts[back], closest.counts[3 - back]), (50, 0, 50));
    // Shadow rays visit the far child first, and hit there.
    let any = visits(RayQuery::AnyHit);
    assert_eq!((any.counts[back], any.counts[3 - back]), (50, 0));
    // Half areas: 16 of 24.
    assert!((closest.predicted(&tree, back as u32) - 50.0 * 16.0 / 24.0).abs() < 1e-4);
    // Each ray visits the root and one leaf of one triangle; the tests of either cost 1.
    let token = CancelToken::new();
    let (measured, predicted) = closest.sums(&tree, &token).unwrap();
    assert_eq!((measured, closest.cost(&tree, &token)), (100, Ok(2.0)));
    assert!((predicted - 50.0 * (1.0 + 2.0 * 16.0 / 24.0)).abs() < 1e-4, "{predicted}");
    let none = Visits { counts: vec![0; 3], rays: 50 };
    assert_eq!((none.sums(&tree, &token), none.cost(&tree, &token)), (Ok((0, 0.0)), Ok(0.0)));
}

#[test]
fn trees_without_containers_to_test_have_visits_too() {
    let token = CancelToken::new();
    let empty =
        measure_visits(&Tree::<Aabb>::EMPTY, &Vec::new(), 9, |_| Ray::new(Vec3::ZERO, Vec3::X), QUERIES[0], &token);
    assert_eq!(empty.unwrap(), Visits { counts: Vec::new(), rays: 9 });
    let triangles = trees::soup(1, 0.5, 1);
    let AnyTree::Sphere(leaf) = trees::halved::<Sphere>(&triangles, 1) else { unreachable!("asked for spheres") };
    let away = Ray::new(Vec3::X * 9.0, Vec3::X);
    let visits = measure_visits(&leaf, &triangles, 5, |_| away, QUERIES[2], &token).unwrap();
    assert_eq!((visits.root_hits(), visits.predicted(&leaf, 0)), (5, 5.0));
}

/// Whether `hits` of `trials` may have a probability of `p`: within six standard deviations, and one more hit for luck.
fn is_likely(hits: u32, trials: u32, p: f64) -> bool {
    let expected = p * f64::from(trials);
    (f64::from(hits) - expected).abs() <= 6.0 * (expected * (1.0 - p)).max(0.0).sqrt() + 1.0
}

#[test]
fn random_lines_visit_nodes_in_proportion_to_their_surface() {
    const LINES: u32 = 100_000;
    // Flat, long and thick, and far from the origin, where coordinates have fewer digits.
    for scale in [Vec3::ONE, Vec3::new(1.0, 0.01, 1.0), Vec3::new(0.1, 10.0, 0.2)] {
        for offset in [0.0, 100.0] {
            let place = |p: Vec3| p * scale + Vec3::splat(offset);
            let triangles: Vec<_> = trees::soup(60, 0.3, 77)
                .into_iter()
                .map(|t| Triangle { a: place(t.a), b: place(t.b), c: place(t.c) })
                .collect();
            for tree in [
                trees::halved::<Aabb>(&triangles, 1),
                trees::halved::<Sphere>(&triangles, 1),
                trees::halved::<Dop14>(&triangles, 1),
            ] {
                let sah_cost = f64::from(tree_stats(&tree, &CancelToken::new()).unwrap().sah_cost);
                with_tree!(&tree, tree => {
                    let lines = RandomLines::new(tree.nodes[0].container, 5);
                    let visits = by_lines(tree, |index| lines.ray(index), LINES);
                    let cost = visits.cost(tree, &CancelToken::new()).unwrap();
                    assert!((cost / sah_cost - 1.0).abs() < 0.02, "{scale}, {offset}: {cost} instead of {sah_cost}");
                    let missed = LINES - visits.root_hits();
                    assert!(missed <= LINES / 10_000, "{scale}, {offset}: only by rounding, not {missed}");
                    for node in 1..tree.nodes.len() as u32 {
                        let (count, share) = (visits.counts[node as usize], f64::from(area_share(tree, node)));
                        let predicted = visits.predicted(tree, node);
                        assert!((predicted - share * f64::from(visits.root_hits())).abs() < 1e-3);
                        assert!(
                            is_likely(count, visits.root_hits(), share),
                            "{scale}, {offset}: node {node} has {count} visits, not {predicted}"
                        );
                    }
                });
            }
        }
    }
}

#[test]
fn lines_through_a_sphere_around_a_box_meet_the_box_in_proportion_to_its_surface() {
    const LINES: u32 = 100_000;
    let triangles = trees::soup(20, 0.3, 78);
    let AnyTree::Aabb(tree) = trees::halved::<Aabb>(&triangles, 1) else { unreachable!("asked for boxes") };
    let bounds = tree.nodes[0].container;
    let sphere = Sphere { center: bounds.center(), radius: bounds.extent().length() * 0.5 };
    let lines = RandomLines::new(sphere, 9);
    let visits = by_lines(&tree, |index| lines.ray(index), LINES);
    let area = 2.0 * f64::from(bounds.half_area()) / (4.0 * std::f64::consts::PI * f64::from(sphere.radius).powi(2));
    assert!((0.2..0.9).contains(&area));
    assert!(is_likely(visits.root_hits(), LINES, area), "{} of {LINES}, not {area}", visits.root_hits());
}

#[test]
fn random_lines_have_no_preferred_direction_and_repeat() {
    const LINES: u32 = 50_000;
    let sphere = Sphere { center: Vec3::new(3.0, -1.0, 2.0), radius: 0.5 };
    let lines = RandomLines::new(sphere, 1);
    let mut sum = [Vec3::ZERO; 2];
    for index in 0..LINES {
        let ray = lines.ray(index);
        assert!((ray.direction.length() - 1.0).abs() < 1e-5 && ray.origin.distance(sphere.center) >= sphere.radius);
        sum = [sum[0] + ray.direction, sum[1] + ray.direction * ray.direction];
    }
    let mean = sum.map(|sum| sum / LINES as f32);
    // Standard deviations: 1/√3 and 2/√45, over √LINES.
    assert!(mean[0].abs().max_element() < 6.0 * 0.58 / (LINES as f32).sqrt(), "{mean:?}");
    assert!((mean[1] - 1.0 / 3.0).abs().max_element() < 6.0 * 0.3 / (LINES as f32).sqrt(), "{mean:?}");
    assert_ne!(RandomLines::new(sphere, 2).ray(0), lines.ray(0));
    assert_eq!(RandomLines::new(sphere, 1).ray(LINES), lines.ray(LINES));
    // Nothing to meet.
    for ray in [RandomLines::new(Aabb::EMPTY, 1).ray(0), RandomLines::new(Sphere::EMPTY, 1).ray(0)] {
        assert!(!ray.origin.is_nan() || !ray.direction.is_nan());
    }
}
