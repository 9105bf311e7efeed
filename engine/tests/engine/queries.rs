//! All hits, closest points, inside and outside: against tests of every triangle, which textbook geometry in double precision judges.

use std::ops::ControlFlow;

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::follow::{Follower, Policy};
use bvhscope_engine::geometry::{Aabb, Dop14, Hit, PreparedRay, Ray, Shear, Sphere, Triangle};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::query::{self, ClosestPoint, HitLists, closed::Edges};
use bvhscope_engine::settings::{BuildSettings, Pass, Passes, Preset};
use bvhscope_engine::tree::traverse::NoProbe;
use bvhscope_engine::tree::{AnyTree, ContainerKind};
use bvhscope_engine::wide::{AnyWideTree, NodeForm};
use bvhscope_engine::{TestCounts, build, with_tree};
use glam::{DVec3, Vec3};

use crate::oracle;
use crate::random::Random;
use crate::trees;

/// Every hit by the engine's own test of every triangle, by distance, then index. The oracle judges each.
fn scan_all(triangles: &[Triangle], ray: &Ray) -> Vec<Hit> {
    let (prepared, shear) = (PreparedRay::new(*ray), Shear::new(ray.direction));
    let mut hits = Vec::new();
    for (index, triangle) in triangles.iter().enumerate() {
        let hit = triangle.intersect(&prepared, &shear, prepared.ray.t_max);
        let hit = hit.map(|hit| Hit { t: hit.t, primitive_index: index as u32, u: hit.u, v: hit.v });
        let alone = hit.map(|hit| Hit { primitive_index: 0, ..hit });
        oracle::check(std::slice::from_ref(triangle), ray, alone.as_ref());
        hits.extend(hit);
    }
    hits.sort_by(|a, b| a.t.partial_cmp(&b.t).unwrap().then(a.primitive_index.cmp(&b.primitive_index)));
    hits
}

/// The distance of `p` from a triangle by its plane and its edges, in double precision.
fn distance(triangle: &Triangle, p: Vec3) -> f64 {
    let corners = [triangle.a, triangle.b, triangle.c].map(|corner| corner.as_dvec3() - p.as_dvec3());
    let scale = corners.iter().map(|corner| corner.abs().max_element()).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let corners = corners.map(|corner| corner / scale);
    let mut nearest = f64::INFINITY;
    for edge in 0..3 {
        let (from, way) = (corners[edge], corners[(edge + 1) % 3] - corners[edge]);
        let along = if way == DVec3::ZERO { 0.0 } else { (-from.dot(way) / way.length_squared()).clamp(0.0, 1.0) };
        nearest = nearest.min((from + way * along).length());
    }
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    if normal.length() > 1e-9 {
        let normal = normal.normalize();
        // The origin lies above the triangle where it lies on the inner side of each edge.
        let is_above = [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (*to - *from).cross(-*from).dot(normal) >= 0.0);
        if is_above {
            nearest = nearest.min(a.dot(normal).abs());
        }
    }
    nearest * scale
}

/// The nearest point by the engine's own test of every triangle; the distances of all triangles judge it.
fn scan_points(triangles: &[Triangle], point: Vec3, radius: f32) -> Option<(u32, f64)> {
    if !point.is_finite() {
        return None;
    }
    let mut nearest: Option<(u32, f64)> = None;
    for (index, triangle) in triangles.iter().enumerate() {
        let found = triangle.nearest_point(point);
        if nearest.is_none_or(|(_, least)| found.distance_squared < least) {
            nearest = Some((index as u32, found.distance_squared));
        }
    }
    let (_, squared) = nearest?;
    let least = triangles.iter().map(|triangle| distance(triangle, point)).fold(f64::INFINITY, f64::min);
    let size = triangles.iter().map(|t| t.bounds().extent().max_element()).fold(0.0, f32::max);
    assert!((squared.sqrt() - least).abs() <= least * 1e-9 + f64::from(size) * 1e-12, "{squared} {least}");
    nearest.filter(|(_, squared)| *squared <= f64::from(radius) * f64::from(radius))
}

fn levels() -> impl Iterator<Item = SimdLevel> {
    SimdLevel::ALL.into_iter().filter(|level| level.is_available())
}

fn wide_trees(triangles: &[Triangle], tree: &AnyTree) -> Vec<AnyWideTree> {
    let wide = |form| AnyWideTree::new(tree, triangles, form, &CancelToken::new()).unwrap();
    vec![wide(NodeForm::Full), wide(NodeForm::Compact)]
}

fn points(triangles: &[Triangle], count: usize, seed: u64) -> Vec<Vec3> {
    let mut random = Random(seed);
    let bounds = triangles.iter().fold(Aabb::EMPTY, |all, t| all.union(&t.bounds()));
    let size = bounds.extent().max_element();
    let mut points = vec![Vec3::NAN, Vec3::INFINITY, Vec3::splat(3e38), bounds.center()];
    for index in 0..count {
        let triangle = triangles[random.below(triangles.len())];
        points.push(match index % 5 {
            // On corners and edges, near the surface, around, far away.
            0 => triangle.a,
            1 => (triangle.a + triangle.b) * 0.5,
            2 => triangle.a.lerp(triangle.c, 0.3) + random.vector() * size * 1e-3,
            3 => bounds.center() + random.vector() * size,
            _ => bounds.center() + random.vector() * size * 1e4,
        });
    }
    points
}

/// Compares the queries of many rays and points with those of single ones.
fn check_batches(name: &str, wide: &AnyWideTree, level: SimdLevel, rays: &[Ray], points: &[Vec3]) {
    let (mut lists, mut hits) = (HitLists::default(), Vec::new());
    for max in [usize::MAX, 1] {
        wide.hit_lists(level.level(), rays, max, &mut lists);
        assert_eq!((lists.ends.len(), lists.has_more.len()), (rays.len(), rays.len()), "{name}, {level:?}");
        for (index, ray) in rays.iter().enumerate() {
            let has_more = wide.all_hits(level.level(), ray, max, &mut hits);
            assert_eq!((lists.of(index), lists.has_more[index]), (&hits[..], has_more), "{name}, {level:?}, {ray:?}");
        }
    }
    for radius in [f32::INFINITY, 0.0, 0.3] {
        let single = |point: &Vec3| wide.closest_point(level.level(), *point, radius);
        // Each point after the ones before it and after those behind it.
        let both: Vec<Vec3> = points.iter().chain(points.iter().rev()).copied().collect();
        let mut found = vec![None; both.len()];
        wide.closest_points(level.level(), &both, radius, &mut found);
        assert_eq!(found, both.iter().map(single).collect::<Vec<_>>(), "{name}, {level:?}, within {radius}");
    }
}

/// Compares all queries of a tree and of the wide trees made from it with tests of every triangle.
fn check(name: &str, triangles: &[Triangle], tree: &AnyTree, wide: &[AnyWideTree], rays: &[Ray], points: &[Vec3]) {
    for (wide, level) in wide.iter().flat_map(|wide| levels().map(move |level| (wide, level))) {
        check_batches(name, wide, level, rays, points);
    }
    let (mut found, mut again) = (Vec::new(), Vec::new());
    for ray in rays {
        let expected = scan_all(triangles, ray);
        for max in [usize::MAX, 0, 1, 3, expected.len()] {
            let is_more = expected.len() > max;
            let expected = &expected[..max.min(expected.len())];
            let mut counts = TestCounts::default();
            let has_more = with_tree!(tree, tree => {
                let leaves: Vec<_> = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
                query::all_hits_counted(tree, &leaves, ray, max, &mut found, &mut counts)
            });
            assert_eq!((&found[..], has_more), (expected, is_more), "{name}, {max} of {ray:?}");
            assert!(counts.primitives >= found.len() as u64, "{name}");
            for (wide, level) in wide.iter().flat_map(|wide| levels().map(move |level| (wide, level))) {
                let has_more = wide.all_hits(level.level(), ray, max, &mut again);
                assert_eq!((&again[..], has_more), (expected, is_more), "{name}, wide, {level:?}, {max} of {ray:?}");
            }
        }
    }
    for point in points {
        for radius in [f32::INFINITY, 0.0, 0.3] {
            let expected = scan_points(triangles, *point, radius);
            let brief = |found: Option<ClosestPoint>| found.map(|found| (found.primitive_index, found.distance));
            let expected = expected.map(|(index, squared)| (index, squared.sqrt()));
            let binary = with_tree!(tree, tree => {
                let leaves: Vec<_> = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
                query::closest_point(tree, &leaves, *point, radius, &mut NoProbe)
            });
            assert_eq!(brief(binary), expected, "{name}, {point} within {radius}");
            for (wide, level) in wide.iter().flat_map(|wide| levels().map(move |level| (wide, level))) {
                let found = wide.closest_point(level.level(), *point, radius);
                assert_eq!(found, binary, "{name}, wide, {level:?}, {point} within {radius}");
            }
        }
    }
}

#[test]
fn queries_find_what_a_scan_finds() {
    for (name, triangles) in trees::nasty_scenes() {
        let (rays, points) = (trees::rays(&triangles, 24, 3), points(&triangles, 20, 4));
        let settings = |container| BuildSettings::preset(Preset::Fast, container);
        let oriented = Passes::NONE.with(Pass::Orient).with(Pass::Split);
        let built = [
            settings(ContainerKind::Aabb),
            settings(ContainerKind::Sphere),
            settings(ContainerKind::Dop14),
            BuildSettings { optimize: oriented, ..settings(ContainerKind::Aabb) },
        ];
        let mut trees: Vec<_> = built
            .iter()
            .map(|settings| build(&triangles, settings, &CancelToken::new()).unwrap().tree().clone())
            .collect();
        trees.push(trees::halved::<Aabb>(&triangles, 5));
        if triangles.len() > 1 {
            trees.extend([trees::chain::<Sphere>(&triangles), trees::chain::<Dop14>(&triangles)]);
        }
        for tree in &trees {
            let name = format!("{name}, {:?}", tree.container_kind());
            check(&name, &triangles, tree, &wide_trees(&triangles, tree), &rays, &points);
        }
    }
}

#[test]
fn trees_that_follow_a_motion_answer_like_new_ones() {
    let rest = trees::ball(Vec3::ZERO, 1.0, 9);
    let moved = |amount: f32| -> Vec<Triangle> {
        let turn = |p: Vec3| p + Vec3::new((p.y * 3.0).sin(), 0.0, p.x * p.y) * amount;
        rest.iter().map(|t| Triangle { a: turn(t.a), b: turn(t.b), c: turn(t.c) }).collect()
    };
    for container in ContainerKind::ALL {
        for policy in Policy::ALL {
            let token = CancelToken::new();
            let settings = BuildSettings::preset(Preset::Fast, container);
            let poses = [moved(0.0), moved(0.8)];
            let Ok(mut follower) = Follower::new(policy, &settings, &poses, &token) else { continue };
            follower.follow(&poses[1], &token).unwrap();
            let name = format!("{policy:?}, {container:?}");
            let (rays, points) = (trees::rays(&poses[1], 24, 5), points(&poses[1], 10, 6));
            check(&name, &poses[1], follower.tree(), std::slice::from_ref(&follower.wide().tree), &rays, &points);
        }
    }
}

#[test]
fn visits_come_in_order_and_stop() {
    let triangles: Vec<_> = (0..100)
        .map(|i| Vec3::Z * (i * 37 % 100) as f32)
        .map(|a| Triangle { a, b: a + Vec3::X, c: a + Vec3::Y })
        .collect();
    let bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new()).unwrap();
    let ray = Ray::new(Vec3::new(0.2, 0.2, -1.0), Vec3::Z);
    for stop_after in [1, 8, 9, 64, 99, 100, 1000] {
        let mut seen = Vec::new();
        bvh.visit_hits(&ray, |hit| {
            seen.push(hit.t);
            if seen.len() == stop_after { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let expected: Vec<_> = (1..=stop_after.min(100)).map(|t| t as f32).collect();
        assert_eq!(seen, expected);
    }
    assert_eq!(bvh.count_hits(&ray), 100);
}

#[test]
fn points_are_inside_or_outside_of_a_closed_mesh() {
    let token = CancelToken::new();
    // Nested, the inner one a hollow; a cube whose diagonals and edges are aligned with everything.
    let mut ball = trees::ball(Vec3::ZERO, 1.0, 12);
    ball.extend(trees::ball(Vec3::ZERO, 0.5, 12));
    let cube = trees::nasty_scenes().into_iter().find(|(name, _)| *name == "room of grids").unwrap().1;
    assert!(Edges::of(&ball, &token).unwrap().is_closed() && !Edges::of(&ball[1..], &token).unwrap().is_closed());
    let mut random = Random(9);
    for container in ContainerKind::ALL {
        let settings = BuildSettings::preset(Preset::Fast, container);
        let bvh = build(&ball, &settings, &token).unwrap();
        for _ in 0..500 {
            let point = random.vector() * 1.2;
            let distance = f64::from(point.length());
            // Chords of the facets lie up to 4 % inside of the sphere.
            if (distance - 1.0).abs() > 0.05 && (distance - 0.5).abs() > 0.03 {
                assert_eq!(bvh.contains(point), (0.5..1.0).contains(&distance), "{container:?} {point}");
            }
            let signed = bvh.signed_distance(point).unwrap();
            assert_eq!(signed < 0.0, bvh.contains(point));
            let nearest = (1.0 - distance).abs().min((distance - 0.5).abs());
            assert!((signed.abs() - nearest).abs() < 0.05, "{point} {signed}");
        }
        assert_eq!(bvh.signed_distance(Vec3::NAN), None);
        // Six by six by three; on a lattice every ray in a plane of the grid would meet edges.
        let [low, high] = [Vec3::ZERO, Vec3::new(6.0, 6.0, 3.0)];
        let room: Vec<_> = cube
            .iter()
            .copied()
            .filter(|t| t.bounds().min.cmpge(low).all() && t.bounds().max.cmple(high).all())
            .collect();
        let bvh = build(&room, &settings, &token).unwrap();
        for x in 0..13 {
            for y in 0..13 {
                let point = Vec3::new(x as f32 - 3.0, y as f32 - 3.0, 1.5);
                let is_inside = point.cmpgt(low).all() && point.cmplt(high).all();
                let is_on = (point - point.clamp(low, high)).length() == 0.0 && !is_inside;
                assert!(is_on || bvh.contains(point) == is_inside, "{container:?} {point}");
            }
        }
    }
}
