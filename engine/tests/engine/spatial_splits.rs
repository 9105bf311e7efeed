//! The builder that divides nodes by planes, so that several leaves hold one triangle: against its definition written down plainly.

use std::collections::BTreeSet;

use bvhscope_engine::builders::{BuildError, build_binary};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::refit::{build_for_poses, refit};
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass, Passes};
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::validate::validate;
use bvhscope_engine::tree::{AnyTree, Tree};
use glam::{DVec3, Vec3, Vec3Swizzles as _};

use crate::random::Random;
use crate::trees;

fn settings(builder: BuilderKind) -> BuildSettings {
    BuildSettings { builder, ..BuildSettings::default() }
}

fn built(triangles: &[Triangle], builder: BuilderKind) -> Tree<Aabb> {
    match build_binary(triangles, &settings(builder), &CancelToken::new()).unwrap().0 {
        AnyTree::Aabb(tree) => tree,
        _ => panic!("not boxes"),
    }
}

/// Both sides of a division: the triangles on each, some perhaps on both.
type Division = [BTreeSet<u32>; 2];

/// A box with double precision.
#[derive(Clone, Copy)]
struct Bounds {
    min: DVec3,
    max: DVec3,
}

impl Bounds {
    const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |all, point| Self { min: all.min.min(point), max: all.max.max(point) })
    }

    fn of(triangle: &Triangle) -> Self {
        Self::around(corners(triangle))
    }

    fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    fn half_area(&self) -> f64 {
        let d = (self.max - self.min).max(DVec3::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

fn corners(triangle: &Triangle) -> [DVec3; 3] {
    [triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3)
}

/// The corners of the part of `triangle` on one side of a plane, one after the other around it (Sutherland and Hodgman).
fn clipped(triangle: &Triangle, axis: usize, position: f64, above: bool) -> Vec<DVec3> {
    let polygon = corners(triangle);
    let depth = |point: DVec3| if above { point[axis] - position } else { position - point[axis] };
    let mut part = Vec::new();
    for at in 0..3 {
        let (from, to) = (polygon[at], polygon[(at + 1) % 3]);
        if depth(from) >= 0.0 {
            part.push(from);
        }
        if depth(from) * depth(to) < 0.0 {
            part.push(from.lerp(to, depth(from) / (depth(from) - depth(to))));
        }
    }
    part
}

/// Cost and sides of the best division of the whole list, found by trying all.
fn best_list_division(triangles: &[Triangle]) -> (f64, Division, [Bounds; 2]) {
    let mut best = (f64::INFINITY, Division::default(), [Bounds::EMPTY; 2]);
    for axis in 0..3 {
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let centre = |index: u32| triangles[index as usize].bounds().center()[axis];
        order.sort_by(|&a, &b| centre(a).total_cmp(&centre(b)).then(a.cmp(&b)));
        for left in 1..order.len() {
            let (first, second) = order.split_at(left);
            let sides = [first, second].map(|side| {
                side.iter().fold(Bounds::EMPTY, |all, &index| all.union(&Bounds::of(&triangles[index as usize])))
            });
            let cost = sides[0].half_area() * first.len() as f64 + sides[1].half_area() * second.len() as f64;
            if cost < best.0 {
                best = (cost, [first, second].map(|side| side.iter().copied().collect()), sides);
            }
        }
    }
    best
}

/// A plane across all triangles, with the boxes of both sides and the numbers of triangles that reach into them.
#[derive(Clone, Copy)]
struct Plane {
    axis: usize,
    position: f64,
    sides: [(Bounds, usize); 2],
}

impl Plane {
    fn new(triangles: &[Triangle], axis: usize, position: f64) -> Self {
        let mut sides = [(Bounds::EMPTY, 0); 2];
        for triangle in triangles {
            let Bounds { min, max } = Bounds::of(triangle);
            for (side, (bounds, count)) in sides.iter_mut().enumerate() {
                if if side == 0 { min[axis] < position } else { max[axis] > position } {
                    *bounds = bounds.union(&Bounds::around(clipped(triangle, axis, position, side == 1)));
                    *count += 1;
                }
            }
        }
        Self { axis, position, sides }
    }

    fn cost(&self) -> f64 {
        self.sides.iter().map(|(bounds, count)| bounds.half_area() * *count as f64).sum()
    }

    /// Each triangle that the plane crosses goes to both sides, or as a whole to one where that is cheaper. Returns how many do.
    fn divide(mut self, triangles: &[Triangle]) -> (Division, usize) {
        let (mut division, mut whole) = (Division::default(), 0);
        for (index, triangle) in (0..).zip(triangles) {
            let bounds = Bounds::of(triangle);
            let reaches = [bounds.min[self.axis] < self.position, bounds.max[self.axis] > self.position];
            let mut goes = reaches;
            if reaches == [true; 2] {
                let mut cheapest = self;
                for kept in 0..2 {
                    let mut moved = self;
                    moved.sides[kept].0 = moved.sides[kept].0.union(&bounds);
                    moved.sides[1 - kept].1 -= 1;
                    if moved.cost() <= cheapest.cost() {
                        (cheapest, goes) = (moved, [kept == 0, kept == 1]);
                    }
                }
                whole += usize::from(goes != reaches);
                self = cheapest;
            }
            for side in 0..2 {
                if goes[side] {
                    division[side].insert(index);
                }
            }
        }
        (division, whole)
    }
}

/// The best of 31 planes at equal distances across each axis.
fn best_plane(triangles: &[Triangle]) -> Plane {
    let all = triangles.iter().fold(Bounds::EMPTY, |all, triangle| all.union(&Bounds::of(triangle)));
    let planes = (0..3).flat_map(|axis| (1..32).map(move |slab| (axis, slab)));
    let planes = planes.map(|(axis, slab)| {
        let position = all.min[axis] + (all.max[axis] - all.min[axis]) * f64::from(slab) / 32.0;
        Plane::new(triangles, axis, position)
    });
    let dividing = planes.filter(|plane| plane.sides.iter().all(|side| side.1 > 0));
    dividing.min_by(|a, b| a.cost().total_cmp(&b.cost())).unwrap()
}

/// The triangles below both children of the root.
fn division_of(tree: &Tree<Aabb>) -> Division {
    let first = tree.nodes[0].first as usize;
    [first, first + 1].map(|child| {
        let (mut open, mut below) = (vec![child], BTreeSet::new());
        while let Some(at) = open.pop() {
            let node = &tree.nodes[at];
            if node.is_leaf() {
                below.extend(&tree.primitive_indices[node.slots()]);
            } else {
                open.extend([node.first as usize, node.first as usize + 1]);
            }
        }
        below
    })
}

#[test]
fn the_first_split_is_the_cheapest_of_lists_and_planes() {
    let (mut planes, mut lists, mut wholes, mut cut) = (0, 0, 0, 0);
    for seed in 0..240 {
        let count = [3, 5, 8, 13, 40, 90][seed as usize % 6];
        let mut triangles = trees::sticks(count, seed);
        if seed % 2 == 0 {
            triangles.extend(trees::soup(count, 0.3, seed));
        }
        if seed % 5 == 0 {
            triangles = trees::soup(count, 0.1, seed);
        }
        let (list_cost, by_list, sides) = best_list_division(&triangles);
        let common = Bounds { min: sides[0].min.max(sides[1].min), max: sides[0].max.min(sides[1].max) };
        let all = sides[0].union(&sides[1]);
        let overlaps = (common.max - common.min).min_element() >= 0.0 && common.half_area() > 1e-5 * all.half_area();
        let plane = best_plane(&triangles);
        let mut expected = by_list;
        lists += 1;
        // A node costs as much as a triangle: what is cheaper as a leaf is not cut.
        let pays = plane.cost() < list_cost.min((triangles.len() as f64 - 1.0) * all.half_area());
        if overlaps && pays {
            let (division, whole) = plane.divide(&triangles);
            if division.iter().all(|side| !side.is_empty()) {
                cut += division[0].intersection(&division[1]).count();
                wholes += whole;
                expected = division;
                planes += 1;
                lists -= 1;
            }
        }
        let mut found = division_of(&built(&triangles, BuilderKind::Sbvh));
        // Which side is left does not matter to a division of the list.
        if found != expected {
            found.reverse();
        }
        assert!(found == expected, "seed {seed}: {found:?} instead of {expected:?}");
    }
    // All kinds of divisions were compared.
    assert!(planes >= 20 && lists >= 10 && wholes >= 20 && cut >= 100, "{planes}, {lists}, {wholes}, {cut}");
}

/// Scenes with long triangles, and how much planes lower the cost of the sweep at least.
pub fn long_scenes() -> [(&'static str, Vec<Triangle>, f32); 3] {
    // Beams between floors of small triangles, as of a building.
    let mut building: Vec<Triangle> = (0..4).flat_map(|floor| trees::grid(12, 1, floor as f32 * 4.0)).collect();
    building.extend(trees::sticks(60, 3).iter().map(|stick| {
        let place = |point: Vec3| (point + 1.0) * 6.0;
        Triangle { a: place(stick.a), b: place(stick.b), c: place(stick.c) }
    }));
    [
        ("sticks", trees::sticks(2000, 1), 0.95),
        ("large soup", trees::soup(2000, 1.0, 2), 1.0),
        ("building", building, 0.95),
    ]
}

#[test]
fn planes_lower_the_cost_of_scenes_with_long_triangles() {
    for (name, triangles, most) in long_scenes() {
        let [sbvh, sweep] = [BuilderKind::Sbvh, BuilderKind::Sweep].map(|builder| {
            let tree = AnyTree::Aabb(built(&triangles, builder));
            tree_stats(&tree, &CancelToken::new()).unwrap().sah_cost
        });
        assert!(sbvh < most * sweep, "{name}: SBVH {sbvh}, sweep {sweep}");
    }
}

#[test]
fn references_cover_their_triangles_and_stay_within_bounds() {
    let mut random = Random(7);
    for (name, triangles) in
        long_scenes().map(|(name, triangles, _)| (name, triangles)).into_iter().chain(trees::nasty_scenes())
    {
        let tree = built(&triangles, BuilderKind::Sbvh);
        let references = tree.primitive_indices.len();
        assert!((triangles.len()..=2 * triangles.len()).contains(&references), "{name}: {references} references");
        if name == "sticks" {
            assert!(references > triangles.len() * 11 / 10, "{name}: {references} references");
        }
        // Triangles that are scaled for the build are in their leaves as a whole.
        if ["tiny coordinates", "huge coordinates"].contains(&name) {
            assert_eq!(references, triangles.len(), "{name}");
        }
        let mut boxes = vec![Vec::new(); triangles.len()];
        for leaf in tree.nodes.iter().filter(|node| node.is_leaf()) {
            assert_eq!(leaf.count, 1, "{name}");
            boxes[tree.primitive_indices[leaf.first as usize] as usize].push(leaf.container);
        }
        for (triangle, boxes) in triangles.iter().zip(&boxes) {
            let whole = triangle.bounds();
            assert!(boxes.iter().all(|part| whole.contains(part, 0.0)), "{name}: {boxes:?} of {triangle:?}");
            let slack = whole.max.abs().max(whole.min.abs()).max_element() * f32::EPSILON;
            for _ in 0..40 {
                let (u, v) = (random.vector().x.abs(), random.vector().x.abs());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let point = triangle.a + (triangle.b - triangle.a) * u + (triangle.c - triangle.a) * v;
                let holds = |part: &Aabb| part.contains(&Aabb { min: point, max: point }, slack);
                assert!(boxes.iter().any(holds), "{name}: {point} of {triangle:?} in none of {boxes:?}");
            }
        }
    }
}

/// Rays through the planes themselves would slip between parts that did not overlap.
#[test]
fn parts_extend_beyond_the_planes_between_them() {
    let mut neighbours = 0;
    for (name, triangles, _) in long_scenes() {
        let tree = built(&triangles, BuilderKind::Sbvh);
        let Aabb { min, max } = tree.nodes[0].container;
        let step = min.abs().max(max.abs()).max_element() * f32::EPSILON;
        let mut parts = vec![Vec::new(); triangles.len()];
        for leaf in tree.nodes.iter().filter(|node| node.is_leaf()) {
            parts[tree.primitive_indices[leaf.first as usize] as usize].push(leaf.container);
        }
        for (below, above) in parts.iter().flat_map(|own| own.iter().flat_map(|a| own.iter().map(move |b| (a, b)))) {
            let common = below.max - above.min;
            for axis in 0..3 {
                let is_long = [below, above].iter().all(|part| part.extent()[axis] > 100.0 * step);
                if is_long && common[axis].abs() < 30.0 * step {
                    neighbours += 1;
                    assert!(common[axis] >= 4.0 * step, "{name}: {below:?} beside {above:?}");
                }
            }
        }
    }
    assert!(neighbours > 50, "{neighbours} neighbours");
}

#[test]
fn the_tree_is_the_same_on_any_number_of_threads() {
    let triangles = trees::sticks(9_000, 4);
    let [one, two, four] = [1, 2, 4].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| built(&triangles, BuilderKind::Sbvh))
    });
    assert!(one == two && one == four);
}

#[test]
fn builds_stop_at_every_poll() {
    let triangles = trees::sticks(6_000, 6);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for builder in [BuilderKind::Sbvh, BuilderKind::Hploc] {
        let build = |token: &CancelToken| pool.install(|| build_binary(&triangles, &settings(builder), token));
        let count = {
            use std::sync::Arc;
            use std::sync::atomic::{AtomicU64, Ordering};
            let polls = Arc::new(AtomicU64::new(0));
            let counted = Arc::clone(&polls);
            build(&CancelToken::watched(move |poll| {
                counted.store(poll, Ordering::Relaxed);
                false
            }))
            .unwrap();
            polls.load(Ordering::Relaxed)
        };
        assert!(count > 10, "{}: {count} polls", builder.name());
        for poll in (1..=count).step_by((count / 30).max(1) as usize) {
            let cancelled = build(&CancelToken::watched(move |now| now == poll));
            assert!(matches!(cancelled, Err(BuildError::Cancelled(_))), "{} at {poll} of {count}", builder.name());
        }
    }
}

#[test]
fn trees_of_triangles_that_move_hold_them_whole() {
    let triangles = trees::sticks(500, 8);
    let turned = |t: &Triangle| Triangle { a: t.a.zxy() * 1.5, b: t.b.zxy() * 1.5, c: t.c.zxy() * 1.5 };
    let moved: Vec<Triangle> = triangles.iter().map(turned).collect();
    let token = CancelToken::new();
    let mut tree = AnyTree::Aabb(built(&triangles, BuilderKind::Sbvh));
    refit(&mut tree, &moved, &token).unwrap();
    assert_eq!(validate(&tree, &moved), Ok(()));
    // Of several poses there is no plane to cut at.
    let [sbvh, sweep] = [BuilderKind::Sbvh, BuilderKind::Sweep]
        .map(|builder| build_for_poses(&[&triangles[..], &moved], &settings(builder), &token).unwrap());
    assert!(sbvh == sweep);
}

#[test]
fn passes_take_trees_whose_leaves_share_triangles() {
    for (name, triangles, _) in long_scenes() {
        let plain = AnyTree::Aabb(built(&triangles, BuilderKind::Sbvh));
        assert_eq!(validate(&plain, &triangles), Ok(()), "{name}");
        let before = tree_stats(&plain, &CancelToken::new()).unwrap().sah_cost;
        for passes in Pass::ALL.map(|pass| Passes::NONE.with(pass)).into_iter().chain([Passes::FINISHED, Passes::ALL]) {
            let settings = BuildSettings { optimize: passes, rounds: 6, ..settings(BuilderKind::Sbvh) };
            let tree = build_binary(&triangles, &settings, &CancelToken::new()).unwrap().0;
            assert_eq!(validate(&tree, &triangles), Ok(()), "{name}, {passes}");
            // Costs of oriented boxes do not compare.
            let cost = tree_stats(&tree, &CancelToken::new()).unwrap().sah_cost;
            assert!(
                passes.contains(Pass::Orient) || cost <= before * (1.0 + 1e-5),
                "{name}, {passes}: {cost}, {before}"
            );
            // The builder splits triangles itself.
            assert!(passes != Passes::NONE.with(Pass::Split) || tree == plain, "{name}");
        }
    }
}
