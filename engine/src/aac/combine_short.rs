//! `combine_clusters` for lists of up to 32 clusters, which are nearly all in a build: the distances of all pairs are computed
//! at once and stored as a matrix in the L1 cache, so that no best match is ever searched again. A merge changes one row and one
//! column of it. The smallest distance is the minimum of the columns' minima, and unless it occurs twice, its lanes identify
//! the pair. A union takes the place of its first cluster, and that of the second stays empty until the end.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same lane or row")]

use fearless_simd::{Select, Simd, SimdMask};

use crate::aac::cluster::{Cluster, ClusterStack};
use crate::aac::cluster_container::{ClusterContainer, splat_fields};
use crate::aac::pair_writer::PairWriter;
use crate::kernel::bits::bits;
use crate::kernel::lanes::{Fields, Lanes};

/// Distances between up to `N` clusters, one row per cluster; infinity on the diagonal and in rows of no cluster. Columns of empty
/// places are stale.
#[repr(align(64))]
struct Matrix<const N: usize>([[f32; N]; N]);

/// Merges the closest pair of the clusters from `base` on until `target` are left. There must be more than `target` and at most
/// `N` clusters, the lanes of `W` vectors.
#[inline(always)]
#[expect(clippy::too_many_lines, reason = "one loop over lists in registers")]
pub fn combine_short<C: ClusterContainer, S: Simd, V: Lanes<S>, const W: usize, const N: usize>(
    simd: S,
    list: &mut ClusterStack<C>,
    base: usize,
    target: usize,
    pairs: &mut PairWriter<C>,
) {
    const { assert!(N == W * V::LEN && N.is_power_of_two() && N <= 32) };
    let mut len = list.len - base;
    let infinity = V::splat(simd, f32::INFINITY);
    let mut fields = [C::Fields::splat(infinity); W];
    for w in 0..W {
        fields[w] = list.load_row::<S, V>(simd, base + w * V::LEN);
    }
    let Ok(items) = <&mut [Cluster<C>; N]>::try_from(&mut list.items[base..base + N]) else { return };

    let quads = len.div_ceil(4);
    // One bit per place that holds a cluster.
    let mut occupied = (1_u64 << len) - 1;
    // for each c in C: its distances to all others, and the minimum of each column
    let mut matrix = Matrix([[f32::INFINITY; N]; N]);
    let mut nearest = [infinity; W];
    for at in 0..len {
        let own = splat_fields::<C, S, V>(simd, &items[at % N].fields);
        let none = lanes::<S, V, W>(simd, !occupied | 1 << at);
        for w in 0..W {
            let distances = none[w].select(infinity, C::merge_distances(simd, &own, &fields[w]));
            distances.store_slice(&mut matrix.0[at % N][w * V::LEN..(w + 1) * V::LEN]);
            nearest[w] = nearest[w].min(distances);
        }
    }
    // Distances of the latest union, which is at `low`; not included in `nearest`.
    let mut union_distances = [infinity; W];
    let mut low = 0;
    loop {
        // (left, right) = the pair with the smallest distance: among the other clusters, or with the latest union
        let mut smallest = nearest[0].min(union_distances[0]);
        for w in 1..W {
            smallest = smallest.min(nearest[w]).min(union_distances[w]);
        }
        let smallest = V::splat(simd, smallest.reduce_min());
        let others = bits_of::<S, V, W>(&nearest, smallest);
        let with_union = bits_of::<S, V, W>(&union_distances, smallest);
        let candidates = others | with_union | u32::from(with_union != 0) << low;
        let high;
        if candidates.count_ones() == 2 {
            low = candidates.trailing_zeros() as usize % N;
            high = candidates.ilog2() as usize % N;
        } else {
            (low, high) = matrix.break_tie::<C, S, V, W>(simd, smallest, candidates & occupied as u32, items);
        }

        // C = C − {left, right} + the cluster of both, in the place of the first
        let pair = [items[low], items[high]];
        let union = C::union_fields::<S, V>(simd, &pair[0].fields, &pair[1].fields);
        items[low] = Cluster::from_lanes::<S, V>(&union, pairs.push(&pair), pair[0].count + pair[1].count);
        let at_low = lanes::<S, V, W>(simd, 1 << low);
        for w in 0..W {
            for field in 0..C::USED_FIELDS {
                fields[w][field] = at_low[w].select(union[field], fields[w][field]);
            }
        }
        occupied &= !(1 << high);
        len -= 1;
        if len <= target {
            break;
        }

        // The distances of the new cluster, and the columns' minima without it.
        let none = lanes::<S, V, W>(simd, !occupied | 1 << low);
        for w in 0..W {
            union_distances[w] = none[w].select(infinity, C::merge_distances(simd, &union, &fields[w]));
        }
        matrix.0[low] = [f32::INFINITY; N];
        matrix.0[high] = [f32::INFINITY; N];
        // Four independent minima, to break the dependency chain.
        let mut minima = [[infinity; W]; 4];
        for rows in matrix.0.as_chunks::<4>().0.iter().take(quads) {
            for at in 0..4 {
                let row = row_of::<S, V, W, N>(simd, &rows[at]);
                for w in 0..W {
                    minima[at][w] = minima[at][w].min(row[w]);
                }
            }
        }
        for w in 0..W {
            let minimum = minima[0][w].min(minima[1][w]).min(minima[2][w].min(minima[3][w]));
            nearest[w] = none[w].select(infinity, minimum);
            union_distances[w].store_slice(&mut matrix.0[low][w * V::LEN..(w + 1) * V::LEN]);
        }
        // Scalar stores: for whole rows with one lane selected the compiler emits masked stores, which are slow on AMD under AVX2.
        let union_row = matrix.0[low];
        for (row, distance) in matrix.0.iter_mut().zip(union_row).take(4 * quads) {
            row[low] = distance;
        }
    }
    for w in 0..W {
        for field in 0..C::USED_FIELDS {
            let at = base + w * V::LEN;
            fields[w][field].store_slice(&mut list.fields[field][at..at + V::LEN]);
        }
    }
    list.len = base + len;
    // Move the last clusters to the empty places.
    let mut behind = occupied & (u64::MAX << len);
    while behind != 0 {
        let (from, to) = (behind.ilog2() as usize, occupied.trailing_ones() as usize);
        behind &= !(1 << from);
        occupied |= 1 << to;
        list.set(base + to, list.items[base + from]);
    }
}

impl<const N: usize> Matrix<N> {
    /// Of the pairs whose distance is `smallest`, all among the `candidates`, the one with the fewest primitives, then with the
    /// lowest places.
    #[inline(always)]
    fn break_tie<C: ClusterContainer, S: Simd, V: Lanes<S>, const W: usize>(
        &self,
        simd: S,
        smallest: V,
        candidates: u32,
        items: &[Cluster<C>; N],
    ) -> (usize, usize) {
        let mut best = (u32::MAX, 0, 1);
        for low in bits(u64::from(candidates)) {
            let low = low % N;
            let partners = bits_of(&row_of::<S, V, W, N>(simd, &self.0[low]), smallest) & candidates;
            for high in bits(u64::from(partners)).filter(|&high| high > low) {
                best = best.min((items[low].count + items[high % N].count, low, high % N));
            }
        }
        (best.1, best.2)
    }
}

/// Loads `row` as vectors.
#[inline(always)]
fn row_of<S: Simd, V: Lanes<S>, const W: usize, const N: usize>(simd: S, row: &[f32; N]) -> [V; W] {
    let mut vectors = [V::splat(simd, 0.0); W];
    for w in 0..W {
        vectors[w] = V::from_slice(simd, &row[w * V::LEN..(w + 1) * V::LEN]);
    }
    vectors
}

/// Mask of the lanes whose bits are set.
#[inline(always)]
fn lanes<S: Simd, V: Lanes<S>, const W: usize>(simd: S, bits: u64) -> [V::Mask; W] {
    let mut masks = [V::Mask::from_bitmask(simd, 0); W];
    for w in 0..W {
        masks[w] = V::Mask::from_bitmask(simd, bits >> (w * V::LEN));
    }
    masks
}

/// One bit per lane of `row` that equals `value`.
#[inline(always)]
fn bits_of<S: Simd, V: Lanes<S>, const W: usize>(row: &[V; W], value: V) -> u32 {
    row.iter().enumerate().fold(0, |bits, (w, row)| bits | (row.simd_eq(value).to_bitmask() as u32) << (w * V::LEN))
}
