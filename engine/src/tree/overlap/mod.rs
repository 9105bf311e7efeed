//! End-point overlap (EPO): the surface of the scene inside nodes that do not hold it.

use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::geometry::Triangle;
use crate::kernel::parallel::{par_collect, par_tasks};
use crate::tree::container::Container;
use crate::tree::node::{AnyTree, Tree};
use crate::tree::statistics::INTERSECTION_COST;
use crate::with_tree;

mod clip;

use clip::Clip;

/// Number of nodes that the samples may visit on average before the rest of them is left out. On models from scans to
/// architecture, in boxes and spheres, they visit 50 to 800.
const VISITS_PER_SAMPLE: u64 = 1 << 12;
/// Minimum number of samples that are looked at together, where each visits every node: enough for all threads, and bounded.
const MIN_SAMPLES_AT_ONCE: u64 = 16;

/// End-point overlap of a tree, and the share of the scene that it is known from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct EndPointOverlap {
    /// The overlap, at least 0, in the unit of the SAH cost.
    pub value: f32,
    /// Number of triangles whose surface was looked for in foreign nodes.
    pub sampled: usize,
    /// Number of triangles with an area.
    pub triangles: usize,
    /// Number of nodes visited: the work that it took.
    pub visited: u64,
}

impl EndPointOverlap {
    /// Whether every triangle counted; otherwise the overlap is an estimate.
    pub fn is_exact(&self) -> bool {
        self.sampled == self.triangles
    }

    /// The sample of an estimate, in words; `None` where the value is exact.
    ///
    /// ```
    /// use bvhscope_engine::tree::overlap::EndPointOverlap;
    ///
    /// let overlap = EndPointOverlap { value: 1.5, sampled: 2_000, triangles: 69_451, visited: 100_000 };
    /// assert_eq!(overlap.estimate_note().as_deref(), Some("estimated from 2000 of 69451 triangles"));
    /// ```
    pub fn estimate_note(&self) -> Option<String> {
        let Self { sampled, triangles, .. } = self;
        (!self.is_exact()).then(|| format!("estimated from {sampled} of {triangles} triangles"))
    }
}

/// End-point overlap (Aila, Karras, Laine: *On Quality Metrics of Bounding Volume Hierarchies*, HPG 2013, section 4): the
/// cost of the surface of the scene that lies inside nodes that do not hold it, over the total surface. An interior node
/// costs [`traversal_cost`](crate::tree::ContainerKind::traversal_cost), a leaf [`INTERSECTION_COST`] for each primitive. `triangles` is
/// the list that `tree` was built from.
///
/// Exact for up to `max_samples` triangles. Beyond, estimated from that many triangles, evenly spread over the total surface.
/// Where triangles coincide, each lies in nearly every node: once the samples have visited some thousand nodes each on average,
/// the rest of them is left out, and the overlap is estimated from fewer. The result has their number; it is the same
/// on any number of threads.
///
/// A triangle in several leaves counts once, and is held by all of them and the nodes above them. 0 for a tree without overlap
/// and for a scene without surface.
pub fn end_point_overlap(
    tree: &AnyTree,
    triangles: &[Triangle],
    max_samples: usize,
    token: &CancelToken,
) -> Result<EndPointOverlap, Cancelled> {
    with_tree!(tree, tree => overlap_of(tree, triangles, max_samples, token))
}

/// A sampled triangle: its first slot in leaf order and the surface area that it represents.
struct Sample {
    slot: u32,
    weight: f64,
}

/// A slot in leaf order that holds the triangle of a sample, and the index of the sample.
struct SampleSlot {
    slot: u32,
    sample: u32,
}

#[expect(clippy::too_many_lines, reason = "the steps of one estimate")]
fn overlap_of<C: Clip>(
    tree: &Tree<C>,
    triangles: &[Triangle],
    max_samples: usize,
    token: &CancelToken,
) -> Result<EndPointOverlap, Cancelled> {
    let mut areas = par_collect(tree.primitive_indices.len(), token, |slot| {
        triangles[tree.primitive_indices[slot] as usize].area()
    })?;
    let is_split = tree.primitive_indices.len() > triangles.len();
    if is_split {
        // Only the first slot of each triangle counts.
        let mut seen = vec![false; triangles.len()];
        for (areas, indices) in areas.chunks_mut(MEDIUM_STEPS).zip(tree.primitive_indices.chunks(MEDIUM_STEPS)) {
            token.check()?;
            for (area, &index) in areas.iter_mut().zip(indices) {
                if std::mem::replace(&mut seen[index as usize], true) {
                    *area = 0.0;
                }
            }
        }
    }
    let (mut total, mut with_area) = (0.0, 0);
    for batch in areas.chunks(MEDIUM_STEPS) {
        token.check()?;
        total = batch.iter().fold(total, |sum, area| sum + area);
        with_area += batch.iter().filter(|area| **area > 0.0).count();
    }
    let mut overlap = EndPointOverlap { value: 0.0, sampled: with_area, triangles: with_area, visited: 0 };
    if tree.nodes.is_empty() || tree.nodes[0].is_leaf() || !(total > 0.0 && total.is_finite()) {
        return Ok(overlap);
    }
    let samples = choose_samples(&areas, total, max_samples.max(1), token)?;
    let parents = tree.parents(token)?;
    let slots = if is_split { all_slots(tree, triangles.len(), &samples, token)? } else { first_slots(&samples) };
    let leaves = leaves_of_slots(tree, &slots, token)?;
    let mut sample_leaves: Vec<(u32, u32)> = slots.iter().zip(leaves).map(|(slot, leaf)| (slot.sample, leaf)).collect();
    sample_leaves.sort_unstable();
    let foreign_of = |&sample_index: &u32, token: &CancelToken| {
        let sample = &samples[sample_index as usize];
        let first = sample_leaves.partition_point(|entry| entry.0 < sample_index);
        let mut own = Vec::new();
        for &(_, leaf) in sample_leaves[first..].iter().take_while(|entry| entry.0 == sample_index) {
            for node in std::iter::successors(Some(leaf), |&node| (node != 0).then(|| parents[node as usize])) {
                token.check_every(MEDIUM_STEPS, own.len())?;
                own.push(node);
            }
        }
        let climbed = own.len() as u64;
        own.sort_unstable();
        own.dedup();
        let slot = sample.slot as usize;
        let triangle = &triangles[tree.primitive_indices[slot] as usize];
        let Foreign { cost, visited } = foreign_cost(tree, triangle, &own, token)?;
        Ok(Foreign { cost: sample.weight * cost / areas[slot], visited: visited + climbed })
    };
    // Any first part of this order is spread over the whole list.
    let mut order: Vec<u32> = (0..samples.len() as u32).collect();
    order.sort_unstable_by_key(|index| index.reverse_bits());
    let max_visits = (max_samples as u64).saturating_mul(VISITS_PER_SAMPLE);
    let mut parts = Vec::with_capacity(samples.len());
    while parts.len() < order.len() && overlap.visited <= max_visits {
        // As many as stay within the limit even if each of them visits every node.
        let at_once = ((max_visits - overlap.visited) / tree.nodes.len() as u64).max(MIN_SAMPLES_AT_ONCE);
        let end = (parts.len() as u64).saturating_add(at_once).min(order.len() as u64) as usize;
        // Collected before they are summed, so that the sum does not depend on the number of threads.
        let found: Vec<Foreign> = par_tasks(&order[parts.len()..end], token, foreign_of)?;
        overlap.visited += found.iter().map(|foreign| foreign.visited).sum::<u64>();
        parts.extend(found.into_iter().map(|foreign| foreign.cost));
    }
    let weight: f64 = order[..parts.len()].iter().map(|&index| samples[index as usize].weight).sum();
    let value = (parts.iter().sum::<f64>() / weight) as f32;
    overlap.value = if value.is_finite() { value } else { 0.0 };
    overlap.sampled = parts.len();
    Ok(overlap)
}

/// All triangles with an area, or those at `max_samples` steps of equal area through the list.
fn choose_samples(
    areas: &[f64],
    total: f64,
    max_samples: usize,
    token: &CancelToken,
) -> Result<Vec<Sample>, Cancelled> {
    if areas.len() <= max_samples {
        let with_area = areas.iter().enumerate().filter(|(_, area)| **area > 0.0);
        return Ok(with_area.map(|(slot, &area)| Sample { slot: slot as u32, weight: area }).collect());
    }
    let step = total / max_samples as f64;
    let mut samples = Vec::with_capacity(max_samples);
    let mut area_so_far = 0.0;
    let mut next = step * 0.5;
    for (slot, &area) in areas.iter().enumerate() {
        token.check_every(MEDIUM_STEPS, slot)?;
        area_so_far += area;
        if area_so_far > next {
            let steps = ((area_so_far - next) / step).floor() + 1.0;
            samples.push(Sample { slot: slot as u32, weight: steps * step });
            next += steps * step;
        }
    }
    Ok(samples)
}

/// Slots of the samples' triangles where each has one slot.
fn first_slots(samples: &[Sample]) -> Vec<SampleSlot> {
    samples.iter().zip(0..).map(|(sample, index)| SampleSlot { slot: sample.slot, sample: index }).collect()
}

/// Slots of the samples' triangles where a triangle can have several; the list has `triangle_count` triangles.
fn all_slots<C: Container>(
    tree: &Tree<C>,
    triangle_count: usize,
    samples: &[Sample],
    token: &CancelToken,
) -> Result<Vec<SampleSlot>, Cancelled> {
    const NO_SAMPLE: u32 = u32::MAX;
    let mut sample_of = vec![NO_SAMPLE; triangle_count];
    for (sample, index) in samples.iter().zip(0..) {
        sample_of[tree.primitive_indices[sample.slot as usize] as usize] = index;
    }
    let mut slots = Vec::with_capacity(samples.len());
    for (batch, indices) in tree.primitive_indices.chunks(MEDIUM_STEPS).enumerate() {
        token.check()?;
        for (&index, slot) in indices.iter().zip((batch * MEDIUM_STEPS) as u32..) {
            let sample = sample_of[index as usize];
            if sample != NO_SAMPLE {
                slots.push(SampleSlot { slot, sample });
            }
        }
    }
    Ok(slots)
}

/// Index of the leaf of each slot; `slots` is in ascending order.
fn leaves_of_slots<C: Container>(
    tree: &Tree<C>,
    slots: &[SampleSlot],
    token: &CancelToken,
) -> Result<Vec<u32>, Cancelled> {
    let mut leaves = vec![0; slots.len()];
    for (index, node) in tree.nodes.iter().enumerate() {
        token.check_every(MEDIUM_STEPS, index)?;
        if node.is_leaf() {
            let begin = slots.partition_point(|slot| slot.slot < node.first);
            let count = slots[begin..].iter().take_while(|slot| slot.slot < node.first + node.count).count();
            leaves[begin..begin + count].fill(index as u32);
        }
    }
    Ok(leaves)
}

/// Cost of a triangle in the nodes that do not hold it.
struct Foreign {
    /// Σ cost · area of the triangle inside the node, over these nodes.
    cost: f64,
    /// Number of nodes visited.
    visited: u64,
}

/// The cost of `triangle` in nodes that do not hold it. `own` lists those that do, in ascending order.
fn foreign_cost<C: Clip>(
    tree: &Tree<C>,
    triangle: &Triangle,
    own: &[u32],
    token: &CancelToken,
) -> Result<Foreign, Cancelled> {
    let bounds = triangle.bounds();
    let mut cost = 0.0;
    // Children of its own nodes that are not its own are the roots of all foreign subtrees.
    let mut stack = Vec::new();
    for (step, &node) in own.iter().enumerate() {
        token.check_every(MEDIUM_STEPS, step)?;
        stack.extend(tree.nodes[node as usize].children().filter(|child| own.binary_search(child).is_err()));
    }
    // Where all triangles coincide, all nodes are visited.
    let mut visited = 0;
    while let Some(index) = stack.pop() {
        visited += 1;
        if visited % MEDIUM_STEPS as u64 == 0 {
            token.check()?;
        }
        let node = &tree.nodes[index as usize];
        let area = node.container.clipped_area(triangle, &bounds);
        if area <= 0.0 {
            continue;
        }
        if node.is_leaf() {
            cost += area * f64::from(INTERSECTION_COST) * f64::from(node.count);
        } else {
            cost += area * f64::from(C::KIND.traversal_cost());
            stack.extend(node.children());
        }
    }
    Ok(Foreign { cost, visited })
}
