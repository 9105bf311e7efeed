//! Checks the invariants of a tree.

use crate::geometry::{Aabb, Triangle};
use crate::with_tree;

use super::container::{Container, ContainerKind};
use super::node::{AnyTree, Node, Tree};

/// Tolerance of containment for spheres, as a fraction of the scene's size, because square roots and quotients are rounded. Boxes
/// are exact.
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
    let (slots, count) = (tree.primitive_indices.len(), triangles.len());
    if slots < count {
        return Err(format!("{slots} primitives in the tree, {count} in the list"));
    }
    if tree.nodes.is_empty() {
        return if count == 0 && tree.max_depth == 0 {
            Ok(())
        } else {
            Err(format!("no nodes for {count} primitives, depth {}", tree.max_depth))
        };
    }
    let mut validator = Validator::new(tree, triangles);
    for (index, node) in tree.nodes.iter().enumerate() {
        validator.check_node(index, node)?;
        if node.is_leaf() {
            validator.check_leaf(index, node)?;
        } else {
            validator.check_children(index, node)?;
        }
    }
    validator.check_primitives()?;
    check_neighbours(&tree.nodes)?;
    let deepest = validator.depths.iter().copied().max().unwrap_or(0);
    if deepest != tree.max_depth {
        return Err(format!("the deepest node has depth {deepest}, the tree says {}", tree.max_depth));
    }
    Ok(())
}

/// State of one pass over the nodes in their order.
struct Validator<'a, C: Container> {
    tree: &'a Tree<C>,
    triangles: &'a [Triangle],
    slack: f32,
    /// For each triangle whether a leaf so far holds it.
    primitive_seen: Vec<bool>,
    /// For each triangle the box around the leaves that hold it; empty in a tree that holds each triangle once.
    leaf_bounds: Vec<Aabb>,
    slot_seen: Vec<bool>,
    /// For each node whether it is the root or a child of a node so far.
    node_seen: Vec<bool>,
    depths: Vec<u32>,
}

impl<'a, C: Container> Validator<'a, C> {
    fn new(tree: &'a Tree<C>, triangles: &'a [Triangle]) -> Self {
        let is_split = tree.primitive_indices.len() > triangles.len();
        let mut node_seen = vec![false; tree.nodes.len()];
        node_seen[0] = true;
        Self {
            tree,
            triangles,
            slack: containment_slack(tree),
            primitive_seen: vec![false; triangles.len()],
            leaf_bounds: vec![Aabb::EMPTY; if is_split { triangles.len() } else { 0 }],
            slot_seen: vec![false; tree.primitive_indices.len()],
            node_seen,
            depths: vec![0; tree.nodes.len()],
        }
    }

    /// Parents come first, so the parent of each node was seen before it.
    fn check_node(&self, index: usize, node: &Node<C>) -> Result<(), String> {
        if !self.node_seen[index] {
            return Err(format!("node {index} is not reached from the root"));
        }
        let bounds = node.container.bounds();
        if !(bounds.min.is_finite() && bounds.max.is_finite() && node.container.relative_area().is_finite()) {
            return Err(format!("the container of node {index} is not finite: {:?}", node.container));
        }
        Ok(())
    }

    fn check_leaf(&mut self, index: usize, leaf: &Node<C>) -> Result<(), String> {
        let slots = self.tree.primitive_indices.len();
        let end = u64::from(leaf.first) + u64::from(leaf.count);
        if end > slots as u64 {
            return Err(format!("leaf {index} ends at slot {end} of {slots}"));
        }
        for slot in leaf.first as usize..end as usize {
            if std::mem::replace(&mut self.slot_seen[slot], true) {
                return Err(format!("slot {slot} belongs to leaf {index} and to another"));
            }
            self.check_primitive(self.tree.primitive_indices[slot] as usize, index, &leaf.container)?;
        }
        Ok(())
    }

    /// Checks that leaf number `leaf` may hold `primitive`, and that its `container` is around all of it unless it was split.
    fn check_primitive(&mut self, primitive: usize, leaf: usize, container: &C) -> Result<(), String> {
        let count = self.triangles.len();
        let Some(seen) = self.primitive_seen.get_mut(primitive) else {
            return Err(format!("leaf {leaf} holds primitive {primitive} of {count}"));
        };
        let was_seen = std::mem::replace(seen, true);
        if let Some(leaf_bounds) = self.leaf_bounds.get_mut(primitive) {
            *leaf_bounds = leaf_bounds.union(&container.bounds());
            return Ok(());
        }
        if was_seen {
            return Err(format!("primitive {primitive} is in leaf {leaf} and in another"));
        }
        let Triangle { a, b, c } = self.triangles[primitive];
        if let Some(corner) = [a, b, c].iter().find(|&&corner| !container.contains_point(corner, self.slack)) {
            return Err(format!("leaf {leaf} does not hold corner {corner} of primitive {primitive}: {container:?}"));
        }
        Ok(())
    }

    fn check_children(&mut self, index: usize, node: &Node<C>) -> Result<(), String> {
        let (arity, nodes) = (node.arity(), &self.tree.nodes);
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
            if std::mem::replace(&mut self.node_seen[child], true) {
                return Err(format!("node {child} has two parents, one is {index}"));
            }
            let (outer, inner) = (&node.container, &nodes[child].container);
            if !outer.contains(inner, self.slack) {
                return Err(format!("node {child} sticks out of its parent {index}: {inner:?} in {outer:?}"));
            }
            self.depths[child] = self.depths[index] + 1;
        }
        Ok(())
    }

    /// Checks, after all nodes, that the leaves hold each slot and enclose each triangle.
    fn check_primitives(&self) -> Result<(), String> {
        if let Some(slot) = self.slot_seen.iter().position(|seen| !seen) {
            return Err(format!("primitive {} in slot {slot} is in no leaf", self.tree.primitive_indices[slot]));
        }
        if let Some(primitive) = self.primitive_seen.iter().position(|seen| !seen) {
            return Err(format!("primitive {primitive} is in no leaf"));
        }
        let is_open = |(leaves, triangle): (&Aabb, &Triangle)| !leaves.contains(&triangle.bounds(), self.slack);
        if let Some(primitive) = self.leaf_bounds.iter().zip(self.triangles).position(is_open) {
            return Err(format!("the leaves of primitive {primitive} do not enclose it"));
        }
        Ok(())
    }
}

/// Checks that the slots below each node are contiguous and in the order of its children.
fn check_neighbours<C: Container>(nodes: &[Node<C>]) -> Result<(), String> {
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

/// Tolerance of containment in `tree`, in world units.
pub(crate) fn containment_slack<C: Container>(tree: &Tree<C>) -> f32 {
    match (C::KIND, tree.nodes.first()) {
        (ContainerKind::Aabb, _) | (_, None) => 0.0,
        (ContainerKind::Sphere, Some(root)) => {
            let bounds = root.container.bounds();
            SPHERE_SLACK * bounds.extent().max_element().max(bounds.min.abs().max(bounds.max.abs()).max_element())
        }
    }
}
