//! `combine_clusters` for lists of up to 32, of which nearly all of a build consists: all distances at once, kept as a matrix
//! in the first cache. A merge changes one row and one column of it; the smallest distance is that of the columns'
//! minima, and where no two distances are equal their lanes tell the pair. A union takes the place of its first part, and
//! that of the second stays empty until the end.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same lane or row")]

use fearless_simd::{Select, Simd, SimdMask};

use crate::aac::cluster::{Cluster, Clustered, Clusters, Pairs, splat_fields};
use crate::kernel::bits::bits;
use crate::kernel::lanes::{FIELDS, Lanes};

/// A row for each of up to `N` clusters: the distances to all others, infinity where there is none. Columns of empty places
/// keep what they held.
#[repr(align(64))]
struct Matrix<const N: usize>([[f32; N]; N]);

/// Merges the closest pair of the clusters from `base` on until `target` are left; there are more, but no more than
/// `N`, the lanes of `W` vectors.
#[inline(always)]
pub fn combine_short<C: Clustered, S: Simd, V: Lanes<S>, const W: usize, const N: usize>(
    simd: S,
    list: &mut Clusters,
    base: usize,
    target: usize,
    pairs: &mut Pairs<C>,
) {
    const { assert!(N == W * V::LEN && N.is_power_of_two() && N <= 32) };
    let mut len = list.len - base;
    let infinity = V::splat(simd, f32::INFINITY);
    let mut fields: [[V; FIELDS]; W] = std::array::from_fn(|w| list.row::<C, S, V>(simd, base + w * V::LEN));
    let Ok(items) = <&mut [Cluster; N]>::try_from(&mut list.items[base..base + N]) else { return };

    let quads = len.div_ceil(4);
    // A bit for each place that is taken.
    let mut taken = (1_u64 << len) - 1;
    let mut matrix = Matrix([[f32::INFINITY; N]; N]);
    let mut nearest = [infinity; W];
    for at in 0..len {
        let own = splat_fields::<C, S, V>(simd, &items[at % N].fields);
        let none = lanes::<S, V, W>(simd, !taken | 1 << at);
        for w in 0..W {
            let distances = none[w].select(infinity, C::distances(&own, &fields[w]));
            distances.store_slice(&mut matrix.0[at % N][w * V::LEN..(w + 1) * V::LEN]);
            nearest[w] = nearest[w].min(distances);
        }
    }
    // The row of the latest union, which stands at `low`; `nearest` is without it.
    let mut fresh = [infinity; W];
    let mut low = 0;
    loop {
        // Whose distance is the smallest: among the old clusters, and to the latest union.
        let mut smallest = nearest[0].min(fresh[0]);
        for w in 1..W {
            smallest = smallest.min(nearest[w]).min(fresh[w]);
        }
        let smallest = V::splat(simd, smallest.reduce_min());
        let old = bits_of::<S, V, W>(&nearest, smallest);
        let new = bits_of::<S, V, W>(&fresh, smallest);
        let candidates = old | new | u32::from(new != 0) << low;
        let high;
        if candidates.count_ones() == 2 {
            low = candidates.trailing_zeros() as usize % N;
            high = candidates.ilog2() as usize % N;
        } else {
            (low, high) = matrix.break_tie::<S, V, W>(simd, smallest, candidates & taken as u32, items);
        }

        // Two become one, which takes the first one's place.
        let pair = [items[low], items[high]];
        let union = C::union_fields::<S, V>(simd, &pair[0].fields, &pair[1].fields);
        items[low] = Cluster::from_lanes::<C, S, V>(&union, pairs.push(&pair), pair[0].count + pair[1].count);
        let at_low = lanes::<S, V, W>(simd, 1 << low);
        for w in 0..W {
            for field in 0..C::USED_FIELDS {
                fields[w][field] = at_low[w].select(union[field], fields[w][field]);
            }
        }
        taken &= !(1 << high);
        len -= 1;
        if len <= target {
            break;
        }

        let none = lanes::<S, V, W>(simd, !taken | 1 << low);
        for w in 0..W {
            fresh[w] = none[w].select(infinity, C::distances(&union, &fields[w]));
        }
        matrix.0[low] = [f32::INFINITY; N];
        matrix.0[high] = [f32::INFINITY; N];
        // Four minima, that none waits for the one before.
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
            fresh[w].store_slice(&mut matrix.0[low][w * V::LEN..(w + 1) * V::LEN]);
        }
        // Lane by lane: compilers write whole rows that they select lanes of with masked stores, slow on AMD under AVX2.
        let fresh_row = matrix.0[low];
        for (row, fresh_at) in matrix.0.iter_mut().zip(fresh_row).take(4 * quads) {
            row[low] = fresh_at;
        }
    }
    for w in 0..W {
        for field in 0..C::USED_FIELDS {
            let at = base + w * V::LEN;
            fields[w][field].store_slice(&mut list.fields[field][at..at + V::LEN]);
        }
    }
    list.len = base + len;
    // The last ones take the places that are empty.
    let mut behind = taken & (u64::MAX << len);
    while behind != 0 {
        let (from, to) = (behind.ilog2() as usize, taken.trailing_ones() as usize);
        behind &= !(1 << from);
        taken |= 1 << to;
        list.set::<C>(base + to, list.items[base + from]);
    }
}

impl<const N: usize> Matrix<N> {
    /// Of the pairs whose distance is `smallest`, all among the `candidates`, that with the fewest primitives, then the
    /// lowest places.
    #[inline(always)]
    fn break_tie<S: Simd, V: Lanes<S>, const W: usize>(
        &self,
        simd: S,
        smallest: V,
        candidates: u32,
        items: &[Cluster; N],
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

/// The vectors of `row`.
#[inline(always)]
fn row_of<S: Simd, V: Lanes<S>, const W: usize, const N: usize>(simd: S, row: &[f32; N]) -> [V; W] {
    std::array::from_fn(|w| V::from_slice(simd, &row[w * V::LEN..(w + 1) * V::LEN]))
}

/// The lanes whose bits are set.
#[inline(always)]
fn lanes<S: Simd, V: Lanes<S>, const W: usize>(simd: S, bits: u64) -> [V::Mask; W] {
    std::array::from_fn(|w| V::Mask::from_bitmask(simd, bits >> (w * V::LEN)))
}

/// A bit for each lane of `row` that is `value`.
#[inline(always)]
fn bits_of<S: Simd, V: Lanes<S>, const W: usize>(row: &[V; W], value: V) -> u32 {
    row.iter().enumerate().fold(0, |bits, (w, row)| bits | (row.simd_eq(value).to_bitmask() as u32) << (w * V::LEN))
}
