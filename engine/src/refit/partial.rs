//! Partial rebuilds: subtrees whose cost has grown too much since they were built are built again, all others fitted.

use std::collections::HashMap;

use super::bottom_up::{FitInterior as _, ToChildren, fit};
use super::on_boxes::on_boxes;
use crate::aac::ClusterContainer;
use crate::builders::{BuildError, build_tree};
use crate::cancel::{CancelToken, Cancelled, LIGHT_STEPS};
use crate::geometry::Triangle;
use crate::kernel::parallel::par_tasks;
use crate::optimize::subtree_costs;
use crate::settings::{BuildSettings, Pass};
use crate::tree::{AnyTree, Node, Tree, with_built_tree};

/// SAH cost of each subtree of a tree when it was built, over the area of the subtree's root: so that it does not grow with a model that
/// does.
#[derive(Debug, Clone)]
pub struct BuiltCosts(Vec<f32>);

impl BuiltCosts {
    /// The costs in a binary tree that has just been built.
    pub fn new(tree: &AnyTree, token: &CancelToken) -> Result<Self, Cancelled> {
        with_built_tree!(tree, tree => Ok(Self(relative_costs(&mut tree.clone(), token)?)), tree => {
            Ok(Self(relative_costs(&mut tree.to_plain(token)?, token)?))
        })
    }
}

/// The subtrees that are built again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrownParts {
    /// Growth of the SAH cost, over the area of the subtree's root, above which a subtree is built again.
    pub growth: f32,
    /// Triangles of a subtree at least; those of a smaller one are judged with what holds them.
    pub triangles: u32,
}

/// Share of all triangles in subtrees that have grown from which on the whole tree is built: it then costs as much, and less is kept.
const WHOLE_SHARE: f32 = 0.5;

/// [`refit()`](super::refit()) of a binary tree, after which the topmost subtrees that have `grown` since they were built are built again
/// with `settings`, whose container is that of the tree; the whole tree where these hold half of it. `built` are the costs of the tree and
/// follow it. Returns the number of triangles in subtrees that were built.
///
/// A subtree is judged by itself: one that moves away as a whole, or grows evenly, is as good as before; the one that holds it
/// is not.
///
/// # Errors
///
/// As [`build_binary`](crate::builders::build_binary); the tree is fitted then.
///
/// # Panics
///
/// As [`refit()`](super::refit()), where a node has another number of children than two, and where `built` are the costs of another tree.
pub fn partial_rebuild(
    tree: &mut AnyTree,
    built: &mut BuiltCosts,
    triangles: &[Triangle],
    settings: &BuildSettings,
    grown: GrownParts,
    token: &CancelToken,
) -> Result<usize, BuildError> {
    let optimize = settings.optimize.without(Pass::Orient);
    let settings = BuildSettings { container: tree.container_kind(), optimize, ..*settings };
    with_built_tree!(tree, tree => rebuild_grown(tree, built, triangles, &settings, grown, token), tree => on_boxes(tree, triangles, token, |tree| {
        partial_rebuild(tree, built, triangles, &settings, grown, token)
    }))
}

/// A subtree that was built again, with its [`BuiltCosts`].
struct Part<C> {
    tree: Tree<C>,
    costs: Vec<f32>,
}

fn rebuild_grown<C: ClusterContainer>(
    tree: &mut Tree<C>,
    built: &mut BuiltCosts,
    triangles: &[Triangle],
    settings: &BuildSettings,
    grown: GrownParts,
    token: &CancelToken,
) -> Result<usize, BuildError> {
    assert!(tree.is_binary(token)?, "partial rebuilds need a binary tree");
    assert_eq!(tree.nodes.len(), built.0.len(), "the costs are those of another tree");
    fit(tree, triangles, |_, fitted| fitted, &ToChildren, token)?;
    let grown = grown_subtrees(tree, &built.0, grown, token)?;
    let rebuild = |node: u32, count: u32, token: &CancelToken| {
        // In the order of the list, so that a rebuilt root is the tree that a build makes.
        let mut sources = slots_below(tree, node, count).to_vec();
        sources.sort_unstable();
        // Split triangles have several slots.
        sources.dedup();
        let own: Vec<Triangle> = sources.iter().map(|&index| triangles[index as usize]).collect();
        let mut part = build_tree(&own, settings, token)?;
        part.primitive_indices.iter_mut().for_each(|index| *index = sources[*index as usize]);
        let costs = relative_costs(&mut part, token)?;
        Ok(Part { tree: part, costs })
    };
    let parts = par_tasks(&grown, token, |&(node, count), token| Ok(rebuild(node, count, token)))?;
    let parts: Vec<Part<C>> = parts.into_iter().collect::<Result<_, BuildError>>()?;
    if !parts.is_empty() {
        let places: HashMap<u32, usize> = grown.iter().map(|&(node, _)| node).zip(0..).collect();
        (*tree, built.0) = assemble(tree, &built.0, &parts, &places, token)?;
    }
    Ok(grown.iter().map(|&(_, count)| count as usize).sum())
}

/// SAH cost of each subtree over the area of its root; no number where it has none. Changes nothing.
fn relative_costs<C: ClusterContainer>(tree: &mut Tree<C>, token: &CancelToken) -> Result<Vec<f32>, Cancelled> {
    let (costs, _) = subtree_costs(&mut tree.nodes, false, token)?;
    Ok(costs.iter().zip(&tree.nodes).map(|(subtree, node)| subtree.cost / node.container.relative_area()).collect())
}

/// The topmost nodes whose subtrees have grown, each with the number of slots below it; the root where these hold much of it. Changes
/// nothing.
fn grown_subtrees<C: ClusterContainer>(
    tree: &mut Tree<C>,
    built: &[f32],
    GrownParts { growth, triangles }: GrownParts,
    token: &CancelToken,
) -> Result<Vec<(u32, u32)>, Cancelled> {
    let (costs, _) = subtree_costs(&mut tree.nodes, false, token)?;
    let (mut open, mut grown, mut slots) = (vec![0_u32], Vec::new(), 0);
    while let Some(index) = open.pop() {
        let (Some(node), at) = (tree.nodes.get(index as usize), index as usize) else { break };
        let count = costs[at].count;
        if node.is_leaf() || (count < triangles && index > 0) {
            continue;
        }
        if costs[at].cost > growth * built[at] * node.container.relative_area() {
            grown.push((index, count));
            slots += count;
        } else {
            open.extend(node.children());
        }
    }
    let all = tree.primitive_indices.len() as u32;
    if slots as f32 > all as f32 * WHOLE_SHARE {
        grown = vec![(0, all)];
    }
    Ok(grown)
}

/// The primitive indices of the `count` slots below `node`.
fn slots_below<C>(tree: &Tree<C>, node: u32, count: u32) -> &[u32] {
    let mut leftmost = &tree.nodes[node as usize];
    while !leftmost.is_leaf() {
        leftmost = &tree.nodes[leftmost.first as usize];
    }
    &tree.primitive_indices[leftmost.first as usize..][..count as usize]
}

/// The tree with `parts` in the `places` of nodes, in depth-first order, and its costs.
fn assemble<C: ClusterContainer>(
    old: &Tree<C>,
    built: &[f32],
    parts: &[Part<C>],
    places: &HashMap<u32, usize>,
    token: &CancelToken,
) -> Result<(Tree<C>, Vec<f32>), Cancelled> {
    const UNWRITTEN: u32 = 0;
    let unwritten = |container| Node { container, first: UNWRITTEN, count: 0 };
    let mut tree = Tree {
        nodes: Vec::with_capacity(old.nodes.len()),
        primitive_indices: Vec::with_capacity(old.primitive_indices.len()),
        max_depth: 0,
    };
    let mut costs = Vec::with_capacity(old.nodes.len());
    tree.nodes.push(unwritten(C::EMPTY));
    costs.push(0.0);
    // Nodes above those that were built, whose containers may be others now.
    let mut kept = Vec::new();
    // Part or the old tree, node in it, place, depth.
    let mut open = vec![(None, 0_u32, 0_usize, 0_u32)];
    while let Some((mut part, mut index, place, depth)) = open.pop() {
        if tree.nodes.len() % LIGHT_STEPS < 2 {
            token.check()?;
        }
        if let (None, Some(&replacing)) = (part, places.get(&index)) {
            (part, index) = (Some(replacing), 0);
        }
        let (source, source_costs) =
            part.map_or((old, built), |part: usize| (&parts[part].tree, &parts[part].costs[..]));
        let node = source.nodes[index as usize];
        costs[place] = source_costs[index as usize];
        tree.max_depth = tree.max_depth.max(depth);
        if node.is_leaf() {
            tree.nodes[place] = Node { first: tree.primitive_indices.len() as u32, ..node };
            tree.primitive_indices.extend_from_slice(&source.primitive_indices[node.slots()]);
            continue;
        }
        let first = tree.nodes.len();
        tree.nodes[place] = Node { first: first as u32, ..node };
        tree.nodes.extend([unwritten(C::EMPTY); 2]);
        costs.extend([0.0; 2]);
        open.extend([(part, node.first + 1, first + 1, depth + 1), (part, node.first, first, depth + 1)]);
        if part.is_none() {
            kept.push(place);
        }
    }
    // A sphere depends on what it was made of.
    kept.sort_unstable();
    for &place in kept.iter().rev() {
        ToChildren.fit(&mut tree.nodes, 0, place);
    }
    Ok((tree, costs))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::builders::build_binary;
    use crate::tree::statistics::tree_stats;
    use crate::tree::validate::validate;

    /// Triangles in a row along x, all of size one.
    fn row(count: usize) -> Vec<Triangle> {
        let at = |x: f32| Triangle { a: Vec3::X * x, b: Vec3::new(x, 1.0, 0.0), c: Vec3::new(x, 0.0, 1.0) };
        (0..count).map(|x| at(x as f32)).collect()
    }

    #[test]
    fn only_the_subtree_that_was_mixed_up_is_built_again() {
        let (token, settings) = (CancelToken::new(), BuildSettings::default());
        let mut triangles = row(1024);
        let mut tree = build_binary(&triangles, &settings, &token).unwrap().0;
        let mut built = BuiltCosts::new(&tree, &token).unwrap();
        let rebuild = |tree: &mut AnyTree, built: &mut BuiltCosts, triangles: &[Triangle]| {
            let grown = GrownParts { growth: 1.3, triangles: 2 };
            partial_rebuild(tree, built, triangles, &settings, grown, &token).unwrap()
        };
        assert_eq!(rebuild(&mut tree, &mut built, &triangles), 0, "nothing moved");
        // Apart as a whole, each with the same neighbours.
        let wide: Vec<Triangle> =
            triangles.iter().map(|t| Triangle { a: t.a * 2.0, b: t.b * 2.0, c: t.c * 2.0 }).collect();
        assert_eq!(rebuild(&mut tree, &mut built, &wide), 0, "grown evenly");
        // 64 of them change places with one another.
        for near in 0..32 {
            triangles.swap(2 * near, 63 - near);
        }
        let count = rebuild(&mut tree, &mut built, &triangles);
        assert!((64..512).contains(&count), "{count}");
        validate(&tree, &triangles).unwrap();
        assert_eq!(rebuild(&mut tree, &mut built, &triangles), 0, "built for these places");
        let AnyTree::Aabb(boxes) = &tree else { unreachable!() };
        let depths = boxes.depths(&token).unwrap();
        assert_eq!(depths.into_iter().max(), Some(boxes.max_depth));
        assert_eq!(built.0.len(), boxes.nodes.len());
    }

    #[test]
    fn a_grown_root_is_a_rebuild() {
        let (token, settings) = (CancelToken::new(), BuildSettings::default());
        let mut triangles = row(500);
        let mut tree = build_binary(&triangles, &settings, &token).unwrap().0;
        let mut built = BuiltCosts::new(&tree, &token).unwrap();
        for index in 0..250 {
            triangles.swap(index, (index * 7919) % 500);
        }
        let grown = GrownParts { growth: 1.01, triangles: 1000 };
        assert_eq!(partial_rebuild(&mut tree, &mut built, &triangles, &settings, grown, &token), Ok(500));
        // Node for node, but in another order in memory.
        let rebuilt = build_binary(&triangles, &settings, &token).unwrap().0;
        let [own, expected] = [&tree, &rebuilt].map(|tree| tree_stats(tree, &token).unwrap());
        assert_eq!(own.nodes_per_depth, expected.nodes_per_depth);
        assert!((own.sah_cost - expected.sah_cost).abs() < 1e-5 * expected.sah_cost);
        assert_eq!(tree.primitive_indices(), rebuilt.primitive_indices());
    }
}
