//! Hair: cubic curves with a thickness, cut into pieces that lie in polytopes of fourteen planes, which fit slanted pieces better than
//! boxes do.
//!
//! ```text
//! cargo run --release -p bvhscope-engine --example curves
//! ```

use bvhscope_engine::glam::Vec3;
use bvhscope_engine::{Aabb, BuildError, BuildSettings, CancelToken, Dop14, ItemBvh, Ray};

/// Width and height of the picture, in characters.
const SIZE: [usize; 2] = [96, 40];
/// Half of the thickness of a hair, in world units.
const RADIUS: f32 = 0.004;
/// Straight steps that a piece is intersected as.
const STEPS: u8 = 4;

/// Control points of a cubic Bézier curve.
type Curve = [Vec3; 4];

fn main() -> Result<(), BuildError> {
    let pieces: Vec<Curve> = (0..6_000).map(hair).flat_map(quarters).collect();
    // A curve stays within the hull of its control points.
    let dops: Vec<Dop14> = pieces.iter().map(|curve| Dop14::around_balls(*curve, RADIUS)).collect();
    let boxes: Vec<Aabb> = dops.iter().map(|dop| dop.bounds).collect();
    let (settings, token) = (BuildSettings::default(), CancelToken::new());
    let trees = [
        ("boxes", ItemBvh::build(&boxes[..], &settings, &token)?),
        ("14-DOPs", ItemBvh::build(&dops[..], &settings, &token)?),
    ];
    for (name, bvh) in &trees {
        let mut tests = 0;
        let picture = draw(bvh, &pieces, &mut tests);
        if *name == "14-DOPs" {
            println!("{picture}");
        }
        let rays = SIZE[0] * SIZE[1];
        println!("{} pieces in {name}: {:.1} tested a ray", pieces.len(), f64::from(tests) / rays as f64);
    }
    Ok(())
}

/// Hair number `index` on a ball.
fn hair(index: i32) -> Curve {
    let (height, angle) = (1.0 - (index as f32 + 0.5) / 3_000.0, index as f32 * 2.399_963_2);
    let around = (1.0 - height * height).sqrt();
    let root = Vec3::new(around * angle.cos(), height, around * angle.sin());
    let swirl = Vec3::Y.cross(root) * 0.5;
    [root, root * 1.2, root * 1.35 + swirl * 0.6, root * 1.3 + swirl + Vec3::NEG_Y * 0.35]
}

/// A curve, cut in four (de Casteljau).
fn quarters(curve: Curve) -> impl Iterator<Item = Curve> {
    let halves = |[a, b, c, d]: Curve| {
        let (ab, bc, cd) = ((a + b) * 0.5, (b + c) * 0.5, (c + d) * 0.5);
        let (abc, bcd) = ((ab + bc) * 0.5, (bc + cd) * 0.5);
        let middle = (abc + bcd) * 0.5;
        [[a, ab, abc, middle], [middle, bcd, cd, d]]
    };
    halves(curve).into_iter().flat_map(halves)
}

fn point_on([a, b, c, d]: &Curve, t: f32) -> Vec3 {
    let s = 1.0 - t;
    *a * (s * s * s) + *b * (3.0 * s * s * t) + *c * (3.0 * s * t * t) + *d * (t * t * t)
}

fn draw(bvh: &ItemBvh, pieces: &[Curve], tests: &mut u32) -> String {
    let mut picture = String::new();
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let at = Vec3::new(x as f32 / SIZE[0] as f32 - 0.5, 0.5 - y as f32 / SIZE[1] as f32, 0.0) * 3.4;
            let ray = Ray::new(at + Vec3::Z * 4.0, Vec3::NEG_Z);
            let hit = bvh.closest_hit(&ray, |item, ray| {
                *tests += 1;
                pass(&pieces[item as usize], ray)
            });
            let shade = hit.map_or(0, |hit| 9 - (hit.t.clamp(2.6, 4.5) - 2.6).mul_add(4.0, 0.0) as usize);
            picture.push(b" .:-=+*#%@"[shade] as char);
        }
        picture.push('\n');
    }
    picture
}

/// Where `ray`, of unit direction, passes the middle of a piece that it comes nearer than [`RADIUS`].
fn pass(curve: &Curve, ray: &Ray) -> Option<f32> {
    let steps = (0..STEPS).map(|step| [step, step + 1].map(|end| point_on(curve, f32::from(end) / f32::from(STEPS))));
    let passes = steps.filter_map(|[from, to]| {
        // Across the ray, the nearest point of the step to the origin.
        let across = |point: Vec3| point - ray.origin - ray.direction * (point - ray.origin).dot(ray.direction);
        let (start, way) = (across(from), across(to) - across(from));
        let along = if way == Vec3::ZERO { 0.0 } else { (-start.dot(way) / way.length_squared()).clamp(0.0, 1.0) };
        let is_near = (start + way * along).length() < RADIUS;
        is_near.then(|| (from.lerp(to, along) - ray.origin).dot(ray.direction))
    });
    passes.reduce(f32::min)
}
