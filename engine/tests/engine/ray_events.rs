//! The steps that a traversal tells its probe of: they are those of the ray, in an order that a stack explains, and they count up
//! to the tests.

use std::collections::HashSet;

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Hit, PreparedRay, Ray, Sphere, Triangle};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::settings::{BuildSettings, Pass, Passes};
use bvhscope_engine::tree::traverse::{RayEvent, RayLog, TestCounts, Traversal, any_hit_with, closest_hit};
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind, Node, Tree};
use bvhscope_engine::wide::Child;
use bvhscope_engine::{WideBvh, with_tree, with_wide_tree};
use glam::Vec3;

use crate::any_arity::irregular;
use crate::trees;

/// How a ray is traced.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Query {
    Closest(Traversal),
    Any,
}

const QUERIES: [Query; 3] = [Query::Closest(Traversal::Ordered), Query::Closest(Traversal::Paper), Query::Any];

/// Trees of boxes and of spheres over triangles near and far apart, with one and several triangles per leaf.
fn scenes() -> Vec<(String, Vec<Triangle>, AnyTree)> {
    let mut scenes = Vec::new();
    for (name, triangles) in [("soup", trees::soup(600, 0.3, 3)), ("ball", trees::ball(Vec3::ZERO, 1.0, 12))] {
        for container in ContainerKind::ALL {
            for optimize in [Passes::NONE, Passes::NONE.with(Pass::Collapse)] {
                let settings = BuildSettings { container, optimize, ..BuildSettings::default() };
                let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
                scenes.push((format!("{name}, {container:?}, {optimize}"), triangles.clone(), tree));
            }
        }
    }
    let triangles = trees::soup(400, 0.5, 8);
    let settings = BuildSettings { optimize: Passes::NONE.with(Pass::Split), ..BuildSettings::default() };
    let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
    scenes.push(("split".to_owned(), triangles, tree));
    let wide: Vec<_> = scenes.iter().map(|(name, triangles, tree)| (name, triangles, irregular(tree, 9, 1))).collect();
    let wide = wide.into_iter().map(|(name, triangles, tree)| (format!("{name}, widened"), triangles.clone(), tree));
    let wide: Vec<_> = wide.collect();
    scenes.extend(wide);
    scenes
}

/// Rays through the scene, also such that end or begin within it.
fn rays(triangles: &[Triangle]) -> Vec<Ray> {
    let mut rays = trees::rays(triangles, 400, 17);
    for (i, ray) in rays.iter_mut().enumerate() {
        let length = ray.direction.length();
        match i % 4 {
            0 => ray.t_max = 2.0 / length,
            1 => ray.t_min = 0.5 / length,
            _ => {}
        }
    }
    rays
}

/// The log of a ray, whether it hit, and the tests that [`TestCounts`] counts of it.
fn traced<C: Container>(
    tree: &Tree<C>,
    leaf_triangles: &Vec<Triangle>,
    ray: &Ray,
    query: Query,
) -> (RayLog, Option<Option<Hit>>, bool, TestCounts) {
    let (mut log, mut counts) = (RayLog::default(), TestCounts::default());
    match query {
        Query::Closest(traversal) => {
            let hit = closest_hit(tree, leaf_triangles, ray, traversal, &mut log);
            assert_eq!(closest_hit(tree, leaf_triangles, ray, traversal, &mut counts), hit);
            (log, Some(hit), hit.is_some(), counts)
        }
        Query::Any => {
            let found = any_hit_with(tree, leaf_triangles, ray, &mut log);
            assert_eq!(any_hit_with(tree, leaf_triangles, ray, &mut counts), found);
            (log, None, found, counts)
        }
    }
}

/// Replays the steps with a stack: what is tested are the children of the visited node, what is popped was pushed last.
fn replay<C: Container>(tree: &Tree<C>, ray: &Ray, query: Query, events: &[RayEvent]) {
    let prepared = PreparedRay::new(*ray);
    let part = C::ray_part(&prepared);
    let (mut stack, mut current, mut popped) = (Vec::new(), None::<u32>, None::<u32>);
    let mut entered = HashSet::new();
    let mut nearest = f32::INFINITY;
    let mut last_t = None;
    let parent_is_current = |node: u32, current: Option<u32>| match current {
        None => node == 0,
        Some(current) => tree.nodes[current as usize].children().contains(&node),
    };
    for event in events {
        match *event {
            RayEvent::Enter { node, t } => {
                assert!(parent_is_current(node, current), "{event:?} in {current:?}");
                let container = &tree.nodes[node as usize].container;
                let entry = container.entry(&prepared, &part, prepared.ray.t_min, prepared.ray.t_max);
                assert_eq!(entry, Some(t));
                assert!(entered.insert(node), "{event:?} twice");
            }
            RayEvent::Miss { node } => {
                assert!(parent_is_current(node, current), "{event:?} in {current:?}");
                let container = &tree.nodes[node as usize].container;
                let entry = container.entry(&prepared, &part, prepared.ray.t_min, prepared.ray.t_max);
                assert_eq!(entry, None);
            }
            RayEvent::Cull { node, t } => {
                assert_eq!(query, Query::Closest(Traversal::Ordered), "only this one culls");
                assert!(t > nearest, "{event:?} before {nearest}");
                assert!(entered.remove(&node), "{event:?} was not entered");
                assert!(popped.take().is_none_or(|popped| popped == node));
            }
            RayEvent::Push { node } => {
                assert!(entered.contains(&node), "{event:?} was not entered");
                stack.push(node);
            }
            RayEvent::Pop { node } => {
                assert_eq!(stack.pop(), Some(node));
                popped = Some(node);
            }
            RayEvent::Visit { node } => {
                assert!(popped.take().is_none_or(|popped| popped == node));
                assert!(entered.contains(&node) || tree.nodes[0].is_leaf(), "{event:?} was not entered");
                current = Some(node);
            }
            RayEvent::Triangle { index, t } => {
                let Node { first, count, .. } = tree.nodes[current.expect("a leaf was visited") as usize];
                assert!(tree.primitive_indices[first as usize..(first + count) as usize].contains(&index));
                assert!(t.is_none_or(|t| t <= nearest));
                last_t = t;
            }
            RayEvent::Nearer { t } => {
                assert_eq!(last_t, Some(t));
                assert!(t <= nearest);
                nearest = t;
            }
        }
    }
    assert!(query == Query::Any || stack.is_empty(), "all that was pushed was popped");
}

#[test]
fn the_steps_of_a_ray_count_up_to_its_tests() {
    let (mut culls, mut rays_traced) = ([0; 2], 0);
    for (name, triangles, tree) in scenes() {
        let rays = rays(&triangles);
        with_tree!(&tree, tree => {
            let leaf_triangles: Vec<_> = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
            for query in QUERIES {
                for ray in &rays {
                    let (log, closest, found, counts) = traced(tree, &leaf_triangles, ray, query);
                    rays_traced += 1;
                    assert_eq!(log.counts(), counts, "{name}, {query:?}, {ray:?}");
                    let number = |is: fn(&RayEvent) -> bool| log.events().iter().filter(|event| is(event)).count() as u64;
                    let containers = number(|e| matches!(e, RayEvent::Enter { .. } | RayEvent::Miss { .. }));
                    let primitives = number(|e| matches!(e, RayEvent::Triangle { .. }));
                    assert_eq!(TestCounts { containers, primitives }, counts, "{name}, {query:?}, {ray:?}");
                    let last = log.events().iter().rev().find_map(|event| match event {
                        RayEvent::Nearer { t } => Some(*t),
                        _ => None,
                    });
                    assert_eq!(last.is_some(), found);
                    assert!(closest.is_none_or(|hit| hit.map(|hit| hit.t) == last), "{name}, {query:?}: {closest:?}");
                    replay(tree, ray, query, log.events());
                    let after_pop = |pair: &[RayEvent]| matches!(pair[0], RayEvent::Pop { .. });
                    for pair in log.events().windows(2).filter(|pair| matches!(pair[1], RayEvent::Cull { .. })) {
                        culls[usize::from(after_pop(pair))] += 1;
                    }
                }
            }
        });
    }
    assert!(rays_traced > 10_000, "{rays_traced}");
    assert!(culls.iter().all(|&count| count > 100), "tested behind a hit, and popped behind one: {culls:?}");
}

#[test]
fn rays_that_test_little_tell_little() {
    let triangles = trees::soup(4, 0.2, 2);
    let AnyTree::Aabb(tree) = trees::halved::<Aabb>(&triangles, 1) else { unreachable!("asked for boxes") };
    let events = |tree: &Tree<Aabb>, ray: &Ray| {
        let mut log = RayLog::default();
        let _ = closest_hit(tree, &triangles, ray, Traversal::Ordered, &mut log);
        log.events().to_vec()
    };
    assert_eq!(events(&tree, &Ray::new(Vec3::ZERO, Vec3::ZERO)), []);
    assert_eq!(events(&tree, &Ray::new(Vec3::X * 9.0, Vec3::X)), [RayEvent::Miss { node: 0 }]);
    // A root that is a leaf has no container test.
    let AnyTree::Aabb(leaf) = trees::halved::<Aabb>(&triangles[..1], 1) else { unreachable!("asked for boxes") };
    let beside = [RayEvent::Visit { node: 0 }, RayEvent::Triangle { index: 0, t: None }];
    assert_eq!(events(&leaf, &Ray::new(Vec3::X * 9.0, Vec3::X)), beside);
    let mut log = RayLog::default();
    let _ = closest_hit(&leaf, &triangles, &Ray::new(Vec3::X * 9.0, Vec3::X), Traversal::Paper, &mut log);
    log.clear();
    assert_eq!(log, RayLog::default());
}

#[test]
fn the_wide_tree_tells_the_same_steps() {
    let level = SimdLevel::best().level();
    let mut kinds = [0; 3];
    for (name, triangles, tree) in scenes() {
        let WideBvh { tree: wide, .. } = WideBvh::new(&tree, &triangles, &CancelToken::new()).unwrap();
        for ray in rays(&triangles) {
            for any in [false, true] {
                let (mut log, mut counts) = (RayLog::default(), TestCounts::default());
                let t = if any {
                    let found = wide.any_hit_with(level, &ray, &mut log);
                    assert_eq!(wide.any_hit_with(level, &ray, &mut counts), found);
                    None
                } else {
                    let hit = wide.closest_hit_with(level, &ray, &mut log);
                    assert_eq!(wide.closest_hit_with(level, &ray, &mut counts), hit);
                    let last = log.events().iter().rev().find_map(|event| match event {
                        RayEvent::Nearer { t } => Some(*t),
                        _ => None,
                    });
                    assert_eq!(hit.map(|hit| hit.t), last, "{name}, {ray:?}");
                    last
                };
                assert_eq!(log.counts(), counts);
                let children: usize =
                    with_wide_tree!(&wide, tree => replay_wide(tree, any, t, log.events(), &mut kinds));
                assert!(children as u64 <= 8 * counts.containers);
                let triangles = log.events().iter().filter(|event| matches!(event, RayEvent::Triangle { .. })).count();
                assert!((counts.primitives..=4 * counts.primitives).contains(&(triangles as u64)));
            }
        }
    }
    assert!(kinds.iter().all(|&count| count > 100), "tested and culled, popped and culled, missed: {kinds:?}");
}

/// Replays the steps in a wide tree, where the children of a visited node are tested at once. Returns the number of children tested.
fn replay_wide<C: bvhscope_engine::wide::WideContainer>(
    tree: &bvhscope_engine::wide::WideTree<C>,
    any: bool,
    nearest_in_all: Option<f32>,
    events: &[RayEvent],
    kinds: &mut [usize; 3],
) -> usize {
    let (mut stack, mut untested) = (Vec::new(), Vec::<u32>::new());
    let (mut children, mut nearest, mut popped) = (0, f32::INFINITY, None::<u32>);
    for event in events {
        match *event {
            RayEvent::Enter { node, .. } | RayEvent::Miss { node } => {
                assert_eq!(untested.pop(), Some(node), "the children of the visited node, in order");
                children += 1;
                kinds[2] += usize::from(matches!(event, RayEvent::Miss { .. }));
            }
            RayEvent::Cull { node, t } => {
                assert!(t > nearest && !any, "{event:?} before {nearest}");
                kinds[usize::from(popped.is_some())] += 1;
                assert!(popped.take().is_none_or(|popped| popped == node));
            }
            RayEvent::Push { node } => stack.push(node),
            RayEvent::Pop { node } => {
                assert_eq!(stack.pop(), Some(node), "the last pushed");
                popped = Some(node);
            }
            RayEvent::Visit { node } => {
                assert!(untested.is_empty(), "all children were tested");
                popped = None;
                let child = Child::from_bits(node);
                if !child.is_leaf() {
                    // The first lane is popped first.
                    untested = tree.children_of(child).map(Child::bits).collect();
                    assert!(untested.len() >= 2);
                    untested.reverse();
                }
            }
            RayEvent::Triangle { t, .. } => assert!(t.is_none_or(|t| t <= nearest)),
            RayEvent::Nearer { t } => nearest = t,
        }
    }
    assert!(any || nearest_in_all.is_none_or(|t| t == nearest));
    assert!(any || stack.is_empty());
    children
}

#[test]
fn rays_end_at_the_same_hit_in_boxes_and_in_spheres() {
    let triangles = trees::soup(100, 0.3, 5);
    let (AnyTree::Aabb(boxes), AnyTree::Sphere(spheres)) =
        (trees::halved::<Aabb>(&triangles, 1), trees::halved::<Sphere>(&triangles, 1))
    else {
        unreachable!("asked for both")
    };
    let leaf_triangles: Vec<_> = boxes.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
    for ray in trees::rays(&triangles, 100, 6) {
        let nearest = |events: &[RayEvent]| events.iter().rev().find(|e| matches!(e, RayEvent::Nearer { .. })).copied();
        let logs = [
            traced(&boxes, &leaf_triangles, &ray, QUERIES[0]).0,
            traced(&spheres, &leaf_triangles, &ray, QUERIES[0]).0,
        ];
        assert_eq!(nearest(logs[0].events()), nearest(logs[1].events()));
    }
}
