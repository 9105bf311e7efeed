//! Scenes of copies in two levels beside their flat scenes: the very hits, and pictures that differ by the rounding of normals alone.

use std::collections::BTreeMap;
use std::sync::Arc;

use bvhscope::accel::followed::FollowSession;
use bvhscope::accel::tracer::{CountedQuery, Counting};
use bvhscope::accel::{Accel, Follow};
use bvhscope::colors::srgb::decode;
use bvhscope::render::{NormalSource, RayKind, RenderRequest, RenderSettings, Shading, rays_of_picture, render};
use bvhscope::scene::{Instancing, LoadOptions, Moment, SceneCopies, SceneSource, load};
use bvhscope::view::NamedView;
use bvhscope_engine::follow::Policy;
use bvhscope_engine::geometry::Ray;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Pass};
use bvhscope_engine::tree::traverse::{TestCounts, Traversal};
use bvhscope_engine::{BuildError, Bvh, CancelToken, ContainerKind, SimdLevel};
use glam::Vec3;

/// The scene flat and in two levels.
fn both(name: &str) -> [Arc<Accel>; 2] {
    [Instancing::Flat, Instancing::TwoLevel].map(|instances| {
        let options = LoadOptions { instances, ..LoadOptions::default() };
        let token = CancelToken::new();
        let scene = Arc::new(load(&SceneSource::parse(name.as_ref()).unwrap(), &options, &token).unwrap());
        assert_eq!(scene.copies.is_some(), instances == Instancing::TwoLevel);
        let accel = Accel::build(&scene, &BuildSettings::default(), &token).unwrap();
        accel.compute_leaf_triangles(&token).unwrap();
        Arc::new(accel)
    })
}

fn picture(accel: &Arc<Accel>, camera_of: &Accel, shading: Shading) -> RenderRequest {
    let camera = NamedView::Default.camera(&camera_of.scene, camera_of.scene.up);
    let settings = RenderSettings { shading, normals: NormalSource::File, ..RenderSettings::default() };
    RenderRequest::new(accel, camera, settings, [96, 64])
}

const SCENES: [&str; 3] = ["builtin:forest:30", "builtin:village:25", "builtin:stack:80"];

#[test]
fn rays_find_what_they_find_in_the_flat_scene() {
    for name in SCENES {
        let [flat, copies] = both(name);
        assert_eq!(flat.scene.triangle_count(), copies.scene.triangle_count());
        assert_eq!(flat.scene.bounds, copies.scene.bounds, "{name}");
        let token = CancelToken::new();
        let kinds = [RayKind::Primary, RayKind::Bounce];
        let lists = kinds.map(|kind| rays_of_picture(&picture(&flat, &flat, Shading::Depth), kind, &token).unwrap());
        let rays: Vec<Ray> = lists.concat();
        let [of_flat, of_copies] = [&flat, &copies].map(|accel| accel.tracer(SimdLevel::best()));
        let (mut expected, mut found) = (vec![None; rays.len()], vec![None; rays.len()]);
        of_flat.nearest(&rays, &mut expected);
        of_copies.nearest(&rays, &mut found);
        assert_eq!(found, expected, "{name}");
        assert!(expected.iter().flatten().count() * 20 > rays.len(), "{name}: few hits");
        let (mut expected_blocked, mut blocked) = (vec![false; rays.len()], vec![false; rays.len()]);
        of_flat.blocked(&rays, &mut expected_blocked);
        of_copies.blocked(&rays, &mut blocked);
        assert_eq!(blocked, expected_blocked, "{name}");
        let (mut directly, mut blocked_directly) = (vec![None; rays.len()], vec![false; rays.len()]);
        copies.closest_hits(&rays, &mut directly);
        copies.any_hits(&rays, &mut blocked_directly);
        assert!(directly == expected && blocked_directly == expected_blocked, "{name}");
        for (index, ray) in rays.iter().enumerate().step_by(37) {
            assert_eq!(
                (copies.closest_hit(ray), copies.any_hit(ray)),
                (expected[index], expected_blocked[index]),
                "{name}"
            );
            let [mut hits, mut of_list] = [Vec::new(), Vec::new()];
            let has_more = [of_flat.all_hits(ray, 5, &mut hits), of_copies.all_hits(ray, 5, &mut of_list)];
            assert!(hits == of_list && has_more[0] == has_more[1], "{name}: {ray:?}");
            let point = ray.at(0.1 * index as f32 / rays.len() as f32);
            assert_eq!(of_copies.closest_point(point), of_flat.closest_point(point), "{name}: {point}");
        }
        let ways = [
            Counting::Nothing,
            Counting::Tests,
            Counting::Steps,
            Counting::Lines,
            Counting::WholeRay,
            Counting::Copies,
        ];
        for counting in ways {
            for traversal in Traversal::ALL {
                let mut counted = vec![(None, TestCounts::default()); rays.len()];
                of_copies.counted(&rays, CountedQuery { counting, traversal, passes: &|_| false }, &mut counted);
                assert!(counted.iter().map(|(hit, _)| hit).eq(&expected), "{name}, {counting:?}, {traversal:?}");
                let tests: u64 = counted.iter().map(|(_, tests)| tests.containers).sum();
                assert_eq!(tests > 0, counting != Counting::Nothing, "{name}, {counting:?}");
            }
        }
        // A hidden copy lets rays pass, wherever its triangles are.
        let hidden = copies.scene.primitive_of(expected.iter().flatten().next().unwrap().primitive_index);
        let passes = &|hit| copies.scene.primitive_of(hit) == hidden;
        let query = CountedQuery { counting: Counting::Nothing, traversal: Traversal::Ordered, passes };
        let mut lists = [of_flat, of_copies].map(|tracer| {
            let mut counted = vec![(None, TestCounts::default()); rays.len()];
            tracer.counted(&rays, query, &mut counted);
            counted
        });
        let [flat, copies] = &mut lists;
        assert!(flat == copies && flat.iter().map(|(hit, _)| hit).ne(&expected), "{name}");
    }
}

#[test]
fn pictures_are_those_of_the_flat_scene() {
    for name in SCENES {
        let [flat, copies] = both(name);
        for shading in [Shading::Lit, Shading::Normals, Shading::Depth, Shading::Clusters] {
            let frames = [&flat, &copies]
                .map(|accel| render(&picture(accel, &flat, shading), &CancelToken::new(), &|_| ()).unwrap());
            let [expected, found] = frames.each_ref().map(|frame| &frame.rgba);
            let differing =
                expected.iter().zip(found).filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > 2));
            let primitives = frames.each_ref().map(|frame| &frame.primitive);
            for (of_flat, of_copies) in primitives[0].iter().zip(primitives[1]) {
                let expected = if *of_flat == u32::MAX { u32::MAX } else { copies.scene.primitive_of(*of_flat) };
                assert_eq!(*of_copies, expected, "{name}, {shading:?}: the copy that has the triangle");
            }
            // The colours of clusters are those of copies.
            let (differing, all) = (differing.count(), expected.len());
            assert!(
                shading == Shading::Clusters || differing * 200 <= all,
                "{name}, {shading:?}: {differing} of {all}"
            );
        }
    }
}

#[test]
fn moments_are_those_of_the_flat_scene_by_every_policy() {
    let (token, settings) = (CancelToken::new(), BuildSettings::default());
    let scenes = both("builtin:traffic:60");
    for policy in Policy::ALL {
        let follow = Follow { policy, frames: 10 }.normal();
        let mut sessions = [FollowSession::default(), FollowSession::default()];
        let mut meshes: Option<Arc<Bvh>> = None;
        for seconds in [0.0, 1.1, 2.9, 4.0] {
            let mut at = |form: usize| {
                let scene = Arc::new(scenes[form].scene.at(Moment { clip: 0, seconds }, &token).unwrap());
                Arc::new(Accel::follow(&scene, &settings, follow, &mut sessions[form], &token).unwrap())
            };
            let [flat, copies] = [at(0), at(1)];
            let name = format!("{} at {seconds}", policy.name());
            assert_eq!((copies.scene.bounds, copies.scene.subject), (flat.scene.bounds, flat.scene.subject), "{name}");
            assert!(seconds == 0.0 || flat.scene.triangles != scenes[0].scene.triangles, "{name}: it moves");
            for (number, triangle) in (0..).zip(&flat.scene.triangles) {
                assert_eq!(copies.scene.triangle(number), *triangle, "{name}");
            }
            let requests = [&flat, &copies].map(|accel| picture(accel, accel, Shading::Lit));
            let frames = requests.each_ref().map(|request| render(request, &token, &|_| ()).unwrap());
            let [expected, found] = frames.each_ref().map(|frame| &frame.rgba);
            let differ = |(a, b): &([u8; 4], [u8; 4])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 2);
            let differing = expected.iter().copied().zip(found.iter().copied()).filter(differ).count();
            assert!(differing * 200 <= expected.len(), "{name}: {differing} of {}", expected.len());
            let rays = rays_of_picture(&requests[0], RayKind::Bounce, &token).unwrap();
            let mut hits = [vec![None; rays.len()], vec![None; rays.len()]];
            for (accel, hits) in [&flat, &copies].into_iter().zip(&mut hits) {
                accel.tracer(SimdLevel::best()).nearest(&rays, hits);
            }
            assert!(hits[0] == hits[1] && hits[0].iter().flatten().count() * 20 > rays.len(), "{name}");
            let mesh = Arc::clone(&copies.levels().unwrap().wide().copies().meshes()[1]);
            assert!(meshes.as_ref().is_none_or(|known| Arc::ptr_eq(known, &mesh)), "{name}: trees of meshes stay");
            meshes = Some(mesh);
        }
    }
}

/// The hue of a pixel: its linear colour without its brightness.
fn hue(rgba: &[u8]) -> Vec3 {
    Vec3::from_array([0, 1, 2].map(|channel: usize| decode(f32::from(rgba[channel]) / 255.0))).normalize_or_zero()
}

/// The hues of a picture by the number that `number` makes of what each pixel shows.
fn hues_of(mut request: RenderRequest, number: impl Fn(u32) -> u32) -> BTreeMap<u32, Vec<Vec3>> {
    // The colours of several rays would be mixed at edges.
    request.settings.samples = 1;
    let frame = render(&request, &CancelToken::new(), &|_| ()).unwrap();
    let mut hues: BTreeMap<u32, Vec<Vec3>> = BTreeMap::new();
    for (primitive, rgba) in frame.primitive.iter().zip(&frame.rgba) {
        // Dark pixels are rounded too much.
        if *primitive != u32::MAX && rgba[..3].iter().max() > Some(&100) {
            hues.entry(number(*primitive)).or_default().push(hue(rgba));
        }
    }
    hues
}

#[test]
fn copies_and_meshes_have_colors_of_their_own() {
    let [flat, copies] = both("builtin:forest:30");
    let scene = copies.scene.copies.as_ref().unwrap();
    let same: fn(&SceneCopies, u32) -> u32 = |_, copy| copy;
    for (shading, number) in [(Shading::Copies, same), (Shading::Meshes, |scene, copy| scene.copies().mesh(copy))] {
        let hues = hues_of(picture(&copies, &flat, shading), |copy| number(scene, copy));
        assert!(hues.len() > 4, "{shading:?}: {}", hues.len());
        let firsts: Vec<Vec3> = hues.values().map(|hues| hues[0]).collect();
        for (number, hues) in &hues {
            assert!(hues.iter().all(|hue| hue.dot(hues[0]) > 0.999), "{shading:?}: {number} has one colour");
        }
        let alike = |at: usize| firsts[..at].iter().filter(|hue| hue.dot(firsts[at]) > 0.999).count();
        let alike: usize = (0..firsts.len()).map(alike).sum();
        assert!(alike * 10 < firsts.len() * (firsts.len() - 1) / 2, "{shading:?}: {alike} pairs of {}", firsts.len());
        let flat = hues_of(picture(&flat, &flat, shading), |_| 0);
        assert!(flat[&0].iter().all(|hue| hue.dot(flat[&0][0]) > 0.999), "{shading:?}: a flat scene has one colour");
    }
}

#[test]
fn settings_that_need_triangles_are_refused_by_name() {
    let options = LoadOptions { instances: Instancing::TwoLevel, ..LoadOptions::default() };
    let source = SceneSource::parse("builtin:stack:5".as_ref()).unwrap();
    let scene = Arc::new(load(&source, &options, &CancelToken::new()).unwrap());
    let refused = |settings: BuildSettings| match Accel::build(&scene, &settings, &CancelToken::new()) {
        Err(BuildError::Refused(text)) => text,
        other => panic!("{other:?}"),
    };
    let spheres = BuildSettings { container: ContainerKind::Sphere, ..BuildSettings::default() };
    assert!(refused(spheres).contains("not spheres") && refused(spheres).contains("--instances flat"));
    let mut split = BuildSettings::default();
    split.optimize = split.optimize.with(Pass::Split);
    assert!(refused(split).contains("'split'"), "{}", refused(split));
    let sbvh = BuildSettings { builder: BuilderKind::Sbvh, ..BuildSettings::default() };
    assert!(refused(sbvh).contains("'sbvh' works on triangles"), "{}", refused(sbvh));
}

#[test]
fn normals_of_turned_and_mirrored_copies_stay_perpendicular() {
    let [flat, copies] = both("builtin:village:40");
    let scene = &copies.scene;
    let all = 0..u32::try_from(scene.triangle_count()).unwrap();
    for number in all.step_by(101) {
        assert_eq!(scene.triangle(number), flat.scene.triangles[number as usize]);
        let own = scene.copies.as_ref().unwrap();
        let [inside, world] = [own.triangles()[scene.surface_of(number) as usize], scene.triangle(number)];
        let [normal, ..] = scene.normals_of(number, [inside.scaled_normal().normalize_or_zero(); 3]);
        let cosine = |edge: Vec3| normal.dot(edge.normalize_or_zero()).abs();
        assert!(cosine(world.b - world.a) < 1e-4 && cosine(world.c - world.a) < 1e-4, "{number}");
    }
}
