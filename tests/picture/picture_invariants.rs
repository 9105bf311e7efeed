//! Invariants of every picture.

use std::sync::Arc;

use bvhscope::accel::Accel;
use bvhscope::camera::Camera;
use bvhscope::render::{Adaptation, Exposure, RenderRequest, RenderSettings, render, render_adapting};
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
        let mut scene = Scene::from_triangles(SceneSource::default_builtin(), triangles);
        scene.material_indices = vec![0, 1].into();
        scene.materials = vec![paint(0.5), paint(red)];
        let scene = Arc::new(scene);
        let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap());
        let camera = Camera::framing(&scene.bounds, Vec3::Y);
        let settings = RenderSettings { samples: 1, ..RenderSettings::default() };
        let request = RenderRequest::new(&accel, camera, settings, [64, 48]);
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

#[test]
fn a_closed_room_is_exposed_more_and_all_passes_of_a_view_alike() {
    let corner = |bits: u32| Vec3::new((bits & 1) as f32, (bits >> 1 & 1) as f32, (bits >> 2 & 1) as f32) * 2.0 - 1.0;
    let sides = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|side| {
        let [a, b, c, d] = side.map(corner);
        [Triangle { a, b, c }, Triangle { a, b: c, c: d }]
    });
    let scene = Arc::new(Scene::from_triangles(SceneSource::default_builtin(), triangles.collect()));
    let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap());
    let outside = Camera::framing(&scene.bounds, Vec3::Y);
    let inside = Camera { eye: Vec3::new(0.1, 0.2, 0.9), target: Vec3::NEG_Z, ..outside };
    let adapted = |camera: Camera, coarseness: f32, exposure: Exposure, adaptation: Option<Adaptation>| {
        let settings = RenderSettings { samples: 2, exposure, ..RenderSettings::default() };
        let accel = Arc::clone(&accel);
        let request = RenderRequest {
            accel,
            camera,
            settings,
            width_px: 64,
            height_px: 48,
            coarseness,
            count_tests: false,
            hidden: None,
            clusters: None,
            layout: None,
        };
        render_adapting(&request, adaptation, &CancelToken::new(), &|_| ()).unwrap()
    };
    let pictured = |camera, coarseness, exposure| adapted(camera, coarseness, exposure, None);
    assert_eq!(pictured(outside, 1.0, Exposure::Auto).exposure_stops, 0.0);
    let room = pictured(inside, 1.0, Exposure::Auto);
    assert!((1.0..=4.0).contains(&room.exposure_stops), "{}", room.exposure_stops);
    assert_eq!(pictured(inside, 4.0, Exposure::Auto).exposure_stops, room.exposure_stops, "the coarse pass");
    let mean = |frame: &bvhscope::render::Frame| {
        frame.rgba.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / frame.rgba.len() as f64
    };
    let dark = pictured(inside, 1.0, Exposure::Fixed(0.0));
    assert!(mean(&room) > 80.0 && mean(&room) > mean(&dark) * 1.4, "{} {}", mean(&room), mean(&dark));
    // The coarse pass, which traces no bounces, is as bright as the picture at rest.
    let coarse = pictured(inside, 4.0, Exposure::Auto);
    assert!((mean(&coarse) - mean(&room)).abs() < 15.0, "{} {}", mean(&coarse), mean(&room));
    let locked = pictured(inside, 1.0, Exposure::Fixed(room.exposure_stops));
    assert_eq!(locked.rgba, room.rgba, "locking changes nothing");
    // From outside into the room, half of the way at a time.
    let mut frame = pictured(outside, 4.0, Exposure::Auto);
    let mut stops = vec![frame.exposure_stops];
    while !(frame.is_adapted && frame.camera == inside) {
        let half = Adaptation { from: frame.metered(), fraction: 0.5 };
        frame = adapted(inside, 4.0, Exposure::Auto, Some(half));
        stops.push(frame.exposure_stops);
    }
    assert!((6..12).contains(&stops.len()) && stops.is_sorted(), "{stops:?}");
    assert!((mean(&frame) - mean(&coarse)).abs() < 1.0, "{} {}", mean(&frame), mean(&coarse));
}
