//! Threads: a build in a pool of its own, one tree traced by several threads, and a build cancelled from another thread.
//!
//! `cargo run --release -p bvhscope-engine --example threads`

mod meshes;

use std::error::Error;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use bvhscope_engine::glam::Vec3;
use bvhscope_engine::{BuildError, BuildSettings, CancelToken, ContainerKind, Preset, Ray, build};

const THREADS: usize = 4;
const RAYS_PER_THREAD: usize = 100_000;

fn main() -> Result<(), Box<dyn Error>> {
    let triangles = meshes::bumpy_ball(500_000);
    let settings = BuildSettings::preset(Preset::Best, ContainerKind::Aabb);

    // A build runs in the pool that it is started in; the tree is the same in any pool.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build()?;
    let bvh = Arc::new(pool.install(|| build(&triangles, &settings, &CancelToken::new()))?);
    println!("built by {} threads in {:.0} ms", bvh.report().threads, bvh.report().build_time.as_secs_f64() * 1e3);

    // Queries run on the thread that calls them, and any number of threads may call them at once.
    let workers: Vec<_> = (0..THREADS)
        .map(|worker| {
            let bvh = Arc::clone(&bvh);
            thread::spawn(move || {
                let from = Vec3::new(worker as f32, 1.0, 4.0);
                let to = |ray: usize| Vec3::new((ray % 100) as f32 / 50.0 - 1.0, (ray / 100) as f32 / 500.0 - 1.0, 0.0);
                let rays: Vec<Ray> = (0..RAYS_PER_THREAD).map(|ray| Ray::new(from, to(ray) - from)).collect();
                let mut hits = vec![None; rays.len()];
                bvh.closest_hits(&rays, &mut hits);
                hits.iter().flatten().count()
            })
        })
        .collect();
    for (worker, handle) in workers.into_iter().enumerate() {
        let hits = handle.join().map_err(|_| "a worker panicked")?;
        println!("thread {worker}: {hits} of {RAYS_PER_THREAD} rays hit");
    }

    // Clones of a token refer to the same work: one builds, another cancels and reads the progress.
    let token = CancelToken::new();
    let builder = {
        let token = token.clone();
        thread::spawn(move || build(&triangles, &settings, &token).map(|_| ()))
    };
    thread::sleep(Duration::from_millis(20));
    token.cancel();
    match builder.join().map_err(|_| "the builder panicked")? {
        Err(BuildError::Cancelled(_)) => println!("cancelled at {:.0} %", token.progress() * 100.0),
        Err(error) => return Err(error.into()),
        Ok(()) => println!("done before it was cancelled"),
    }
    Ok(())
}
