//! `combine_clusters(C, n)`, figure 7: the upward half of approximate agglomerative clustering (Gu et al., HPG 2013). The closest
//! pair of clusters is merged until n are left:
//!
//! ```text
//! combine_clusters(C, n):
//!     for each c in C: c.closest = find_best_match(C, c)
//!     while |C| > n:
//!         (left, right) = the pair c, c.closest with the smallest distance d(c, c.closest)
//!         C = C − {left, right} + the cluster of both
//!         search again: the best match of the new cluster, and of each c whose c.closest was left or right
//!     return C
//! ```
//!
//! The distance is the surface area of the container around both. Of equally close pairs the one with fewer primitives is
//! merged first, then the one at the lower indices, so that a build is deterministic. A union takes the place of its first
//! cluster and leaves that of its second empty, until the last clusters of the list are moved to the empty places: at the
//! end, or once a long list has many.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::{Simd, f32x8, f32x16};

use crate::aac::cluster::ClusterStack;
use crate::aac::cluster_container::ClusterContainer;
use crate::aac::combine_long::{Scratch, combine_long};
use crate::aac::combine_short::combine_short;
use crate::aac::pair_writer::PairWriter;
use crate::cancel::{CancelToken, Cancelled};

/// Merges the closest pair of the clusters from `base` on until at most `target` are left. Both clusters of each merge are
/// written to `pairs` as siblings.
#[inline(always)]
pub fn combine_clusters<C: ClusterContainer, S: Simd>(
    simd: S,
    list: &mut ClusterStack<C>,
    scratch: &mut Scratch<C>,
    base: usize,
    target: usize,
    pairs: &mut PairWriter<C>,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let len = list.len - base;
    if len <= target {
        return Ok(());
    }
    // All variants merge the same clusters, except where indices alone break a tie: a long list moves its last clusters earlier.
    match len {
        0..=8 => combine_short::<C, S, f32x8<S>, 1, 8>(simd, list, base, target, pairs),
        9..=16 if C::LONGEST_SHORT_LIST >= 16 => {
            combine_short::<C, S, f32x16<S>, 1, 16>(simd, list, base, target, pairs);
        }
        17..=32 if C::LONGEST_SHORT_LIST >= 32 => {
            combine_short::<C, S, f32x16<S>, 2, 32>(simd, list, base, target, pairs);
        }
        _ => return combine_long(simd, list, scratch, base, target, pairs, token),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::aac::cluster::Cluster;
    use crate::geometry::{Aabb, Container as _, Dop14, Sphere};
    use crate::kernel::SimdLevel;
    use crate::kernel::simd::dispatch;
    use crate::tree::Node;

    /// Small containers at few positions, so that many distances are equal. No two clusters have the same number of primitives:
    /// indices never break a tie.
    fn clusters<C: ClusterContainer>(count: usize, seed: u32) -> ClusterStack<C> {
        let mut state = seed;
        let mut number = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) % below
        };
        let mut list = ClusterStack::with_capacity(count);
        for first in 0..count as u32 {
            // Of very many pairs at the same distance not all are compared.
            let places = if count > 64 { [64, 48, 32] } else { [4, 3, 2] };
            let a = Vec3::from(places.map(|below| number(below) as f32));
            let b = a + Vec3::new(number(2) as f32, number(2) as f32, 0.5);
            let container = C::of_triangle(&crate::geometry::Triangle { a, b, c: a });
            let primitives =
                if count < 32 { 1 << (first * 11 % count as u32) } else { number(1 << 16) << 8 | number(1 << 8) };
            list.push(Cluster { fields: container.fields(), first, count: primitives });
        }
        list
    }

    /// The nodes that are written while `count` clusters are merged to `target`, then those of the remaining clusters.
    fn merged<C: ClusterContainer>(
        level: SimdLevel,
        count: usize,
        target: usize,
        seed: u32,
        long: bool,
    ) -> Vec<Node<C>> {
        let mut nodes: Vec<Node<C>> = bytemuck::zeroed_vec(2 * (count - target));
        let mut list = clusters::<C>(count, seed);
        let (mut pairs, mut scratch, token) =
            (PairWriter::new(&mut nodes, 100), Scratch::default(), CancelToken::new());
        let result = dispatch!(level.level(), simd => {
            if long {
                combine_long(simd, &mut list, &mut scratch, 0, target, &mut pairs, &token)
            } else {
                combine_clusters(simd, &mut list, &mut scratch, 0, target, &mut pairs, &token)
            }
        });
        assert!(result.is_ok());
        assert_eq!(list.len, target);
        for at in 0..target {
            for field in 0..C::USED_FIELDS {
                let forms = [list.items[at].fields[field], list.fields[field][at]];
                assert_eq!(forms[0], forms[1], "both forms of a cluster are the same");
            }
        }
        let remaining = list.items[..target].iter().map(Cluster::node).collect();
        in_order(nodes, remaining)
    }

    /// `nodes` and those of the `remaining` clusters, independent of the clusters' order.
    fn in_order<C: ClusterContainer>(mut nodes: Vec<Node<C>>, mut remaining: Vec<Node<C>>) -> Vec<Node<C>> {
        let order = |node: &Node<C>| (node.count, node.first);
        remaining.sort_unstable_by_key(order);
        nodes.chunks_mut(2).for_each(|pair| pair.sort_unstable_by_key(order));
        nodes.extend(remaining);
        nodes
    }

    /// Merging as in the paper, without the code that does it in lanes.
    trait Plain: ClusterContainer {
        fn distance(&self, other: &Self) -> f32;
        fn around(&self, other: &Self) -> Self;
    }

    impl Plain for Aabb {
        fn distance(&self, other: &Self) -> f32 {
            let size = self.around(other).max - self.around(other).min;
            size.x * size.y + size.y * size.z + size.z * size.x
        }

        fn around(&self, other: &Self) -> Self {
            let [mut min, mut max] = [self.min, self.max];
            for axis in 0..3 {
                min[axis] = if other.min[axis] < min[axis] { other.min[axis] } else { min[axis] };
                max[axis] = if other.max[axis] > max[axis] { other.max[axis] } else { max[axis] };
            }
            Self { min, max }
        }
    }

    impl Plain for Sphere {
        fn distance(&self, other: &Self) -> f32 {
            let [x, y, z] = (self.center - other.center).to_array();
            let reach = ((x * x + y * y + z * z).sqrt() + (self.radius + other.radius)) * 0.5;
            [self.radius, other.radius].into_iter().fold(reach, f32::max)
        }

        fn around(&self, other: &Self) -> Self {
            self.union(other)
        }
    }

    impl Plain for Dop14 {
        fn distance(&self, other: &Self) -> f32 {
            self.around(other).half_area()
        }

        fn around(&self, other: &Self) -> Self {
            self.union(other)
        }
    }

    /// The result of [`merged`] by comparing all pairs before each merge.
    fn merged_by_brute_force<C: Plain>(count: usize, target: usize, seed: u32) -> Vec<Node<C>> {
        let mut items: Vec<Node<C>> = clusters::<C>(count, seed).items[..count].iter().map(Cluster::node).collect();
        let mut nodes = Vec::new();
        while items.len() > target {
            let mut best = (f32::INFINITY, u32::MAX, 0, 0);
            for high in 1..items.len() {
                for low in 0..high {
                    let distance = items[low].container.distance(&items[high].container);
                    let pair = (distance, items[low].count + items[high].count, low, high);
                    best = if pair < best { pair } else { best };
                }
            }
            let (.., low, high) = best;
            let pair = [items[low], items[high]];
            // Pairs are written from the end of the slice, whose first node has index 100.
            nodes.splice(0..0, pair);
            let first = 100 + (2 * (count - target) - nodes.len()) as u32;
            let container = pair[0].container.around(&pair[1].container);
            items[low] = Node { container, first, count: pair[0].count + pair[1].count };
            items.remove(high);
        }
        in_order(nodes, items)
    }

    fn check_long<C: Plain>() {
        for (count, target) in [(33, 32), (33, 1), (48, 32), (64, 32), (80, 49), (97, 7), (128, 73), (200, 1)] {
            for seed in 0..4 {
                let expected = merged_by_brute_force::<C>(count, target, seed);
                for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
                    let nodes = merged::<C>(level, count, target, seed, false);
                    assert_eq!(nodes.len(), expected.len());
                    for (node, expected) in nodes.iter().zip(&expected) {
                        let name = level.name();
                        assert_eq!(
                            (node.first, node.count),
                            (expected.first, expected.count),
                            "{count} to {target}, {name}"
                        );
                        assert_eq!(node.container, expected.container, "{count} to {target}, {name}");
                    }
                }
            }
        }
    }

    #[test]
    fn long_lists_merge_the_closest_boxes() {
        check_long::<Aabb>();
    }

    #[test]
    fn long_lists_merge_the_closest_spheres() {
        check_long::<Sphere>();
    }

    #[test]
    fn long_lists_merge_the_closest_polytopes() {
        check_long::<Dop14>();
    }

    fn check<C: ClusterContainer>() {
        for count in (2..=31).filter(|count| count % 11 != 0) {
            for seed in 0..20 {
                let target = 1 + seed as usize % (count - 1);
                let [short, long] = [false, true].map(|long| {
                    let expected = merged::<C>(SimdLevel::Sse2, count, target, seed, long);
                    for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
                        let nodes = merged::<C>(level, count, target, seed, long);
                        assert!(nodes == expected, "{count} to {target}, seed {seed}, {}, long: {long}", level.name());
                    }
                    expected
                });
                for (short, long) in short.iter().zip(&long) {
                    assert_eq!(
                        (short.first, short.count),
                        (long.first, long.count),
                        "{count} to {target}, seed {seed}"
                    );
                    // The order of two spheres affects the last bits of their union.
                    let [short, long] = [short, long].map(|node| node.container.fields());
                    let is_close = |field: usize| (short[field] - long[field]).abs() <= 1e-6;
                    assert!((0..C::USED_FIELDS).all(is_close), "{count} to {target}, seed {seed}");
                }
            }
        }
    }

    #[test]
    fn short_and_long_lists_merge_the_same_boxes_at_every_level() {
        check::<Aabb>();
    }

    #[test]
    fn short_and_long_lists_merge_the_same_spheres_at_every_level() {
        check::<Sphere>();
    }

    #[test]
    fn short_and_long_lists_merge_the_same_polytopes_at_every_level() {
        check::<Dop14>();
    }
}
