//! The point of a mesh that is nearest to another.

use glam::{DVec3, Vec3};

use crate::geometry::{Feature, Triangle, TrianglePoint, reach};
use crate::tree::traverse::{LeafTriangles, Probe};
use crate::tree::{Container, Node, Tree};

/// The point of a mesh that is nearest to a given point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosestPoint {
    /// The point of the mesh.
    pub point: DVec3,
    /// Its distance, in world units.
    pub distance: f64,
    /// Index of its triangle in the list that the tree was built from; the lowest of those at the same distance.
    pub primitive_index: u32,
    /// Barycentric weight of the triangle's second corner.
    pub u: f64,
    /// Barycentric weight of the triangle's third corner.
    pub v: f64,
    /// The part of the triangle that it lies on.
    pub feature: Feature,
}

/// The nearest point that a traversal has found so far.
pub(crate) struct NearestPoint {
    point: Vec3,
    nearest: Option<(TrianglePoint, u32)>,
    /// The triangle of `nearest`.
    triangle: Triangle,
    /// Square of the distance up to which points are accepted.
    distance_squared: f64,
    reach: f32,
}

impl NearestPoint {
    /// None yet within `radius` of `point`. No point is near to one that is not finite, or within a radius that is negative or NaN.
    pub(crate) fn new(point: Vec3, radius: f32) -> Option<Self> {
        let distance_squared = f64::from(radius) * f64::from(radius);
        let is_usable = point.is_finite() && radius >= 0.0;
        is_usable.then(|| Self {
            point,
            nearest: None,
            triangle: Triangle { a: Vec3::ZERO, b: Vec3::ZERO, c: Vec3::ZERO },
            distance_squared,
            reach: reach(distance_squared),
        })
    }

    /// The point that is asked about.
    pub(crate) fn point(&self) -> Vec3 {
        self.point
    }

    /// The largest [`Container::distance_squared`] of containers that may hold a nearer point.
    #[inline(always)]
    pub(crate) fn reach(&self) -> f32 {
        self.reach
    }

    /// Takes the nearest point of a triangle if none is nearer; equal distances go to the lower index.
    pub(crate) fn offer(&mut self, triangle: &Triangle, primitive_index: u32) {
        let found = triangle.nearest_point(self.point);
        let is_nearer = match self.nearest {
            None => found.distance_squared <= self.distance_squared,
            Some((nearest, index)) => {
                found.distance_squared < nearest.distance_squared
                    || found.distance_squared == nearest.distance_squared && primitive_index < index
            }
        };
        if is_nearer {
            self.nearest = Some((found, primitive_index));
            self.triangle = *triangle;
            self.distance_squared = found.distance_squared;
            self.reach = reach(found.distance_squared);
        }
    }

    /// The triangle of the nearest point with its index, if any.
    pub(crate) fn triangle(&self) -> Option<(Triangle, u32)> {
        self.nearest.map(|(_, primitive_index)| (self.triangle, primitive_index))
    }

    /// The nearest point, if any.
    pub(crate) fn found(&self) -> Option<ClosestPoint> {
        let (TrianglePoint { point, distance_squared, u, v, feature }, primitive_index) = self.nearest?;
        Some(ClosestPoint { point, distance: distance_squared.sqrt(), primitive_index, u, v, feature })
    }
}

/// The point of the triangles of `tree` that is nearest to `point`; `None` where none lies within `radius`, in world units, which may be
/// infinite. Nearer children are visited first, and what is farther than the nearest point so far is skipped. `tree` may have any arity.
pub fn closest_point<C: Container, P: Probe>(
    tree: &Tree<C>,
    leaf_triangles: impl LeafTriangles,
    point: Vec3,
    radius: f32,
    probe: &mut P,
) -> Option<ClosestPoint> {
    let mut nearest = NearestPoint::new(point, radius)?;
    let distance_squared = |container: &C| container.distance_squared(point);
    each_near_leaf(tree, distance_squared, &mut nearest, probe, &mut |leaf, nearest, probe| {
        let indices = &tree.primitive_indices[leaf.slots()];
        for (triangle, primitive_index) in leaf_triangles.in_slots(leaf.slots()).zip(indices) {
            probe.primitive_test();
            nearest.offer(triangle, *primitive_index);
        }
    });
    nearest.found()
}

/// Calls `visit` with each leaf of `tree` that may have a nearer point than the `nearest` so far, nearer leaves first. `distance_squared`
/// is that of a container, as [`Container::distance_squared`] is.
pub(crate) fn each_near_leaf<C: Container, P: Probe>(
    tree: &Tree<C>,
    distance_squared: impl Fn(&C) -> f32,
    nearest: &mut NearestPoint,
    probe: &mut P,
    visit: &mut impl FnMut(&Node<C>, &mut NearestPoint, &mut P),
) {
    let (mut stack, mut near) = (vec![(0.0, 0)], Vec::new());
    while let Some((distance, index)) = stack.pop() {
        let Some(node) = tree.nodes.get(index as usize).filter(|_| distance <= nearest.reach()) else { continue };
        probe.visited(index);
        if node.is_leaf() {
            visit(node, nearest, probe);
            continue;
        }
        for child in node.children() {
            probe.container_test();
            let distance = distance_squared(&tree.nodes[child as usize].container);
            if distance <= nearest.reach() {
                near.push((distance, child));
            }
        }
        // The nearest on top of the stack.
        near.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        stack.append(&mut near);
    }
}
