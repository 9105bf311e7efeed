//! Copies of meshes: the very hits of the flat scene.

use std::sync::Arc;

use bvhscope_engine::geometry::{Aabb, Ray, Triangle};
use bvhscope_engine::settings::{BuildSettings, Pass, Preset};
use bvhscope_engine::tree::Tree;
use bvhscope_engine::tree::traverse::{NoProbe, Traversal};
use bvhscope_engine::{
    AnyTree, BinaryLevels, BuildError, Bvh, CancelToken, ContainerKind, Hit, InstanceHit, Instances, ItemBvh, Placed,
    build,
};
use glam::{Affine3A, EulerRot, Mat3A, Quat, Vec3, Vec3A};

use crate::random::Random;
use crate::trees;

/// A mesh with its tree.
struct Mesh {
    triangles: Vec<Triangle>,
    tree: Arc<Bvh>,
}

fn mesh(triangles: Vec<Triangle>, settings: &BuildSettings) -> Mesh {
    let tree = Arc::new(build(&triangles, settings, &CancelToken::new()).unwrap());
    Mesh { triangles, tree }
}

/// Turned, scaled, mirrored and sheared: a matrix whose scales are about `scale`.
fn matrix(random: &mut Random, kind: usize, scale: f32) -> Mat3A {
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
fn flat(meshes: &[Mesh], copies: &[Placed], instances: &Instances) -> (Vec<Triangle>, Vec<(u32, u32)>) {
    let (mut triangles, mut of) = (Vec::new(), Vec::new());
    for (instance, copy) in (0..).zip(copies) {
        let mesh = &meshes[copy.mesh as usize].triangles;
        triangles.extend(mesh.iter().map(|triangle| instances.copies().copies().place(instance).triangle(triangle)));
        of.extend((0..mesh.len() as u32).map(|triangle| (instance, triangle)));
    }
    (triangles, of)
}

/// Rays at corners, edges, faces and past them, from near and far, along axes, with short and long directions and limits.
fn rays(triangles: &[Triangle], count: usize, random: &mut Random) -> Vec<Ray> {
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

/// Compares every query with the tree of the flat scene. Returns the number of hits.
fn check(name: &str, meshes: &[Mesh], copies: &[Placed], rays: usize, random: &mut Random) -> usize {
    let (settings, token) = (BuildSettings::default(), CancelToken::new());
    let trees = meshes.iter().map(|mesh| Arc::clone(&mesh.tree)).collect();
    let open = 1.0 + 3.0 * random.signed().abs();
    let instances =
        Instances::build(trees, copies, &settings, open, &token).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert!(instances.top().triangle_count() <= (copies.len() as f32 * open) as usize, "{name}");
    let (triangles, of) = flat(meshes, copies, &instances);
    assert_eq!(instances.copies().triangle_count(), triangles.len() as u64, "{name}");
    let bvh = build(&triangles, &settings, &token).unwrap();
    let same = |hit: &Hit| {
        let (instance, primitive_index) = of[hit.primitive_index as usize];
        InstanceHit { t: hit.t, instance, primitive_index, u: hit.u, v: hit.v }
    };
    let (mut all, mut all_flat, mut found) = (Vec::new(), Vec::new(), 0);
    let rays = rays_of(&triangles, rays, random);
    let mut nearest = vec![None; rays.len()];
    instances.closest_hits(&rays, &mut nearest);
    let mut blocked = vec![false; rays.len()];
    instances.any_hits(&rays, &mut blocked);
    let (over, top) = over_own_boxes(&instances, &triangles, &of);
    let lists: Vec<&[Triangle]> = meshes.iter().map(|mesh| &mesh.triangles[..]).collect();
    let levels = BinaryLevels { copies: instances.copies(), top: &top, triangles: &lists };
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
    found
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
    let (mut found, mut rays) = (0, 0);
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
                found += check(&name, &meshes, &copies, 120, &mut random);
                rays += 120;
            }
        }
    }
    assert!(found > rays / 3, "{found} of {rays}");
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
    assert!(check("many", &meshes, &copies, 500, &mut Random(6)) > 300);
    check("none", &meshes, &[], 1, &mut Random(7));
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
