//! The triangles below a node, in parts: those of a large node take too long for one UI frame.

use super::table::NodeTable;
use crate::visibility::TriangleSet;
use bvhscope_engine::with_tree;

impl NodeTable {
    /// Adds the triangles of the nodes `open` and of all below them, at most `nodes` of them; unfinished ones stay in `open`.
    pub fn collect_triangles(&self, open: &mut Vec<u32>, triangles: &mut TriangleSet, nodes: usize) {
        with_tree!(&self.accel.tree, tree => for _ in 0..nodes {
            let Some(node) = open.pop().and_then(|node| tree.nodes.get(node as usize)) else { return };
            tree.primitive_indices[node.slots()].iter().for_each(|&triangle| triangles.insert(triangle));
            open.extend(node.children());
        });
    }
}
