//! Checks the invariants of a tree.

use crate::geometry::{Aabb, Triangle};
use crate::with_tree;

use super::container::{Container, ContainerKind};
use super::node::{AnyTree, Node, Tree};

/// Tolerance of containment for spheres, as a fraction of the scene's size, because square roots and quotients are rounded. Boxes
/// are exact, polytopes and oriented ones are padded.
const SPHERE_SLACK: f32 = 1e-4;

/// Checks that `tree`, of any arity, is a hierarchy over `triangles`: each primitive in exactly one leaf, each container inside
/// its parent's and around its triangles, at most [`Node::MAX_ARITY`] children, every node reached once, parents before
/// children, the primitives below any node contiguous, all numbers finite, `max_depth` right. In a tree with more slots than
/// triangles, whose triangles were split, each triangle is in at least one leaf, and the containers of its leaves together are
/// as large as its box.
///
/// # Errors
///
/// The first broken invariant, in words.
///
/// ```
/// use bvhscope_engine::AnyTree;
/// use bvhscope_engine::tree::{Tree, validate::validate};
///
/// assert_eq!(validate(&AnyTree::Aabb(Tree::EMPTY), &[]), Ok(()));
/// ```
pub fn validate(tree: &AnyTree, triangles: &[Triangle]) -> Result<(), String> {
    with_tree!(tree, tree => validate_tree(tree, triangles))
}

fn validate_tree<C: Container>(tree: &Tree<C>, triangles: &[Triangle]) -> Result<(), String> {
    let nodes = &tree.nodes;
    let indices = &tree.primitive_indices;
    let is_split = indices.len() > triangles.len();
    if indices.len() < triangles.len() {
        return Err(format!("{} primitives in the tree, {} in the list", indices.len(), triangles.len()));
    }
    if nodes.is_empty() {
        return if triangles.is_empty() && tree.max_depth == 0 {
            Ok(())
        } else {
            Err(format!("no nodes for {} primitives, depth {}", triangles.len(), tree.max_depth))
        };
    }
    let slack = containment_slack(tree);
    let mut primitive_seen = vec![false; triangles.len()];
    // Box around the leaves of each triangle, where several can hold it.
    let mut leaf_bounds = vec![Aabb::EMPTY; if is_split { triangles.len() } else { 0 }];
    let mut slot_seen = vec![false; indices.len()];
    let mut node_seen = vec![false; nodes.len()];
    let mut depths = vec![0_u32; nodes.len()];
    node_seen[0] = true;
    for (index, node) in nodes.iter().enumerate() {
        // Parents come first: one pass in order has seen the parent of each node.
        if !node_seen[index] {
            return Err(format!("node {index} is not reached from the root"));
        }
        let bounds = node.container.bounds();
        if !(bounds.min.is_finite() && bounds.max.is_finite() && node.container.relative_area().is_finite()) {
            return Err(format!("the container of node {index} is not finite: {:?}", node.container));
        }
        if node.is_leaf() {
            let end = u64::from(node.first) + u64::from(node.count);
            if end > indices.len() as u64 {
                return Err(format!("leaf {index} ends at slot {end} of {}", indices.len()));
            }
            for slot in node.first as usize..end as usize {
                let primitive = indices[slot] as usize;
                if std::mem::replace(&mut slot_seen[slot], true) {
                    return Err(format!("slot {slot} belongs to leaf {index} and to another"));
                }
                let Some(seen) = primitive_seen.get_mut(primitive) else {
                    return Err(format!("leaf {index} holds primitive {primitive} of {}", triangles.len()));
                };
                if let Some(leaf_bounds) = leaf_bounds.get_mut(primitive) {
                    *seen = true;
                    *leaf_bounds = leaf_bounds.union(&bounds);
                    continue;
                }
                if std::mem::replace(seen, true) {
                    return Err(format!("primitive {primitive} is in leaf {index} and in another"));
                }
                let Triangle { a, b, c } = triangles[primitive];
                if let Some(corner) = [a, b, c].iter().find(|&&corner| !node.container.contains_point(corner, slack)) {
                    return Err(format!(
                        "leaf {index} does not hold corner {corner} of primitive {primitive}: {:?}",
                        node.container
                    ));
                }
            }
            continue;
        }
        let arity = node.arity();
        if !(1..=Node::<C>::MAX_ARITY).contains(&arity) {
            return Err(format!("node {index} has {arity} children instead of 1 to {}", Node::<C>::MAX_ARITY));
        }
        for child in u64::from(node.first)..u64::from(node.first) + u64::from(arity) {
            if child >= nodes.len() as u64 {
                return Err(format!("child {child} of node {index} does not exist: there are {} nodes", nodes.len()));
            }
            let child = child as usize;
            if child <= index {
                return Err(format!("child {child} stands before its parent {index}"));
            }
            if std::mem::replace(&mut node_seen[child], true) {
                return Err(format!("node {child} has two parents, one is {index}"));
            }
            if !node.container.contains(&nodes[child].container, slack) {
                return Err(format!(
                    "node {child} sticks out of its parent {index}: {:?} in {:?}",
                    nodes[child].container, node.container
                ));
            }
            depths[child] = depths[index] + 1;
        }
    }
    if let Some(slot) = slot_seen.iter().position(|seen| !seen) {
        return Err(format!("primitive {} in slot {slot} is in no leaf", indices[slot]));
    }
    if let Some(primitive) = primitive_seen.iter().position(|seen| !seen) {
        return Err(format!("primitive {primitive} is in no leaf"));
    }
    // Backwards: the first slot below each node and the one after the last.
    let mut slots = vec![[0_u32; 2]; nodes.len()];
    for (index, node) in nodes.iter().enumerate().rev() {
        if node.is_leaf() {
            slots[index] = [node.first, node.first + node.count];
            continue;
        }
        let [start, mut middle] = slots[node.first as usize];
        for child in node.children().skip(1) {
            let [next, end] = slots[child as usize];
            if middle != next {
                return Err(format!(
                    "slots {start} to {middle} below node {index}, then {next} to {end}: no neighbours"
                ));
            }
            middle = end;
        }
        slots[index] = [start, middle];
    }
    let is_too_small = |(leaf_bounds, triangle): (&Aabb, &Triangle)| !leaf_bounds.contains(&triangle.bounds(), slack);
    if let Some(primitive) = leaf_bounds.iter().zip(triangles).position(is_too_small) {
        return Err(format!("the leaves of primitive {primitive} do not enclose it"));
    }
    if C::KIND == ContainerKind::Oriented && !is_split {
        check_above(tree, triangles)?;
    }
    let deepest = depths.iter().copied().max().unwrap_or(0);
    if deepest != tree.max_depth {
        return Err(format!("the deepest node has depth {deepest}, the tree says {}", tree.max_depth));
    }
    Ok(())
}

/// Checks that each triangle lies inside all nodes above it: of oriented boxes that does not follow from those in between.
fn check_above<C: Container>(tree: &Tree<C>, triangles: &[Triangle]) -> Result<(), String> {
    let mut parents = vec![0_usize; tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate() {
        node.children().for_each(|child| parents[child as usize] = index);
        for &primitive in &tree.primitive_indices[node.slots()] {
            let Triangle { a, b, c } = triangles[primitive as usize];
            let mut above = index;
            while above != 0 {
                above = parents[above];
                let container = &tree.nodes[above].container;
                if let Some(corner) = [a, b, c].into_iter().find(|&corner| !container.contains_point(corner, 0.0)) {
                    return Err(format!(
                        "node {above} does not hold corner {corner} of primitive {primitive} below it"
                    ));
                }
            }
        }
    }
    Ok(())
}

/// Tolerance of containment in `tree`, in world units.
pub(crate) fn containment_slack<C: Container>(tree: &Tree<C>) -> f32 {
    match (C::KIND, tree.nodes.first()) {
        (ContainerKind::Aabb | ContainerKind::Dop14 | ContainerKind::Oriented, _) | (_, None) => 0.0,
        (ContainerKind::Sphere, Some(root)) => {
            let bounds = root.container.bounds();
            SPHERE_SLACK * bounds.extent().max_element().max(bounds.min.abs().max(bounds.max.abs()).max_element())
        }
    }
}
