//! The same inputs give the same tree and picture, on any number of threads and after any other build.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bvhscope::accel::{Accel, BuildSession};
use bvhscope::camera::Camera;
use bvhscope::render::{Light, RenderRequest, RenderSettings, Shading, render};
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, BuilderKind, Curve, Passes};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::statistics::TreeStats;

#[test]
fn the_build_cache_changes_no_later_tree() {
    let scene = |size| {
        let source = SceneSource::Builtin { name: "terrain".to_owned(), size: Some(size) };
        Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap())
    };
    let scenes = [scene(20_000), scene(30_000)];
    let plain = BuildSettings::default();
    let steps = [
        (0, plain),
        (0, BuildSettings { threshold: 20, ..plain }),
        (0, BuildSettings { curve: Curve::Hilbert, ..plain }),
        (0, BuildSettings { container: ContainerKind::Sphere, curve: Curve::Hilbert, ..plain }),
        (1, BuildSettings { container: ContainerKind::Sphere, curve: Curve::Hilbert, ..plain }),
        (1, BuildSettings { container: ContainerKind::Sphere, curve: Curve::Hilbert, threshold: 3, ..plain }),
        (0, BuildSettings { optimize: Passes::ALL, rounds: 3, ..plain }),
        (0, plain),
        (0, BuildSettings { builder: BuilderKind::Lbvh, ..plain }),
        (0, BuildSettings { threshold: 9, ..plain }),
    ];
    let mut session = BuildSession::default();
    for (step, (scene, settings)) in steps.into_iter().enumerate() {
        for look in [3, 12] {
            let token = CancelToken::watched(move |n| n >= look);
            drop(Accel::build_with_session(&scenes[scene], &settings, Some(&mut session), &token));
        }
        let token = CancelToken::new();
        // Dropped at the end of each step, so that the next one reuses its memory.
        let accel = Accel::build_with_session(&scenes[scene], &settings, Some(&mut session), &token).unwrap();
        let alone = Accel::build_binary(&scenes[scene], &settings, &token).unwrap();
        assert!(accel.tree == alone.tree, "step {step}: {settings:?} makes another tree after others");
        let [own, plain] = [&accel, &alone].map(|accel| TreeStats { sah_cost: 0.0, ..accel.report.stats.clone() });
        assert_eq!(own, plain, "step {step}");
        let [own, plain] = [&accel, &alone].map(|accel| accel.report.stats.sah_cost);
        assert!((own - plain).abs() <= 1e-6 * plain, "step {step}: {own}, {plain}");
        let stages = |accel: &Accel| [accel.report.stages.reused.clone(), stage_names(accel)].concat();
        assert_eq!(stages(&accel), stages(&alone), "step {step}");
    }
}

/// Names of the stages that ran.
fn stage_names(accel: &Accel) -> Vec<&'static str> {
    accel.report.stages.stages.iter().map(|stage| stage.0).collect()
}

#[test]
fn the_time_of_a_build_counts_only_the_stages_that_ran() {
    let source = SceneSource::Builtin { name: "terrain".to_owned(), size: Some(20_000) };
    let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
    let plain = BuildSettings::default();
    let sphere = ContainerKind::Sphere;
    let mut session = BuildSession::default();
    // The bounds do not depend on the settings, the order on container and curve.
    for (step, (settings, is_reused)) in [
        (plain, false),
        (BuildSettings { threshold: 9, ..plain }, true),
        (BuildSettings { threshold: 10, ..plain }, true),
        (BuildSettings { curve: Curve::Hilbert, ..plain }, false),
        (BuildSettings { curve: Curve::Hilbert, threshold: 9, ..plain }, true),
        (BuildSettings { container: sphere, curve: Curve::Hilbert, ..plain }, false),
        (BuildSettings { container: sphere, curve: Curve::Hilbert, epsilon: 0.1, ..plain }, true),
    ]
    .into_iter()
    .enumerate()
    {
        let start = Instant::now();
        let accel = Accel::build_with_session(&scene, &settings, Some(&mut session), &CancelToken::new()).unwrap();
        let elapsed = start.elapsed();
        let report = &accel.report;
        if is_reused {
            assert_eq!(report.stages.reused, ["bounds", "codes", "sort"], "{settings:?}");
            assert_eq!(stage_names(&accel), ["tree", "flatten"], "{settings:?}");
        } else if step == 0 {
            assert!(report.stages.reused.is_empty(), "{settings:?}");
            assert_eq!(stage_names(&accel), ["bounds", "codes", "sort", "tree", "flatten"], "{settings:?}");
        } else {
            assert_eq!(report.stages.reused, ["bounds"], "{settings:?}");
            assert_eq!(stage_names(&accel), ["codes", "sort", "tree", "flatten"], "{settings:?}");
        }
        assert_eq!(report.build_time, report.stages.stages.iter().map(|stage| stage.1).sum::<Duration>());
        assert!(report.build_time <= elapsed, "{settings:?}: {:?} within {elapsed:?}", report.build_time);
        let alone = Accel::build_binary(&scene, &settings, &CancelToken::new()).unwrap();
        assert!(accel.tree == alone.tree, "{settings:?} makes another tree");
        assert!(alone.report.stages.reused.is_empty(), "a build without a session reuses nothing");
    }
}

#[test]
fn pictures_do_not_depend_on_the_number_of_threads() {
    let source = SceneSource::Builtin { name: "terrain".to_owned(), size: Some(2_000) };
    let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
    let picture = |threads: usize, shading: Shading| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap());
            let camera = Camera::framing(&scene.bounds, scene.up);
            let settings = RenderSettings { shading, samples: 2, ..RenderSettings::default() };
            let request = RenderRequest { count_tests: true, ..RenderRequest::new(&accel, camera, settings, [90, 70]) };
            render(&request, &CancelToken::new(), &|_| ()).unwrap()
        })
    };
    for shading in [Shading::Lit, Shading::AmbientOcclusion, Shading::Clusters] {
        let one = picture(1, shading);
        for threads in [2, 3, 7] {
            let many = picture(threads, shading);
            let same = one.rgba == many.rgba && one.distance == many.distance && one.primitive == many.primitive;
            assert!(same, "{}: {threads} threads make another picture", shading.name());
        }
    }
}

#[test]
fn a_coarse_picture_does_not_depend_on_the_wide_tree() {
    let source = SceneSource::Builtin { name: "terrain".to_owned(), size: Some(2_000) };
    let scene = Arc::new(load(&source, &LoadOptions::default(), &CancelToken::new()).unwrap());
    for container in ContainerKind::ALL {
        for shading in Shading::ALL {
            let light = Light::Sun;
            let picture = |accel: Accel| {
                let accel = Arc::new(accel);
                let request = RenderRequest {
                    accel: Arc::clone(&accel),
                    camera: Camera::framing(&scene.bounds, scene.up),
                    settings: RenderSettings { shading, light, ..RenderSettings::default() },
                    width_px: 90,
                    height_px: 70,
                    coarseness: 3.0,
                    count_tests: false,
                    hidden: None,
                    clusters: None,
                    layout: None,
                };
                (render(&request, &CancelToken::new(), &|_| ()).unwrap(), accel)
            };
            let settings = BuildSettings { container, ..BuildSettings::default() };
            let (wide, _) = picture(Accel::build(&scene, &settings, &CancelToken::new()).unwrap());
            let (binary, accel) = picture(Accel::build_binary(&scene, &settings, &CancelToken::new()).unwrap());
            let same = wide.rgba == binary.rgba && wide.distance == binary.distance && wide.values == binary.values;
            assert!(same, "{} {}: the wide tree makes another picture", shading.name(), container.name());
            // Only modes that count in the wide tree need it.
            let is_of_wide = matches!(shading, Shading::Heat(kind) if kind.is_of_wide_tree());
            assert_eq!(accel.known_wide().is_some(), is_of_wide, "{}", shading.name());
        }
    }
}
