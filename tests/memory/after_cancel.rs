//! A cancelled job frees the memory that it took.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bvhscope::accel::Accel;
use bvhscope::camera::Camera;
use bvhscope::export::Protected;
use bvhscope::headless::exr::write_distances;
use bvhscope::headless::picture::write_png;
use bvhscope::overlay::NodeTable;
use bvhscope::render::{RenderRequest, RenderSettings, Shading, render};
use bvhscope::scene::{LoadOptions, SceneSource, load, load_bytes};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::ContainerKind;

use crate::COUNTED;

/// Number of polls at which each job is cancelled, spread evenly over all of them.
const PLACES: u64 = 15;

/// Runs `work` to its end, then cancels it at many polls: the memory in use afterwards is that from before, within a
/// twentieth of the job's peak.
fn gives_all_back(name: &str, pool: &rayon::ThreadPool, work: impl Fn(&CancelToken) -> bool + Sync) {
    let polls = Arc::new(AtomicU64::new(0));
    let counted = Arc::clone(&polls);
    let token = CancelToken::watched(move |_| {
        counted.fetch_add(1, Ordering::Relaxed);
        false
    });
    // The first run makes the tables that are cached for the whole process.
    assert!(!pool.install(|| work(&token)), "{name}: cancelled by itself");
    drop(token);
    let before = COUNTED.current_usage();
    COUNTED.reset_peak_usage();
    assert!(!pool.install(|| work(&CancelToken::new())));
    let needed = COUNTED.peak_usage() - before;
    let polls = polls.load(Ordering::Relaxed);
    for place in 0..polls.min(PLACES) {
        let n = 1 + place * polls / polls.min(PLACES);
        let token = CancelToken::watched(move |poll| poll >= n);
        assert!(pool.install(|| work(&token)), "{name}: went on after poll {n} of {polls}");
        drop(token);
        let more = COUNTED.current_usage().saturating_sub(before);
        assert!(more <= needed / 20, "{name}: {more} bytes of {needed} are kept after poll {n} of {polls}");
    }
}

#[test]
fn cancelled_jobs_free_their_memory() {
    let _alone = crate::alone();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let options = LoadOptions::default();
    let source = SceneSource::Builtin { name: "terrain".to_owned(), size: Some(40_000) };
    gives_all_back("terrain", &pool, |token| load(&source, &options, token).is_err());
    let scene = Arc::new(load(&source, &options, &CancelToken::new()).unwrap());

    let mut obj = String::new();
    for k in 0..30_000 {
        obj += &format!("v {k} {} 0\n", k % 97);
    }
    for k in 3..30_000 {
        obj += &format!("f {} {} {k}\n", k - 2, k - 1);
    }
    gives_all_back("OBJ", &pool, |token| load_bytes(Path::new("a.obj"), obj.as_bytes(), &options, token).is_err());

    for settings in [
        BuildSettings::preset(Preset::Hq, ContainerKind::Aabb),
        BuildSettings::preset(Preset::Hq, ContainerKind::Sphere),
        BuildSettings::preset(Preset::Best, ContainerKind::Aabb),
    ] {
        gives_all_back("build", &pool, |token| Accel::build(&scene, &settings, token).is_err());
    }
    let accel = Arc::new(Accel::build(&scene, &BuildSettings::default(), &CancelToken::new()).unwrap());
    gives_all_back("list of nodes", &pool, |token| {
        let table = NodeTable::new(&accel);
        table
            .list(None, token)
            .and_then(|()| table.complete(ContainerKind::WITH_ORIENTED.into_iter().collect(), token))
            .is_err()
    });

    let camera = Camera::framing(&scene.bounds, scene.up);
    let request = |shading| {
        let settings = RenderSettings { shading, samples: 2, ..RenderSettings::default() };
        RenderRequest { count_tests: true, ..RenderRequest::new(&accel, camera, settings, [200, 150]) }
    };
    for shading in Shading::ALL {
        let request = request(shading);
        gives_all_back(shading.name(), &pool, |token| render(&request, token, &|_| ()).is_err());
    }

    // Large compared with the queues of the encoder's own threads.
    let request = RenderRequest { width_px: 1200, height_px: 900, ..request(Shading::Normals) };
    let frame = render(&request, &CancelToken::new(), &|_| ()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    gives_all_back("PNG", &pool, |token| {
        let path = folder.path().join("a.png");
        write_png(&path, &Protected::default(), [frame.width_px, frame.height_px], &frame.rgba, token).is_err()
    });
    gives_all_back("EXR", &pool, |token| {
        write_distances(&folder.path().join("a.exr"), &Protected::default(), &frame, token).is_err()
    });
}
