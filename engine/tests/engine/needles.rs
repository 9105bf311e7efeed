//! Long and thin triangles: ellipsoids that are up to a million times as long as they are high.

use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::{Aabb, Dop14, Ray, Sphere, Triangle};
use bvhscope_engine::kernel::SimdLevel;
use bvhscope_engine::tree::AnyTree;
use bvhscope_engine::wide::{AnyWideTree, NodeForm};
use glam::{Mat3, Vec3};

use crate::brute_force::check;
use crate::random::Random;
use crate::trees::{ball, halved, scan};

const SCALES: [Vec3; 4] = [
    Vec3::new(10.0, 1.0, 0.1),
    Vec3::new(100.0, 1.0, 0.01),
    Vec3::new(1000.0, 1.0, 1.0),
    Vec3::new(1000.0, 1.0, 0.001),
];

/// A closed ball whose points were multiplied by `matrix`.
fn ellipsoid(matrix: Mat3, rings: usize) -> Vec<Triangle> {
    let point = |point: Vec3| matrix * point;
    ball(Vec3::ZERO, 1.0, rings)
        .iter()
        .map(|triangle| Triangle { a: point(triangle.a), b: point(triangle.b), c: point(triangle.c) })
        .collect()
}

/// A ray that begins well inside, in a direction that is uniform in the ball or in space.
fn ray(random: &mut Random, matrix: Mat3, in_ball: bool) -> Ray {
    let direction = random.vector();
    let direction = if in_ball { matrix * direction } else { direction };
    Ray::new(matrix * (random.vector() * 0.5), direction.normalize_or(Vec3::X))
}

fn distance_of_plane(triangle: &Triangle, ray: &Ray) -> f64 {
    let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3);
    let normal = (b - a).cross(c - a);
    normal.dot(a - ray.origin.as_dvec3()) / normal.dot(ray.direction.as_dvec3())
}

#[test]
fn hits_of_needles_lie_in_their_planes() {
    let mut random = Random(7);
    for scale in &SCALES[1..] {
        let matrix = Mat3::from_diagonal(*scale);
        let triangles = ellipsoid(matrix, 24);
        // Alone, and as a bundle from one point.
        let mut rays: Vec<Ray> = (0..400).map(|index| ray(&mut random, matrix, index % 2 == 0)).collect();
        let (from, target) = (rays[0].origin, rays[0].direction);
        rays.extend((0..256).map(|_| Ray::new(from, (target + random.vector() * 0.05).normalize())));
        let expected: Vec<_> = rays.iter().map(|ray| scan(&triangles, ray)).collect();
        for (ray, hit) in rays.iter().zip(&expected) {
            let hit = hit.expect("the ellipsoid is closed");
            let exact = distance_of_plane(&triangles[hit.primitive_index as usize], ray);
            assert!((f64::from(hit.t) - exact).abs() <= 1e-6 * exact, "{scale}, {ray:?}: {hit:?}, not {exact}");
        }
        for tree in [halved::<Aabb>(&triangles, 2), halved::<Sphere>(&triangles, 1), halved::<Dop14>(&triangles, 1)] {
            check(&format!("ellipsoid {scale}"), &triangles, &tree, &rays, &expected);
        }
    }
}

#[test]
fn no_ray_leaves_a_closed_mesh_of_needles() {
    let mut random = Random(8);
    let turn = Mat3::from_rotation_z(0.7) * Mat3::from_rotation_x(1.1) * Mat3::from_rotation_y(0.4);
    for (scale, turn) in SCALES.into_iter().flat_map(|scale| [(scale, Mat3::IDENTITY), (scale, turn)]) {
        let matrix = turn * Mat3::from_diagonal(scale);
        let triangles = ellipsoid(matrix, 32);
        let rays: Vec<Ray> = (0..20_000).map(|index| ray(&mut random, matrix, index % 2 == 0)).collect();
        for tree in [halved::<Aabb>(&triangles, 2), halved::<Sphere>(&triangles, 2), halved::<Dop14>(&triangles, 2)] {
            require_hits(&triangles, &tree, &rays, &format!("{scale}, turned by {turn}"));
        }
    }
}

/// Requires that each of `rays` hits something, ray by ray and together.
fn require_hits(triangles: &[Triangle], tree: &AnyTree, rays: &[Ray], name: &str) {
    let wide = AnyWideTree::new(tree, triangles, NodeForm::Full, &CancelToken::new()).unwrap();
    let level = SimdLevel::best().level();
    let mut hits = vec![None; rays.len()];
    wide.closest_hits(level, rays, &mut hits);
    let mut blocked = vec![false; rays.len()];
    wide.any_hits(level, rays, &mut blocked);
    for ((ray, hit), blocked) in rays.iter().zip(hits).zip(blocked) {
        assert!(hit.is_some() && blocked, "{name}: {ray:?} leaves");
        assert_eq!(wide.closest_hit(level, ray), hit, "{name}: {ray:?}");
        assert!(wide.any_hit(level, ray), "{name}: {ray:?} leaves");
    }
}
