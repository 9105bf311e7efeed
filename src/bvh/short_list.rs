//! `combine_clusters` for lists of up to 32, of which nearly all of a build consists: all distances at once, kept as a matrix
//! in the first cache. A merge changes one row and one column of it; the smallest distance is that of the columns'
//! minima, and where no two distances are equal their lanes tell the pair.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]
#![allow(clippy::needless_range_loop, reason = "several arrays are indexed by the same lane or row")]

use fearless_simd::{Select, Simd, SimdBase, SimdMask, f32x8, mask32x8, u32x8};

use super::cluster::{Cluster, Clustered, Clusters, FIELDS, LANES, Pairs, broadcast};

/// A row for each of up to `N` clusters, `W` vectors long: the distances to all others, infinity where there is none.
struct Matrix<S: Simd, const W: usize, const N: usize>([[f32x8<S>; W]; N]);

/// Merges the closest pair of the clusters from `base` on until `target` are left; there are more, but no more than
/// `N`, which is eight times `W` and a power of two.
#[inline(always)]
pub fn combine_short<C: Clustered, S: Simd, const W: usize, const N: usize>(
    simd: S,
    list: &mut Clusters,
    base: usize,
    target: usize,
    pairs: &mut Pairs<C>,
) {
    const { assert!(N == W * LANES && N.is_power_of_two()) };
    let mut len = list.len - base;
    let infinity = f32x8::splat(simd, f32::INFINITY);
    let lanes: [u32x8<S>; W] =
        std::array::from_fn(|w| u32x8::from_slice(simd, &LANE_NUMBERS[w * LANES..(w + 1) * LANES]));
    let lanes_at = |at: usize| -> [mask32x8<S>; W] {
        let at = u32x8::splat(simd, at as u32);
        std::array::from_fn(|w| lanes[w].simd_eq(at))
    };
    let mut fields: [[f32x8<S>; FIELDS]; W] = std::array::from_fn(|w| list.row::<C, S>(simd, base + w * LANES));
    let Ok(items) = <&mut [Cluster; N]>::try_from(&mut list.items[base..base + N]) else { return };

    let mut matrix = Matrix([[infinity; W]; N]);
    let mut nearest = [infinity; W];
    let dead = lanes_from(simd, &lanes, len);
    for at in 0..len {
        let own = broadcast::<C, S>(simd, &items[at % N]);
        let itself = lanes_at(at);
        for w in 0..W {
            let distances = (itself[w] | dead[w]).select(infinity, C::distances(&own, &fields[w]));
            matrix.0[at % N][w] = distances;
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
        let smallest = f32x8::splat(simd, smallest.reduce_min());
        let old = bits_of::<S, W>(std::array::from_fn(|w| nearest[w].simd_eq(smallest)));
        let new = bits_of::<S, W>(std::array::from_fn(|w| fresh[w].simd_eq(smallest)));
        let candidates = old | new | u32::from(new != 0) << low;
        let high;
        if candidates.count_ones() == 2 {
            low = candidates.trailing_zeros() as usize % N;
            high = candidates.ilog2() as usize % N;
        } else {
            (low, high) = matrix.break_tie(smallest, candidates, len, items);
        }

        // Two become one, which takes the first one's place; the last takes the second one's.
        let pair = [items[low], items[high]];
        let union = C::union_fields(simd, &pair[0].fields, &pair[1].fields);
        items[low] = Cluster {
            fields: std::array::from_fn(|field| if field < C::USED_FIELDS { union[field][0] } else { 0.0 }),
            first: pairs.push(&pair),
            count: pair[0].count + pair[1].count,
        };
        len -= 1;
        let last = len % N;
        let moved = broadcast::<C, S>(simd, &items[last]);
        items[high] = items[last];
        let (at_low, at_high) = (lanes_at(low), lanes_at(high));
        for w in 0..W {
            for field in 0..C::USED_FIELDS {
                let kept = at_low[w].select(union[field], fields[w][field]);
                fields[w][field] = at_high[w].select(moved[field], kept);
            }
        }
        if len <= target {
            break;
        }

        let dead = lanes_from(simd, &lanes, len);
        let (mut fresh_row, mut moved_row) = ([0.0; N], [0.0; N]);
        for w in 0..W {
            fresh[w] = (at_low[w] | dead[w]).select(infinity, C::distances(&union, &fields[w]));
            fresh[w].store_slice(&mut fresh_row[w * LANES..(w + 1) * LANES]);
            let moved = (at_low[w] | at_high[w] | dead[w]).select(infinity, matrix.0[last][w]);
            moved.store_slice(&mut moved_row[w * LANES..(w + 1) * LANES]);
            matrix.0[high][w] = moved;
            matrix.0[last][w] = infinity;
            matrix.0[low][w] = infinity;
            nearest[w] = infinity;
        }
        // One vector a row: no count to wait for. More: only the rows in use.
        for at in 0..if W == 1 { N } else { len } {
            let (fresh_at, moved_at) = (f32x8::splat(simd, fresh_row[at % N]), f32x8::splat(simd, moved_row[at % N]));
            for w in 0..W {
                let row = at_high[w].select(moved_at, matrix.0[at % N][w]);
                nearest[w] = nearest[w].min(row);
                matrix.0[at % N][w] = at_low[w].select(fresh_at, row);
            }
        }
        for w in 0..W {
            // Columns behind the end keep what they held, which counts no more.
            nearest[w] = (at_low[w] | dead[w]).select(infinity, nearest[w]);
            matrix.0[low][w] = fresh[w];
        }
    }
    for w in 0..W {
        for field in 0..C::USED_FIELDS {
            let at = base + w * LANES;
            fields[w][field].store_slice(&mut list.fields[field][at..at + LANES]);
        }
    }
    list.len = base + len;
}

impl<S: Simd, const W: usize, const N: usize> Matrix<S, W, N> {
    /// Of the pairs whose distance is `smallest`, all among the `candidates`, that with the fewest primitives, then the
    /// lowest positions.
    #[inline(always)]
    fn break_tie(&self, smallest: f32x8<S>, candidates: u32, len: usize, items: &[Cluster; N]) -> (usize, usize) {
        let below = |at: usize| ((1_u64 << at) - 1) as u32;
        let mut best = (u32::MAX, 0, 1);
        let mut rows = candidates & below(len);
        while rows != 0 {
            let low = rows.trailing_zeros() as usize % N;
            rows &= rows - 1;
            let mut partners = bits_of::<S, W>(std::array::from_fn(|w| self.0[low][w].simd_eq(smallest))) & rows;
            while partners != 0 {
                let high = partners.trailing_zeros() as usize % N;
                partners &= partners - 1;
                best = best.min((items[low].count + items[high].count, low, high));
            }
        }
        (best.1, best.2)
    }
}

/// The numbers of the lanes of the longest row.
const LANE_NUMBERS: [u32; 4 * LANES] = {
    let mut numbers = [0; 4 * LANES];
    let mut at = 0;
    while at < numbers.len() {
        numbers[at] = at as u32;
        at += 1;
    }
    numbers
};

/// The lanes from number `len` on.
#[inline(always)]
fn lanes_from<S: Simd, const W: usize>(simd: S, lanes: &[u32x8<S>; W], len: usize) -> [mask32x8<S>; W] {
    let len = u32x8::splat(simd, len as u32);
    std::array::from_fn(|w| lanes[w].simd_ge(len))
}

/// A bit for each lane.
#[inline(always)]
fn bits_of<S: Simd, const W: usize>(masks: [mask32x8<S>; W]) -> u32 {
    masks.iter().enumerate().fold(0, |bits, (w, mask)| bits | (mask.to_bitmask() as u32) << (w * LANES))
}
