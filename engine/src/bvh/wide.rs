//! The wide tree with the best instructions of this machine.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use fearless_simd::Level;
use glam::Vec3;

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Hit, Ray, Triangle};
use crate::query::{ClosestPoint, HitLists};
use crate::tree::AnyTree;
use crate::wide::{AnyWideTree, NodeForm};

/// The wide tree of a [`Bvh`](super::Bvh), traced with the best SIMD level of this machine. [`AnyWideTree`] offers the others.
#[derive(Debug, Clone)]
pub struct WideBvh {
    /// Nodes and leaves.
    pub tree: AnyWideTree,
    /// Wall-clock time of the collapse; not part of [`BuildReport::build_time`](super::BuildReport::build_time), which is the paper's.
    pub collapse_time: Duration,
    triangle_count: usize,
}

/// Directions of rays that decide whether a point lies inside, along no axis or diagonal of a model.
const DIRECTIONS: [Vec3; 7] = [
    Vec3::new(0.433_9, 0.310_7, 0.845_7),
    Vec3::new(-0.271_3, 0.913_1, 0.304_9),
    Vec3::new(0.842_3, -0.397_9, 0.363_7),
    Vec3::new(-0.513_7, -0.620_3, 0.592_7),
    Vec3::new(0.117_1, 0.541_9, -0.832_3),
    Vec3::new(-0.793_9, 0.242_3, -0.557_9),
    Vec3::new(0.359_3, -0.763_1, -0.537_7),
];

/// Barycentric weight below which a ray may meet an edge: several times the rounding of single precision.
const EDGE_WEIGHT: f32 = 1e-5;

fn is_near_edge(hit: &Hit) -> bool {
    hit.u.min(hit.v).min(1.0 - hit.u - hit.v) < EDGE_WEIGHT
}

impl WideBvh {
    /// Collapses `tree` over `triangles` into a wide one, in the calling thread's rayon pool, with nodes of the form that suits their
    /// number; see [`AnyWideTree::new`].
    pub fn new(tree: &AnyTree, triangles: &[Triangle], token: &CancelToken) -> Result<Self, Cancelled> {
        token.begin_stage("wide");
        let start = Instant::now();
        let tree = AnyWideTree::new(tree, triangles, NodeForm::for_triangles(triangles.len()), token)?;
        Ok(Self { tree, collapse_time: start.elapsed(), triangle_count: triangles.len() })
    }

    /// The nearest hit of `ray`; see [`Bvh::closest_hit`](super::Bvh::closest_hit).
    #[inline]
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.tree.closest_hit(Level::new(), ray)
    }

    /// The nearest hits of `rays`; see [`Bvh::closest_hits`](super::Bvh::closest_hits).
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.tree.closest_hits(Level::new(), rays, hits);
    }

    /// Whether anything lies on `ray`; see [`Bvh::any_hit`](super::Bvh::any_hit).
    #[inline]
    pub fn any_hit(&self, ray: &Ray) -> bool {
        self.tree.any_hit(Level::new(), ray)
    }

    /// Whether anything lies on each of `rays`; see [`Bvh::any_hits`](super::Bvh::any_hits).
    pub fn any_hits(&self, rays: &[Ray], blocked: &mut [bool]) {
        self.tree.any_hits(Level::new(), rays, blocked);
    }

    /// The hits of `ray` in order; see [`Bvh::all_hits`](super::Bvh::all_hits).
    pub fn all_hits(&self, ray: &Ray, max: usize, hits: &mut Vec<Hit>) -> bool {
        self.tree.all_hits(Level::new(), ray, max, hits)
    }

    /// The hits of each of `rays` in order; see [`Bvh::hit_lists`](super::Bvh::hit_lists).
    pub fn hit_lists(&self, rays: &[Ray], max: usize, lists: &mut HitLists) {
        self.tree.hit_lists(Level::new(), rays, max, lists);
    }

    /// Visits the hits of `ray` in order; see [`Bvh::visit_hits`](super::Bvh::visit_hits).
    pub fn visit_hits(&self, ray: &Ray, mut visit: impl FnMut(&Hit) -> ControlFlow<()>) {
        let (mut hits, mut visited) = (Vec::new(), 0);
        // Few at first: most visitors stop soon. The first ones are found again by the next traversal, of eight times as many.
        for max in (1..).map(|step| 8_usize.saturating_pow(step)) {
            let has_more = self.all_hits(ray, max, &mut hits);
            if hits[visited..].iter().any(|hit| visit(hit).is_break()) || !has_more {
                return;
            }
            visited = hits.len();
        }
    }

    /// Visits the items whose boxes `ray` meets, of a tree over stand-ins; see [`ItemBvh::visit`](super::ItemBvh::visit).
    pub(crate) fn visit_items(&self, ray: &Ray, mut visit: impl FnMut(u32, f32) -> ControlFlow<(), f32>) {
        self.tree.visit_items(Level::new(), ray, &mut visit);
    }

    /// Number of the hits of `ray`.
    pub fn count_hits(&self, ray: &Ray) -> usize {
        let mut hits = Vec::new();
        self.all_hits(ray, usize::MAX, &mut hits);
        hits.len()
    }

    /// The point of the triangles that is nearest to `point`; see [`Bvh::closest_point`](super::Bvh::closest_point).
    pub fn closest_point(&self, point: Vec3, radius: f32) -> Option<ClosestPoint> {
        self.tree.closest_point(Level::new(), point, radius)
    }

    /// The points of the triangles that are nearest to `points`; see [`Bvh::closest_points`](super::Bvh::closest_points).
    pub fn closest_points(&self, points: &[Vec3], radius: f32, found: &mut [Option<ClosestPoint>]) {
        self.tree.closest_points(Level::new(), points, radius, found);
    }

    /// Whether `point` lies inside; see [`Bvh::contains`](super::Bvh::contains).
    pub fn contains(&self, point: Vec3) -> bool {
        let mut hits = Vec::new();
        let is_odd = |direction: Vec3, hits: &mut Vec<Hit>| {
            self.all_hits(&Ray::new(point, direction), usize::MAX, hits);
            hits.len() % 2 == 1
        };
        // A ray that meets an edge hits the triangles on both sides of it, whether it crosses the surface there or not: another direction
        // decides. Where all are in doubt, most of them.
        let mut inside = 0;
        for direction in DIRECTIONS {
            let is_inside = is_odd(direction, &mut hits);
            if !hits.iter().any(is_near_edge) {
                return is_inside;
            }
            inside += usize::from(is_inside);
        }
        2 * inside > DIRECTIONS.len()
    }

    /// Distance of `point` to the mesh, negative inside; see [`Bvh::signed_distance`](super::Bvh::signed_distance).
    pub fn signed_distance(&self, point: Vec3) -> Option<f64> {
        let distance = self.closest_point(point, f32::INFINITY)?.distance;
        Some(if self.contains(point) { -distance } else { distance })
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangle_count
    }

    /// Bytes of nodes and leaves for each triangle.
    pub fn bytes_per_triangle(&self) -> f64 {
        (self.tree.node_bytes() + self.tree.leaf_bytes()) as f64 / self.triangle_count.max(1) as f64
    }
}
