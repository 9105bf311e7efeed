//! Faults of a tree over instances.

use super::bounds::FileContainer;
use super::error::TreeFileError;
use super::faults::{Fault, FaultKind, Uses, outside_parents};
use super::found::in_chunks;
use super::instance::KnownScene;
use super::links::{Links, Steps};
use super::which_tree::WhichTree;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Aabb;
use crate::tree::Tree;
use crate::tree::validate::containment_slack;

/// Nodes and triangles of a mesh that are compared with the leaf of an instance, one by one. Where a leaf fits closely around a face of a mesh,
/// all triangles of that are. Of others the boxes are compared, less their padding.
const MAX_COMPARED: u32 = 1 << 13;

/// The instances, and the trees of their meshes.
pub(super) struct Copies<'a> {
    pub scene: &'a KnownScene<'a>,
    pub trees: &'a [&'a Tree<Aabb>],
}

/// The faults of the `tree` over `instances`, which `links` gave. Without `copies` it is not compared with what is below it.
///
/// # Errors
///
/// For an instance in several leaves.
pub(super) fn find(
    tree: &Tree<Aabb>,
    numbers: Option<&[u32]>,
    instances: u32,
    links: &Links,
    copies: Option<&Copies<'_>>,
    token: &CancelToken,
) -> Result<Vec<Fault>, TreeFileError> {
    let slack = f64::from(containment_slack(tree));
    let uses = Uses::count(&tree.primitive_indices, instances, &token.part(0, 3))?;
    if let Some(&twice) = tree.primitive_indices.iter().find(|&&instance| uses.several.contains(instance)) {
        return Err(TreeFileError::InstanceTwice(twice));
    }
    let mut faults = Vec::new();
    faults.extend(outside_parents(tree, slack, &token.part(1, 3))?.fault(FaultKind::NodeOutside, numbers));
    if let Some(copies) = copies {
        let outside = in_chunks(tree, &token.part(2, 3), |number, found, steps| {
            let node = &tree.nodes[number as usize];
            for &instance in &tree.primitive_indices[node.slots()] {
                let excess = copies.excess(&node.container, instance, steps)?;
                if excess > slack {
                    found.add(number, excess);
                }
            }
            Ok(())
        })?;
        faults.extend(outside.fault(FaultKind::LeafOutside, numbers));
    }
    if let Some((first, count)) = uses.missing {
        faults.push(Fault::new(FaultKind::InstanceMissing, u64::from(count), first, 0.0));
    }
    if let Some((first, count)) = links.unreached {
        faults.push(Fault::new(FaultKind::NodeUnreached, u64::from(count), first, 0.0));
    }
    Ok(faults.into_iter().map(|fault| Fault { tree: WhichTree::Instances, ..fault }).collect())
}

impl Copies<'_> {
    /// By how much triangles of an instance stick out of the box `leaf`, at most; 0 where none does. Looks first where most may stick out,
    /// and passes over nodes that cannot stick out farther than what was found.
    fn excess(&self, leaf: &Aabb, instance: u32, steps: &mut Steps<'_>) -> Result<f64, Cancelled> {
        let (mesh, place) = self.scene.instances[instance as usize];
        let (tree, triangles) = (self.trees[mesh as usize], self.scene.meshes[mesh as usize]);
        let of_node = |node: u32| (leaf.excess_of(&place.bounds(&tree.nodes[node as usize].container)), node);
        let (mut excess, mut compared) = (0.0_f64, 0_u32);
        let mut open: Vec<(f64, u32)> = tree.nodes.first().map(|_| of_node(0)).into_iter().collect();
        while let Some((at_most, number)) = open.pop() {
            steps.step()?;
            if at_most <= excess {
                continue;
            }
            let node = &tree.nodes[number as usize];
            compared = compared.saturating_add(if node.is_leaf() { node.count } else { node.arity() });
            if compared > MAX_COMPARED {
                excess = excess.max(at_most - place.pad());
                continue;
            }
            let first = open.len();
            open.extend(node.children().map(of_node));
            open[first..].sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            for &triangle in &tree.primitive_indices[node.slots()] {
                steps.step()?;
                excess = excess.max(leaf.excess_of_triangle(&place.triangle(&triangles[triangle as usize])));
            }
        }
        Ok(excess)
    }
}
