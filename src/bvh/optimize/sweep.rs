//! Top-down trees over clusters: the cheapest split by the surface area heuristic, swept exactly where few clusters are left,
//! over bins where there are many (Wald, *On fast Construction of SAH-based Bounding Volume Hierarchies*, 2007).

use glam::Vec3A;

use super::below::Below;
use crate::geometry::Aabb;

/// Bins along each axis.
const BINS: usize = 32;
/// Up to this many clusters are built by one thread.
const FORK_ABOVE: usize = 4096;
/// Up to this many clusters every split is tried.
const SWEEP_UP_TO: usize = 8;
/// Below this depth clusters are halved without looking for a better split, which bounds the recursion.
const MAX_SPLIT_DEPTH: u32 = 96;

/// A box for arithmetic: four lanes a corner.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    min: Vec3A,
    max: Vec3A,
}

impl Bounds {
    pub const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    pub fn new(container: &Aabb) -> Self {
        Self { min: container.min.into(), max: container.max.into() }
    }

    pub fn container(&self) -> Aabb {
        Aabb { min: self.min.into(), max: self.max.into() }
    }

    #[inline(always)]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Half of the surface area; must not be asked of an empty box.
    #[inline(always)]
    pub fn half_area(&self) -> f32 {
        let d = self.max - self.min;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// What is not taken apart: a subtree that goes into the new tree as it is, or a part of the new tree.
#[derive(Debug, Clone, Copy)]
pub struct Cluster {
    pub bounds: Bounds,
    pub below: Below,
    /// The subtree's number where it is given; the slot of its two parts where it is new.
    pub link: u32,
    /// Whether it is new.
    pub new: bool,
}

impl Cluster {
    /// A subtree that exists.
    pub fn given(container: &Aabb, below: Below, link: u32) -> Self {
        Self { bounds: Bounds::new(container), below, link, new: false }
    }

    fn joined(left: &Self, right: &Self, slot: u32) -> Self {
        let bounds = left.bounds.union(&right.bounds);
        let below = Below::joined(bounds.half_area(), left.below, right.below);
        Self { bounds, below, link: slot, new: true }
    }

    /// Twice the middle: enough to compare by.
    #[inline(always)]
    fn middle(&self) -> Vec3A {
        self.bounds.min + self.bounds.max
    }
}

/// The tree over `clusters`, at least one. The parts of each new cluster go to `slots`, one fewer than there are clusters; slot
/// numbers start at `offset`.
pub fn build(clusters: &mut [Cluster], slots: &mut [[Cluster; 2]], offset: usize, depth: u32) -> Cluster {
    if let [cluster] = clusters {
        return *cluster;
    }
    let middle = if depth < MAX_SPLIT_DEPTH { best_split(clusters) } else { clusters.len() / 2 };
    let forks = clusters.len() > FORK_ABOVE;
    let (left, right) = clusters.split_at_mut(middle);
    let (left_slots, rest) = slots.split_at_mut(middle - 1);
    let (own, right_slots) = rest.split_at_mut(1);
    let mut build_left = || build(left, left_slots, offset, depth + 1);
    let mut build_right = || build(right, right_slots, offset + middle, depth + 1);
    let (left, right) = if forks { rayon::join(build_left, build_right) } else { (build_left(), build_right()) };
    own[0] = [left, right];
    Cluster::joined(&left, &right, (offset + middle - 1) as u32)
}

/// Reorders `clusters`, at least two, so that the cheapest split found lies at the returned position.
fn best_split(clusters: &mut [Cluster]) -> usize {
    match clusters.len() {
        2 => 1,
        count if count <= SWEEP_UP_TO => swept_split(clusters),
        _ => binned_split(clusters),
    }
}

/// Every split along each axis.
fn swept_split(clusters: &mut [Cluster]) -> usize {
    let count = clusters.len();
    let mut best = (f32::INFINITY, 0, count / 2);
    let mut orders = [[0_u8; SWEEP_UP_TO]; 3];
    for (axis, order) in orders.iter_mut().enumerate() {
        let order = &mut order[..count];
        for (at, place) in order.iter_mut().enumerate() {
            *place = at as u8;
        }
        order.sort_unstable_by(|&a, &b| {
            let key = |at: u8| clusters[at as usize].middle()[axis];
            key(a).total_cmp(&key(b)).then(a.cmp(&b))
        });
        let mut right_costs = [0.0; SWEEP_UP_TO];
        let (mut bounds, mut primitives) = (Bounds::EMPTY, 0);
        for at in (1..count).rev() {
            let cluster = &clusters[order[at] as usize];
            bounds = bounds.union(&cluster.bounds);
            primitives += cluster.below.primitives;
            right_costs[at] = bounds.half_area() * primitives as f32;
        }
        (bounds, primitives) = (Bounds::EMPTY, 0);
        for at in 1..count {
            let cluster = &clusters[order[at - 1] as usize];
            bounds = bounds.union(&cluster.bounds);
            primitives += cluster.below.primitives;
            let cost = bounds.half_area() * primitives as f32 + right_costs[at];
            if cost < best.0 {
                best = (cost, axis, at);
            }
        }
    }
    let mut sorted = [clusters[0]; SWEEP_UP_TO];
    for (place, &at) in sorted.iter_mut().zip(&orders[best.1][..count]) {
        *place = clusters[at as usize];
    }
    clusters.copy_from_slice(&sorted[..count]);
    best.2
}

/// Splits between bins along each axis.
fn binned_split(clusters: &mut [Cluster]) -> usize {
    let mut middles = Bounds::EMPTY;
    for cluster in clusters.iter() {
        middles = Bounds { min: middles.min.min(cluster.middle()), max: middles.max.max(cluster.middle()) };
    }
    let extent = middles.max - middles.min;
    let scale = Vec3A::select(extent.cmpgt(Vec3A::ZERO), Vec3A::splat(BINS as f32 * 0.9999) / extent, Vec3A::ZERO);
    let scale = Vec3A::select(scale.is_finite_mask(), scale, Vec3A::ZERO);
    let bins_of = |cluster: &Cluster| ((cluster.middle() - middles.min) * scale).as_uvec3();
    let mut counts = [[0_u32; BINS]; 3];
    let mut boxes = [[Bounds::EMPTY; BINS]; 3];
    for cluster in clusters.iter() {
        let bins = bins_of(cluster);
        for (axis, bin) in bins.to_array().into_iter().enumerate() {
            let bin = bin as usize % BINS;
            counts[axis][bin] += cluster.below.primitives;
            boxes[axis][bin] = boxes[axis][bin].union(&cluster.bounds);
        }
    }
    let total: u32 = counts[0].iter().sum();
    let mut best: Option<(f32, usize, u32)> = None;
    for axis in (0..3).filter(|&axis| scale[axis] > 0.0) {
        let mut right_costs = [0.0; BINS];
        let (mut bounds, mut count) = (Bounds::EMPTY, 0);
        for bin in (1..BINS).rev() {
            bounds = bounds.union(&boxes[axis][bin]);
            count += counts[axis][bin];
            right_costs[bin] = if count > 0 { bounds.half_area() * count as f32 } else { 0.0 };
        }
        (bounds, count) = (Bounds::EMPTY, 0);
        for bin in 1..BINS {
            bounds = bounds.union(&boxes[axis][bin - 1]);
            count += counts[axis][bin - 1];
            if count == 0 || count == total {
                continue;
            }
            let cost = bounds.half_area() * count as f32 + right_costs[bin];
            if best.is_none_or(|best| cost < best.0) {
                best = Some((cost, axis, bin as u32));
            }
        }
    }
    let Some((_, axis, bin)) = best else { return clusters.len() / 2 };
    // Unstable, but the same on each run: swaps depend on the clusters only.
    let mut middle = 0;
    for at in 0..clusters.len() {
        if bins_of(&clusters[at])[axis] < bin {
            clusters.swap(at, middle);
            middle += 1;
        }
    }
    middle
}
