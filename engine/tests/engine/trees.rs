//! Trees, scenes and rays for the tests, made here with fixed seeds, and the linear scan that they are compared with.

use bvhscope_engine::geometry::{Hit, PreparedRay, Ray, Shear, Triangle};
use bvhscope_engine::tree::{AnyTree, Container, Node, Tree};
use glam::Vec3;

use crate::oracle;
use crate::random::Random;

impl Random {
    /// A point in the cube from -1 to 1.
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
}

/// A plain tree: the list is halved until `leaf_size` is left.
pub fn halved<C: Container>(triangles: &[Triangle], leaf_size: usize) -> AnyTree
where
    AnyTree: From<Tree<C>>,
{
    let mut tree = Tree { nodes: Vec::new(), primitive_indices: (0..triangles.len() as u32).collect(), max_depth: 0 };
    if !triangles.is_empty() {
        tree.nodes.push(Node { container: C::EMPTY, first: 0, count: 0 });
        halve(&mut tree, triangles, 0, 0..triangles.len(), leaf_size, 0);
    }
    tree.into()
}

fn halve<C: Container>(
    tree: &mut Tree<C>,
    triangles: &[Triangle],
    node: usize,
    range: std::ops::Range<usize>,
    leaf_size: usize,
    depth: u32,
) {
    tree.max_depth = tree.max_depth.max(depth);
    if range.len() <= leaf_size {
        let around = |a: C, i: &u32| a.union(&C::of_triangle(&triangles[*i as usize]));
        let container = tree.primitive_indices[range.clone()].iter().fold(C::EMPTY, around);
        tree.nodes[node] = Node { container, first: range.start as u32, count: range.len() as u32 };
        return;
    }
    let first = tree.nodes.len();
    tree.nodes.extend([Node { container: C::EMPTY, first: 0, count: 0 }; 2]);
    let axis = depth as usize % 3;
    let key = |i: &u32| triangles[*i as usize].bounds().center()[axis];
    tree.primitive_indices[range.clone()].sort_by(|a, b| key(a).total_cmp(&key(b)));
    let middle = range.start + range.len() / 2;
    halve(tree, triangles, first, range.start..middle, leaf_size, depth + 1);
    halve(tree, triangles, first + 1, middle..range.end, leaf_size, depth + 1);
    let container = tree.nodes[first].container.union(&tree.nodes[first + 1].container);
    tree.nodes[node] = Node { container, first: first as u32, count: 0 };
}

/// A list rather than a tree: each interior node has one leaf and the rest.
pub fn chain<C: Container>(triangles: &[Triangle]) -> AnyTree
where
    AnyTree: From<Tree<C>>,
{
    let count = triangles.len();
    let mut rest = vec![C::EMPTY; count + 1];
    for i in (0..count).rev() {
        rest[i] = rest[i + 1].union(&C::of_triangle(&triangles[i]));
    }
    let mut nodes = vec![Node { container: rest[0], first: 1, count: 0 }];
    for i in 0..count - 1 {
        nodes.push(Node { container: C::of_triangle(&triangles[i]), first: i as u32, count: 1 });
        let last = i + 2 == count;
        let (first, size) = if last { (i as u32 + 1, 1) } else { (nodes.len() as u32 + 1, 0) };
        nodes.push(Node { container: rest[i + 1], first, count: size });
    }
    Tree { nodes, primitive_indices: (0..count as u32).collect(), max_depth: count as u32 - 1 }.into()
}

/// Triangles of about `size` in a cube of 2.
pub fn soup(count: usize, size: f32, seed: u64) -> Vec<Triangle> {
    let mut random = Random(seed);
    (0..count)
        .map(|_| {
            let a = random.vector();
            Triangle { a, b: a + random.vector() * size, c: a + random.vector() * size }
        })
        .collect()
}

/// Long thin triangles that cross one another in a cube of 2: their boxes are nearly empty.
pub fn sticks(count: usize, seed: u64) -> Vec<Triangle> {
    let mut random = Random(seed);
    (0..count)
        .map(|_| {
            let (a, b) = (random.vector(), random.vector());
            Triangle { a, b, c: b + random.vector() * 0.02 }
        })
        .collect()
}

/// A flat grid of squares with whole coordinates, two triangles each, in the plane `axis` = `height`.
pub fn grid(cells: usize, axis: usize, height: f32) -> Vec<Triangle> {
    let point = |x: usize, y: usize| {
        let mut p = [0.0; 3];
        p[axis] = height;
        p[(axis + 1) % 3] = x as f32;
        p[(axis + 2) % 3] = y as f32;
        Vec3::from(p)
    };
    let mut triangles = Vec::new();
    for x in 0..cells {
        for y in 0..cells {
            let (a, b, c, d) = (point(x, y), point(x + 1, y), point(x + 1, y + 1), point(x, y + 1));
            triangles.push(Triangle { a, b, c });
            triangles.push(Triangle { a, b: c, c: d });
        }
    }
    triangles
}

/// A closed ball with shared corners.
pub fn ball(center: Vec3, radius: f32, rings: usize) -> Vec<Triangle> {
    let point = |ring: usize, step: usize| {
        let (theta, phi) = (
            std::f32::consts::PI * ring as f32 / rings as f32,
            std::f32::consts::TAU * (step % (2 * rings)) as f32 / (2 * rings) as f32,
        );
        // The poles must be single points, so that the ball is closed.
        let sin = if ring == 0 || ring == rings { 0.0 } else { theta.sin() };
        center + radius * Vec3::new(sin * phi.cos(), theta.cos(), sin * phi.sin())
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for step in 0..2 * rings {
            let (a, b) = (point(ring, step), point(ring, step + 1));
            let (c, d) = (point(ring + 1, step + 1), point(ring + 1, step));
            if ring > 0 {
                triangles.push(Triangle { a, b, c });
            }
            if ring + 1 < rings {
                triangles.push(Triangle { a, b: c, c: d });
            }
        }
    }
    triangles
}

/// Scenes that break builders and traversals, with names.
pub fn nasty_scenes() -> Vec<(&'static str, Vec<Triangle>)> {
    let one = soup(1, 0.5, 1);
    let mut outlier = soup(150, 0.1, 2);
    outlier.extend(soup(1, 1.0, 3).iter().map(|t| scaled(t, 1e9)));
    let line = |i: usize| Vec3::new(i as f32, 0.0, 0.0);
    let mut boxes = grid(6, 0, 0.0);
    for (axis, height) in [(0, 6.0), (1, 0.0), (1, 6.0), (2, 0.0), (2, 3.0)] {
        boxes.extend(grid(6, axis, height));
    }
    let slivers = soup(150, 1.0, 4).iter().map(|t| Triangle { c: t.b + (t.c - t.b) * 1e-6, ..*t }).collect();
    vec![
        ("one triangle", one.clone()),
        ("two triangles", soup(2, 0.5, 5)),
        ("small triangles", soup(300, 0.1, 6)),
        ("large triangles", soup(200, 1.5, 7)),
        ("identical triangles", vec![one[0]; 130]),
        ("flat grid", grid(9, 1, 0.0)),
        ("room of grids", boxes),
        ("collinear corners", (0..60).map(|i| Triangle { a: line(i), b: line(i + 1), c: line(i + 3) }).collect()),
        ("points", (0..60).map(|i| Triangle { a: line(i), b: line(i), c: line(i) }).collect()),
        ("slivers", slivers),
        ("huge outlier", outlier),
        ("tiny coordinates", soup(200, 0.3, 8).iter().map(|t| scaled(t, 1e-18)).collect()),
        ("denormal coordinates", soup(100, 0.3, 9).iter().map(|t| scaled(t, 1e-40)).collect()),
        ("huge coordinates", soup(200, 0.3, 10).iter().map(|t| scaled(t, 1e17)).collect()),
        ("far from the origin", ball(Vec3::new(4000.0, -3000.0, 5000.0), 1.0, 8)),
        ("closed ball", ball(Vec3::ZERO, 1.0, 10)),
        ("sticks", sticks(120, 11)),
    ]
}

fn scaled(triangle: &Triangle, factor: f32) -> Triangle {
    Triangle { a: triangle.a * factor, b: triangle.b * factor, c: triangle.c * factor }
}

/// Rays at and through `triangles`: from around, from inside, along axes through corners, with limits, and broken ones.
pub fn rays(triangles: &[Triangle], count: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random(seed);
    let bounds = triangles.iter().fold(bvhscope_engine::geometry::Aabb::EMPTY, |all, t| all.union(&t.bounds()));
    let size = bounds.extent().max_element();
    let center = bounds.center();
    let mut rays = Vec::new();
    for i in 0..count {
        let target = &triangles[random.below(triangles.len())];
        let weights = random.vector().abs() + 1e-6;
        let weights = weights / weights.element_sum();
        let inside = target.a * weights.x + target.b * weights.y + target.c * weights.z;
        let outside = center + random.vector().normalize_or(Vec3::X) * size * 2.0;
        let axis = Vec3::AXES[random.below(3)] * if random.next() & 1 == 0 { 1.0 } else { -1.0 };
        let ray = match i % 8 {
            0 | 1 => Ray::new(outside, (inside - outside).normalize_or(Vec3::X)),
            2 => Ray::new(center, random.vector().normalize_or(Vec3::Y)),
            3 => Ray::new(inside - axis * size * 2.0, axis),
            // Through a corner, in the planes of the boxes.
            4 => Ray::new(target.a - axis * size * 2.0, axis),
            // Through the middle of an edge.
            5 => {
                let middle = (target.a + target.b) * 0.5;
                Ray::new(outside, (middle - outside).normalize_or(Vec3::X))
            }
            6 => {
                let ray = Ray::new(outside, (inside - outside).normalize_or(Vec3::X));
                Ray { t_min: size * 1.5, t_max: size * 2.5, ..ray }
            }
            _ => Ray::new(target.a, (target.b - target.a).normalize_or(axis)),
        };
        rays.push(ray);
    }
    let broken = [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::new(1.0, f32::NAN, 0.0), Vec3::splat(1e-30)];
    rays.extend(broken.map(|direction| Ray::new(center, direction)));
    rays.push(Ray::new(Vec3::NAN, Vec3::X));
    rays.push(Ray::new(Vec3::INFINITY, Vec3::NEG_X));
    rays.push(Ray { t_min: 2.0, t_max: 1.0, ..Ray::new(center, Vec3::X) });
    rays.push(Ray { t_min: f32::NAN, ..Ray::new(center, Vec3::X) });
    rays.push(Ray { t_max: f32::NAN, ..Ray::new(center, Vec3::X) });
    rays
}

/// The nearest hit by the engine's own test of every triangle, which trees must find to the last bit; equal distances go to the
/// lower index. The oracle judges it.
pub fn scan(triangles: &[Triangle], ray: &Ray) -> Option<Hit> {
    let (prepared, shear) = (PreparedRay::new(*ray), Shear::new(ray.direction));
    let mut nearest: Option<Hit> = None;
    for (index, triangle) in triangles.iter().enumerate() {
        if let Some(hit) = triangle.intersect(&prepared, &shear, prepared.ray.t_max)
            && nearest.is_none_or(|nearest| hit.t < nearest.t)
        {
            nearest = Some(Hit { t: hit.t, primitive_index: index as u32, u: hit.u, v: hit.v });
        }
    }
    oracle::check(triangles, ray, nearest.as_ref());
    nearest
}
