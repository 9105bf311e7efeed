//! Prefetching of memory into the cache.

#![allow(unsafe_code, reason = "the compiler offers no other way to prefetch memory")]

/// Bytes of a cache line.
const LINE: usize = 64;

/// Prefetches `list[index]` into the L1 cache; `index` may be out of bounds. Does nothing on architectures other than x86-64.
#[inline(always)]
pub(crate) fn prefetch<T>(list: &[T], index: usize) {
    let address = list.as_ptr().wrapping_add(index).cast::<u8>();
    for offset in (0..size_of::<T>()).step_by(LINE) {
        prefetch_line(address.wrapping_add(offset));
    }
}

/// [`prefetch`] of an element smaller than a cache line that may lie in two of them.
#[inline(always)]
pub(crate) fn prefetch_whole<T>(list: &[T], index: usize) {
    let address = list.as_ptr().wrapping_add(index).cast::<u8>();
    prefetch_line(address);
    prefetch_line(address.wrapping_add(size_of::<T>() - 1));
}

/// [`prefetch`] of two siblings: as pairs begin at odd indices, elements of half a cache line lie in two lines.
#[inline(always)]
pub(crate) fn prefetch_pair<T>(list: &[T], first: usize) {
    prefetch(list, first);
    prefetch(list, first + 1);
}

/// Prefetches `bytes` at `address`, half a cache line or more, which begin in the first half of a line.
#[inline(always)]
pub(crate) fn prefetch_lines(address: *const u8, bytes: usize) {
    let last = bytes - LINE / 2;
    for offset in (0..last).step_by(LINE) {
        prefetch_line(address.wrapping_add(offset));
    }
    prefetch_line(address.wrapping_add(last));
}

#[inline(always)]
fn prefetch_line(address: *const u8) {
    // SAFETY: a hint that is valid for any address and reads nothing; it is part of SSE, which every x86-64 has.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(address.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For Miri: no address is dereferenced.
    #[test]
    fn any_address_may_be_prefetched() {
        let list = vec![[1_u64; 25]; 7];
        for at in [0, 6, 7, 8, 1000, usize::MAX / size_of::<[u64; 25]>()] {
            prefetch(&list, at);
        }
        prefetch::<u32>(&[], 5);
        prefetch_whole::<[f32; 9]>(&[], 5);
        prefetch_lines(list.as_ptr().cast(), 200);
        prefetch_lines(list.as_ptr().wrapping_add(99).cast(), 256);
        assert_eq!(list, [[1; 25]; 7]);
    }
}
