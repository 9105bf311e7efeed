//! Pictures of thickness and of distance from the surface, of boxes whose values are known.

use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::camera::{Camera, Projection};
use bvhscope::render::{Frame, RenderRequest, RenderSettings, Shading, render};
use bvhscope::scene::{Scene, SceneSource};
use bvhscope::section::SectionPlane;
use bvhscope::visibility::TriangleSet;
use bvhscope_engine::CancelToken;
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::settings::{BuildSettings, BuilderKind};
use bvhscope_engine::tree::ContainerKind;
use glam::Vec3;

/// The twelve triangles of a box, which face outwards.
fn faces(Aabb { min, max }: Aabb) -> Vec<Triangle> {
    let corner = |bits: u32| Vec3::select(glam::BVec3::new(bits & 1 != 0, bits & 2 != 0, bits & 4 != 0), max, min);
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let halves = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    halves.map(|corners| corners.map(corner)).map(|[a, b, c]| Triangle { a, b, c }).collect()
}

/// A cube from -1 to 1, and one unit behind the half of it where x is positive a wall half a unit thick.
fn cube_and_wall() -> Arc<Scene> {
    let cube = Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE };
    let wall = Aabb { min: Vec3::new(0.0, -1.0, -2.5), max: Vec3::new(1.0, 1.0, -2.0) };
    Arc::new(Scene::from_triangles(SceneSource::default_builtin(), [faces(cube), faces(wall)].concat()))
}

const SIDE: u32 = 24;
/// Error of a difference of two distances from where orthographic rays begin, far behind the eye.
const ROUNDING: f32 = 5e-4;

/// A picture of SIDE² pixels of a square of side 4 around the origin, seen along -z.
fn picture(scene: &Arc<Scene>, build: BuildSettings, shading: Shading, hidden: Option<TriangleSet>) -> Frame {
    let accel = Arc::new(Accel::build(scene, &build, &CancelToken::new()).unwrap());
    let fov_y = 2.0 * (2.0_f32 / 8.0).atan();
    let (eye, target) = (Vec3::Z * 8.0, Vec3::ZERO);
    let camera = Camera { eye, target, up: Vec3::Y, fov_y, projection: Projection::Orthographic };
    let section = Some(SectionPlane { normal: Vec3::Z, offset: 0.25, flipped: false });
    let settings = RenderSettings { shading, section, samples: 1, ..RenderSettings::default() };
    let request =
        RenderRequest { hidden: hidden.map(Arc::new), ..RenderRequest::new(&accel, camera, settings, [SIDE; 2]) };
    render(&request, &CancelToken::new(), &|_| ()).unwrap()
}

/// The values of a frame with the places of their pixels.
fn values(frame: &Frame) -> impl Iterator<Item = (f32, f32, f32)> {
    let place = |at: u32| (at as f32 + 0.5) / SIDE as f32 * 4.0 - 2.0;
    (0..SIDE * SIDE).map(move |index| (place(index % SIDE), -place(index / SIDE), frame.values[index as usize]))
}

fn containers() -> impl Iterator<Item = BuildSettings> {
    ContainerKind::WITH_ORIENTED.into_iter().map(|container| BuildSettings::default().for_container(container))
}

#[test]
fn thickness_is_that_of_all_matter_along_the_ray_in_trees_of_all_containers() {
    let scene = cube_and_wall();
    let binary = BuildSettings { builder: BuilderKind::Lbvh, ..BuildSettings::default() };
    for build in containers().chain([binary]) {
        for (x, y, thickness) in values(&picture(&scene, build, Shading::Thickness, None)) {
            match (x.abs().max(y.abs()) < 1.0, x > 0.0) {
                (true, true) => assert!((thickness - 2.5).abs() < ROUNDING, "{thickness} at {x}, {y}"),
                (true, false) => assert!((thickness - 2.0).abs() < ROUNDING, "{thickness} at {x}, {y}"),
                (false, _) => assert_eq!(thickness, Frame::NO_HIT, "at {x}, {y}"),
            }
        }
    }
    let mut wall = TriangleSet::none(scene.triangles.len());
    (12..24).for_each(|triangle| wall.insert(triangle));
    let without_wall = picture(&scene, BuildSettings::default(), Shading::Thickness, Some(wall));
    let in_front_of_it = values(&without_wall).find(|(x, y, _)| *x > 0.1 && y.abs() < 0.5);
    assert!(
        in_front_of_it.is_some_and(|(.., thickness)| (thickness - 2.0).abs() < ROUNDING),
        "hidden triangles do not count"
    );
}

#[test]
fn distance_is_that_of_the_section_plane_from_the_nearest_face() {
    let scene = cube_and_wall();
    for build in containers() {
        let frame = picture(&scene, build, Shading::Distance, None);
        for (x, y, distance) in values(&frame) {
            let [out_x, out_y] = [x, y].map(|place| place.abs() - 1.0);
            // The plane is 0.75 below the cube's upper face.
            let expected = if out_x.max(out_y) < 0.0 {
                (-out_x.max(out_y)).min(0.75)
            } else {
                out_x.max(0.0).hypot(out_y.max(0.0))
            };
            let is_near = out_x.max(out_y) < frame.line_spacing;
            assert!(!is_near || (distance - expected).abs() < 1e-5, "{distance} for {expected} at {x}, {y}");
        }
        // The lines are those of equal distance: of 48 pixels across, some are darker than their neighbours.
        let fewest = frame.rgba.iter().collect::<std::collections::HashSet<_>>().len();
        assert!(fewest > 8 && frame.line_spacing > 0.0, "{fewest} colours");
    }
}
