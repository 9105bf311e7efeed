//! Build rate in million triangles per second: medians over repeated builds, by container, preset and number of threads.
//!
//! `cargo run --release -p bvhscope-engine --example build_rate [TRIANGLES…]`

mod meshes;

use std::time::Duration;

use bvhscope_engine::{BinaryBvh, BuildReport, BuildSettings, CancelToken, ContainerKind, Preset, Triangle};

/// Builds per setting.
const REPEATS: usize = 9;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut counts = std::env::args().skip(1).map(|count| count.parse()).collect::<Result<Vec<usize>, _>>()?;
    if counts.is_empty() {
        counts = vec![70_000, 1_000_000];
    }
    for count in counts {
        let triangles = meshes::bumpy_ball(count);
        println!("{} triangles", triangles.len());
        for container in ContainerKind::ALL {
            for preset in [Preset::Fast, Preset::Hq, Preset::Best] {
                for threads in [1, 2] {
                    measure(&triangles, container, preset, threads)?;
                }
            }
        }
    }
    Ok(())
}

fn measure(
    triangles: &[Triangle],
    container: ContainerKind,
    preset: Preset,
    threads: usize,
) -> Result<(), Box<dyn std::error::Error>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let settings = BuildSettings::preset(preset, container);
    let mut reports = Vec::with_capacity(REPEATS);
    for _ in 0..REPEATS {
        reports.push(pool.install(|| BinaryBvh::build(triangles, &settings, &CancelToken::new()))?.report);
    }
    reports.sort_by_key(|report: &BuildReport| report.build_time);
    let (best, median) = (&reports[0], &reports[REPEATS / 2]);
    let millis = |time: Duration| time.as_secs_f64() * 1e3;
    let stages: Vec<String> =
        best.stages.stages.iter().map(|(name, time)| format!("{name} {:.1}", millis(*time))).collect();
    println!(
        "  {:6} {:4} {threads} threads: median {:5.2}, best {:5.2} Mtri/s (best, ms: {})",
        container.name(),
        preset.name(),
        median.mtriangles_per_s(),
        best.mtriangles_per_s(),
        stages.join(", ")
    );
    Ok(())
}
