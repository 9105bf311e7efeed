//! Containers of the kinds that a tree is not made of.

use super::table::NodeTable;
use crate::accel::Accel;
use crate::overlay::container_set::ContainerSet;
use bvhscope_engine::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use bvhscope_engine::geometry::{Aabb, Dop14, OrientedBox, Sphere, Triangle};
use bvhscope_engine::kernel::parallel::par_collect;
use bvhscope_engine::tree::{AnyTree, Container, ContainerKind, Node, Tree};
use bvhscope_engine::with_tree;

impl NodeTable {
    /// Computes those of the containers of other `kinds` than the tree's that are not known yet, in the calling thread's rayon pool.
    pub fn complete(&self, kinds: ContainerSet, token: &CancelToken) -> Result<(), Cancelled> {
        let triangles = &self.accel.scene.triangles;
        for kind in kinds.iter() {
            if self.knows(kind) {
                continue;
            }
            match kind {
                // Drawn as boxes in a tree that has none.
                ContainerKind::Aabb | ContainerKind::Oriented => {
                    let boxes = with_tree!(&self.accel.tree, tree => containers(tree, triangles, token)?);
                    self.boxes.get_or_init(|| boxes);
                }
                ContainerKind::Sphere => {
                    let spheres = with_tree!(&self.accel.tree, tree => containers(tree, triangles, token)?);
                    self.spheres.get_or_init(|| spheres);
                }
                ContainerKind::Dop14 => {
                    let dops = with_tree!(&self.accel.tree, tree => containers(tree, triangles, token)?);
                    self.dops.get_or_init(|| dops);
                }
            }
        }
        Ok(())
    }

    /// The containers of a kind are known without another pass over the tree: the tree's own are, and the box of a polytope or an
    /// oriented box.
    pub(super) fn knows(&self, kind: ContainerKind) -> bool {
        kind == self.container_kind()
            || match kind {
                ContainerKind::Aabb | ContainerKind::Oriented => {
                    self.container_kind() != ContainerKind::Sphere || self.boxes.get().is_some()
                }
                ContainerKind::Sphere => self.spheres.get().is_some(),
                ContainerKind::Dop14 => self.dops.get().is_some(),
            }
    }

    /// The box of `node`: the tree's own, as a layout stores it, or that of a polytope or of an oriented box, or in a tree of spheres the tight box around the
    /// triangles of the subtree.
    pub fn node_box(&self, node: u32) -> Aabb {
        if let Some(stored) = self.kept.as_ref().and_then(|kept| kept.stored_box(node)) {
            return stored;
        }
        match &self.accel.tree {
            AnyTree::Aabb(tree) => tree.nodes[node as usize].container,
            AnyTree::Dop14(tree) => tree.nodes[node as usize].container.bounds,
            AnyTree::Oriented(tree) => tree.nodes[node as usize].container.bounds,
            AnyTree::Sphere(tree) => self.boxes.get_or_init(|| containers_at_once(tree, &self.accel))[node as usize],
        }
    }

    /// The oriented box of `node`: the tree's own or, in a tree of other containers, the plain box.
    pub fn node_oriented(&self, node: u32) -> OrientedBox {
        match &self.accel.tree {
            AnyTree::Oriented(tree) => tree.nodes[node as usize].container,
            _ => OrientedBox::plain(self.node_box(node)),
        }
    }

    /// The sphere of `node`: the tree's own or, in a tree of other containers, merged bottom-up from the triangles' spheres.
    pub fn node_sphere(&self, node: u32) -> Sphere {
        if let AnyTree::Sphere(tree) = &self.accel.tree {
            return tree.nodes[node as usize].container;
        }
        self.spheres.get_or_init(|| with_tree!(&self.accel.tree, tree => containers_at_once(tree, &self.accel)))
            [node as usize]
    }

    /// The polytope of `node`: the tree's own or, in a tree of other containers, that around the triangles of the subtree.
    pub fn node_dop(&self, node: u32) -> Dop14 {
        if let AnyTree::Dop14(tree) = &self.accel.tree {
            return tree.nodes[node as usize].container;
        }
        self.dops.get_or_init(|| with_tree!(&self.accel.tree, tree => containers_at_once(tree, &self.accel)))
            [node as usize]
    }
}

/// Containers of kind `C` for all nodes of a tree of another kind: leaves from their triangles, interior nodes bottom-up.
fn containers<K: Container, C: Container>(
    tree: &Tree<K>,
    triangles: &[Triangle],
    token: &CancelToken,
) -> Result<Vec<C>, Cancelled> {
    let of_leaf = |node: &Node<K>| {
        let own = &tree.primitive_indices[node.slots()];
        own.iter().fold(C::EMPTY, |all, &index| all.union(&C::of_triangle(&triangles[index as usize])))
    };
    let mut all = par_collect(tree.nodes.len(), token, |at| of_leaf(&tree.nodes[at]))?;
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        token.check_every(MEDIUM_STEPS, index)?;
        all[index] = node.children().fold(all[index], |around, child| around.union(&all[child as usize]));
    }
    Ok(all)
}

/// [`containers`] without a way to cancel.
fn containers_at_once<K: Container, C: Container>(tree: &Tree<K>, accel: &Accel) -> Vec<C> {
    containers(tree, &accel.scene.triangles, &CancelToken::new()).unwrap_or_else(|_| unreachable!("nobody cancels"))
}
