//! Copies of meshes in a tree of two levels beside the flat scene: what each takes to build, to hold and to trace, and that their hits
//! are the same.
//!
//! `cargo run --release -p bvhscope-engine --example copies [COPIES [TRIANGLES [RAYS]]]`: so many copies of five meshes of so many
//! triangles, turned and scaled, on a square; the flat scene is built where it has ten million triangles at most.

mod meshes;

use std::sync::Arc;
use std::time::{Duration, Instant};

use bvhscope_engine::glam::{Affine3A, Quat, Vec3};
use bvhscope_engine::{BuildSettings, Bvh, CancelToken, InstanceHit, Instances, Placed, Ray, Triangle, build};

/// Meshes that there are copies of.
const MESHES: usize = 5;
/// Largest flat scene that is built.
const LARGEST_FLAT: u64 = 10_000_000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers = std::env::args().skip(1).map(|text| text.parse()).collect::<Result<Vec<usize>, _>>()?;
    let number = |at: usize, default| numbers.get(at).copied().unwrap_or(default);
    let (copies, size, rays) = (number(0, 2_000), number(1, 2_000), number(2, 1_000_000));
    let (settings, token) = (BuildSettings::default(), CancelToken::new());

    let meshes: Vec<Vec<Triangle>> = (1..=MESHES).map(|kind| meshes::bumpy_ball(size * kind / 3)).collect();
    let start = Instant::now();
    let trees =
        meshes.iter().map(|mesh| build(mesh, &settings, &token).map(Arc::new)).collect::<Result<Vec<_>, _>>()?;
    let of_meshes = start.elapsed();
    let side = (copies as f32).sqrt();
    let mut random = Random(1);
    let placed: Vec<Placed> = (0..copies)
        .map(|index| Placed {
            mesh: (index % MESHES) as u32,
            transform: Affine3A::from_scale_rotation_translation(
                Vec3::new(0.4, 0.4 + random.unit(), 0.4) * (0.5 + random.unit()),
                Quat::from_rotation_y(6.3 * random.unit()) * Quat::from_rotation_x(random.unit()),
                Vec3::new(random.unit(), 0.0, random.unit()) * side,
            ),
        })
        .collect();
    println!("{copies} copies of {MESHES} meshes, which are built in {}", milliseconds(of_meshes));
    let rays: Vec<Ray> = (0..rays).map(|_| ray(&mut random, side)).collect();
    let mut levels = Vec::new();
    for open in [1.0, 2.0, 4.0] {
        let start = Instant::now();
        let instances = Instances::build(trees.clone(), &placed, &settings, open, &token)?;
        let (built, megabytes) = (milliseconds(start.elapsed()), instances.bytes() as f64 / 1e6);
        let mut hits = vec![None; rays.len()];
        let time = timed(|| instances.closest_hits(&rays, &mut hits));
        let found = hits.iter().flatten().count();
        let rate = rate(rays.len(), time);
        println!(
            "two levels, opened to {open}: built in {built}; {megabytes:.1} MB; {found} hits of {} rays, {rate}",
            rays.len()
        );
        levels.push((instances, hits));
    }
    let triangles = levels[0].0.copies().triangle_count();
    if triangles > LARGEST_FLAT {
        println!("flat: {triangles} triangles are too many");
        return Ok(());
    }
    compare(&levels, &meshes, &placed, &rays)
}

/// Builds and traces the flat scene.
fn compare(
    levels: &[(Instances, Vec<Option<InstanceHit>>)],
    meshes: &[Vec<Triangle>],
    placed: &[Placed],
    rays: &[Ray],
) -> Result<(), Box<dyn std::error::Error>> {
    let (mut triangles, mut of) = (Vec::new(), Vec::new());
    for (instance, copy) in (0..).zip(placed) {
        let (place, mesh) = (levels[0].0.copies().copies().place(instance), &meshes[copy.mesh as usize]);
        triangles.extend(mesh.iter().map(|triangle| place.triangle(triangle)));
        of.extend((0..mesh.len() as u32).map(|triangle| (instance, triangle)));
    }
    let start = Instant::now();
    let flat: Bvh = build(&triangles, &BuildSettings::default(), &CancelToken::new())?;
    let bytes = flat.wide().bytes_per_triangle() * triangles.len() as f64;
    println!("flat, {} triangles: built in {}; {:.1} MB", triangles.len(), milliseconds(start.elapsed()), bytes / 1e6);
    let mut of_flat = vec![None; rays.len()];
    for (round, (instances, hits)) in levels.iter().enumerate() {
        let time = timed(|| rays.iter().zip(&mut of_flat).for_each(|(ray, hit)| *hit = flat.closest_hit(ray)));
        let again = timed(|| instances.closest_hits(rays, &mut vec![None; rays.len()]));
        let ratio = again.as_secs_f64() / time.as_secs_f64();
        println!("flat: {}; opened to {} takes {ratio:.2} of its time", rate(rays.len(), time), 1 << round);
        let same = of_flat.iter().zip(hits).filter(|(flat, hit)| {
            let expected = flat.map(|flat: bvhscope_engine::Hit| {
                let (instance, primitive_index) = of[flat.primitive_index as usize];
                InstanceHit { t: flat.t, instance, primitive_index, u: flat.u, v: flat.v }
            });
            **hit == expected
        });
        if same.count() < rays.len() {
            return Err("the hits must be the same".into());
        }
    }
    println!("all hits are the same");
    Ok(())
}

/// From above the square to a point on it.
fn ray(random: &mut Random, side: f32) -> Ray {
    let origin = Vec3::new(random.unit(), 0.3 + random.unit(), random.unit()) * side;
    Ray::new(origin, Vec3::new(random.unit(), 0.0, random.unit()) * side - origin)
}

fn timed(run: impl FnOnce()) -> Duration {
    let start = Instant::now();
    run();
    start.elapsed()
}

fn milliseconds(time: Duration) -> String {
    format!("{:.1} ms", time.as_secs_f64() * 1e3)
}

fn rate(rays: usize, time: Duration) -> String {
    format!("{:.2} million rays a second", rays as f64 / time.as_secs_f64() / 1e6)
}

/// A generator of numbers (Marsaglia, *Xorshift RNGs*, 2003).
struct Random(u64);

impl Random {
    /// The next number, from 0 to 1.
    fn unit(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }
}
