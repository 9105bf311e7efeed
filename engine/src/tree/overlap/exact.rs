//! The exact overlap: pairs of subtrees, one with the surface and one with the containers, are followed down together.
//!
//! A node that does not hold a triangle lies below a sibling of a node that does. So the pairs of siblings, in both orders, are the
//! roots of all pairs of triangle and foreign node. A pair of subtrees ends where the surface is apart from the container, and where the
//! container holds all of the surface its area counts at once.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS, TaskProgress};
use crate::geometry::Aabb;
use crate::kernel::parallel::{par_collect, par_tasks};
use crate::tree::node_metrics::visit_cost;

use super::clip::Clip;
use super::surface::{FurtherSlot, Surface};

/// Mean number of visits for each triangle after which the overlap is given up.
const MAX_VISITS_PER_TRIANGLE: u64 = 1 << 12;
/// Number of slots below the subtrees of one task.
const SLOTS_PER_TASK: u32 = 256;
/// Number of further slots of one task.
const FURTHER_PER_TASK: usize = 1 << 10;

/// The surface below a node.
struct Below {
    bounds: Aabb,
    area: f64,
    slots: u32,
}

/// Why a walk has ended early.
enum Ended {
    Cancelled,
    /// All walks together have made too many visits.
    TooLong,
}

impl From<Cancelled> for Ended {
    fn from(Cancelled: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// The overlap and the number of visits that it took; `None` where these would be too many, which does not depend on the number of
/// threads.
pub(super) fn overlap<C: Clip>(surface: &Surface<'_, C>, token: &CancelToken) -> Result<Option<(f64, u64)>, Cancelled> {
    let below = surface_below(surface, token)?;
    let tasks = tasks(surface, &below, token)?;
    let max_visits = surface.with_area as u64 * MAX_VISITS_PER_TRIANGLE;
    let visits = AtomicU64::new(0);
    let progress = TaskProgress::new((surface.areas.len() + surface.further.len()) as u64);
    let in_walk = |token: &CancelToken, slots: u64, work: &dyn Fn(&mut Walk<'_, '_, C>) -> Result<(), Ended>| {
        let mut walk = Walk {
            surface,
            below: &below,
            token,
            visits: &visits,
            max_visits,
            own_visits: 0,
            cost: 0.0,
            pairs: Vec::new(),
            nodes: Vec::new(),
        };
        // Not begun where the visits are already too many.
        let ended = walk.count().and_then(|()| work(&mut walk)).and_then(|()| walk.count());
        progress.add(slots, token);
        match ended {
            Ok(()) => Ok(Some(walk.cost)),
            Err(Ended::TooLong) => Ok(None),
            Err(Ended::Cancelled) => Err(Cancelled),
        }
    };
    let foreign = par_tasks(&tasks, token, |task, token| {
        in_walk(token, task.slots, &|walk| task.roots.iter().try_for_each(|&root| walk.subtree(root)))
    })?;
    let held = par_tasks(surface.further.chunks(FURTHER_PER_TASK), token, |further, token| {
        in_walk(token, further.len() as u64, &|walk| walk.held(further))
    })?;
    // Summed in the order of the tasks, so that the sum does not depend on the number of threads.
    let sum = |parts: Vec<Option<f64>>| parts.into_iter().sum::<Option<f64>>();
    let cost = sum(foreign).zip(sum(held)).map(|(foreign, held)| foreign - held);
    Ok(cost.map(|cost| ((cost / surface.total).max(0.0), visits.into_inner())))
}

/// The surface below each node.
fn surface_below<C: Clip>(surface: &Surface<'_, C>, token: &CancelToken) -> Result<Vec<Below>, Cancelled> {
    let nodes = &surface.tree.nodes;
    let mut below = par_collect(nodes.len(), token, |index| {
        let slots = nodes[index].slots();
        let mut found = Below { bounds: Aabb::EMPTY, area: 0.0, slots: slots.len() as u32 };
        for slot in slots.filter(|&slot| surface.areas[slot] > 0.0) {
            found.bounds = found.bounds.union(&surface.triangle(slot).bounds());
            found.area += surface.areas[slot];
        }
        found
    })?;
    // Backwards, so that children are done before their parents.
    for index in (1..nodes.len()).rev() {
        token.check_every(MEDIUM_STEPS, index)?;
        let Below { bounds, area, slots } = below[index];
        let parent = &mut below[surface.parents[index] as usize];
        parent.bounds = parent.bounds.union(&bounds);
        parent.area += area;
        parent.slots += slots;
    }
    Ok(below)
}

/// Subtrees whose surface one thread follows.
struct Task {
    roots: Vec<u32>,
    slots: u64,
}

/// Subtrees with all the surface, in tasks of about the same number of slots.
fn tasks<C: Clip>(surface: &Surface<'_, C>, below: &[Below], token: &CancelToken) -> Result<Vec<Task>, Cancelled> {
    let mut tasks: Vec<Task> = Vec::new();
    for (index, node) in surface.tree.nodes.iter().enumerate() {
        token.check_every(MEDIUM_STEPS, index)?;
        let is_small = |index: usize| below[index].slots <= SLOTS_PER_TASK;
        let is_within_other = index > 0 && is_small(surface.parents[index] as usize);
        if !(is_small(index) || node.is_leaf()) || is_within_other {
            continue;
        }
        let slots = u64::from(below[index].slots);
        match tasks.last_mut() {
            Some(task) if task.slots + slots <= u64::from(SLOTS_PER_TASK) => {
                task.roots.push(index as u32);
                task.slots += slots;
            }
            _ => tasks.push(Task { roots: vec![index as u32], slots }),
        }
    }
    Ok(tasks)
}

/// A walk over pairs of subtrees on one thread.
struct Walk<'s, 'a, C> {
    surface: &'s Surface<'a, C>,
    below: &'s [Below],
    token: &'s CancelToken,
    /// Visits of all walks, and how many they may be.
    visits: &'s AtomicU64,
    max_visits: u64,
    /// Visits of this walk that are not yet among these.
    own_visits: u64,
    /// Σ cost · area so far.
    cost: f64,
    /// Memory for pairs and nodes that are still to be visited.
    pairs: Vec<[u32; 2]>,
    nodes: Vec<u32>,
}

impl<C: Clip> Walk<'_, '_, C> {
    /// Adds the surface below `root` in all nodes that do not hold it.
    fn subtree(&mut self, root: u32) -> Result<(), Ended> {
        let nodes = &self.surface.tree.nodes;
        let mut node = root;
        while node != 0 {
            self.visit()?;
            let parent = self.surface.parents[node as usize];
            for sibling in nodes[parent as usize].children().filter(|&sibling| sibling != node) {
                self.pair(root, sibling)?;
            }
            node = parent;
        }
        let mut inner = vec![root];
        while let Some(node) = inner.pop() {
            self.visit()?;
            let children = nodes[node as usize].children();
            for (a, b) in children.clone().flat_map(|a| children.clone().map(move |b| (a, b))) {
                if a != b {
                    self.pair(a, b)?;
                }
            }
            inner.extend(children);
        }
        Ok(())
    }

    /// Adds the surface below `held` in the node `foreign` and those below it.
    fn pair(&mut self, held: u32, foreign: u32) -> Result<(), Ended> {
        let nodes = &self.surface.tree.nodes;
        self.pairs.push([held, foreign]);
        while let Some([held, foreign]) = self.pairs.pop() {
            self.visit()?;
            let below = &self.below[held as usize];
            let node = &nodes[foreign as usize];
            if below.area <= 0.0 || node.container.misses_box(&below.bounds) {
                continue;
            }
            if node.container.contains_box(&below.bounds) {
                self.cost += below.area * visit_cost(node);
                self.pairs.extend(node.children().map(|child| [held, child]));
            } else if nodes[held as usize].is_leaf() {
                for slot in nodes[held as usize].slots() {
                    self.triangle(slot, foreign)?;
                }
            } else {
                self.pairs.extend(nodes[held as usize].children().map(|child| [child, foreign]));
            }
        }
        Ok(())
    }

    /// Adds the triangle in `slot` in the node `foreign` and those below it.
    fn triangle(&mut self, slot: usize, foreign: u32) -> Result<(), Ended> {
        if self.surface.areas[slot] <= 0.0 {
            return self.visit();
        }
        let mut nodes = std::mem::take(&mut self.nodes);
        let surface = self.surface;
        let cost = surface.cost_below(slot, foreign, &mut nodes, || self.visit());
        self.nodes = nodes;
        self.cost += cost?;
        Ok(())
    }

    /// Adds the triangles of `further` slots in the nodes that hold them there: in these they are not foreign.
    fn held(&mut self, further: &[FurtherSlot]) -> Result<(), Ended> {
        let surface = self.surface;
        for &slot in further {
            self.cost += surface.cost_held(slot, || self.visit())?;
        }
        Ok(())
    }

    fn visit(&mut self) -> Result<(), Ended> {
        self.own_visits += 1;
        if self.own_visits >= MEDIUM_STEPS as u64 { self.count() } else { Ok(()) }
    }

    /// Adds the visits of this walk to those of all.
    fn count(&mut self) -> Result<(), Ended> {
        self.token.check()?;
        let own = std::mem::take(&mut self.own_visits);
        let visits = self.visits.fetch_add(own, Ordering::Relaxed) + own;
        if visits > self.max_visits { Err(Ended::TooLong) } else { Ok(()) }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use std::collections::HashSet;

    use glam::Vec3;

    use super::*;
    use crate::builders::build_binary;
    use crate::geometry::Triangle;
    use crate::settings::{BuildSettings, Pass, Passes};
    use crate::tree::node::Tree;
    use crate::tree::{AnyTree, ContainerKind};
    use crate::{orient, with_tree};

    /// Small triangles and some large ones.
    fn soup(count: usize) -> Vec<Triangle> {
        let mut state = 1_u32;
        let mut number = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut point = move || Vec3::new(number(), number(), number());
        let triangle = |index: usize| {
            let (size, place) = (if index.is_multiple_of(9) { 1.5 } else { 0.2 }, point());
            let [a, b, c] = [0; 3].map(|_| place + point() * size);
            Triangle { a, b, c }
        };
        (0..count).map(triangle).collect()
    }

    /// The overlap from each pair of a triangle and a node.
    fn by_pairs<C: Clip>(tree: &Tree<C>, triangles: &[Triangle]) -> f64 {
        let parents = tree.parents(&CancelToken::new()).unwrap();
        let mut held: Vec<HashSet<u32>> = vec![HashSet::new(); tree.nodes.len()];
        for (index, node) in tree.nodes.iter().enumerate().rev() {
            held[index].extend(&tree.primitive_indices[node.slots()]);
            for child in node.children() {
                let below = held[child as usize].clone();
                held[index].extend(below);
            }
        }
        let (mut cost, mut total) = (0.0, 0.0);
        for (triangle, number) in triangles.iter().zip(0..) {
            total += triangle.area();
            let mut is_met = vec![true; tree.nodes.len()];
            for (index, node) in tree.nodes.iter().enumerate().filter(|(index, _)| !held[*index].contains(&number)) {
                let area = node.container.clipped_area(triangle, &triangle.bounds());
                is_met[index] = is_met[parents[index] as usize] && area > 0.0;
                if is_met[index] {
                    cost += area * visit_cost(node);
                }
            }
        }
        cost / total
    }

    fn check(tree: &AnyTree, triangles: &[Triangle], what: &str) {
        with_tree!(tree, tree => {
            let surface = Surface::new(tree, triangles, &CancelToken::new()).unwrap();
            let found = [1, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| overlap(&surface, &CancelToken::new())).unwrap().unwrap()
            });
            assert_eq!(found[0], found[1], "{what}: the same on any number of threads");
            let expected = by_pairs(tree, triangles);
            assert!(expected > 0.1 && (found[0].0 / expected - 1.0).abs() < 1e-9, "{what}: {} for {expected}", found[0].0);
        });
    }

    #[test]
    fn pairs_of_subtrees_find_what_pairs_of_triangle_and_node_do() {
        let triangles = soup(700);
        for container in ContainerKind::ALL {
            for passes in [Passes::NONE, Passes::NONE.with(Pass::Collapse), Passes::FINISHED.with(Pass::Split)] {
                let settings = BuildSettings { optimize: passes, container, ..BuildSettings::default() };
                if settings.refusal(triangles.len()).is_none() {
                    let (tree, _) = build_binary(&triangles, &settings, &CancelToken::new()).unwrap();
                    check(&tree, &triangles, &format!("{container:?}, {passes}"));
                    if let AnyTree::Aabb(_) = tree {
                        let oriented = orient(&tree, &triangles, &CancelToken::new()).unwrap();
                        check(&oriented, &triangles, &format!("oriented, {passes}"));
                    }
                }
            }
        }
    }
}
