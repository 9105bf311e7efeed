//! Invariants of every picture.

use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::camera::Camera;
use bvhscope::render::{RenderRequest, RenderSettings, render};
use bvhscope::scene::{Material, Scene, SceneSource};
use bvhscope_engine::{BuildSettings, CancelToken, Triangle};
use glam::Vec3;

#[test]
fn nan_samples_are_counted_and_black() {
    let picture = |red: f32| {
        let triangles = vec![
            Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y },
            Triangle { a: Vec3::X * 2.0, b: Vec3::X * 3.0, c: Vec3::new(2.0, 1.0, 0.0) },
        ];
        let paint = |red: f32| Material { base_color: Vec3::new(red, 0.5, 0.5), unlit: true, ..Material::clay() };
        let scene = Arc::new(Scene {
            material_indices: vec![0, 1],
            materials: vec![paint(0.5), paint(red)],
            ..Scene::from_triangles(SceneSource::default_builtin(), triangles)
        });
        let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap());
        let camera = Camera::framing(&scene.bounds, Vec3::Y);
        let settings = RenderSettings { samples: 1, ..RenderSettings::default() };
        let request = RenderRequest {
            accel,
            camera,
            settings,
            width_px: 64,
            height_px: 48,
            coarseness: 1.0,
            count_tests: false,
            hidden: None,
        };
        render(&request, &CancelToken::new(), &|_| ()).unwrap()
    };
    let (sound, broken) = (picture(0.5), picture(f32::NAN));
    let bad = broken.primitive.iter().filter(|&&primitive| primitive == 1).count() as u64;
    assert!(bad > 10 && broken.stats.nan_samples == bad && sound.stats.nan_samples == 0);
    for (index, &primitive) in broken.primitive.iter().enumerate() {
        let expected = if primitive == 1 { [0, 0, 0, 255] } else { sound.rgba[index] };
        assert_eq!(broken.rgba[index], expected, "pixel {index}");
    }
}
