//! Which node of another tree of the same scene holds the same triangles.

use crate::accel::Accel;
use crate::scene::Scene;
use bvhscope_engine::tree::Tree;
use bvhscope_engine::with_tree;

/// A node by the triangles below it, which identify it in every tree of the same scene, of a scene of copies by the copies, whichever are
/// unfolded. In a tree of split triangles a leaf that shares its triangles with another may be taken for that one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NodeIdentity {
    contents: Contents,
    /// The smallest number of a triangle below the node, as hits name it.
    smallest: u32,
    /// Of a node in the mesh of an unfolded copy.
    is_below: bool,
}

impl NodeIdentity {
    /// The identity of `node`; `None` for indices beyond the tree. Takes a pass over its subtree.
    pub fn of(accel: &Accel, node: u32) -> Option<Self> {
        let (mut contents, mut smallest) = (Contents::default(), u32::MAX);
        let is_below = accel.node_of_mesh(node).is_some();
        with_tree!(&accel.tree, tree => for_each_primitive(tree, node, |primitive| {
            contents.add(part_of(&accel.scene, is_below, primitive));
            smallest = smallest.min(accel.scene.hit_of(primitive));
        }));
        (contents.count > 0).then_some(Self { contents, smallest, is_below })
    }

    /// The node of `accel` that holds exactly the same triangles; `None` where there is none. Takes a pass over a subtree of at
    /// most twice as many triangles, or over the whole tree.
    pub fn find(&self, accel: &Accel) -> Option<u32> {
        if u64::from(self.smallest) >= accel.scene.triangle_count() {
            return None;
        }
        let mut path = accel.path_to(accel.scene.primitive_of(self.smallest));
        path.retain(|&node| accel.node_of_mesh(node).is_some() == self.is_below);
        let part = |primitive| part_of(&accel.scene, self.is_below, primitive);
        with_tree!(&accel.tree, tree => find_on_path(tree, &path, self.contents, part))
    }
}

/// The part that a primitive is of the contents of a node, if any: of the triangles of an unfolded copy, the first stands for the copy in
/// nodes above it.
fn part_of(scene: &Scene, is_below: bool, primitive: u32) -> Option<u32> {
    match scene.copy_of(primitive) {
        Some((copy, triangle)) if !is_below => matches!(triangle, None | Some(0)).then_some(copy),
        Some(_) => Some(scene.hit_of(primitive)),
        None => Some(primitive),
    }
}

/// Number of primitives, and a hash of their indices that does not depend on their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Contents {
    count: u32,
    hash: u64,
}

impl Contents {
    fn add(&mut self, part: Option<u32>) {
        let Some(part) = part else { return };
        self.count += 1;
        self.hash = self.hash.wrapping_add(scramble(u64::from(part)));
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

/// The node of `path` that has these contents, of each primitive `part`. Goes up from the end and stops where a node has more.
fn find_on_path<C>(tree: &Tree<C>, path: &[u32], wanted: Contents, part: impl Fn(u32) -> Option<u32>) -> Option<u32> {
    let mut contents = Contents::default();
    let mut below = None;
    for &node in path.iter().rev() {
        // The node's contents are those of its child on the path and of that child's siblings.
        if let Some(below) = below {
            let siblings = tree.nodes[node as usize].children().filter(|&child| child != below);
            siblings.for_each(|child| for_each_primitive(tree, child, |primitive| contents.add(part(primitive))));
        } else {
            for_each_primitive(tree, node, |primitive| contents.add(part(primitive)));
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
    use crate::scene::{Instancing, LoadOptions, SceneSource, load};
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

    /// Whichever copies are unfolded, nodes above the meshes and in those that stay unfolded are found again.
    #[test]
    fn nodes_are_found_where_other_copies_are_unfolded() {
        let token = CancelToken::new();
        let source = SceneSource::Builtin { name: "village".to_owned(), size: Some(40) };
        let options = LoadOptions { instances: Instancing::TwoLevel, ..LoadOptions::default() };
        let folded = Arc::new(load(&source, &options, &token).unwrap());
        let with = |copies: &[u32]| {
            let unfolded = folded.with_unfolded(&copies.iter().copied().collect(), &token).unwrap();
            Accel::build(&Arc::new(unfolded), &BuildSettings::default(), &token).unwrap()
        };
        let trees = [with(&[]), with(&[3, 4, 11]), with(&[4, 20])];
        let place = |accel: &Accel, node: u32| {
            accel.node_of_mesh(node).or_else(|| {
                let primitive = accel.tree.first_primitive_below(node)?;
                Some((accel.scene.copy_of(primitive)?.0, u32::MAX))
            })
        };
        for from in &trees {
            let nodes = from.tree.node_count() as u32;
            let identities: Vec<_> = (0..nodes).map(|node| NodeIdentity::of(from, node).unwrap()).collect();
            for to in &trees {
                let mut found = 0;
                for (node, identity) in (0..nodes).zip(&identities) {
                    let at = identity.find(to);
                    let copy = from.node_of_mesh(node).map(|(copy, _)| copy);
                    let is_there = copy.is_none_or(|copy| to.scene.unfolded.ranges.contains(copy));
                    assert_eq!(at.is_some(), is_there, "node {node}");
                    found += usize::from(at.is_some());
                    if let Some(at) = at.filter(|_| copy.is_some()) {
                        assert_eq!(place(to, at), place(from, node));
                    }
                }
                assert!(found >= trees[0].tree.node_count());
            }
        }
    }
}
