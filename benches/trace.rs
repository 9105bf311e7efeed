//! Primary rays through the binary tree on one core: `cargo bench --bench trace [-- MODEL [SIZE]]`.
//!
//! Prints the least and the median time of ten rounds, for boxes and spheres, ordered and paper traversal, and what the
//! statistics cost. The view fills the picture with the model.

#![allow(clippy::pedantic, reason = "tests and measurements may be plainer than the libraries")]

use std::ffi::OsString;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bvhscope::accel::Accel;
use bvhscope::camera::{Camera, CameraFrame};
use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::tree::traverse::{NoProbe, TestCounts, Traversal};

const TILE: u32 = 8;
const ROUNDS: usize = 10;

fn main() {
    // `cargo bench` passes flags of its own.
    let mut arguments = std::env::args_os().skip(1).filter(|argument| !argument.to_string_lossy().starts_with("--"));
    let model = arguments.next().unwrap_or_else(|| OsString::from("builtin:teapot"));
    let size = arguments.next().and_then(|size| size.to_str()?.parse().ok()).unwrap_or(1024);
    let token = CancelToken::new();
    let scene = SceneSource::parse(&model)
        .map_err(anyhow::Error::msg)
        .and_then(|source| load(&source, &LoadOptions::default(), &token).map_err(anyhow::Error::from));
    let scene = match scene {
        Ok(scene) => Arc::new(scene),
        Err(error) => {
            eprintln!("{error}");
            std::process::exit(1);
        }
    };
    let mut camera = Camera::framing(&scene.bounds, scene.up);
    // The model's height fills the picture, cut off where it is wider.
    camera.eye = camera.target + (camera.eye - camera.target) * 0.5;
    let frame = camera.for_size(size, size);
    println!("{}, {} triangles, {size}×{size} rays in {TILE}×{TILE} tiles", model.display(), scene.triangles.len());
    for container in ContainerKind::ALL {
        let settings = BuildSettings::preset(Preset::Fast, container);
        let (build_time, accel) = timed(|| Accel::build(&scene, &settings, &token));
        let accel = accel.expect("AAC refuses nothing and nobody cancels");
        let (stats_time, _) = timed(|| tree_stats(&accel.tree, &token));
        let (overlap_time, overlap) =
            timed(|| accel.epo(None, &token).expect("nobody cancels").expect("the scene is flat"));
        let (lineage_time, _) = timed(|| accel.ancestry().parents.len());
        let (path_time, path) = timed(|| accel.path_to(scene.triangles.len() as u32 / 2));
        println!(
            "{}: accel {build_time:.1?} (tree {:.1?}), statistics {stats_time:.1?}, EPO {:.3} in {overlap_time:.1?}, \
             ancestry {lineage_time:.1?}, path of {} in {path_time:.1?}, SAH {:.2}, depth {}",
            container.name(),
            accel.report.build_time,
            overlap.value,
            path.len(),
            accel.report.stats.sah_cost,
            accel.report.stats.max_depth,
        );
        for traversal in [Traversal::Ordered, Traversal::Paper] {
            measure(&accel, &frame, size, traversal);
        }
    }
}

fn measure(accel: &Accel, frame: &CameraFrame, size: u32, traversal: Traversal) {
    let mut counts = TestCounts::default();
    let rays = f64::from(size * size);
    let hits = trace(accel, frame, size, |accel, ray| accel.closest_hit_with(ray, traversal, &mut counts).is_some());
    let mut times: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let (time, _) = timed(|| {
                trace(accel, frame, size, |accel, ray| accel.closest_hit_with(ray, traversal, &mut NoProbe).is_some())
            });
            time.as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!(
        "  {traversal:?}: {:.2} Mray/s best, {:.2} median; {:.1} % hit, {:.1} container and {:.1} primitive tests a ray",
        rays / times[0] / 1e6,
        rays / times[ROUNDS / 2] / 1e6,
        hits as f64 / rays * 100.0,
        counts.containers as f64 / rays,
        counts.primitives as f64 / rays,
    );
}

/// Number of rays, tile by tile, for which `hit` is true.
fn trace(
    accel: &Accel,
    frame: &CameraFrame,
    size: u32,
    mut hit: impl FnMut(&Accel, &bvhscope_engine::geometry::Ray) -> bool,
) -> u32 {
    let mut hits = 0;
    for tile_y in (0..size).step_by(TILE as usize) {
        for tile_x in (0..size).step_by(TILE as usize) {
            for y in tile_y..(tile_y + TILE).min(size) {
                for x in tile_x..(tile_x + TILE).min(size) {
                    hits += u32::from(hit(accel, &frame.ray(x as f32 + 0.5, y as f32 + 0.5)));
                }
            }
        }
    }
    hits
}

fn timed<T>(run: impl FnOnce() -> T) -> (Duration, T) {
    let start = Instant::now();
    let result = run();
    (start.elapsed(), result)
}
