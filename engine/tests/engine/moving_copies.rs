//! Copies that move: the tree over them follows by each policy, the trees of their meshes stay, and hits are those of the flat scene.

use std::sync::Arc;

use bvhscope_engine::follow::{Follower, POSES, Policy};
use bvhscope_engine::geometry::{Aabb, Placement, Triangle};
use bvhscope_engine::tree::traverse::{NoProbe, Traversal};
use bvhscope_engine::{AnyTree, BinaryLevels, BuildSettings, CancelToken, Copies, Instances, MeshCopies, Ray};
use glam::{Affine3A, Mat3A, Quat, Vec3};

use crate::instances::{Mesh, compare, matrix, mesh};
use crate::random::Random;
use crate::trees;

const COPIES: usize = 60;

/// Three meshes, one of them without triangles.
fn meshes() -> [Mesh; 3] {
    let settings = BuildSettings::default();
    [trees::ball(Vec3::new(0.2, 0.0, 0.1), 1.0, 6), trees::soup(40, 0.7, 5), Vec::new()].map(|one| mesh(one, &settings))
}

/// The copies in a frame: they turn and fly apart, turned, scaled, mirrored and sheared; in some frames some are pressed flat, to a line or to
/// a point, or turned inside out.
fn placed(meshes: &[Mesh], frame: usize) -> Arc<MeshCopies> {
    let mut random = Random(9);
    let around = |mesh: &Mesh| mesh.triangles.iter().fold(Aabb::EMPTY, |all, triangle| all.union(&triangle.bounds()));
    let bounds: Vec<Aabb> = meshes.iter().map(around).collect();
    let copy = |index: usize| {
        let (at, speed) = (random.vector() * 4.0, random.vector() * 0.7);
        let pressed = match (index % 7, frame % 4) {
            (0, 1) => Vec3::new(1.0, 0.0, 1.0),
            (0, 2) => Vec3::new(0.0, 0.0, 2.0),
            (1, 2) => Vec3::ZERO,
            (2, 3) => Vec3::new(1.0, -1.0, 1.0),
            (3, 1) => Vec3::new(1e-9, 1.0, 1e9),
            _ => Vec3::ONE,
        };
        let turn = Mat3A::from_quat(Quat::from_scaled_axis(speed * frame as f32));
        let matrix3 = turn * matrix(&mut random, index, 0.6) * Mat3A::from_diagonal(pressed);
        let transform = Affine3A { matrix3, translation: (at + speed * frame as f32).into() };
        let mesh = if index == 5 { 2 } else { index % 2 };
        (mesh as u32, Placement::moving(&transform, &bounds[mesh]).unwrap())
    };
    let trees = meshes.iter().map(|mesh| Arc::clone(&mesh.tree)).collect();
    let copies = Copies::at((0..COPIES).map(copy));
    Arc::new(MeshCopies::new(trees, Arc::new(copies)).unwrap())
}

/// The triangle across the box of each copy, by which a tree over them follows.
fn stand_ins(copies: &MeshCopies, meshes: &[Mesh]) -> Vec<Triangle> {
    let stand_in = |copy: u32| {
        let place = copies.copies().place(copy);
        let triangles = &meshes[copies.copies().mesh(copy) as usize].triangles;
        let bounds = triangles.iter().fold(Aabb::EMPTY, |all, one| all.union(&place.triangle(one).bounds()));
        Triangle::across(&if bounds.is_empty() { Aabb { min: Vec3::ZERO, max: Vec3::ZERO } } else { bounds })
    };
    (0..copies.copies().len() as u32).map(stand_in).collect()
}

#[test]
fn hits_are_those_of_the_flat_scene_by_every_policy() {
    let (settings, token, meshes) = (BuildSettings::default(), CancelToken::new(), meshes());
    let frames: Vec<Arc<MeshCopies>> = (0..POSES).map(|frame| placed(&meshes, frame)).collect();
    let boxes: Vec<Vec<Triangle>> = frames.iter().map(|copies| stand_ins(copies, &meshes)).collect();
    let lists: Vec<&[Triangle]> = meshes.iter().map(|mesh| &mesh.triangles[..]).collect();
    for policy in Policy::ALL {
        let (mut found, mut random) = ([[0; 2]; 2], Random(3));
        let mut follower = Follower::new(policy, &settings, &boxes, &token).unwrap();
        boxes.iter().for_each(|frame| follower.enclose(frame, &token).unwrap());
        for (frame, (copies, boxes)) in frames.iter().zip(&boxes).enumerate() {
            let name = format!("{}, frame {frame}", policy.name());
            follower.follow(boxes, &token).unwrap();
            let instances = Instances::over(Arc::clone(copies), Arc::clone(follower.wide()));
            let counts = compare(&name, &meshes, &instances, 150, &mut random);
            found.iter_mut().zip(counts).for_each(|(sum, of)| *sum = [sum[0] + of[0], sum[1] + of[1]]);
            let AnyTree::Aabb(top) = follower.tree() else { panic!("of boxes") };
            let levels = BinaryLevels { copies, top, triangles: &lists, unfolded: None };
            for _ in 0..200 {
                let ray = Ray::new(random.vector() * 9.0, random.vector());
                let expected = instances.closest_hit(&ray);
                for traversal in Traversal::ALL {
                    assert_eq!(levels.closest_hit(&ray, traversal, &mut NoProbe), expected, "{name}, {ray:?}");
                }
            }
            let shares = copies.meshes().iter().zip(&meshes).all(|(tree, mesh)| Arc::ptr_eq(tree, &mesh.tree));
            assert!(shares, "{name}");
        }
        assert!(found.iter().all(|[rays, hits]| hits * 3 > *rays), "{policy:?}: {found:?}");
    }
}

#[test]
fn what_is_pressed_flat_is_hit_and_what_is_a_line_or_nowhere_is_not() {
    let (settings, token) = (BuildSettings::default(), CancelToken::new());
    let ball = mesh(trees::ball(Vec3::ZERO, 1.0, 8), &settings);
    let bounds = Aabb { min: Vec3::splat(-1.0), max: Vec3::ONE };
    let hit = |scale: Vec3| {
        let place = Placement::moving(&Affine3A::from_scale(scale), &bounds).unwrap();
        assert_eq!(place.is_singular(), scale.min_element() == 0.0);
        let copies = MeshCopies::new(vec![Arc::clone(&ball.tree)], Arc::new(Copies::at([(0, place)]))).unwrap();
        let instances = Instances::of(Arc::new(copies), &settings, 1.0, &token).unwrap();
        instances.closest_hit(&Ray::new(Vec3::new(0.21, 3.0, 0.13), Vec3::NEG_Y)).map(|hit| hit.t)
    };
    assert_eq!(hit(Vec3::new(1.0, 0.0, 1.0)), Some(3.0));
    assert!(hit(Vec3::ONE).is_some_and(|t| (2.0..2.2).contains(&t)));
    assert_eq!([Vec3::new(1.0, 0.0, 0.0), Vec3::ZERO].map(hit), [None; 2]);
    // As for a ball, of which each normal is the position.
    let place = |scale| Placement::moving(&Affine3A::from_scale(scale), &bounds).unwrap();
    assert_eq!(place(Vec3::new(2.0, 0.0, 1.0)).normal(Vec3::splat(0.5)), Vec3::Y);
    for transform in [Affine3A::from_scale(Vec3::NAN), Affine3A::from_translation(Vec3::splat(1e19))] {
        assert!(Placement::moving(&transform, &bounds).is_err());
    }
}
