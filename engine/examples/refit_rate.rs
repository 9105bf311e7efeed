//! Rate of refitting in million triangles per second, and the SAH cost that each way leaves: medians over a mesh that is bent more and
//! more.
//!
//! `cargo run --release -p bvhscope-engine --example refit_rate [TRIANGLES|FILE…]`, where a file holds nine f32 for each triangle, as
//! `bvhscope info MODEL --triangles FILE` writes them.

mod meshes;

use std::time::{Duration, Instant};

use bvhscope_engine::glam::Vec3;
use bvhscope_engine::refit::{WideRefit, refit, refit_and_reinsert, refit_and_rotate};
use bvhscope_engine::tree::statistics::tree_stats;
use bvhscope_engine::{AnyTree, BinaryBvh, BuildSettings, CancelToken, Cancelled, ContainerKind, Triangle, WideBvh};

/// A way to fit a tree to triangles that moved.
type Way = fn(&mut AnyTree, &[Triangle], &CancelToken) -> Result<(), Cancelled>;

/// Moments of the movement.
const MOMENTS: usize = 9;
/// Subtrees that are moved at most.
const MOVES: usize = 1_000;

fn main() -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let mut meshes: Vec<String> = std::env::args().skip(1).collect();
    if meshes.is_empty() {
        meshes = ["100000", "1000000"].map(str::to_owned).to_vec();
    }
    for mesh in meshes {
        let triangles = mesh.parse().map_or_else(|_| read(&mesh), |count| Ok(meshes::bumpy_ball(count)))?;
        println!("{} triangles", triangles.len());
        for container in ContainerKind::ALL {
            for threads in [1, 2] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
                pool.install(|| measure(&triangles, container))?;
            }
        }
    }
    Ok(())
}

/// The triangles in a file of nine little-endian f32 for each, scaled to the size of the other mesh.
fn read(path: &str) -> Result<Vec<Triangle>, std::io::Error> {
    let bytes = std::fs::read(path)?;
    let number = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let numbers: Vec<f32> = bytes.chunks_exact(4).map(number).collect();
    let (low, high) =
        numbers.iter().fold((f32::MAX, f32::MIN), |(low, high), &number| (low.min(number), high.max(number)));
    let corner = |at: &[f32]| (Vec3::from_slice(at) - low) * (2.0 / (high - low)) - 1.0;
    let triangle = |of: &[f32]| Triangle { a: corner(&of[..3]), b: corner(&of[3..6]), c: corner(&of[6..]) };
    Ok(numbers.chunks_exact(9).map(triangle).collect())
}

/// The mesh bent around the y axis.
fn bent(triangles: &[Triangle], angle: f32) -> Vec<Triangle> {
    let corner = |point: Vec3| {
        let (sin, cos) = (angle * point.y).sin_cos();
        Vec3::new(cos * point.x + sin * point.z, point.y, cos * point.z - sin * point.x)
    };
    triangles.iter().map(|t| Triangle { a: corner(t.a), b: corner(t.b), c: corner(t.c) }).collect()
}

fn measure(at_rest: &[Triangle], container: ContainerKind) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let token = CancelToken::new();
    let settings = BuildSettings { container, ..BuildSettings::default() };
    let built = BinaryBvh::build(at_rest, &settings, &token)?;
    let mut wide = WideBvh::new(&built.tree, at_rest, &token)?;
    let lanes = WideRefit::new(&wide.tree, &built.tree, &token)?;
    let moments: Vec<Vec<Triangle>> = (1..=MOMENTS).map(|moment| bent(at_rest, 0.3 * moment as f32)).collect();
    let show = |name: &str, times: &mut Vec<Duration>, tree: &AnyTree| -> Result<(), Cancelled> {
        times.sort_unstable();
        let rate = |time: Duration| at_rest.len() as f64 / time.as_secs_f64() / 1e6;
        println!(
            "  {:6} {} threads, {name:8}: median {:6.1}, best {:6.1} Mtri/s, SAH cost {:.1}",
            container.name(),
            rayon::current_num_threads(),
            rate(times[MOMENTS / 2]),
            rate(times[0]),
            tree_stats(tree, &token)?.sah_cost
        );
        Ok(())
    };
    let ways: [(&str, Way); 3] = [
        ("refit", refit),
        ("rotate", |tree, triangles, token| refit_and_rotate(tree, triangles, token).map(|_| ())),
        ("reinsert", |tree, triangles, token| refit_and_reinsert(tree, triangles, MOVES, token).map(|_| ())),
    ];
    for (name, keep) in ways {
        let (mut tree, mut times, mut wide_times) = (built.tree.clone(), Vec::new(), Vec::new());
        for triangles in &moments {
            let start = Instant::now();
            keep(&mut tree, triangles, &token)?;
            times.push(start.elapsed());
            if name == "refit" {
                let start = Instant::now();
                lanes.apply(&mut wide.tree, &tree, triangles, &token)?;
                wide_times.push(start.elapsed());
            }
        }
        show(name, &mut times, &tree)?;
        if name == "refit" {
            show("wide", &mut wide_times, &tree)?;
        }
    }
    let last = moments.last().map_or(at_rest, Vec::as_slice);
    let (mut times, mut tree) = (Vec::new(), built.tree);
    for _ in 0..MOMENTS {
        let start = Instant::now();
        tree = BinaryBvh::build(last, &settings, &token)?.tree;
        times.push(start.elapsed());
    }
    show("rebuild", &mut times, &tree)?;
    Ok(())
}
