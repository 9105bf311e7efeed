//! How many million triangles a second the builders take: medians over repeated builds, by scene, container, preset and
//! threads. `cargo run --release --example build_rate [FILE…]` adds models to the generated scenes.

use std::time::{Duration, Instant};

use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope_engine::builders::build_binary;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::geometry::Triangle;
use bvhscope_engine::settings::{BuildSettings, Preset};
use bvhscope_engine::tree::ContainerKind;
use glam::Vec3;

const REPEATS: usize = 9;

/// A bumpy ball of about `count` triangles, in rows.
fn ball(count: usize) -> Vec<Triangle> {
    let side = (count as f32 / 2.0).sqrt() as usize;
    let at = |row: usize, column: usize| {
        let (v, u) =
            (row as f32 / side as f32 * std::f32::consts::PI, column as f32 / side as f32 * std::f32::consts::TAU);
        let radius = 1.0 + 0.05 * (9.0 * u).sin() * (7.0 * v).sin();
        radius * Vec3::new(v.sin() * u.cos(), v.cos(), v.sin() * u.sin())
    };
    let mut triangles = Vec::with_capacity(2 * side * side);
    for row in 0..side {
        for column in 0..side {
            let [a, b, c, d] = [at(row, column), at(row + 1, column), at(row + 1, column + 1), at(row, column + 1)];
            triangles.extend([Triangle { a, b, c }, Triangle { a, b: c, c: d }]);
        }
    }
    triangles
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut scenes = vec![("ball".to_owned(), ball(70_000)), ("ball".to_owned(), ball(1_000_000))];
    for path in std::env::args().skip(1) {
        let scene = load(&SceneSource::parse(path.as_ref())?, &LoadOptions::default(), &CancelToken::new())?;
        scenes.push((path, scene.triangles));
    }
    for (name, triangles) in &scenes {
        println!("{name}: {} triangles", triangles.len());
        for container in ContainerKind::ALL {
            for preset in [Preset::Fast, Preset::Hq] {
                for threads in [1, 2] {
                    measure(triangles, container, preset, threads);
                }
            }
        }
    }
    Ok(())
}

fn measure(triangles: &[Triangle], container: ContainerKind, preset: Preset, threads: usize) {
    let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(threads).build() else { return };
    let settings = BuildSettings::preset(preset, container);
    let mut times: Vec<(Duration, String)> = (0..REPEATS)
        .filter_map(|_| {
            let start = Instant::now();
            let (_, stages) = pool.install(|| build_binary(triangles, &settings, &CancelToken::new())).ok()?;
            let elapsed = start.elapsed();
            let stages: Vec<String> =
                stages.stages.iter().map(|(name, time)| format!("{name} {:.1}", time.as_secs_f64() * 1e3)).collect();
            Some((elapsed, stages.join(", ")))
        })
        .collect();
    times.sort();
    let rate = |time: Duration| triangles.len() as f64 / time.as_secs_f64() / 1e6;
    println!(
        "  {:6} {:4} {threads} threads: median {:5.2}, best {:5.2} Mtri/s (best, ms: {})",
        container.name(),
        preset.name(),
        rate(times[REPEATS / 2].0),
        rate(times[0].0),
        times[0].1
    );
}
