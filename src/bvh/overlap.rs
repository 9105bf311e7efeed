//! End-point overlap: how much of the scene's surface lies in nodes that do not hold it.

use rayon::prelude::*;

use super::lists::listed;
use super::stats::{INTERSECTION_COST, TRAVERSAL_COST};
use super::{AnyTree, Container, Tree};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Sphere, Triangle};
use crate::with_tree;

/// Triangles between two looks at the token.
const BATCH: usize = 1 << 14;

/// End-point overlap (Aila, Karras, Laine: *On Quality Metrics of Bounding Volume Hierarchies*, HPG 2013, section 4): the
/// cost of the surface of the scene that lies inside nodes that do not hold it, over the total surface. An interior node
/// costs [`TRAVERSAL_COST`], a leaf [`INTERSECTION_COST`] for each primitive.
///
/// Exact for up to `max_samples` triangles. Beyond, estimated from that many triangles, evenly spread over the total
/// surface. 0 for a tree without overlap and for a scene without surface. Nothing once `token` is cancelled.
pub fn end_point_overlap(
    tree: &AnyTree,
    triangles: &[Triangle],
    max_samples: usize,
    token: &CancelToken,
) -> Result<f32, Cancelled> {
    with_tree!(tree, tree => overlap_of(tree, triangles, max_samples, token))
}

/// A sampled triangle: its slot in leaf order and how much of the surface it stands for.
struct Sample {
    slot: u32,
    weight: f64,
}

fn overlap_of<C: Clip>(
    tree: &Tree<C>,
    triangles: &[Triangle],
    max_samples: usize,
    token: &CancelToken,
) -> Result<f32, Cancelled> {
    let areas = listed(tree.primitive_indices.len(), token, |slot| {
        f64::from(triangles[tree.primitive_indices[slot] as usize].scaled_normal().length()) * 0.5
    })?;
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
    let leaves = leaf_of_each(tree, &samples, token)?;
    // Collected before they are summed, so that the sum does not depend on the number of threads.
    let parts: Vec<f64> = samples
        .par_iter()
        .zip(&leaves)
        .map(|(sample, &leaf)| {
            token.check()?;
            let slot = sample.slot as usize;
            let mut path = vec![leaf];
            while let Some(&node) = path.last()
                && node != 0
            {
                path.push(parents[node as usize]);
            }
            path.reverse();
            let triangle = &triangles[tree.primitive_indices[slot] as usize];
            Ok(sample.weight * foreign_cost(tree, triangle, &path, token)? / areas[slot])
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

/// The leaf of each sample, given by slot in rising order.
fn leaf_of_each<C: Container>(tree: &Tree<C>, samples: &[Sample], token: &CancelToken) -> Result<Vec<u32>, Cancelled> {
    let mut leaves = vec![0; samples.len()];
    for (index, node) in tree.nodes.iter().enumerate() {
        if index.is_multiple_of(BATCH) {
            token.check()?;
        }
        if node.is_leaf() {
            let begin = samples.partition_point(|sample| sample.slot < node.first);
            let count = samples[begin..].iter().take_while(|sample| sample.slot < node.first + node.count).count();
            leaves[begin..begin + count].fill(index as u32);
        }
    }
    Ok(leaves)
}

/// Σ cost · area of `triangle` inside the node, over the nodes that are not on its `path` from the root.
fn foreign_cost<C: Clip>(
    tree: &Tree<C>,
    triangle: &Triangle,
    path: &[u32],
    token: &CancelToken,
) -> Result<f64, Cancelled> {
    let bounds = triangle.bounds();
    let mut sum = 0.0;
    // The path's siblings are the tops of everything foreign.
    let mut waiting = Vec::new();
    for pair in path.windows(2) {
        let first = tree.nodes[pair[0] as usize].first;
        waiting.push(if pair[1] == first { first + 1 } else { first });
    }
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
