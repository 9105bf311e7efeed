//! A hundred thousand spheres: the hierarchy sees their boxes alone, and asks for each intersection.
//!
//! ```text
//! cargo run --release -p bvhscope-engine --example spheres
//! ```

use std::time::Instant;

use bvhscope_engine::glam::Vec3;
use bvhscope_engine::{BuildSettings, CancelToken, ItemBvh, Ray, Sphere};

/// Width and height of the picture, in characters.
const SIZE: [usize; 2] = [96, 40];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Along a spiral that fills a disc (Vogel, *A better way to construct the sunflower head*, 1979).
    let place = |index: i32| {
        let (radius, angle) = (0.01 * (index as f32).sqrt(), index as f32 * 2.399_963_2);
        Vec3::new(radius * angle.cos(), radius * angle.sin(), 0.3 * (9.0 * radius).sin())
    };
    let spheres: Vec<Sphere> = (0..100_000).map(|index| Sphere { center: place(index), radius: 0.013 }).collect();
    let start = Instant::now();
    let bvh = ItemBvh::build(&spheres[..], &BuildSettings::default(), &CancelToken::new())?;
    println!("{} spheres, built in {:.0} ms", spheres.len(), start.elapsed().as_secs_f64() * 1e3);

    let (mut tests, mut rays) = (0_u32, 0_u32);
    for y in 0..SIZE[1] {
        let mut line = String::new();
        for x in 0..SIZE[0] {
            let at = Vec3::new(x as f32 / SIZE[0] as f32 - 0.5, 0.5 - y as f32 / SIZE[1] as f32, 0.0) * 6.6;
            let ray = Ray::new(Vec3::new(0.0, -6.0, 9.0), at - Vec3::new(0.0, -6.0, 9.0));
            let hit = bvh.closest_hit(&ray, |item, ray| {
                tests += 1;
                enter(&spheres[item as usize], ray)
            });
            rays += 1;
            line.push(hit.map_or(' ', |hit| {
                // The height of waves.
                b".:-=+*#%@"[((ray.at(hit.t).z + 0.32) * 14.0).clamp(0.0, 8.0) as usize] as char
            }));
        }
        println!("{}", line.trim_end());
    }
    println!("{:.2} spheres tested a ray", f64::from(tests) / f64::from(rays));
    Ok(())
}

/// Where `ray` enters `sphere`.
fn enter(sphere: &Sphere, ray: &Ray) -> Option<f32> {
    let from = ray.origin - sphere.center;
    let (a, b) = (ray.direction.length_squared(), from.dot(ray.direction));
    // The distance of the centre from the ray, squared, is more exact than the discriminant of the textbook.
    let nearest = from - ray.direction * (b / a);
    let inside = sphere.radius * sphere.radius - nearest.length_squared();
    (inside >= 0.0).then(|| (-b - (a * inside).sqrt()) / a)
}
