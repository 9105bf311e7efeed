//! Copies of meshes: the very hits of the flat scene.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use bvhscope_engine::geometry::{Aabb, OrientedBox, Ray, Triangle};
use bvhscope_engine::settings::{BuildSettings, Pass, Preset};
use bvhscope_engine::tree::Tree;
use bvhscope_engine::tree::traverse::{NoProbe, Probe, TestCounts, Traversal};
use bvhscope_engine::tree::validate::validate;
use bvhscope_engine::tree::visits::RayQuery;
use bvhscope_engine::{
    AnyTree, BinaryLevels, BuildError, Bvh, CancelToken, ContainerKind, CopyCost, Hit, InstanceHit, Instances, ItemBvh,
    LevelNode, Placed, Unfolded, UnfoldedCopy, WideBvh, build,
};
use glam::{Affine3A, EulerRot, Mat3A, Quat, Vec3, Vec3A};

use crate::random::Random;
use crate::trees;

/// A mesh with its tree.
pub struct Mesh {
    pub triangles: Vec<Triangle>,
    pub tree: Arc<Bvh>,
}

pub fn mesh(triangles: Vec<Triangle>, settings: &BuildSettings) -> Mesh {
    let tree = Arc::new(build(&triangles, settings, &CancelToken::new()).unwrap());
    Mesh { triangles, tree }
}

/// Turned, scaled, mirrored and sheared: a matrix whose scales are about `scale`.
pub fn matrix(random: &mut Random, kind: usize, scale: f32) -> Mat3A {
    let turned = Mat3A::from_quat(Quat::from_euler(
        EulerRot::XYZ,
        random.signed() * 3.0,
        random.signed() * 3.0,
        random.signed(),
    ));
    let scaled = |scale: Vec3| Mat3A::from_diagonal(scale);
    match kind % 6 {
        0 => scaled(Vec3::splat(scale)),
        1 => turned * scaled(Vec3::splat(scale)),
        // Mirrored, and not alike on all axes.
        2 => turned * scaled(Vec3::new(-scale, scale, 0.3 * scale)),
        3 => turned * Mat3A::from_cols(Vec3A::X, Vec3A::new(2.5, 1.0, 0.0), Vec3A::new(-1.0, 3.0, 1.0)) * scale,
        4 => scaled(Vec3::new(scale, 1e-3 * scale, 1e2 * scale)) * turned,
        _ => turned * turned.transpose() * scale,
    }
}

/// The flat scene, and the copy and the triangle of each of its triangles.
fn flat(meshes: &[Mesh], instances: &Instances) -> (Vec<Triangle>, Vec<(u32, u32)>) {
    let (mut triangles, mut of, copies) = (Vec::new(), Vec::new(), instances.copies().copies());
    for instance in 0..copies.len() as u32 {
        let mesh = &meshes[copies.mesh(instance) as usize].triangles;
        triangles.extend(mesh.iter().map(|triangle| copies.place(instance).triangle(triangle)));
        of.extend((0..mesh.len() as u32).map(|triangle| (instance, triangle)));
    }
    (triangles, of)
}

/// Rays at corners, edges, faces and past them, from near and far, along axes, with short and long directions and limits.
pub fn rays(triangles: &[Triangle], count: usize, random: &mut Random) -> Vec<Ray> {
    let ray = |index: usize| {
        let triangle = triangles[random.below(triangles.len())];
        let size = triangle.bounds().extent().length().max(f32::MIN_POSITIVE);
        let (s, t) = (random.signed().abs(), random.signed().abs());
        let target = match index % 4 {
            0 => triangle.a,
            1 => triangle.b.lerp(triangle.c, t),
            _ => triangle.a.lerp(triangle.b, t).lerp(triangle.c, s),
        };
        let away = [0.3, 3.0, 100.0, 1e5][index / 4 % 4] * size;
        let mut towards = random.vector().normalize_or(Vec3::X);
        if index.is_multiple_of(7) {
            towards = [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::new(0.6, 0.0, 0.8)][index / 7 % 4];
        }
        let origin = target - towards * away;
        let length = [1.0, 1e-9, 1e9, 17.0][index / 16 % 4];
        let mut ray = Ray::new(origin, (target - origin).normalize_or(towards) * length);
        match index % 11 {
            0 => ray.t_max = away / length,
            1 => ray.t_min = 0.5 * away / length,
            _ => {}
        }
        ray
    };
    (0..count).map(ray).collect()
}

/// Packets of rays from one point whose directions have the same signs and the same longest axis: towards corners, edges and faces, in
/// narrow and wide bundles, with limits.
fn packets(triangles: &[Triangle], count: usize, random: &mut Random) -> Vec<Vec<Ray>> {
    let mut packet = |index: usize| {
        let target = triangles[random.below(triangles.len())];
        let size = target.bounds().extent().length().max(f32::MIN_POSITIVE);
        let away = [0.3, 3.0, 100.0, 1e5][index % 4] * size;
        let towards = (random.vector().signum() * Vec3::splat(0.4) + random.vector() * 0.3).normalize();
        let origin = target.a - towards * away;
        let length = [1.0, 1e-9, 1e9, 17.0][index / 4 % 4];
        let spread = [1e-5, 0.01, 0.3][index % 3];
        let coherent = |direction: Vec3| {
            let longest = |v: Vec3| v.abs().max_position();
            direction.signum() == towards.signum() && longest(direction) == longest(towards)
        };
        let t_min = if index.is_multiple_of(5) { 0.5 * away / length } else { 0.0 };
        let ray = |lane: usize| {
            let other = if lane.is_multiple_of(2) { target } else { triangles[random.below(triangles.len())] };
            let at = other.b.lerp(other.c, random.signed().abs());
            let at = [other.a, at, at.lerp(other.a, 0.3)][lane / 2 % 3];
            let wanted = [(at - origin).normalize_or(towards), (towards + random.vector() * spread).normalize()];
            let direction = wanted.into_iter().find(|direction| coherent(*direction)).unwrap_or(towards);
            let mut ray = Ray::new(origin, direction * length);
            ray.t_min = t_min;
            if lane.is_multiple_of(7) {
                ray.t_max = 1.001 * away / length;
            }
            ray
        };
        (0..[16, 100, 256][index % 3]).map(ray).collect()
    };
    (0..count).map(&mut packet).collect()
}

/// Compares packets of rays with the tree of the flat scene. Returns the numbers of rays and hits.
fn check_packets(name: &str, instances: &Instances, of: &[(u32, u32)], bvh: &Bvh, packets: &[Vec<Ray>]) -> [usize; 2] {
    let mut found = [0; 2];
    for rays in packets {
        // One more than there are rays, which nothing may touch.
        let untouched = InstanceHit { t: 0.0, instance: 7, primitive_index: 7, u: 0.0, v: 0.0 };
        let mut hits = vec![Some(untouched); rays.len() + 1];
        instances.closest_hits(rays, &mut hits);
        assert_eq!(hits.pop(), Some(Some(untouched)), "{name}");
        for (ray, hit) in rays.iter().zip(hits) {
            let expected = bvh.closest_hit(ray).map(|hit| of_copy(of, &hit));
            assert_eq!(hit, expected, "{name}, {ray:?} of {}", rays.len());
            found = [found[0] + 1, found[1] + usize::from(expected.is_some())];
        }
    }
    found
}

/// A hit of the flat scene as one of a copy.
fn of_copy(of: &[(u32, u32)], hit: &Hit) -> InstanceHit {
    let (instance, primitive_index) = of[hit.primitive_index as usize];
    InstanceHit { t: hit.t, instance, primitive_index, u: hit.u, v: hit.v }
}

/// Builds a tree over `copies`, more or less opened, and compares it by [`compare`].
fn check(name: &str, meshes: &[Mesh], copies: &[Placed], rays: usize, random: &mut Random) -> [[usize; 2]; 2] {
    let (settings, token) = (BuildSettings::default(), CancelToken::new());
    let trees = meshes.iter().map(|mesh| Arc::clone(&mesh.tree)).collect();
    let open = 1.0 + 3.0 * random.signed().abs();
    let instances =
        Instances::build(trees, copies, &settings, open, &token).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert!(instances.top().triangle_count() <= (copies.len() as f32 * open) as usize, "{name}");
    compare(name, meshes, &instances, rays, random)
}

/// Compares every query with the tree of the flat scene. Returns the numbers of rays and of hits, of single rays and of packets.
pub fn compare(
    name: &str,
    meshes: &[Mesh],
    instances: &Instances,
    rays: usize,
    random: &mut Random,
) -> [[usize; 2]; 2] {
    let (settings, token) = (BuildSettings::default(), CancelToken::new());
    let (triangles, of) = flat(meshes, instances);
    assert_eq!(instances.copies().triangle_count(), triangles.len() as u64, "{name}");
    let bvh = build(&triangles, &settings, &token).unwrap();
    let same = |hit: &Hit| of_copy(&of, hit);
    let (mut all, mut all_flat, mut found) = (Vec::new(), Vec::new(), 0);
    let packets = if triangles.is_empty() { Vec::new() } else { packets(&triangles, rays / 10, random) };
    let in_packets = check_packets(name, instances, &of, &bvh, &packets);
    let rays = rays_of(&triangles, rays, random);
    let mut nearest = vec![None; rays.len()];
    instances.closest_hits(&rays, &mut nearest);
    let mut blocked = vec![false; rays.len()];
    instances.any_hits(&rays, &mut blocked);
    let (over, top) = over_own_boxes(instances, &triangles, &of);
    let lists: Vec<&[Triangle]> = meshes.iter().map(|mesh| &mesh.triangles[..]).collect();
    let levels = BinaryLevels { copies: instances.copies(), top: &top, triangles: &lists, unfolded: None };
    for (index, ray) in rays.iter().enumerate() {
        let expected = bvh.closest_hit(ray).map(|hit| same(&hit));
        assert_eq!(levels.any_hit(ray, &mut NoProbe), expected.is_some(), "{name}, {ray:?}");
        assert_eq!([instances.closest_hit(ray), over.closest_hit(ray)], [expected; 2], "{name}, {ray:?}");
        for traversal in Traversal::ALL {
            let binary = levels.closest_hit(ray, traversal, &mut NoProbe);
            assert_eq!(binary, expected, "{name}, {traversal:?}, {ray:?}");
        }
        assert_eq!((nearest[index], blocked[index]), (expected, bvh.any_hit(ray)), "{name}, {ray:?}");
        for max in [usize::MAX, 1, 3] {
            let has_more = bvh.all_hits(ray, max, &mut all_flat);
            assert_eq!(instances.all_hits(ray, max, &mut all), has_more, "{name}, {ray:?}");
            assert!(all.iter().copied().eq(all_flat.iter().map(same)), "{name}, {ray:?}: {all:?} {all_flat:?}");
        }
        found += usize::from(expected.is_some());
    }
    [[rays.len(), found], in_packets]
}

/// The same copies below a tree over the boxes of their triangles, and its binary tree.
fn over_own_boxes(instances: &Instances, triangles: &[Triangle], of: &[(u32, u32)]) -> (Instances, Tree<Aabb>) {
    let (settings, token) = (BuildSettings::default(), CancelToken::new());
    // A copy without triangles has a box that it does not need.
    let mut boxes = vec![Aabb { min: Vec3::ZERO, max: Vec3::ZERO }; instances.copies().copies().len()];
    for (triangle, (copy, index)) in triangles.iter().zip(of) {
        let bounds = &mut boxes[*copy as usize];
        *bounds = if *index == 0 { triangle.bounds() } else { bounds.union(&triangle.bounds()) };
    }
    let top = ItemBvh::build(&boxes[..], &settings, &token).unwrap();
    let AnyTree::Aabb(tree) = top.tree().clone() else { panic!("of boxes") };
    (Instances::over(Arc::clone(instances.copies()), Arc::new(top.into_wide())), tree)
}

fn rays_of(triangles: &[Triangle], count: usize, random: &mut Random) -> Vec<Ray> {
    if triangles.is_empty() { vec![Ray::new(Vec3::ZERO, Vec3::X)] } else { rays(triangles, count, random) }
}

#[test]
fn copies_are_hit_as_the_flat_scene_is() {
    let mut random = Random(77);
    let best = BuildSettings::preset(Preset::Best, ContainerKind::Aabb);
    let split = BuildSettings { optimize: best.optimize.with(Pass::Split), ..best };
    let nasty = |wanted: &str| trees::nasty_scenes().into_iter().find(|(name, _)| *name == wanted).unwrap().1;
    let fast = BuildSettings::default();
    let meshes = [
        mesh(trees::ball(Vec3::new(0.2, 0.0, 0.1), 1.0, 14), &fast),
        mesh(nasty("room of grids"), &best),
        mesh(trees::soup(200, 0.7, 5), &split),
        mesh(Vec::new(), &fast),
        mesh(trees::soup(1, 1.0, 6), &fast),
    ];
    let mut found = [[0; 2]; 2];
    for scale in [1e-6_f32, 1e-3, 1.0, 1e3, 1e6] {
        for offset in [0.0, 1.0, 1e3, 1e7] {
            for kind in 0..6 {
                let copy = |index: usize| {
                    let around = random.vector() * scale * 3.0 + Vec3::splat(offset) * random.vector().signum();
                    Placed {
                        mesh: (index % meshes.len()) as u32,
                        transform: Affine3A { matrix3: matrix(&mut random, kind, scale), translation: around.into() },
                    }
                };
                let mut copies: Vec<Placed> = (0..10).map(copy).collect();
                // Coplanar and equal.
                copies.push(copies[1]);
                copies.push(copies[5]);
                let name = format!("scale {scale}, offset {offset}, kind {kind}");
                let [single, packets] = check(&name, &meshes, &copies, 120, &mut random);
                for (sum, [rays, hits]) in found.iter_mut().zip([single, packets]) {
                    *sum = [sum[0] + rays, sum[1] + hits];
                }
            }
        }
    }
    for [rays, hits] in found {
        assert!(hits > rays / 3, "{hits} of {rays}");
    }
}

#[test]
fn many_copies_and_none() {
    let mut random = Random(5);
    let meshes = [mesh(trees::ball(Vec3::ZERO, 1.0, 5), &BuildSettings::default())];
    let copy = |_| Placed {
        mesh: 0,
        transform: Affine3A { matrix3: matrix(&mut random, 1, 0.4), translation: (random.vector() * 8.0).into() },
    };
    let copies: Vec<Placed> = (0..700).map(copy).collect();
    for [rays, hits] in check("many", &meshes, &copies, 500, &mut Random(6)) {
        assert!(hits > rays / 2, "{hits} of {rays}");
    }
    check("none", &meshes, &[], 1, &mut Random(7));
}

/// In a list as a tree a ray that comes to the rest before the first has all that it passes on its stack.
#[test]
fn trees_deeper_than_the_stacks_of_streams_are_traced() {
    let (settings, token) = (BuildSettings::default(), CancelToken::new());
    let placed: Vec<Placed> =
        (0..1_000).map(|x| Placed { mesh: 0, transform: Affine3A::from_translation(Vec3::X * x as f32) }).collect();
    let wall = mesh(vec![Triangle { a: Vec3::ZERO, b: Vec3::Y, c: Vec3::Z }], &settings);
    let row = Instances::build(vec![Arc::clone(&wall.tree)], &placed, &settings, 1.0, &token).unwrap();
    let walls: Vec<Triangle> =
        (0..1_000).map(|copy| row.copies().copies().place(copy).triangle(&wall.triangles[0])).collect();
    let list = WideBvh::new(&trees::chain::<Aabb>(&walls), &walls, &token).unwrap();
    let row = Instances::over(Arc::clone(row.copies()), Arc::new(list));
    // Through the boxes of all: through the last triangle, and past all.
    let ray = |at: f32| Ray::new(Vec3::new(2_000.0, at, at), Vec3::NEG_X);
    let rays: Vec<Ray> = (0..200).map(|index| ray(if index % 3 == 0 { 0.25 } else { 0.75 })).collect();
    let (mut hits, mut blocked) = (vec![None; rays.len()], vec![false; rays.len()]);
    // In parts that are too small for packets.
    for (rays, hits) in rays.chunks(8).zip(hits.chunks_mut(8)) {
        row.closest_hits(rays, hits);
    }
    row.any_hits(&rays, &mut blocked);
    for (index, ray) in rays.iter().enumerate() {
        let expected = (index % 3 == 0).then_some((999, 1_001.0));
        assert_eq!(hits[index].map(|hit| (hit.instance, hit.t)), expected, "{ray:?}");
        assert_eq!((hits[index], blocked[index]), (row.closest_hit(ray), expected.is_some()), "{ray:?}");
    }
}

#[test]
fn what_cannot_be_traced_is_refused_by_name() {
    let token = CancelToken::new();
    let ball = trees::ball(Vec3::ZERO, 1.0, 4);
    let of = |container| Arc::new(build(&ball, &BuildSettings::preset(Preset::Fast, container), &token).unwrap());
    let refused = |container, copy: Placed| {
        let unit = Placed { mesh: 0, transform: Affine3A::IDENTITY };
        match Instances::build(vec![of(container)], &[unit, copy], &BuildSettings::default(), 1.0, &token) {
            Err(BuildError::Refused(text)) => text,
            other => panic!("{other:?}"),
        }
    };
    let copy = |transform| Placed { mesh: 0, transform };
    for (container, name) in [(ContainerKind::Sphere, "spheres"), (ContainerKind::Dop14, "14-DOPs")] {
        assert!(refused(container, copy(Affine3A::IDENTITY)).contains(name));
    }
    let text = refused(ContainerKind::Aabb, copy(Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0))));
    assert!(text.contains("copy 1") && text.contains("singular"), "{text}");
    let text = refused(ContainerKind::Aabb, Placed { mesh: 3, transform: Affine3A::IDENTITY });
    assert!(text.contains("copy 1") && text.contains("no such mesh"), "{text}");
}

#[test]
fn opened_copies_fill_less_of_the_scene() {
    // Long ones that cross each other: the boxes of whole copies overlap throughout.
    let token = CancelToken::new();
    let long = |p: Vec3| p * Vec3::new(8.0, 0.2, 0.2);
    let needle = trees::ball(Vec3::ZERO, 1.0, 20);
    let needle = needle.iter().map(|t| Triangle { a: long(t.a), b: long(t.b), c: long(t.c) }).collect();
    let needle = mesh(needle, &BuildSettings::default());
    let copy = |index: i32| {
        let turned = Quat::from_rotation_y(index as f32 * 0.4) * Quat::from_rotation_z(0.3);
        Placed { mesh: 0, transform: Affine3A::from_rotation_translation(turned, Vec3::Y * index as f32 * 0.1) }
    };
    let copies: Vec<Placed> = (0..24).map(copy).collect();
    let entered = |open: f32| {
        let trees = vec![Arc::clone(&needle.tree)];
        let instances = Instances::build(trees, &copies, &BuildSettings::default(), open, &token).unwrap();
        let boxes = instances.copies().boxes(open, &token).unwrap();
        assert_eq!(boxes.len(), instances.top().triangle_count());
        (boxes.len(), boxes.iter().map(|bounds| bounds.extent().element_product()).sum::<f32>())
    };
    let (closed, opened) = (entered(1.0), entered(8.0));
    assert_eq!(closed.0, 24);
    assert!(opened.0 > 100 && opened.0 <= 192, "{opened:?}");
    assert!(opened.1 < 0.5 * closed.1, "{closed:?} {opened:?}");
}

/// The copies that a ray is carried into, and its tests.
#[derive(Default)]
struct Carried(Vec<u32>, TestCounts);

impl Probe for Carried {
    fn container_test(&mut self) {
        self.1.containers += 1;
    }
    fn primitive_test(&mut self) {
        self.1.primitives += 1;
    }
    fn carried(&mut self, copy: u32) {
        self.0.push(copy);
    }
}

/// The box along the axes of each node, and of the first of them that stand for it.
fn boxes_of(tree: &Tree<OrientedBox>) -> Vec<Aabb> {
    tree.nodes.iter().map(|node| node.container.bounds).collect()
}

/// Visits by node, visits in meshes that are not unfolded, containers that are entered or missed, and tests of one ray.
#[derive(Default)]
struct Told {
    visits: HashMap<u32, u32>,
    below: u32,
    tested: u64,
    primitives: Vec<(u32, Option<f32>)>,
    counts: TestCounts,
    /// The smallest distance that an entered container of each node was told to begin at.
    entered: HashMap<u32, f32>,
}

impl Probe for Told {
    const EVENTS: bool = true;

    fn container_test(&mut self) {
        self.counts.containers += 1;
    }
    fn primitive_test(&mut self) {
        self.counts.primitives += 1;
    }
    fn visited(&mut self, node: u32) {
        *self.visits.entry(node).or_default() += 1;
    }
    fn visited_below(&mut self) {
        self.below += 1;
    }
    fn entered(&mut self, node: u32, t: f32) {
        self.tested += 1;
        self.entered.insert(node, t);
    }
    fn missed(&mut self, _: u32) {
        self.tested += 1;
    }
    fn tested(&mut self, primitive: u32, t: Option<f32>) {
        self.primitives.push((primitive, t));
    }
}

/// A tree over copies of two meshes, a ball and a soup, and what they consist of.
struct TwoLevels {
    meshes: [Mesh; 2],
    instances: Instances,
    triangles: Vec<Triangle>,
    of: Vec<(u32, u32)>,
    top: Tree<Aabb>,
}

fn two_levels(count: usize, scale: f32, settings: &BuildSettings, random: &mut Random) -> TwoLevels {
    let meshes = [mesh(trees::ball(Vec3::ZERO, 1.0, 9), settings), mesh(trees::soup(60, 0.7, 5), settings)];
    let copy = |index: usize| Placed {
        mesh: (index % 2) as u32,
        transform: Affine3A {
            matrix3: matrix(random, index, scale),
            translation: (random.vector() * 4.0 * scale).into(),
        },
    };
    let copies: Vec<Placed> = (0..count).map(copy).collect();
    let trees = meshes.iter().map(|mesh| Arc::clone(&mesh.tree)).collect();
    let instances = Instances::build(trees, &copies, settings, 1.0, &CancelToken::new()).unwrap();
    let (triangles, of) = flat(&meshes, &instances);
    let (_, top) = over_own_boxes(&instances, &triangles, &of);
    TwoLevels { meshes, instances, triangles, of, top }
}

#[test]
fn all_copies_unfolded_are_a_tree_of_the_flat_scene() {
    let (mut random, token) = (Random(57), CancelToken::new());
    // Leaves of one copy, and of several.
    for settings in [BuildSettings::default(), BuildSettings::preset(Preset::Best, ContainerKind::Aabb)] {
        let scene = two_levels(40, 0.7, &settings, &mut random);
        let copies = scene.instances.copies();
        let first = |copy: u32| scene.of.iter().position(|of| *of == (copy, 0)).unwrap() as u32;
        let all: Vec<UnfoldedCopy> = (0..40).map(|copy| UnfoldedCopy { copy, first: first(copy) }).collect();
        let (tree, unfolded) = Unfolded::new(copies, &scene.top, &all, &token).unwrap();
        assert_eq!(unfolded.copies(), all);
        let depths = scene.meshes.iter().map(|mesh| mesh.tree.tree().max_depth()).max().unwrap();
        assert!(tree.max_depth > scene.top.max_depth.max(depths));
        let tree = AnyTree::Oriented(tree);
        validate(&tree, &scene.triangles).unwrap();
        let leaf_triangles = tree.leaf_triangles(&scene.triangles, &token).unwrap();
        for ray in rays(&scene.triangles, 2000, &mut random) {
            let hit = tree.closest_hit(&leaf_triangles, &ray, Traversal::Ordered, &mut NoProbe);
            assert_eq!(hit.map(|hit| of_copy(&scene.of, &hit)), scene.instances.closest_hit(&ray), "{ray:?}");
        }
    }
}

#[test]
fn unfolded_nodes_stand_for_those_of_both_levels() {
    // So small that rays are carried by powers of two.
    for scale in [0.7, 1e-8] {
        check_unfolded(scale);
    }
}

fn check_unfolded(scale: f32) {
    let (mut random, token, settings) = (Random(58), CancelToken::new(), BuildSettings::default());
    let scene = two_levels(30, scale, &settings, &mut random);
    let copies = scene.instances.copies();
    // Every third, whose triangles follow the copies.
    let mut next = 30;
    let mut unfold = |copy: u32| {
        let first = next;
        next += scene.meshes[copies.copies().mesh(copy) as usize].triangles.len() as u32;
        UnfoldedCopy { copy, first }
    };
    let some: Vec<UnfoldedCopy> = (0..30).step_by(3).map(&mut unfold).collect();
    let (tree, unfolded) = Unfolded::new(copies, &scene.top, &some, &token).unwrap();
    let (nothing, _) = Unfolded::new(copies, &scene.top, &[], &token).unwrap();
    assert_eq!(boxes_of(&nothing), in_order(&scene.top));
    let mut primitives = tree.primitive_indices.clone();
    primitives.sort_unstable();
    assert!(primitives.into_iter().eq((0..next).filter(|primitive| *primitive >= 30 || primitive % 3 != 0)));
    // Each node of both levels once; of leaves in which some copies are unfolded, once more.
    let mesh_nodes = |copy: &UnfoldedCopy| {
        let AnyTree::Aabb(tree) = scene.meshes[copies.copies().mesh(copy.copy) as usize].tree.tree() else { panic!() };
        tree.nodes.len()
    };
    let wanted = scene.top.nodes.len() + some.iter().map(mesh_nodes).sum::<usize>();
    let distinct: HashSet<_> = unfolded.origins.iter().map(|origin| format!("{origin:?}")).collect();
    assert_eq!((distinct.len(), unfolded.origins.len()), (wanted, tree.nodes.len()));
    let of_node = |node: u32| unfolded.origins[node as usize];
    let lists: Vec<&[Triangle]> = scene.meshes.iter().map(|mesh| &mesh.triangles[..]).collect();
    let folded = BinaryLevels { copies, top: &scene.top, triangles: &lists, unfolded: None };
    let levels = BinaryLevels { unfolded: Some(&unfolded), ..folded };
    let mut entered = 0;
    for ray in rays(&scene.triangles, 1000, &mut random) {
        for traversal in Traversal::ALL {
            let [mut told, mut before] = [Told::default(), Told::default()];
            let hit = levels.closest_hit(&ray, traversal, &mut told);
            assert_eq!(hit, folded.closest_hit(&ray, traversal, &mut before), "{ray:?}");
            assert_eq!(told.counts, before.counts, "{ray:?}");
            // The same visits, in whichever of the two they are counted.
            let sum = |told: &Told| told.visits.values().sum::<u32>() + told.below;
            assert_eq!(sum(&told), sum(&before), "{ray:?}");
            for (node, visits) in &told.visits {
                match of_node(*node) {
                    LevelNode::Above { node } => assert_eq!(before.visits.get(&node), Some(visits), "{ray:?}"),
                    LevelNode::Below { copy, .. } => assert_eq!(copy % 3, 0, "{ray:?}"),
                }
            }
            assert!(
                told.below < before.below || before.below == told.below && told.visits.len() == before.visits.len()
            );
            // The nearest hit has the number of its triangle or copy.
            if let Some(InstanceHit { t, instance, primitive_index, .. }) = hit {
                let at = some.iter().find(|unfolded| unfolded.copy == instance);
                let number = at.map_or(instance, |unfolded| unfolded.first + primitive_index);
                assert!(told.primitives.contains(&(number, Some(t))), "{ray:?}");
            }
            // Distances are those along the ray in the world, where the container begins or the ray itself.
            for (node, t) in &told.entered {
                let point = ray.at(*t);
                let reach = ray.origin.abs().max_element() + (ray.direction * *t).abs().max_element();
                let excess = beyond_planes(&tree.nodes[*node as usize].container, point);
                assert!(excess <= 1e-3 * f64::from(reach), "{excess} at {t} of {ray:?}");
                entered += u32::from(matches!(of_node(*node), LevelNode::Below { .. }));
            }
        }
    }
    assert!(entered > 5_000, "{entered}");
    let rays = rays(&scene.triangles, 3000, &mut random);
    let ray = |index: u32| (rays[index as usize], RayQuery::ClosestHit(Traversal::Ordered), 1);
    let visits = levels.measure_weighted_visits(rays.len() as u32, ray, &token).unwrap();
    let mut expected = vec![0; tree.nodes.len()];
    for ray in &rays {
        let mut told = Told::default();
        levels.closest_hit(ray, Traversal::Ordered, &mut told);
        told.visits.iter().for_each(|(node, visits)| expected[*node as usize] += visits);
    }
    assert_eq!(visits.counts, expected);
    let costs = levels.costs(rays.len() as u32, ray, &token).unwrap();
    assert_eq!(costs, folded.costs(rays.len() as u32, ray, &token).unwrap());
}

/// By how much `point` is not between the planes of a box.
fn beyond_planes(container: &OrientedBox, point: Vec3) -> f64 {
    let beyond = |at: usize| {
        let normal = container.normals[at].as_dvec3();
        let along = point.as_dvec3().dot(normal);
        (f64::from(container.low[at]) - along).max(along - f64::from(container.high[at])) / normal.length()
    };
    (0..3).map(beyond).fold(0.0, f64::max)
}

/// The boxes of a tree in the order in which they are unfolded: depth first, siblings together.
fn in_order(tree: &Tree<Aabb>) -> Vec<Aabb> {
    let (mut boxes, mut open) = (vec![tree.nodes[0].container], vec![0]);
    while let Some(node) = open.pop() {
        let children = tree.nodes[node as usize].children();
        boxes.extend(children.clone().map(|child| tree.nodes[child as usize].container));
        open.extend(children.rev());
    }
    boxes
}

#[test]
fn costs_of_copies_are_those_of_single_rays() {
    let (mut random, token, settings) = (Random(91), CancelToken::new(), BuildSettings::default());
    let meshes = [mesh(trees::ball(Vec3::ZERO, 1.0, 9), &settings), mesh(trees::soup(60, 0.7, 5), &settings)];
    let copy = |index: usize| Placed {
        mesh: (index % 2) as u32,
        transform: Affine3A { matrix3: matrix(&mut random, index, 0.7), translation: (random.vector() * 3.0).into() },
    };
    let copies: Vec<Placed> = (0..30).map(copy).collect();
    let trees = meshes.iter().map(|mesh| Arc::clone(&mesh.tree)).collect();
    let instances = Instances::build(trees, &copies, &settings, 1.0, &token).unwrap();
    let (triangles, of) = flat(&meshes, &instances);
    let (_, top) = over_own_boxes(&instances, &triangles, &of);
    let lists: Vec<&[Triangle]> = meshes.iter().map(|mesh| &mesh.triangles[..]).collect();
    let levels = BinaryLevels { copies: instances.copies(), top: &top, triangles: &lists, unfolded: None };
    let rays = rays(&triangles, 3000, &mut random);
    for query in [RayQuery::ClosestHit(Traversal::Ordered), RayQuery::ClosestHit(Traversal::Paper), RayQuery::AnyHit] {
        // Every fifth ray stands for none, others for one to four.
        let weight = |index: usize| (index % 5) as u32;
        let ray = |index: u32| (rays[index as usize], query, weight(index as usize));
        let found = levels.costs(rays.len() as u32, ray, &token).unwrap();
        let (mut expected, mut all) = (vec![CopyCost::default(); copies.len()], TestCounts::default());
        let (mut ray_count, mut hits) = (0, 0);
        for (index, ray) in rays.iter().enumerate() {
            let (mut probe, weight) = (Carried::default(), u64::from(weight(index)));
            let hit = match query {
                RayQuery::ClosestHit(traversal) => levels.closest_hit(ray, traversal, &mut probe),
                // Any hit ends in the copy that the ray was carried into last.
                RayQuery::AnyHit => {
                    let is_hit = levels.any_hit(ray, &mut probe);
                    let hit = |instance: &u32| InstanceHit {
                        t: 0.0,
                        instance: *instance,
                        primitive_index: 0,
                        u: 0.0,
                        v: 0.0,
                    };
                    probe.0.last().filter(|_| is_hit).map(hit)
                }
            };
            (ray_count, hits) = (ray_count + weight, hits + weight * u64::from(hit.is_some()));
            all.containers += weight * probe.1.containers;
            all.primitives += weight * probe.1.primitives;
            probe.0.iter().for_each(|copy| expected[*copy as usize].entered += weight);
            hit.iter().for_each(|hit| expected[hit.instance as usize].hits += weight);
        }
        assert_eq!((found.rays, found.hits), (ray_count, hits), "{query:?}");
        let counts = |costs: &[CopyCost]| costs.iter().map(|cost| (cost.entered, cost.hits)).collect::<Vec<_>>();
        assert_eq!(counts(&found.copies), counts(&expected), "{query:?}");
        let sum = |count: fn(&CopyCost) -> u64| found.copies.iter().map(count).sum::<u64>();
        assert_eq!(found.containers_above + sum(|cost| cost.tests.containers), all.containers, "{query:?}");
        assert_eq!(sum(|cost| cost.tests.primitives), all.primitives, "{query:?}");
        assert!(found.copies.iter().all(|cost| cost.hits <= cost.entered), "{query:?}");
        // A copy by itself has the same tests by the rays that are carried into nothing else.
        let alone = |index: usize| {
            let mut probe = Carried::default();
            levels.closest_hit(&rays[index], Traversal::Paper, &mut probe);
            probe.0.len() == 1
        };
        let index = (0..rays.len()).find(|&index| weight(index) == 1 && alone(index)).unwrap();
        let of_one = levels.costs(1, |_| (rays[index], RayQuery::ClosestHit(Traversal::Paper), 3), &token).unwrap();
        let mut probe = Carried::default();
        levels.closest_hit(&rays[index], Traversal::Paper, &mut probe);
        let cost = of_one.copies[probe.0[0] as usize];
        assert_eq!((cost.entered, of_one.rays), (3, 3));
        assert_eq!(cost.tests.primitives, 3 * probe.1.primitives);
        assert_eq!(cost.tests.containers + of_one.containers_above, 3 * probe.1.containers);
        assert!(of_one.containers_above >= 3 && cost.tests.containers > 0);
    }
}
