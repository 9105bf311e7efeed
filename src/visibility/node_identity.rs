//! Which node of another tree of the same scene holds the same triangles.

use crate::accel::Accel;
use bvhscope_engine::tree::Tree;
use bvhscope_engine::with_tree;

/// A node by the triangles below it, which identify it in every tree of the same scene. In a tree of split triangles a leaf
/// that shares its triangles with another may be taken for that one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NodeIdentity {
    contents: Contents,
    /// The smallest index of a triangle below the node.
    smallest: u32,
}

impl NodeIdentity {
    /// The identity of `node`; `None` for indices beyond the tree. Takes a pass over its subtree.
    pub fn of(accel: &Accel, node: u32) -> Option<Self> {
        with_tree!(&accel.tree, tree => {
            let (mut contents, mut smallest) = (Contents::default(), u32::MAX);
            for_each_primitive(tree, node, |primitive| {
                contents.add(primitive);
                smallest = smallest.min(primitive);
            });
            (contents.count > 0).then_some(Self { contents, smallest })
        })
    }

    /// The node of `accel` that holds exactly the same triangles; `None` where there is none. Takes a pass over a subtree of at
    /// most twice as many triangles, or over the whole tree.
    pub fn find(&self, accel: &Accel) -> Option<u32> {
        if self.smallest as usize >= accel.scene.triangles.len() {
            return None;
        }
        let path = accel.path_to(self.smallest);
        with_tree!(&accel.tree, tree => find_on_path(tree, &path, self.contents))
    }
}

/// Number of primitives, and a hash of their indices that does not depend on their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Contents {
    count: u32,
    hash: u64,
}

impl Contents {
    fn add(&mut self, primitive: u32) {
        self.count += 1;
        self.hash = self.hash.wrapping_add(scramble(u64::from(primitive)));
    }
}

/// The output function of SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014), so that sums of
/// different sets of indices differ.
const fn scramble(index: u64) -> u64 {
    let z = index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Calls `visit` with each primitive below `node`.
fn for_each_primitive<C>(tree: &Tree<C>, node: u32, mut visit: impl FnMut(u32)) {
    let mut open = vec![node];
    while let Some(node) = open.pop().and_then(|node| tree.nodes.get(node as usize)) {
        tree.primitive_indices[node.slots()].iter().for_each(|&primitive| visit(primitive));
        open.extend(node.children());
    }
}

/// The node of `path`, which ends at a leaf, that has these contents. Goes up from the leaf and stops where a node has more.
fn find_on_path<C>(tree: &Tree<C>, path: &[u32], wanted: Contents) -> Option<u32> {
    let mut contents = Contents::default();
    let mut below = None;
    for &node in path.iter().rev() {
        // The node's contents are those of its child on the path and of that child's siblings.
        if let Some(below) = below {
            let siblings = tree.nodes[node as usize].children().filter(|&child| child != below);
            siblings.for_each(|child| for_each_primitive(tree, child, |primitive| contents.add(primitive)));
        } else {
            for_each_primitive(tree, node, |primitive| contents.add(primitive));
        }
        if contents.count >= wanted.count {
            return (contents == wanted).then_some(node);
        }
        below = Some(node);
    }
    None
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, SceneSource, load};
    use bvhscope_engine::cancel::CancelToken;
    use bvhscope_engine::settings::{BuildSettings, BuilderKind};
    use bvhscope_engine::tree::ContainerKind;
    use std::collections::BTreeSet;
    use std::sync::Arc;

    fn primitives(accel: &Accel, node: u32) -> BTreeSet<u32> {
        let mut set = BTreeSet::new();
        with_tree!(&accel.tree, tree => for_each_primitive(tree, node, |primitive| assert!(set.insert(primitive))));
        set
    }

    /// Compared with sets of triangles for every node.
    #[test]
    fn nodes_are_found_exactly_where_another_tree_has_them() {
        let token = CancelToken::new();
        let source = SceneSource::Builtin { name: "teapot".to_owned(), size: Some(2) };
        let scene = Arc::new(load(&source, &LoadOptions::default(), &token).unwrap());
        let build = |settings: &BuildSettings| Accel::build(&scene, settings, &token).unwrap();
        let aac = build(&BuildSettings::default());
        let others = [
            BuildSettings { container: ContainerKind::Sphere, ..BuildSettings::default() },
            BuildSettings { threshold: 4, ..BuildSettings::default() },
            BuildSettings { builder: BuilderKind::BinnedSah, ..BuildSettings::default() },
        ];
        for settings in others {
            let other = build(&settings);
            let sets: Vec<_> = (0..other.tree.node_count() as u32).map(|node| primitives(&other, node)).collect();
            let mut found = 0;
            for node in 0..aac.tree.node_count() as u32 {
                let own = primitives(&aac, node);
                let expected = sets.iter().position(|set| *set == own).map(|node| node as u32);
                assert_eq!(NodeIdentity::of(&aac, node).unwrap().find(&other), expected, "node {node}, {settings:?}");
                found += usize::from(expected.is_some());
            }
            assert!(found > 1 && found < aac.tree.node_count(), "{found} of {}", aac.tree.node_count());
        }
        assert_eq!(NodeIdentity::of(&aac, u32::MAX), None);
    }
}
