//! The volume that the children of a node have in common, as it is drawn.

use glam::DVec3;

use super::table::NodeTable;
use crate::overlay::node::{OverlayNode, Role};
use crate::overlay::settings::OverlaySettings;
use bvhscope_engine::geometry::{Aabb, Dop14, Sphere};
use bvhscope_engine::tree::AnyTree;
use bvhscope_engine::tree::node_metrics::{intersections_of_children, pairs_of_children};

impl NodeTable {
    /// The common volume of each two of the children of `node`, as instance data of the tree's own kind of container: the box or
    /// polytope itself, of spheres the smallest sphere around it. Of oriented boxes its faces in pieces, each a quadrilateral: a corner,
    /// and the way from there to the other three in place of the edges of a box. None for a leaf and where no two have anything in
    /// common.
    pub fn overlap_instances(&self, node: u32) -> Vec<OverlayNode> {
        if self.is_leaf(node) {
            return Vec::new();
        }
        let whole = OverlaySettings::default().spelt_out(self.container_kind());
        let mut plain = self.instance(node, self.depth(node), &whole);
        plain.flags |= (Role::Overlap as u32) << Role::SHIFT;
        match &self.accel.tree {
            AnyTree::Aabb(tree) => intersections_of_children(tree, node)
                .map(|Aabb { min, max }| OverlayNode { box_min: min.to_array(), box_max: max.to_array(), ..plain })
                .collect(),
            AnyTree::Sphere(tree) => intersections_of_children(tree, node)
                .map(|Sphere { center, radius }| OverlayNode {
                    sphere_center: center.to_array(),
                    sphere_radius: radius,
                    ..plain
                })
                .collect(),
            AnyTree::Oriented(tree) => pairs_of_children(tree, node)
                .flat_map(|(a, b)| a.intersection_faces(b))
                .flat_map(|face| quadrilaterals(&face))
                .map(|[corner, edges @ ..]| OverlayNode { corner, edges, ..plain })
                .collect(),
            AnyTree::Dop14(tree) => intersections_of_children(tree, node)
                .map(|Dop14 { bounds, low, high }| OverlayNode {
                    box_min: bounds.min.to_array(),
                    box_max: bounds.max.to_array(),
                    low,
                    high,
                    ..plain
                })
                .collect(),
        }
    }
}

/// A convex polygon in quadrilaterals around its first corner, the last of which may be a triangle: that corner, and the way from there
/// to the others.
fn quadrilaterals(polygon: &[DVec3]) -> Vec<[[f32; 3]; 4]> {
    let first = polygon[0];
    let way = |at: usize| (polygon[at.min(polygon.len() - 1)] - first).as_vec3().to_array();
    let piece = |at: usize| [first.as_vec3().to_array(), way(at), way(at + 1), way(at + 2)];
    (1..polygon.len() - 1).step_by(2).map(piece).collect()
}
