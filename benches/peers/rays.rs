//! The rays that every engine gets: primary rays, and those that leave from where they hit.

use bvhscope::camera::Camera;
use bvhscope_engine::geometry::{Aabb, Ray, Triangle};
use bvhscope_engine::tree::Tree;
use bvhscope_engine::tree::traverse::{NoProbe, Traversal, closest_hit};
use glam::Vec3;

/// Rays that leave from each hit to measure ambient occlusion.
pub const OCCLUSION_RAYS: u64 = 4;

/// Kind of query.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Query {
    /// The nearest hit.
    Closest,
    /// Any hit.
    Any,
    /// All hits, by distance.
    All,
    /// The point of the mesh that is nearest to the ray's origin.
    Point,
}

/// The kinds of rays and points.
pub const WORKS: [&str; 5] = ["primary", "ao", "diffuse", "all-hits", "closest-point"];

/// Rays with a question.
pub struct Workload {
    /// One of [`WORKS`].
    pub name: &'static str,
    /// Kind of query.
    pub query: Query,
    /// True if neighbours in the list run alike.
    pub coherent: bool,
    /// In the order in which they are traced.
    pub rays: Vec<Ray>,
}

/// An engine's results, the same for all engines.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// Hits, at most one of a ray unless the query is [`Query::All`].
    pub hits: u64,
    /// Sum of their distances; 0 where the query is [`Query::Any`].
    pub distance: f64,
}

impl Tally {
    /// Both together.
    pub fn plus(self, other: Self) -> Self {
        Self { hits: self.hits + other.hits, distance: self.distance + other.distance }
    }

    /// Adds a ray's hit distance, infinity for none.
    #[inline(always)]
    pub fn add(&mut self, t: f32) {
        if t < f32::INFINITY {
            self.hits += 1;
            self.distance += f64::from(t);
        }
    }
}

/// Primary rays through the centres of `size`² pixels (a power of two) along the Z curve, so that each 4 × 4, 8 × 8 or 16 × 16
/// neighbours form a square tile; four ambient occlusion rays and one diffuse ray for each of their hits in `tree`, distributed
/// by the cosine, without limits; all hits of the primary rays; and a sixteenth as many points for which the nearest point is sought,
/// distributed evenly over `bounds`. The same in every run.
pub fn workloads(
    tree: &Tree<Aabb>,
    triangles: &[Triangle],
    bounds: &Aabb,
    camera: &Camera,
    size: u32,
) -> [Workload; WORKS.len()] {
    let leaf_triangles: Vec<Triangle> = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
    let frame = camera.for_size(size, size);
    // Far enough off the surface for every engine's rounding.
    let lift = 1e-5 * bounds.extent().length();
    let mut primary = Vec::new();
    let (mut occlusion, mut diffuse) = (Vec::new(), Vec::new());
    for index in 0..size * size {
        let (x, y) = (every_other_bit(index), every_other_bit(index >> 1));
        let ray = frame.ray(x as f32 + 0.5, y as f32 + 0.5);
        primary.push(ray);
        let Some(hit) = closest_hit(tree, &leaf_triangles, &ray, Traversal::Ordered, &mut NoProbe) else { continue };
        let normal = triangles[hit.primitive_index as usize].scaled_normal().normalize();
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        let origin = ray.at(hit.t) + normal * lift;
        let pixel = u64::from(index) * (OCCLUSION_RAYS + 1);
        occlusion.extend((0..OCCLUSION_RAYS).map(|k| Ray::new(origin, around(normal, pixel + k))));
        diffuse.push(Ray::new(origin, around(normal, pixel + OCCLUSION_RAYS)));
    }
    let share = |bits: u64| (bits & 0x1f_ffff) as f32 / (1 << 21) as f32;
    let point = |index| {
        let x = mixed(index);
        Ray::new(bounds.min + bounds.extent() * Vec3::new(share(x), share(x >> 21), share(x >> 42)), Vec3::X)
    };
    let points = (0..u64::from(size * size / 16)).map(point).collect();
    let [first, second, third, fourth, fifth] = WORKS;
    [
        Workload { name: first, query: Query::Closest, coherent: true, rays: primary.clone() },
        Workload { name: second, query: Query::Any, coherent: false, rays: occlusion },
        Workload { name: third, query: Query::Closest, coherent: false, rays: diffuse },
        Workload { name: fourth, query: Query::All, coherent: true, rays: primary },
        Workload { name: fifth, query: Query::Point, coherent: false, rays: points },
    ]
}

/// Neighbouring rays that stay together when a workload is divided: 64 × 64 pixels of primary rays.
const TILE: usize = 4096;

/// The workload divided among `threads`, tile by tile in turn.
pub fn in_parts(work: &Workload, threads: usize) -> Vec<Workload> {
    let part = |thread: usize| Workload {
        name: work.name,
        query: work.query,
        coherent: work.coherent,
        rays: work.rays.chunks(TILE).skip(thread).step_by(threads).flatten().copied().collect(),
    };
    (0..threads).map(part).collect()
}

/// The bits 0, 2, 4, … of a position on the Z curve.
fn every_other_bit(mut x: u32) -> u32 {
    x &= 0x5555_5555;
    x = (x | x >> 1) & 0x3333_3333;
    x = (x | x >> 2) & 0x0f0f_0f0f;
    x = (x | x >> 4) & 0x00ff_00ff;
    (x | x >> 8) & 0xffff
}

/// Random bits number `index`.
fn mixed(index: u64) -> u64 {
    // splitmix64 (Steele, Lea, Flood, *Fast Splittable Pseudorandom Number Generators*, 2014).
    let mut x = index.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// Direction number `index` around `normal`, distributed by the cosine.
fn around(normal: Vec3, index: u64) -> Vec3 {
    let x = mixed(index);
    let share = |bits: u64| (bits & 0xff_ffff) as f32 / (1 << 24) as f32;
    let (angle, height) = (share(x) * std::f32::consts::TAU, share(x >> 24));
    let radius = height.sqrt();
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let direction =
        tangent * (radius * angle.cos()) + bitangent * (radius * angle.sin()) + normal * (1.0 - height).sqrt();
    direction.normalize()
}
