//! A parallel radix sort of 64-bit keys. Large ranges are scattered into buckets by their leading digit, each thread its
//! chunk (Satish, Harris, Garland, *Designing Efficient Sorting Algorithms for Manycore GPUs*, 2009: histogram, prefix
//! sum, scatter). Ranges that fit a core's L2 cache are sorted there, least significant digit first, by as many bits as
//! distinguish most of their keys; the few that remain out of order are sorted by comparison.

use std::slice::IterMut;

use crate::cancel::{CancelToken, Cancelled};
use crate::kernel::parallel::{par_tasks, zeros};

/// Maximum bits of the digit by which large ranges are scattered.
const MAX_LEADING_DIGIT_BITS: u32 = 10;
/// Binary logarithm of the minimum number of keys per bucket, were they evenly distributed.
const BUCKET_SIZE_BITS: u32 = 11;
/// Maximum bits of a digit within the L2 cache: 1024 write positions fit the L1 cache.
const MAX_DIGIT_BITS: u32 = 10;
const DIGITS: usize = 1 << MAX_DIGIT_BITS;
/// Maximum number of keys sorted within the L2 cache: keys and scratch take 256 KiB each.
const MAX_LOCAL: usize = 1 << 15;
/// Maximum number of keys sorted by comparison, where that is faster.
const MAX_COMPARED: usize = 64;
/// Minimum number of keys per chunk, below which a thread of its own does not pay.
const MIN_CHUNK: usize = 1 << 14;
/// Maximum number of chunks that a range is scattered from. More are scattered faster, but one thread divides the output among them:
/// with 32 that takes 1 % of a build (dragon), as long as it saves.
const MAX_CHUNKS: usize = 16;
/// Keys between two cancellation checks.
const KEYS_PER_CHECK: usize = 1 << 17;

/// Sorts `keys`, all less than 2^`bits` and preferably distinct. The result does not depend on the number of threads.
pub fn radix_sort(keys: &mut [u64], bits: u32, token: &CancelToken) -> Result<(), Cancelled> {
    if keys.len() <= MAX_COMPARED {
        keys.sort_unstable();
        return Ok(());
    }
    radix_sort_with(keys, &mut zeros(keys.len(), token)?, bits, token)
}

/// [`radix_sort`] with a `scratch` list of the same length, whose contents are unspecified afterwards.
pub fn radix_sort_with(keys: &mut [u64], scratch: &mut [u64], bits: u32, token: &CancelToken) -> Result<(), Cancelled> {
    sort_range(keys, scratch, bits, false, token)
}

/// Sorts `keys` by their lowest `bits` bits, above which all are equal; the result goes to `scratch` if `to_scratch`.
fn sort_range(
    keys: &mut [u64],
    scratch: &mut [u64],
    bits: u32,
    to_scratch: bool,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    token.check()?;
    if keys.len() <= MAX_LOCAL || bits == 0 {
        sort_local(keys, scratch, bits);
        if to_scratch {
            scratch.copy_from_slice(keys);
        }
        return Ok(());
    }
    let digit_bits = (keys.len().ilog2() - BUCKET_SIZE_BITS).min(MAX_LEADING_DIGIT_BITS).min(bits);
    let shift = bits - digit_bits;
    let buckets = 1_usize << digit_bits;
    let digit = |key: u64| (key >> shift) as usize & (buckets - 1);
    // Histogram: how often each digit occurs in each chunk.
    let chunk_len = keys.len().div_ceil(MAX_CHUNKS).max(MIN_CHUNK);
    let histograms: Vec<Vec<usize>> = par_tasks(keys.chunks(chunk_len), token, |chunk, token| {
        let mut histogram = vec![0; buckets];
        for keys in chunk.chunks(KEYS_PER_CHECK) {
            token.check()?;
            for &key in keys {
                histogram[digit(key)] += 1;
            }
        }
        Ok(histogram)
    })?;
    let sizes: Vec<usize> =
        (0..buckets).map(|bucket| histograms.iter().map(|histogram| histogram[bucket]).sum()).collect();
    // All keys have the same digit: nothing moves.
    if sizes.contains(&keys.len()) {
        return sort_range(keys, scratch, shift, to_scratch, token);
    }
    token.check()?;
    // Divide the output: bucket by bucket, and within each bucket chunk by chunk.
    let mut remaining = &mut scratch[..];
    let mut outputs: Vec<Vec<IterMut<u64>>> = histograms.iter().map(|_| Vec::with_capacity(buckets)).collect();
    for bucket in 0..buckets {
        for (histogram, output) in histograms.iter().zip(&mut outputs) {
            let (own, others) = remaining.split_at_mut(histogram[bucket]);
            output.push(own.iter_mut());
            remaining = others;
        }
    }
    // Scatter: each chunk writes its keys to its own part of each bucket.
    par_tasks(keys.chunks(chunk_len).zip(outputs), token, |(chunk, mut output), token| {
        for keys in chunk.chunks(KEYS_PER_CHECK) {
            token.check()?;
            for &key in keys {
                if let Some(slot) = output[digit(key)].next() {
                    *slot = key;
                }
            }
        }
        Ok(())
    })?;
    // Sort each bucket by the remaining bits.
    let (mut keys, mut scratch) = (keys, scratch);
    let mut parts = Vec::with_capacity(buckets);
    for size in sizes.into_iter().filter(|&size| size > 0) {
        let (own_keys, own_scratch);
        (own_keys, keys) = keys.split_at_mut(size);
        (own_scratch, scratch) = scratch.split_at_mut(size);
        parts.push((own_scratch, own_keys));
    }
    par_tasks(parts, token, |(keys, scratch), token| sort_range(keys, scratch, shift, !to_scratch, token)).map(drop)
}

/// [`sort_range`] by one thread, in place.
fn sort_local(keys: &mut [u64], scratch: &mut [u64], bits: u32) {
    if keys.len() <= MAX_COMPARED {
        keys.sort_unstable();
        return;
    }
    // Points of a surface fill two of three dimensions: distinguishing their codes takes 3/2 as many bits.
    let used_bits = (keys.len().ilog2() * 3 / 2 + 2).min(bits);
    let passes = used_bits.div_ceil(MAX_DIGIT_BITS);
    let digit_bits = used_bits.div_ceil(passes.max(1));
    let low_bit = bits.saturating_sub(passes * digit_bits);
    let (mut from, mut to) = (&mut *keys, &mut *scratch);
    let mut starts = [0_u32; DIGITS];
    for pass in 0..passes {
        let shift = low_bit + pass * digit_bits;
        let mask = (1_u64 << digit_bits.min(bits.saturating_sub(shift))) - 1;
        let digit = |key: u64| (key >> shift & mask) as usize % DIGITS;
        starts[..1 << digit_bits].fill(0);
        for &key in &*from {
            starts[digit(key)] += 1;
        }
        let mut start = 0;
        for count in &mut starts[..1 << digit_bits] {
            start += std::mem::replace(count, start);
        }
        for &key in &*from {
            let position = &mut starts[digit(key)];
            to[*position as usize] = key;
            *position += 1;
        }
        std::mem::swap(&mut from, &mut to);
    }
    if passes % 2 == 1 {
        keys.copy_from_slice(scratch);
    }
    // Keys that are still out of order agree in all bits from `low_bit` up.
    let mut at = 1;
    while at < keys.len() {
        if keys[at - 1] > keys[at] {
            let cell = keys[at] >> low_bit;
            let start = keys[..at].iter().rposition(|key| key >> low_bit != cell).map_or(0, |before| before + 1);
            let end = at + keys[at..].iter().position(|key| key >> low_bit != cell).unwrap_or(keys.len() - at);
            keys[start..end].sort_unstable();
            at = end;
        }
        at += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudorandom keys, the same on each run.
    fn keys(count: usize) -> Vec<u64> {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        std::iter::repeat_with(|| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 1
        })
        .take(count)
        .collect()
    }

    fn check(keys: &[u64], bits: u32, name: &str) {
        let mut expected = keys.to_vec();
        expected.sort_unstable();
        for threads in [1, 3] {
            let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(threads).build() else { panic!("no threads") };
            let mut sorted = keys.to_vec();
            assert!(pool.install(|| radix_sort(&mut sorted, bits, &CancelToken::new())).is_ok());
            assert!(sorted == expected, "{name}, {bits} bits, {threads} threads");
        }
    }

    #[test]
    fn it_sorts_as_the_standard_library_does() {
        for count in [0, 1, 2, 64, 65, 1000, 32_768, 32_769, 200_000] {
            for bits in [63, 30, 21, 16, 7, 1] {
                let keys: Vec<u64> = keys(count).iter().map(|key| key >> (63 - bits)).collect();
                check(&keys, bits, &format!("{count} keys"));
            }
        }
        let largest: Vec<u64> = keys(1000).iter().map(|key| !key).collect();
        check(&largest, 64, "keys with all bits");
    }

    #[test]
    fn crowded_and_equal_keys_are_sorted_too() {
        check(&vec![7; 100_000], 63, "all equal");
        let mut outlier: Vec<u64> = keys(100_000).iter().map(|key| key >> 40).collect();
        outlier.push(u64::MAX >> 1);
        check(&outlier, 63, "one far away");
        let two: Vec<u64> = keys(100_000).iter().map(|key| (key & 1) << 62 | key >> 50).collect();
        check(&two, 63, "two crowds");
        let descending: Vec<u64> = (0..100_000).rev().collect();
        check(&descending, 63, "descending");
    }
}
