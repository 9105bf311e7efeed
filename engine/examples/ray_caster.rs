//! A small ray caster: one primary ray per pixel, one shadow ray per hit, written as a PNG.
//!
//! `cargo run --release -p bvhscope-engine --example ray_caster [FILE.png]`

mod meshes;

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;

use bvhscope_engine::glam::Vec3;
use bvhscope_engine::{BuildSettings, Bvh, CancelToken, ContainerKind, Hit, Preset, Ray, Triangle, build};
use rayon::prelude::*;

const WIDTH: usize = 640;
const HEIGHT: usize = 480;
/// Edge of a tile in pixels: the rays of one tile are traced as one packet.
const TILE: usize = 16;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "ray_caster.png".to_owned());
    let mut triangles = meshes::bumpy_ball(200_000);
    let [a, b, c, d] = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, z)| Vec3::new(x, -1.05, z));
    triangles.extend([Triangle { a, b: c, c: b }, Triangle { a, b: d, c }]);

    let bvh = build(&triangles, &BuildSettings::preset(Preset::Best, ContainerKind::Aabb), &CancelToken::new())?;
    println!("{} triangles in {:.1} ms", triangles.len(), bvh.report().build_time.as_secs_f64() * 1e3);

    let tiles: Vec<(usize, usize)> =
        (0..HEIGHT).step_by(TILE).flat_map(|y| (0..WIDTH).step_by(TILE).map(move |x| (x, y))).collect();
    let traced: Vec<Vec<u8>> = tiles.par_iter().map(|&(x, y)| trace_tile(&bvh, &triangles, x, y)).collect();
    let mut picture = vec![0; WIDTH * HEIGHT];
    for (&(x, y), greys) in tiles.iter().zip(&traced) {
        for (row, greys) in greys.chunks(TILE).enumerate() {
            picture[(y + row) * WIDTH + x..][..TILE].copy_from_slice(greys);
        }
    }

    let mut encoder = png::Encoder::new(BufWriter::new(File::create(&path)?), WIDTH as u32, HEIGHT as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header()?.write_image_data(&picture)?;
    println!("wrote {path}");
    Ok(())
}

/// The grey of each pixel of the tile with its upper left corner at (x, y), row by row.
fn trace_tile(bvh: &Bvh, triangles: &[Triangle], x: usize, y: usize) -> Vec<u8> {
    let rays: Vec<Ray> = (0..TILE * TILE).map(|pixel| primary_ray(x + pixel % TILE, y + pixel / TILE)).collect();
    let mut hits = vec![None; rays.len()];
    bvh.closest_hits(&rays, &mut hits);

    let to_light = Vec3::new(1.0, 2.0, 1.5).normalize();
    let shadow_rays: Vec<Ray> = rays.iter().zip(&hits).map(|(ray, hit)| shadow_ray(ray, *hit, to_light)).collect();
    let mut blocked = vec![false; rays.len()];
    bvh.any_hits(&shadow_rays, &mut blocked);

    let grey = |((ray, hit), blocked): ((&Ray, &Option<Hit>), &bool)| {
        let Some(hit) = hit else { return 24 };
        let normal = triangles[hit.primitive_index as usize].scaled_normal().normalize_or_zero();
        let facing_normal = if normal.dot(ray.direction) < 0.0 { normal } else { -normal };
        let direct = if *blocked { 0.0 } else { facing_normal.dot(to_light).max(0.0) };
        (255.0 * (0.15 + 0.8 * direct)) as u8
    };
    rays.iter().zip(&hits).zip(&blocked).map(grey).collect()
}

/// The ray through the centre of a pixel.
fn primary_ray(x: usize, y: usize) -> Ray {
    let (eye, scale) = (Vec3::new(0.0, 0.6, 3.2), 0.8 / HEIGHT as f32);
    let right = (x as f32 + 0.5 - WIDTH as f32 / 2.0) * scale;
    let up = (HEIGHT as f32 / 2.0 - y as f32 - 0.5) * scale;
    Ray::new(eye, Vec3::new(right, up - 0.2, -1.0).normalize())
}

/// The ray from a hit towards the light, starting a little off the surface; one that hits nothing where there is no hit.
fn shadow_ray(ray: &Ray, hit: Option<Hit>, to_light: Vec3) -> Ray {
    let t_max = if hit.is_some() { f32::INFINITY } else { -1.0 };
    let origin = ray.at(hit.map_or(0.0, |hit| hit.t * 0.9999));
    Ray { t_max, ..Ray::new(origin, to_light) }
}
