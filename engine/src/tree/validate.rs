//! Checks the invariants of a tree.

use crate::geometry::{Aabb, Triangle};
use crate::with_tree;

use super::node::{AnyTree, Node, Tree};
use crate::geometry::{Container, ContainerKind};

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
    let mut reached = Reached::root(tree, triangles);
    for (index, node) in nodes.iter().enumerate() {
        // Parents come first: one pass in order has seen the parent of each node.
        if !reached.nodes[index] {
            return Err(format!("node {index} is not reached from the root"));
        }
        let bounds = node.container.bounds();
        if !(bounds.min.is_finite() && bounds.max.is_finite() && node.container.relative_area().is_finite()) {
            return Err(format!("the container of node {index} is not finite: {:?}", node.container));
        }
        if node.is_leaf() {
            reached.check_leaf(tree, triangles, index, slack)?;
        } else {
            reached.check_children(tree, index, slack)?;
        }
    }
    if let Some(slot) = reached.slots.iter().position(|seen| !seen) {
        return Err(format!("primitive {} in slot {slot} is in no leaf", indices[slot]));
    }
    if let Some(primitive) = reached.primitives.iter().position(|seen| !seen) {
        return Err(format!("primitive {primitive} is in no leaf"));
    }
    check_slots(nodes)?;
    let is_too_small = |(leaf_bounds, triangle): (&Aabb, &Triangle)| !leaf_bounds.contains(&triangle.bounds(), slack);
    if let Some(primitive) = reached.leaf_bounds.iter().zip(triangles).position(is_too_small) {
        return Err(format!("the leaves of primitive {primitive} do not enclose it"));
    }
    if C::KIND == ContainerKind::Oriented && !is_split(tree, triangles) {
        check_above(tree, triangles)?;
    }
    let deepest = reached.depths.iter().copied().max().unwrap_or(0);
    if deepest != tree.max_depth {
        return Err(format!("the deepest node has depth {deepest}, the tree says {}", tree.max_depth));
    }
    Ok(())
}

/// Whether triangles were split: several leaves may hold one.
const fn is_split<C: Container>(tree: &Tree<C>, triangles: &[Triangle]) -> bool {
    tree.primitive_indices.len() > triangles.len()
}

/// The parts of a tree that were reached from its root so far.
struct Reached {
    primitives: Vec<bool>,
    /// Box around the leaves of each triangle, where several can hold it; empty otherwise.
    leaf_bounds: Vec<Aabb>,
    slots: Vec<bool>,
    nodes: Vec<bool>,
    depths: Vec<u32>,
}

impl Reached {
    /// The root alone, of a tree that has one.
    fn root<C: Container>(tree: &Tree<C>, triangles: &[Triangle]) -> Self {
        let mut nodes = vec![false; tree.nodes.len()];
        nodes[0] = true;
        Self {
            primitives: vec![false; triangles.len()],
            leaf_bounds: vec![Aabb::EMPTY; if is_split(tree, triangles) { triangles.len() } else { 0 }],
            slots: vec![false; tree.primitive_indices.len()],
            depths: vec![0; nodes.len()],
            nodes,
        }
    }

    /// Checks that leaf `index` alone has its slots, and holds the triangles in them.
    fn check_leaf<C: Container>(
        &mut self,
        tree: &Tree<C>,
        triangles: &[Triangle],
        index: usize,
        slack: f32,
    ) -> Result<(), String> {
        let (node, indices) = (&tree.nodes[index], &tree.primitive_indices);
        let end = u64::from(node.first) + u64::from(node.count);
        if end > indices.len() as u64 {
            return Err(format!("leaf {index} ends at slot {end} of {}", indices.len()));
        }
        for (slot, &primitive) in (node.first as usize..).zip(&indices[node.first as usize..end as usize]) {
            let primitive = primitive as usize;
            if std::mem::replace(&mut self.slots[slot], true) {
                return Err(format!("slot {slot} belongs to leaf {index} and to another"));
            }
            let Some(seen) = self.primitives.get_mut(primitive) else {
                return Err(format!("leaf {index} holds primitive {primitive} of {}", triangles.len()));
            };
            if let Some(leaf_bounds) = self.leaf_bounds.get_mut(primitive) {
                *seen = true;
                *leaf_bounds = leaf_bounds.union(&node.container.bounds());
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
        Ok(())
    }

    /// Checks that interior node `index` alone has its children, and encloses them.
    fn check_children<C: Container>(&mut self, tree: &Tree<C>, index: usize, slack: f32) -> Result<(), String> {
        let (node, nodes) = (&tree.nodes[index], &tree.nodes);
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
            if std::mem::replace(&mut self.nodes[child], true) {
                return Err(format!("node {child} has two parents, one is {index}"));
            }
            if !node.container.contains(&nodes[child].container, slack) {
                return Err(format!(
                    "node {child} sticks out of its parent {index}: {:?} in {:?}",
                    nodes[child].container, node.container
                ));
            }
            self.depths[child] = self.depths[index] + 1;
        }
        Ok(())
    }
}

/// Checks that the slots below each node are neighbours.
fn check_slots<C: Container>(nodes: &[Node<C>]) -> Result<(), String> {
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
