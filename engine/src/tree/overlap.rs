//! End-point overlap: how much of the scene's surface lies in nodes that do not hold it.

use rayon::prelude::*;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Sphere, Triangle};
use crate::kernel::par_collect::par_collect;
use crate::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST};
use crate::tree::{AnyTree, Container, Tree};
use crate::with_tree;

/// Triangles between two looks at the token.
const BATCH: usize = 1 << 14;

/// End-point overlap (Aila, Karras, Laine: *On Quality Metrics of Bounding Volume Hierarchies*, HPG 2013, section 4): the
/// cost of the surface of the scene that lies inside nodes that do not hold it, over the total surface. An interior node
/// costs [`TRAVERSAL_COST`], a leaf [`INTERSECTION_COST`] for each primitive.
///
/// Exact for up to `max_samples` triangles. Beyond, estimated from that many triangles, evenly spread over the total
/// surface. A triangle that several leaves hold is one, which all of them and the nodes above them hold. 0 for a tree without
/// overlap and for a scene without surface. Nothing once `token` is cancelled.
pub fn end_point_overlap(
    tree: &AnyTree,
    triangles: &[Triangle],
    max_samples: usize,
    token: &CancelToken,
) -> Result<f32, Cancelled> {
    with_tree!(tree, tree => overlap_of(tree, triangles, max_samples, token))
}

/// A sampled triangle: its first slot in leaf order and how much of the surface it stands for.
struct Sample {
    slot: u32,
    weight: f64,
}

/// A slot in leaf order that holds the triangle of a sample, given by number.
struct Place {
    slot: u32,
    sample: u32,
}

fn overlap_of<C: Clip>(
    tree: &Tree<C>,
    triangles: &[Triangle],
    max_samples: usize,
    token: &CancelToken,
) -> Result<f32, Cancelled> {
    let mut areas = par_collect(tree.primitive_indices.len(), token, |slot| {
        f64::from(triangles[tree.primitive_indices[slot] as usize].scaled_normal().length()) * 0.5
    })?;
    let repeats = tree.primitive_indices.len() > triangles.len();
    if repeats {
        // Only the first slot of each has one.
        let mut seen = vec![false; triangles.len()];
        for (areas, indices) in areas.chunks_mut(BATCH).zip(tree.primitive_indices.chunks(BATCH)) {
            token.check()?;
            for (area, &index) in areas.iter_mut().zip(indices) {
                if std::mem::replace(&mut seen[index as usize], true) {
                    *area = 0.0;
                }
            }
        }
    }
    let mut total = 0.0;
    for batch in areas.chunks(BATCH) {
        token.check()?;
        total = batch.iter().fold(total, |sum, area| sum + area);
    }
    if tree.nodes.is_empty() || tree.nodes[0].is_leaf() || !(total > 0.0 && total.is_finite()) {
        return Ok(0.0);
    }
    let samples = choose_samples(&areas, total, max_samples.max(1), token)?;
    let parents = tree.parents(token)?;
    let places = if repeats { places_of(tree, triangles.len(), &samples, token)? } else { first_places(&samples) };
    let leaves = leaf_of_each(tree, &places, token)?;
    let mut homes: Vec<(u32, u32)> = places.iter().zip(leaves).map(|(place, leaf)| (place.sample, leaf)).collect();
    homes.sort_unstable();
    // Collected before they are summed, so that the sum does not depend on the number of threads.
    let parts: Vec<f64> = samples
        .par_iter()
        .zip(0..samples.len() as u32)
        .map(|(sample, number)| {
            token.check()?;
            let homes = &homes[homes.partition_point(|home| home.0 < number)..];
            let mut own = Vec::new();
            for &(_, leaf) in homes.iter().take_while(|home| home.0 == number) {
                own.extend(std::iter::successors(Some(leaf), |&node| (node != 0).then(|| parents[node as usize])));
            }
            own.sort_unstable();
            own.dedup();
            let slot = sample.slot as usize;
            let triangle = &triangles[tree.primitive_indices[slot] as usize];
            Ok(sample.weight * foreign_cost(tree, triangle, &own, token)? / areas[slot])
        })
        .collect::<Result<_, Cancelled>>()?;
    let overlap = (parts.iter().sum::<f64>() / total) as f32;
    Ok(if overlap.is_finite() { overlap } else { 0.0 })
}

/// Every triangle that has an area, or `max_samples` steps of equal area through all of them.
fn choose_samples(
    areas: &[f64],
    total: f64,
    max_samples: usize,
    token: &CancelToken,
) -> Result<Vec<Sample>, Cancelled> {
    if areas.len() <= max_samples {
        let with_area = areas.iter().enumerate().filter(|(_, area)| **area > 0.0);
        return Ok(with_area.map(|(slot, &area)| Sample { slot: slot as u32, weight: area }).collect());
    }
    let step = total / max_samples as f64;
    let mut samples = Vec::with_capacity(max_samples);
    let mut passed = 0.0;
    let mut next = step * 0.5;
    for (slot, &area) in areas.iter().enumerate() {
        if slot.is_multiple_of(BATCH) {
            token.check()?;
        }
        passed += area;
        if passed > next {
            let steps = ((passed - next) / step).floor() + 1.0;
            samples.push(Sample { slot: slot as u32, weight: steps * step });
            next += steps * step;
        }
    }
    Ok(samples)
}

/// Where the samples' triangles are if each has one slot alone.
fn first_places(samples: &[Sample]) -> Vec<Place> {
    samples.iter().zip(0..).map(|(sample, number)| Place { slot: sample.slot, sample: number }).collect()
}

/// All slots of the samples' triangles, which are some of `triangles`.
fn places_of<C: Container>(
    tree: &Tree<C>,
    triangles: usize,
    samples: &[Sample],
    token: &CancelToken,
) -> Result<Vec<Place>, Cancelled> {
    const NO_SAMPLE: u32 = u32::MAX;
    let mut sample_of = vec![NO_SAMPLE; triangles];
    for (sample, number) in samples.iter().zip(0..) {
        sample_of[tree.primitive_indices[sample.slot as usize] as usize] = number;
    }
    let mut places = Vec::with_capacity(samples.len());
    for (batch, indices) in tree.primitive_indices.chunks(BATCH).enumerate() {
        token.check()?;
        for (&index, slot) in indices.iter().zip((batch * BATCH) as u32..) {
            let sample = sample_of[index as usize];
            if sample != NO_SAMPLE {
                places.push(Place { slot, sample });
            }
        }
    }
    Ok(places)
}

/// The leaf of each place, given by slot in rising order.
fn leaf_of_each<C: Container>(tree: &Tree<C>, places: &[Place], token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
    let mut leaves = vec![0; places.len()];
    for (index, node) in tree.nodes.iter().enumerate() {
        if index.is_multiple_of(BATCH) {
            token.check()?;
        }
        if node.is_leaf() {
            let begin = places.partition_point(|place| place.slot < node.first);
            let count = places[begin..].iter().take_while(|place| place.slot < node.first + node.count).count();
            leaves[begin..begin + count].fill(index as u32);
        }
    }
    Ok(leaves)
}

/// Σ cost · area of `triangle` inside the node, over the nodes that are not its `own`, in rising order.
fn foreign_cost<C: Clip>(
    tree: &Tree<C>,
    triangle: &Triangle,
    own: &[u32],
    token: &CancelToken,
) -> Result<f64, Cancelled> {
    let bounds = triangle.bounds();
    let mut sum = 0.0;
    // What is not its own, but below what is, are the tops of everything foreign.
    let interior = own.iter().map(|&node| &tree.nodes[node as usize]).filter(|node| !node.is_leaf());
    let children = interior.flat_map(|node| [node.first, node.first + 1]);
    let mut waiting: Vec<u32> = children.filter(|child| own.binary_search(child).is_err()).collect();
    // Where all triangles lie on one another, these are all nodes.
    let mut visited = 0_usize;
    while let Some(index) = waiting.pop() {
        visited += 1;
        if visited.is_multiple_of(BATCH) {
            token.check()?;
        }
        let node = &tree.nodes[index as usize];
        let area = node.container.clipped_area(triangle, &bounds);
        if area <= 0.0 {
            continue;
        }
        if node.is_leaf() {
            sum += area * f64::from(INTERSECTION_COST) * f64::from(node.count);
        } else {
            sum += area * f64::from(TRAVERSAL_COST);
            waiting.extend([node.first, node.first + 1]);
        }
    }
    Ok(sum)
}

/// A container that can say how much of a triangle lies inside it.
trait Clip: Container {
    /// Area of the part of `triangle`, whose box is `bounds`, inside.
    fn clipped_area(&self, triangle: &Triangle, bounds: &Aabb) -> f64;
}

impl Clip for Aabb {
    /// Exact: Sutherland and Hodgman's clipping against each face, 1974.
    fn clipped_area(&self, triangle: &Triangle, bounds: &Aabb) -> f64 {
        if self.intersection(bounds).is_empty() {
            return 0.0;
        }
        if Aabb::contains(self, bounds, 0.0) {
            return f64::from(triangle.scaled_normal().length()) * 0.5;
        }
        let corners = [triangle.a, triangle.b, triangle.c].map(glam::Vec3::as_dvec3);
        let (min, max) = (self.min.as_dvec3(), self.max.as_dvec3());
        // Each of the six planes adds at most one corner to a convex polygon.
        let mut polygon = [glam::DVec3::ZERO; 9];
        polygon[..3].copy_from_slice(&corners);
        let mut count = 3;
        for axis in 0..3 {
            for (plane, sign) in [(min[axis], 1.0), (max[axis], -1.0)] {
                let mut clipped = [glam::DVec3::ZERO; 9];
                let mut clipped_count = 0;
                for i in 0..count {
                    let (from, to) = (polygon[i], polygon[(i + 1) % count]);
                    let (inside_from, inside_to) = ((from[axis] - plane) * sign, (to[axis] - plane) * sign);
                    if inside_from >= 0.0 && clipped_count < 9 {
                        clipped[clipped_count] = from;
                        clipped_count += 1;
                    }
                    if inside_from * inside_to < 0.0 && clipped_count < 9 {
                        clipped[clipped_count] = from + (to - from) * (inside_from / (inside_from - inside_to));
                        clipped_count += 1;
                    }
                }
                (polygon, count) = (clipped, clipped_count);
                if count < 3 {
                    return 0.0;
                }
            }
        }
        let fan = (1..count - 1).map(|i| (polygon[i] - polygon[0]).cross(polygon[i + 1] - polygon[0]));
        fan.sum::<glam::DVec3>().length() * 0.5
    }
}

impl Clip for Sphere {
    /// Exact: the sphere cuts the triangle's plane in a disc; the area that a triangle and a disc share is a sum over the
    /// edges.
    fn clipped_area(&self, triangle: &Triangle, bounds: &Aabb) -> f64 {
        let center = self.center.as_dvec3();
        let radius = f64::from(self.radius);
        let nearest = center.clamp(bounds.min.as_dvec3(), bounds.max.as_dvec3());
        if radius <= 0.0 || nearest.distance_squared(center) >= radius * radius {
            return 0.0;
        }
        let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(glam::Vec3::as_dvec3);
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { return 0.0 };
        let height = (center - a).dot(normal);
        let disc_squared = radius * radius - height * height;
        if disc_squared <= 0.0 {
            return 0.0;
        }
        let x_axis = (b - a).normalize();
        let y_axis = normal.cross(x_axis);
        let [a, b, c] = [a, b, c].map(|corner| {
            let offset = corner - center;
            glam::DVec2::new(offset.dot(x_axis), offset.dot(y_axis))
        });
        let area = edge_area(a, b, disc_squared) + edge_area(b, c, disc_squared) + edge_area(c, a, disc_squared);
        area.max(0.0)
    }
}

/// Signed area that the triangle from the disc's middle to the edge `p`–`q` shares with the disc.
fn edge_area(p: glam::DVec2, q: glam::DVec2, radius_squared: f64) -> f64 {
    // Angle between two directions, signed.
    let sector = |from: glam::DVec2, to: glam::DVec2| 0.5 * radius_squared * from.perp_dot(to).atan2(from.dot(to));
    let edge = q - p;
    let (aa, half_b, cc) = (edge.length_squared(), p.dot(edge), p.length_squared() - radius_squared);
    let discriminant = half_b * half_b - aa * cc;
    if aa == 0.0 || discriminant <= 0.0 {
        return sector(p, q);
    }
    // Where the edge's line enters and leaves the disc, cut to the edge.
    let root = discriminant.sqrt();
    let (enter, leave) = (((-half_b - root) / aa).max(0.0), ((-half_b + root) / aa).min(1.0));
    if enter >= leave {
        return sector(p, q);
    }
    let (inside_from, inside_to) = (p + edge * enter, p + edge * leave);
    sector(p, inside_from) + 0.5 * inside_from.perp_dot(inside_to) + sector(inside_to, q)
}
