//! A parallel, stable radix sort, least significant digit first (Satish, Harris, Garland, *Designing Efficient Sorting
//! Algorithms for Manycore GPUs*, 2009: histogram, prefix sum, scatter).

use std::slice::IterMut;

use rayon::prelude::*;

/// Bits of a digit: 1024 counters and write positions still fit a core's first cache.
const DIGIT_BITS: u32 = 10;
const BUCKETS: usize = 1 << DIGIT_BITS;
/// Items below which a chunk of its own does not pay.
const MIN_CHUNK: usize = 1 << 15;

/// Sorts `items` by the bits `low_bit..high_bit` of their keys. Equal keys keep their order, whatever the number of
/// threads.
pub fn radix_sort<T: Copy + Default + Send + Sync>(
    items: &mut Vec<T>,
    low_bit: u32,
    high_bit: u32,
    key: impl Fn(&T) -> u64 + Sync,
) {
    let chunk_len = items.len().div_ceil(rayon::current_num_threads()).max(MIN_CHUNK);
    let mut scattered = vec![T::default(); items.len()];
    for shift in (low_bit..high_bit).step_by(DIGIT_BITS as usize) {
        let mask = (1_u64 << DIGIT_BITS.min(high_bit - shift)) - 1;
        let digit = |item: &T| ((key(item) >> shift) & mask) as usize % BUCKETS;
        // How often each digit occurs in each chunk.
        let histograms: Vec<Vec<usize>> = items
            .par_chunks(chunk_len)
            .map(|chunk| {
                let mut histogram = vec![0; BUCKETS];
                for item in chunk {
                    histogram[digit(item)] += 1;
                }
                histogram
            })
            .collect();
        // One digit for all: nothing moves.
        if (0..BUCKETS).any(|bucket| histograms.iter().map(|histogram| histogram[bucket]).sum::<usize>() == items.len())
        {
            continue;
        }
        // Cut the output: bucket by bucket, and within each one chunk by chunk, which keeps the sort stable.
        let mut rest = &mut scattered[..];
        let mut outputs: Vec<Vec<IterMut<T>>> = histograms.iter().map(|_| Vec::with_capacity(BUCKETS)).collect();
        for bucket in 0..BUCKETS {
            for (histogram, output) in histograms.iter().zip(&mut outputs) {
                let (own, others) = rest.split_at_mut(histogram[bucket]);
                output.push(own.iter_mut());
                rest = others;
            }
        }
        // Each chunk writes its items to its own parts of the buckets.
        items.par_chunks(chunk_len).zip(outputs).for_each(|(chunk, mut output)| {
            for item in chunk {
                if let Some(place) = output[digit(item)].next() {
                    *place = *item;
                }
            }
        });
        std::mem::swap(items, &mut scattered);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers without order, the same on each run.
    fn keys(count: usize) -> Vec<(u64, u32)> {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        (0..count as u32)
            .map(|index| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 1, index)
            })
            .collect()
    }

    #[test]
    fn it_sorts_as_the_standard_library_does() {
        for count in [0, 1, 2, 1000, 100_000] {
            for bits in [63, 30, 7] {
                let mut items: Vec<(u64, u32)> =
                    keys(count).iter().map(|(key, index)| (key >> (63 - bits), *index)).collect();
                let mut expected = items.clone();
                expected.sort_by_key(|item| item.0);
                radix_sort(&mut items, 0, bits, |item| item.0);
                assert!(items == expected, "{count} items of {bits} bits");
            }
        }
    }

    #[test]
    fn only_the_chosen_bits_count_and_ties_keep_their_order() {
        let mut items = keys(70_000);
        let mut expected = items.clone();
        expected.sort_by_key(|item| item.0 >> 20 & 0xff);
        radix_sort(&mut items, 20, 28, |item| item.0);
        assert!(items == expected, "the order differs");
    }
}
