//! Trees over items of the caller's own: what a test of every item finds, and for boxes the trees of triangles.

use std::ops::ControlFlow;

use bvhscope_engine::builders::build_binary;
use bvhscope_engine::geometry::{Aabb, Dop14, Ray, Sphere, Triangle};
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass, Preset};
use bvhscope_engine::tree::{AnyTree, Container, Tree};
use bvhscope_engine::{BuildError, CancelToken, ContainerKind, ItemBvh, Items};
use glam::{DVec3, Vec3};

use crate::random::Random;
use crate::trees;

/// Settings that build items of a kind.
fn settings(container: ContainerKind) -> Vec<BuildSettings> {
    let presets = Preset::ALL.into_iter().map(|preset| {
        let settings = BuildSettings::preset(preset, container);
        BuildSettings { optimize: settings.optimize.without(Pass::Split), ..settings }
    });
    let builders = BuilderKind::ALL.into_iter().filter(|builder| !builder.needs_triangles());
    let builders = builders.map(|builder| BuildSettings { builder, container, ..BuildSettings::default() });
    presets.chain(builders).filter(|settings| settings.refusal(300).is_none()).collect()
}

/// Balls in a heap, at a scale and an offset; some are equal, some are points.
fn balls(scale: f32, offset: Vec3) -> Vec<Sphere> {
    let mut random = Random(11);
    let ball = |index: i32| {
        let center = offset + random.vector() * scale;
        let radius = if index % 7 == 0 { 0.0 } else { 0.1 * scale * random.vector().x.abs() };
        Sphere { center, radius }
    };
    let mut balls: Vec<Sphere> = (0..300).map(ball).collect();
    balls[200] = balls[100];
    balls
}

/// Where `ray` enters `ball`, in double precision; no nearer than `t_min`.
fn enter(ball: &Sphere, ray: &Ray) -> Option<f32> {
    let (origin, direction) = (ray.origin.as_dvec3() - ball.center.as_dvec3(), ray.direction.as_dvec3());
    let squared = direction.length_squared();
    let middle = -origin.dot(direction) / squared;
    let inside = f64::from(ball.radius).powi(2) - (origin + direction * middle).length_squared();
    let t = (middle - (inside / squared).sqrt()) as f32;
    (inside >= 0.0 && t >= ray.t_min && t <= ray.t_max).then_some(t)
}

fn rays(balls: &[Sphere], count: usize) -> Vec<Ray> {
    let mut random = Random(5);
    let bounds = balls.iter().fold(Aabb::EMPTY, |all, ball| all.union(&ball.bounds()));
    let ray = |index: usize| {
        let origin = bounds.center() + random.vector() * bounds.extent() * 1.2;
        let target = balls[random.below(balls.len())].center;
        // Not so short or long that rays cannot have it.
        let direction = if index.is_multiple_of(3) { Vec3::NEG_Y } else { (target - origin) / bounds.extent().x };
        let mut ray = Ray::new(origin, direction);
        if index.is_multiple_of(5) {
            (ray.t_min, ray.t_max) = (0.3 * bounds.extent().x, 0.9 * bounds.extent().x);
        }
        ray
    };
    (0..count).map(ray).collect()
}

/// Compares the queries of a tree of any kind over `balls` with tests of every ball.
fn check(name: &str, bvh: &ItemBvh, balls: &[Sphere], rays: &[Ray]) -> usize {
    let mut found = 0;
    for ray in rays {
        let all: Vec<(f32, u32)> =
            (0_u32..).zip(balls).filter_map(|(item, ball)| Some((enter(ball, ray)?, item))).collect();
        let nearest = all.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let hit = bvh.closest_hit(ray, |item, ray| enter(&balls[item as usize], ray));
        assert_eq!(hit.map(|hit| (hit.t, hit.item)), nearest, "{name}, {ray:?}");
        let is_blocked = bvh.any_hit(ray, |item, ray| enter(&balls[item as usize], ray).is_some());
        assert_eq!(is_blocked, nearest.is_some(), "{name}, {ray:?}");
        let mut visited = vec![0; balls.len()];
        bvh.visit(ray, |item, t_max| {
            visited[item as usize] += 1;
            ControlFlow::Continue(t_max)
        });
        assert!(all.iter().all(|(_, item)| visited[*item as usize] == 1), "{name}, {ray:?}");
        assert!(visited.iter().all(|times| *times <= 1), "{name}, {ray:?}");
        found += all.len();
    }
    found
}

/// Every node holds the containers of its items, and all items are there.
fn check_tree<C: Container>(tree: &Tree<C>, items: &[C], sticks_out: impl Fn(&C, &C) -> bool) {
    let mut indices = tree.primitive_indices.clone();
    indices.sort_unstable();
    assert!(indices.iter().copied().eq(0..items.len() as u32));
    for node in tree.nodes.iter().filter(|node| node.is_leaf()) {
        for index in &tree.primitive_indices[node.slots()] {
            assert!(!sticks_out(&items[*index as usize], &node.container), "item {index} in {:?}", node.container);
        }
    }
    for node in tree.nodes.iter().filter(|node| !node.is_leaf()) {
        for child in node.children() {
            assert!(!sticks_out(&tree.nodes[child as usize].container, &node.container), "node {child}");
        }
    }
}

#[test]
fn queries_find_what_a_test_of_every_item_finds() {
    let mut found = 0;
    // The last ones are beyond what areas in single precision can be, so that they are built scaled.
    for (scale, offset) in
        [(1.0, Vec3::ZERO), (1.0, Vec3::new(300.0, -50.0, 2e3)), (1e-30, Vec3::ZERO), (1e25, Vec3::ZERO)]
    {
        let balls = balls(scale, offset);
        let boxes: Vec<Aabb> =
            balls.iter().map(|ball| Dop14::around_balls([ball.center], ball.radius).bounds).collect();
        let dops: Vec<Dop14> = balls.iter().map(|ball| Dop14::around_balls([ball.center], ball.radius)).collect();
        let rays = rays(&balls, 60);
        for items in [Items::from(&boxes[..]), Items::from(&balls[..]), Items::from(&dops[..])] {
            let kind = match items {
                Items::Boxes(_) => ContainerKind::Aabb,
                Items::Spheres(_) => ContainerKind::Sphere,
                Items::Dops(_) => ContainerKind::Dop14,
            };
            for settings in settings(kind) {
                let name = format!("{kind:?} of {scale} at {offset}, {settings:?}");
                // Whatever they say of containers.
                let other = BuildSettings { container: ContainerKind::Aabb, ..settings };
                let bvh = ItemBvh::build(items, &other, &CancelToken::new()).unwrap();
                assert_eq!(bvh.report().stats.max_depth, bvh.tree().max_depth(), "{name}");
                match bvh.tree() {
                    AnyTree::Aabb(tree) => check_tree(tree, &boxes, |item, node| !node.contains(item, 0.0)),
                    // Their unions are rounded outwards, but in single precision.
                    AnyTree::Sphere(tree) => {
                        check_tree(tree, &balls, |item, node| !node.contains(item, node.radius * 1e-6))
                    }
                    AnyTree::Dop14(tree) => check_tree(tree, &dops, |item, node| !node.contains(item, 0.0)),
                    AnyTree::Oriented(_) => panic!("{name}"),
                }
                found += check(&name, &bvh, &balls, &rays);
            }
        }
    }
    assert!(found > 5_000, "{found}");
}

#[test]
fn items_of_nearer_leaves_are_visited_first() {
    // A row of boxes with gaps between them, so that the order along a ray is that of their leaves.
    let sheet = |at: u8| {
        let min = Vec3::new(-1.0, -1.0, f32::from(at));
        Aabb { min, max: min + Vec3::new(2.0, 2.0, 0.5) }
    };
    let sheets: Vec<Aabb> = (0..200).map(sheet).collect();
    let settings = settings(ContainerKind::Aabb);
    // One leaf has them all otherwise.
    for settings in settings.iter().filter(|settings| settings.builder != BuilderKind::None) {
        let bvh = ItemBvh::build(&sheets[..], settings, &CancelToken::new()).unwrap();
        // Through the shorter test of boxes, and through that for all rays.
        for direction in [Vec3::new(1e-4, 2e-4, 1.0), Vec3::Z] {
            for (ray, is_reversed) in
                [(Ray::new(-direction, direction), false), (Ray::new(direction * 300.0, -direction), true)]
            {
                let mut order = Vec::new();
                bvh.visit(&ray, |item, t_max| {
                    order.push(if is_reversed { 199 - item } else { item });
                    ControlFlow::Continue(t_max)
                });
                assert_eq!(order.len(), sheets.len(), "{settings:?}, {ray:?}");
                // Those of a leaf come in any order: at most four.
                let is_near = |(rank, item): (u32, &u32)| rank.abs_diff(*item) < 4;
                assert!((0..).zip(&order).all(is_near), "{settings:?}, {ray:?}, {order:?}");
            }
        }
    }
}

#[test]
fn boxes_of_triangles_have_the_trees_of_the_triangles() {
    for (name, triangles) in trees::nasty_scenes() {
        let boxes: Vec<Aabb> = triangles.iter().map(Triangle::bounds).collect();
        for settings in settings(ContainerKind::Aabb) {
            let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
            let bvh = ItemBvh::build(&boxes[..], &settings, &CancelToken::new()).unwrap();
            assert!(*bvh.tree() == tree, "{name}, {settings:?}");
        }
    }
}

#[test]
fn spheres_are_clustered_by_their_own_areas() {
    // Points that lie in pairs along x, with spheres so large that another pairing costs less: the triangle between the corners of
    // a box, or a tree of boxes, would have the other one.
    let balls = balls(1.0, Vec3::ZERO);
    let settings = BuildSettings { threshold: 300, ..BuildSettings::preset(Preset::Fast, ContainerKind::Sphere) };
    let bvh = ItemBvh::build(&balls[..], &settings, &CancelToken::new()).unwrap();
    let AnyTree::Sphere(tree) = bvh.tree() else { panic!("of spheres") };
    // The first pair that is merged is the closest of all pairs: found by brute force.
    let mut closest = (f32::INFINITY, 0, 0);
    for a in 0..balls.len() {
        for b in a + 1..balls.len() {
            let area = balls[a].union(&balls[b]).relative_area();
            if area < closest.0 {
                closest = (area, a as u32, b as u32);
            }
        }
    }
    let siblings = |node: &&bvhscope_engine::tree::Node<Sphere>| {
        let mut items: Vec<u32> = Vec::new();
        for child in node.children() {
            let child = &tree.nodes[child as usize];
            if !child.is_leaf() || child.count != 1 {
                return false;
            }
            items.push(tree.primitive_indices[child.slots()][0]);
        }
        items.sort_unstable();
        items == [closest.1, closest.2]
    };
    assert_eq!(tree.nodes.iter().filter(|node| !node.is_leaf()).filter(siblings).count(), 1, "{closest:?}");
}

#[test]
fn items_without_a_container_and_passes_for_triangles_are_refused() {
    let build = |items: &[Aabb], settings| ItemBvh::build(items, &settings, &CancelToken::new());
    let refused = |built: Result<ItemBvh, BuildError>| match built {
        Err(BuildError::Refused(text)) => text,
        other => panic!("{other:?}"),
    };
    let unit = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
    for bad in [Aabb::EMPTY, Aabb { max: Vec3::NAN, ..unit }, Aabb { min: Vec3::NEG_INFINITY, ..unit }] {
        let text = refused(build(&[unit, bad], BuildSettings::default()));
        assert!(text.contains("item 1 is empty or not finite"), "{text}");
    }
    for pass in [Pass::Split, Pass::Orient] {
        let default = BuildSettings::default();
        let text = refused(build(&[unit], BuildSettings { optimize: default.optimize.with(pass), ..default }));
        assert!(text.contains(pass.name()), "{text}");
    }
    let sbvh = BuildSettings { builder: BuilderKind::Sbvh, ..BuildSettings::default() };
    let text = refused(build(&[unit], sbvh));
    assert!(text.contains("the builder 'sbvh' needs triangles"), "{text}");
    let token = CancelToken::new();
    token.cancel();
    assert_eq!(
        ItemBvh::build(&[unit][..], &BuildSettings::default(), &token).err(),
        Some(BuildError::Cancelled(bvhscope_engine::Cancelled))
    );
    let empty = build(&[], BuildSettings::default()).unwrap();
    assert_eq!(empty.closest_hit(&Ray::new(Vec3::ZERO, Vec3::X), |_, _| Some(1.0)), None);
    assert!(!empty.any_hit(&Ray::new(Vec3::ZERO, Vec3::X), |_, _| true));
}

#[test]
fn polytopes_around_balls_enclose_what_the_balls_sweep() {
    let mut random = Random(3);
    for case in 0..200 {
        let scale = [1e-3, 1.0, 1e4][case % 3];
        let points: Vec<Vec3> = (0..1 + case % 4).map(|_| random.vector() * scale).collect();
        let radius = random.vector().x.abs() * scale * 0.3;
        let dop = Dop14::around_balls(points.iter().copied(), radius);
        for _ in 0..50 {
            let (from, to) = (points[random.below(points.len())], points[random.below(points.len())]);
            let along = f64::from(random.vector().x.abs());
            let center = from.as_dvec3().lerp(to.as_dvec3(), along);
            let surface: DVec3 = center + random.vector().as_dvec3().normalize() * f64::from(radius) * 0.999_999;
            assert!(dop.excess_of_point(surface.as_vec3()) <= f64::from(scale) * 1e-6, "{dop:?} {surface}");
        }
        // No wider than it must be.
        let widest = points.iter().map(|point| point.dot(Vec3::ONE)).fold(f32::NEG_INFINITY, f32::max) + 1.74 * radius;
        assert!(dop.high[0] <= widest + scale * 1e-4, "{dop:?}");
    }
    assert!(Dop14::around_balls([], 1.0).is_empty());
}
