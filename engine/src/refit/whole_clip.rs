//! One tree for a whole clip of animation (Bittner, Meister, *T-SAH: Animation Optimized Bounding Volume Hierarchies*, 2015).
//!
//! The cost of a tree is the mean of its SAH costs in several poses. Since each of these is a sum of areas of nodes, whatever optimises a
//! tree by areas does so for the clip once the area of a node is the mean of those of its boxes in all poses, each over the area of the
//! root there.

use super::bottom_up::{ToChildren, fit};
use crate::builders::{BuildError, build_binary};
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::{Aabb, Triangle};
use crate::optimize::{Effort, NodeBounds as _, reinsert, write_in_order};
use crate::settings::{BuildSettings, BuilderKind, Pass};
use crate::tree::statistics::{INTERSECTION_COST, TRAVERSAL_COST, tree_stats};
use crate::tree::{AnyTree, Container as _, Node, Tree, with_built_tree};

/// Poses at most that a tree is optimised for.
const MAX_POSES: usize = 16;

/// Effort of reinsertion: the tree is made once for a clip.
const EFFORT: Effort = Effort { max_rounds: 40, min_gain: 1e-4, primitives_per_candidate: 8 };

/// Builds one binary tree for several poses of the same triangles, in the calling thread's rayon pool: of the trees that `settings` build
/// in each pose the one whose mean SAH cost over all poses is least; of boxes, its subtrees are then moved to where that mean falls. It is
/// fitted to the first pose, and is fitted to any other by [`refit()`](super::refit()).
///
/// 4, 8 and 16 poses, at equal distances in time, have equal weights. Of more, 16 are taken. While a tree is optimised, each node has a
/// box for each pose: 24 bytes times poses. [`Pass::Split`] is left out, and [`BuilderKind::Sweep`] takes the place of [`BuilderKind::Sbvh`]:
/// parts of triangles do not move with them. The same tree for any number of threads.
///
/// # Errors
///
/// As [`build_binary`].
///
/// # Panics
///
/// Where the poses have different numbers of triangles.
pub fn build_for_poses<P: AsRef<[Triangle]>>(
    poses: &[P],
    settings: &BuildSettings,
    token: &CancelToken,
) -> Result<AnyTree, BuildError> {
    let count = poses.len().min(MAX_POSES);
    let poses: Vec<&[Triangle]> = (0..count).map(|pose| poses[pose * poses.len() / count].as_ref()).collect();
    let builder = if settings.builder == BuilderKind::Sbvh { BuilderKind::Sweep } else { settings.builder };
    let passes = settings.optimize.without(Pass::Split).without(Pass::Orient);
    let settings = BuildSettings { builder, optimize: passes, ..*settings };
    let Some(&first) = poses.first() else { return Ok(build_binary(&[], &settings, token)?.0) };
    assert!(poses.iter().all(|pose| pose.len() == first.len()), "poses of different models");
    let mut best: Option<(f64, AnyTree)> = None;
    for (at, pose) in poses.iter().enumerate() {
        let token = token.part(at, 2 * count);
        let (tree, _) = build_binary(pose, &settings, &token)?;
        let (cost, tree) = summed_cost(tree, &poses, &token)?;
        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, tree));
        }
    }
    let Some((_, mut tree)) = best else { unreachable!("there is a pose") };
    if let AnyTree::Aabb(tree) = &mut tree {
        let token = token.part(1, 2);
        match count {
            ..=4 => optimize::<4>(tree, &poses, &token)?,
            5..=8 => optimize::<8>(tree, &poses, &token)?,
            _ => optimize::<MAX_POSES>(tree, &poses, &token)?,
        }
    }
    fit_to(&mut tree, first, token)?;
    Ok(tree)
}

fn fit_to(tree: &mut AnyTree, pose: &[Triangle], token: &CancelToken) -> Result<(), Cancelled> {
    with_built_tree!(tree, tree => fit(tree, pose, |_, fitted| fitted, &ToChildren, token), _tree => {
        unreachable!("no builder makes oriented boxes")
    })
}

/// The sum of the SAH costs of a tree over all poses, and the tree, fitted to the last.
fn summed_cost(mut tree: AnyTree, poses: &[&[Triangle]], token: &CancelToken) -> Result<(f64, AnyTree), Cancelled> {
    let mut sum = 0.0;
    for pose in poses {
        fit_to(&mut tree, pose, token)?;
        sum += f64::from(tree_stats(&tree, token)?.sah_cost);
    }
    Ok((sum, tree))
}

/// Moves subtrees where that lowers the mean SAH cost over `K` poses, which are those of `poses` in turn. Leaves containers of no pose.
fn optimize<const K: usize>(
    tree: &mut Tree<Aabb>,
    poses: &[&[Triangle]],
    token: &CancelToken,
) -> Result<(), Cancelled> {
    if tree.nodes.len() < 2 {
        return Ok(());
    }
    let unfitted = |node: &Node<Aabb>| Node { container: [Aabb::EMPTY; K], first: node.first, count: node.count };
    let mut nodes: Vec<Node<[Aabb; K]>> = tree.nodes.iter().map(unfitted).collect();
    for at in 0..K {
        fit(tree, poses[at * poses.len() / K], |_, fitted| fitted, &ToChildren, token)?;
        let root_area = tree.nodes[0].container.half_area();
        // Lengths over the root of the root's area make areas over that area.
        let scale = if root_area > 0.0 && root_area.is_finite() { root_area.sqrt().recip() } else { 1.0 };
        for (posed, node) in nodes.iter_mut().zip(&tree.nodes) {
            posed.container[at] = node.container.scaled(scale);
        }
    }
    let cost = |node: &Node<[Aabb; K]>| {
        let each = if node.is_leaf() { INTERSECTION_COST * node.count as f32 } else { TRAVERSAL_COST };
        f64::from(node.container.mean_half_area() * each)
    };
    let cost: f64 = nodes.iter().map(cost).sum();
    reinsert(&mut nodes, tree.primitive_indices.len(), cost, EFFORT, token)?;
    for (node, posed) in tree.nodes.iter_mut().zip(&nodes) {
        (node.first, node.count) = (posed.first, posed.count);
    }
    write_in_order(tree, token)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use glam::Vec3;

    use super::*;

    /// Two pairs of triangles that pass each other: in the first pose neighbours by x, in all others by y.
    fn passing(seconds: f32) -> Vec<Triangle> {
        let at = |x: f32, y: f32| {
            let a = Vec3::new(x, y, 0.0);
            Triangle { a, b: a + Vec3::X * 0.1, c: a + Vec3::Y * 0.1 }
        };
        let mut triangles = Vec::new();
        for index in 0..32 {
            let side = if index % 2 == 0 { 1.0 } else { -1.0 };
            triangles.push(at(index as f32 * 0.2, side * seconds * 40.0));
        }
        triangles
    }

    #[test]
    fn the_mean_over_all_poses_is_less_than_that_of_the_first_ones_tree() {
        let (token, settings) = (CancelToken::new(), BuildSettings::default());
        for count in [2, 4, 5, 8, 16, 40] {
            let poses: Vec<Vec<Triangle>> = (0..count).map(|pose| passing(pose as f32 / count as f32)).collect();
            let lists: Vec<&[Triangle]> = poses.iter().map(Vec::as_slice).collect();
            let mean = |tree: AnyTree| summed_cost(tree, &lists, &token).unwrap().0 / f64::from(count);
            let of_first = mean(build_binary(&poses[0], &settings, &token).unwrap().0);
            let of_all = mean(build_for_poses(&poses, &settings, &token).unwrap());
            assert!(of_all < of_first * 0.99, "{count} poses: {of_all} of {of_first}");
            // Moves of subtrees lower the mean of poses of equal weights, not the cost in one of them.
            let of_each = poses.iter().map(|pose| mean(build_binary(pose, &settings, &token).unwrap().0));
            let least = of_each.fold(f64::INFINITY, f64::min);
            assert!(
                of_all < least * 1.000_01 || !matches!(count, 2 | 4 | 8 | 16),
                "{count} poses: {of_all} of {least}"
            );
        }
    }
}
