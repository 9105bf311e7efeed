//! Scenes of copies with other meshes: one in parts, or two as one.

use std::collections::BinaryHeap;
use std::sync::Arc;

use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Triangle};
use bvhscope_engine::kernel::parallel::par_collect;
use bvhscope_engine::tree::Tree;
use bvhscope_engine::{AnyTree, BuildSettings, Bvh, Instances, MeshCopies, Placed, build, with_tree};

use super::measure::LabError;
use super::mesh_pairs::{MeshPair, moved};
use crate::budget::Budget;
use crate::scene::SceneCopies;

/// A scene whose meshes are changed.
pub struct MeshChanges<'a> {
    scene: &'a SceneCopies,
    /// The meshes with their trees.
    meshes: &'a MeshCopies,
    /// Of all new trees.
    settings: &'a BuildSettings,
}

impl<'a> MeshChanges<'a> {
    /// Changes of `meshes`, which are those of `scene`.
    pub fn new(scene: &'a SceneCopies, meshes: &'a MeshCopies, settings: &'a BuildSettings) -> Self {
        Self { scene, meshes, settings }
    }

    /// The scene with each copy of `mesh` as `count` copies of its parts, which are the subtrees that remain where the nodes with the largest
    /// boxes are opened; `None` where the tree has no so many.
    ///
    /// # Errors
    ///
    /// [`LabError::Refused`] for settings that a tree over copies cannot have, and once `token` is cancelled.
    pub fn split(&self, mesh: u32, count: usize, token: &CancelToken) -> Result<Option<Instances>, LabError> {
        let AnyTree::Aabb(tree) = self.meshes.meshes()[mesh as usize].tree() else { return Ok(None) };
        let nodes = largest_subtrees(tree, count);
        if nodes.len() != count {
            return Ok(None);
        }
        self.check_memory(&[mesh])?;
        let triangles = self.scene.mesh(mesh);
        let part = |node: u32| part(&tree.below(node, token)?, triangles, token);
        let parts = nodes.into_iter().map(part).collect::<Result<Vec<_>, Cancelled>>()?;
        let (meshes, numbers) = self.without(&[mesh], parts);
        let parts = numbers[mesh as usize]..meshes.len() as u32;
        let placed = |copy: u32| {
            let own = self.scene.copies().mesh(copy);
            let meshes = if own == mesh { parts.clone() } else { numbers[own as usize]..numbers[own as usize] + 1 };
            meshes.map(move |mesh| self.placed(copy, mesh))
        };
        let placed: Vec<Placed> = (0..self.scene.copies().len() as u32).flat_map(placed).collect();
        self.instances(meshes, &placed, token).map(Some)
    }

    /// The scene with the copies of both meshes of `pair` as copies of one, with a tree of its own.
    ///
    /// # Errors
    ///
    /// As [`MeshChanges::split`].
    pub fn merge(&self, pair: &MeshPair, token: &CancelToken) -> Result<Instances, LabError> {
        let [first, second] = pair.meshes;
        self.check_memory(&pair.meshes)?;
        let relative = self.scene.mesh(second).iter().map(|triangle| moved(&pair.relative, triangle));
        let triangles: Vec<Triangle> = self.scene.mesh(first).iter().copied().chain(relative).collect();
        let merged = Arc::new(build(&triangles, self.settings, token)?);
        let (meshes, numbers) = self.without(&pair.meshes, vec![merged]);
        let kept = (0..self.scene.copies().len() as u32).filter(|&copy| self.scene.copies().mesh(copy) != second);
        let placed = kept.map(|copy| self.placed(copy, numbers[self.scene.copies().mesh(copy) as usize]));
        self.instances(meshes, &placed.collect::<Vec<_>>(), token)
    }

    /// Checks that there is room for the triangles and trees of `changed` once more.
    fn check_memory(&self, changed: &[u32]) -> Result<(), LabError> {
        let bytes = |&mesh: &u32| {
            let own = &self.meshes.meshes()[mesh as usize];
            let wide = &own.wide().tree;
            let triangles = size_of_val(self.scene.mesh(mesh));
            (triangles + with_tree!(own.tree(), tree => tree.bytes()) + wide.node_bytes() + wide.leaf_bytes()) as u64
        };
        let checked = Budget::of_process().check("other meshes", changed.iter().map(bytes).sum());
        checked.map_err(|error| LabError::Refused(error.to_string()))
    }

    /// The meshes without `changed`, the `new` ones behind them, and the new number of each; of changed ones the first of the new.
    fn without(&self, changed: &[u32], new: Vec<Arc<Bvh>>) -> (Vec<Arc<Bvh>>, Vec<u32>) {
        let kept = (self.meshes.meshes().len() - changed.len()) as u32;
        let (mut meshes, mut numbers) = (Vec::new(), Vec::new());
        for (mesh, tree) in (0..).zip(self.meshes.meshes()) {
            if changed.contains(&mesh) {
                numbers.push(kept);
            } else {
                numbers.push(meshes.len() as u32);
                meshes.push(Arc::clone(tree));
            }
        }
        meshes.extend(new);
        (meshes, numbers)
    }

    /// A copy of `mesh` in the place of `copy`.
    fn placed(&self, copy: u32, mesh: u32) -> Placed {
        Placed { mesh, transform: self.scene.copies().place(copy).transform() }
    }

    fn instances(&self, meshes: Vec<Arc<Bvh>>, placed: &[Placed], token: &CancelToken) -> Result<Instances, LabError> {
        Ok(Instances::build(meshes, placed, self.settings, 1.0, token)?)
    }
}

/// The roots of the subtrees that remain where the nodes with the largest boxes are opened, as long as there are at most `count`.
fn largest_subtrees(tree: &Tree<Aabb>, count: usize) -> Vec<u32> {
    let keyed = |node: u32| (tree.area(node).to_bits(), node);
    let mut open = BinaryHeap::from_iter((!tree.nodes.is_empty()).then(|| keyed(0)));
    let mut closed = Vec::new();
    // As numbers that are not negative, areas are ordered by their bits.
    while let Some((_, largest)) = open.pop() {
        let node = &tree.nodes[largest as usize];
        if node.is_leaf() || open.len() + closed.len() + node.children().len() > count {
            closed.push(largest);
        } else {
            open.extend(node.children().map(keyed));
        }
    }
    closed.sort_unstable();
    closed
}

/// The part of `triangles` that `tree` has, as a mesh of its own.
fn part(tree: &Tree<Aabb>, triangles: &[Triangle], token: &CancelToken) -> Result<Arc<Bvh>, Cancelled> {
    let mut numbers = tree.primitive_indices.clone();
    numbers.sort_unstable();
    numbers.dedup();
    let own = par_collect(numbers.len(), token, |at| triangles[numbers[at] as usize])?;
    let renumbered = par_collect(tree.primitive_indices.len(), token, |slot| {
        numbers.partition_point(|&number| number < tree.primitive_indices[slot]) as u32
    })?;
    let tree = Tree { nodes: tree.nodes.clone(), primitive_indices: renumbered, max_depth: tree.max_depth };
    Ok(Arc::new(Bvh::of_tree(tree.into(), &own, token)?))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use bvhscope_engine::glam::Vec3;

    /// Triangles whose distances grow, so that the tree is lopsided.
    fn tree() -> Tree<Aabb> {
        let corner = |at: u32| Vec3::new((at * at) as f32, (7 * at % 11) as f32, (5 * at % 3) as f32);
        let triangle = |at| Triangle { a: corner(at), b: corner(at) + Vec3::X, c: corner(at) + Vec3::Y };
        let triangles: Vec<Triangle> = (0..60).map(triangle).collect();
        let built = build(&triangles, &BuildSettings::default(), &CancelToken::new()).unwrap();
        match built.tree() {
            AnyTree::Aabb(tree) => tree.clone(),
            _ => unreachable!("boxes are the default"),
        }
    }

    #[test]
    fn parts_are_what_the_nodes_with_the_largest_boxes_leave() {
        let tree = tree();
        let parents = tree.parents(&CancelToken::new()).unwrap();
        for count in [1, 2, 3, 8, 30, 60] {
            let parts = largest_subtrees(&tree, count);
            assert_eq!(parts.len(), count);
            // Those above the parts were opened.
            let mut is_opened = vec![false; tree.nodes.len()];
            for &part in &parts {
                let mut node = part;
                while node != 0 {
                    node = parents[node as usize];
                    is_opened[node as usize] = true;
                }
            }
            let opened = (0..tree.nodes.len() as u32).filter(|&node| is_opened[node as usize]);
            assert_eq!(opened.clone().count(), count - 1, "each of two children, so that the parts are the whole tree");
            let smallest = opened.map(|node| tree.area(node)).fold(f32::INFINITY, f32::min);
            let interior = parts.iter().filter(|&&part| !tree.nodes[part as usize].is_leaf());
            assert!(interior.clone().all(|&part| tree.area(part) <= smallest), "{count}");
        }
        assert_eq!(largest_subtrees(&tree, 100).len(), 60, "there are no more than leaves");
    }
}
