//! Every built-in scene: its size, its validity, and that it is the same each time.

use std::sync::Arc;

use bvhscope::scene::{BUILTIN_SCENES, Clip, LoadOptions, Moment, Scene, SceneSource, load};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Aabb;

fn builtin(name: &str, size: Option<u32>) -> Scene {
    let source = SceneSource::Builtin { name: name.to_owned(), size };
    load(&source, &LoadOptions::default(), &CancelToken::new()).expect("a built-in scene")
}

#[test]
fn every_scene_is_valid_and_reproducible() {
    for scene in BUILTIN_SCENES {
        let made = builtin(scene.name, None);
        let again = builtin(scene.name, None);
        assert!(made.triangles == again.triangles, "{}", scene.name);
        assert!(made.warnings.is_empty(), "{}: {:?}", scene.name, made.warnings);
        let around = made.triangles.iter().fold(Aabb::EMPTY, |bounds, triangle| bounds.union(&triangle.bounds()));
        assert_eq!(made.bounds, around, "{}", scene.name);
        for &material in made.material_indices.iter() {
            assert!((material as usize) < made.materials.len(), "{}", scene.name);
        }
        if let Some(attributes) = &made.attributes {
            assert_eq!(attributes.corners.len(), made.triangles.len(), "{}", scene.name);
            for (triangle, corners) in made.triangles.iter().zip(attributes.corners.iter()) {
                let normal: glam::Vec3 = corners.iter().map(|&corner| attributes.normals[corner as usize]).sum();
                let facing = normal.dot(triangle.scaled_normal());
                // Mirrored houses keep the order of their corners.
                assert!(facing > -1e-6 || ["teapot", "village"].contains(&scene.name), "{}: {facing}", scene.name);
            }
        }
    }
}

#[test]
fn sizes_give_the_documented_triangle_counts() {
    assert_eq!(builtin("teapot", None).triangles.len(), 6320);
    assert_eq!(builtin("teapot", Some(1)).triangles.len(), 56);
    assert_eq!(builtin("cornell", None).triangles.len(), 36);
    assert_eq!(builtin("slivers", Some(17)).triangles.len(), 17);
    assert_eq!(builtin("terrain", Some(2)).triangles.len(), 2);
    assert_eq!(builtin("terrain", Some(200_000)).triangles.len(), 199_712);
    assert_eq!(builtin("clusters", Some(3)).mesh_count, 3);
    for (size, [cloth, explosion]) in [(500, [450, 484]), (100_000, [99_458, 99_856])] {
        let [walker, others @ ..] =
            ["walker", "cloth", "explosion"].map(|name| builtin(name, Some(size)).triangles.len());
        assert_eq!(others, [cloth, explosion]);
        assert!((size as usize * 9 / 10..=size as usize).contains(&walker), "{walker} of {size}");
    }
    assert_eq!(["cloth", "explosion"].map(|name| builtin(name, Some(8)).triangles.len()), [8, 8]);
    assert_eq!(builtin("sphereflake", Some(2)).mesh_count, 91);
    let triangles = ["hair", "foliage", "tilted"].map(|name| builtin(name, None).triangles.len());
    assert_eq!(triangles, [199_968, 149_998, 12 + 12 * 400]);
    assert_eq!(["hair", "foliage"].map(|name| builtin(name, Some(96)).triangles.len()), [96, 93]);
}

#[test]
fn sizes_out_of_range_are_refused_with_the_range() {
    for (given, part) in [
        ("teapot:0", "choose 1 to 200 segments"),
        ("teapot:201", "choose 1 to 200 segments"),
        ("terrain:1", "choose 2 to 10000000 triangles"),
        ("clusters:500000000", "choose 1 to 20000 spheres"),
        ("sphereflake:99999999999999999999", "choose 0 to 5 levels"),
        ("sphereflake:-1", "choose 0 to 5 levels"),
        ("cornell:1", "leave the size out"),
    ] {
        let error = SceneSource::parse(format!("builtin:{given}").as_ref()).unwrap_err();
        let (name, size) = given.split_once(':').unwrap();
        assert!(error.contains(part) && error.contains(size) && error.contains(name), "{error}");
        // As a settings file may say it.
        let Ok(size) = size.parse() else { continue };
        let source = SceneSource::Builtin { name: name.to_owned(), size: Some(size) };
        let error = load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains(given), "{error}");
    }
    for scene in BUILTIN_SCENES {
        let size = |number: u32| SceneSource::parse(format!("builtin:{}:{number}", scene.name).as_ref());
        assert!(scene.size.is_none_or(|(_, min, default, max)| [min, default, max].iter().all(|&n| size(n).is_ok())));
    }
}

#[test]
fn moving_scenes_begin_where_their_clips_do_and_move_smoothly() {
    for name in ["walker", "cloth", "explosion"] {
        let scene = builtin(name, Some(2_000));
        let motion = scene.motion.as_ref().expect("it moves");
        for (clip, Clip { start, end, .. }) in motion.clips.iter().enumerate() {
            let at = |seconds: f32| scene.at(Moment { clip, seconds }, &CancelToken::new()).expect("a moment");
            let reach = at(*start).subject;
            let mut last = at(*start);
            let mut moved = 0.0_f32;
            for step in 1..=20 {
                let next = at(start + (end - start) * step as f32 / 20.0);
                assert_eq!(next.triangles.len(), scene.triangles.len());
                assert!(next.triangles.iter().all(|triangle| triangle.is_finite()), "{name}");
                assert_eq!(next.subject, reach, "cameras stand still");
                let beyond = scene.subject.union(&next.bounds).extent() - scene.subject.extent();
                let is_framed = beyond.max_element() < 0.02 * scene.subject.extent().max_element();
                assert!(clip > 0 || is_framed, "{name} leaves the view that one starts with by {beyond}");
                let jump =
                    next.triangles.iter().zip(&last.triangles).map(|(a, b)| a.a.distance(b.a)).fold(0.0, f32::max);
                assert!(jump < 0.8, "{name} clip {clip} step {step}: {jump}");
                moved = moved.max(jump);
                last = next;
            }
            assert!(moved > 0.02, "{name} clip {clip}: {moved}");
            let attributes = [&scene, &last].map(|scene| scene.attributes.as_ref());
            if let [Some(rest), Some(moving)] = attributes {
                assert!(Arc::ptr_eq(&rest.corners, &moving.corners), "what does not move is shared");
                for (triangle, corners) in last.triangles.iter().zip(moving.corners.iter()) {
                    let normal: glam::Vec3 = corners.iter().map(|&corner| moving.normals[corner as usize]).sum();
                    let area = triangle.scaled_normal();
                    assert!(normal.dot(area) > -0.5 * area.length(), "{name}: {normal} on {triangle:?}");
                }
            }
        }
    }
    // The others begin as they are built; the walker's clips have poses of their own.
    for name in ["cloth", "explosion", "traffic"] {
        let scene = builtin(name, Some(500));
        let first = scene.at(Moment { clip: 0, seconds: 0.0 }, &CancelToken::new()).expect("a moment");
        assert!(first.triangles == scene.triangles, "{name}");
    }
}
