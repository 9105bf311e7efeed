//! What there is to say about one node.

use super::lineage::Lineage;
use super::stats::{INTERSECTION_COST, TRAVERSAL_COST, share};
use super::{Container, ContainerKind, Tree};
use crate::geometry::{Aabb, Sphere};

/// A node in numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeDetails {
    /// Its index.
    pub node: u32,
    /// Box or sphere.
    pub kind: ContainerKind,
    /// The smallest box around its container.
    pub bounds: Aabb,
    /// Its sphere, where the container is one.
    pub sphere: Option<Sphere>,
    /// Steps from the root.
    pub depth: u32,
    /// Whether it holds primitives rather than nodes.
    pub is_leaf: bool,
    /// Primitives below it.
    pub primitive_count: u32,
    /// Surface area of its container in square world units.
    pub surface_area: f32,
    /// Its area over the root's, 0 to 1: the share of the rays through the scene that reach it.
    pub root_area_share: f32,
    /// What it adds to the tree's SAH cost itself, over that cost, 0 to 1.
    pub sah_share: f32,
    /// How much of its area overlaps with its sibling's container, 0 to 1; 0 for the root.
    pub sibling_overlap: f32,
    /// The node above.
    pub parent: Option<u32>,
    /// Its parent's other child.
    pub sibling: Option<u32>,
    /// The nodes below.
    pub children: Option<[u32; 2]>,
}

/// Describes the node of this index; `None` where there is none. `sah_cost` is the whole tree's.
pub fn node_details<C: Container>(
    tree: &Tree<C>,
    lineage: &Lineage,
    sah_cost: f32,
    node_index: u32,
) -> Option<NodeDetails> {
    let node = tree.nodes.get(node_index as usize)?;
    let parent = (node_index != 0).then(|| lineage.parents[node_index as usize]);
    let sibling = parent.map(|parent| {
        let first = tree.nodes[parent as usize].first;
        if node_index == first { first + 1 } else { first }
    });
    let bounds = node.container.bounds();
    let area = f64::from(node.container.relative_area());
    let root_area_share = share(area, f64::from(tree.nodes[0].container.relative_area()));
    let own_cost = if node.is_leaf() { node.count as f32 * INTERSECTION_COST } else { TRAVERSAL_COST };
    let overlap = sibling.map_or(0.0, |sibling| node.container.overlap(&tree.nodes[sibling as usize].container));
    let (sphere, surface_area) = match C::KIND {
        ContainerKind::Aabb => (None, area * 2.0),
        ContainerKind::Sphere => {
            let sphere = Sphere { center: bounds.center(), radius: area.sqrt() as f32 };
            (Some(sphere), area * 4.0 * std::f64::consts::PI)
        }
    };
    Some(NodeDetails {
        node: node_index,
        kind: C::KIND,
        bounds,
        sphere,
        depth: lineage.depth(node_index),
        is_leaf: node.is_leaf(),
        primitive_count: lineage.primitive_counts[node_index as usize],
        surface_area: surface_area as f32,
        root_area_share: root_area_share as f32,
        sah_share: share(root_area_share * f64::from(own_cost), f64::from(sah_cost)) as f32,
        sibling_overlap: share(f64::from(overlap), area).min(1.0) as f32,
        parent,
        sibling,
        children: (!node.is_leaf()).then_some([node.first, node.first + 1]),
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bvh::stats::tree_stats;
    use crate::bvh::{AnyTree, Node};

    #[test]
    fn a_node_knows_its_family_and_its_share_of_the_cost() {
        let cube = |min: f32, max: f32| Aabb { min: Vec3::splat(min), max: Vec3::splat(max) };
        let node = |container, first, count| Node { container, first, count };
        let nodes = vec![node(cube(0.0, 4.0), 1, 0), node(cube(0.0, 2.0), 0, 3), node(cube(1.0, 4.0), 3, 1)];
        let tree = Tree { nodes, primitive_indices: vec![0, 1, 2, 3], max_depth: 1 };
        let lineage = Lineage::new(&tree);
        let cost = tree_stats(&AnyTree::Aabb(tree.clone())).sah_cost;
        let details: Vec<_> = (0..4).map_while(|index| node_details(&tree, &lineage, cost, index)).collect();
        assert_eq!(details.len(), 3, "there is no node 3");
        let shares: f32 = details.iter().map(|details| details.sah_share).sum();
        assert!((shares - 1.0).abs() < 1e-6, "every node's share: {shares}");
        let left = details[1];
        assert_eq!((left.parent, left.sibling, left.children), (Some(0), Some(2), None));
        assert_eq!((left.primitive_count, left.depth, left.is_leaf), (3, 1, true));
        assert_eq!((left.surface_area, left.root_area_share), (24.0, 0.25));
        assert_eq!(left.sibling_overlap, 0.25, "a cube of 1 in a cube of 2");
        assert_eq!((details[0].parent, details[0].sibling, details[0].children), (None, None, Some([1, 2])));
        assert_eq!(details[0].sibling_overlap, 0.0);
    }
}
