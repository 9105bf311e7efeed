//! Asks for memory before it is needed.

#![allow(unsafe_code, reason = "the compiler offers no other way to ask for memory ahead of time")]

/// Bytes that are fetched together.
const LINE: usize = 64;

/// Has the cache fetch an element, which need not exist, while other work goes on; nothing where the machine's language has no
/// word for it.
#[inline(always)]
pub(in crate::bvh) fn prefetch<T>(list: &[T], index: usize) {
    let address = list.as_ptr().wrapping_add(index).cast::<u8>();
    for offset in (0..size_of::<T>()).step_by(LINE) {
        prefetch_line(address.wrapping_add(offset));
    }
}

/// [`prefetch`] for what takes three or four lines, without a branch for which.
#[inline(always)]
pub(super) fn prefetch_four_lines(address: *const u8, bytes: usize) {
    for offset in [0, LINE, 2 * LINE, bytes - LINE / 2] {
        prefetch_line(address.wrapping_add(offset));
    }
}

#[inline(always)]
fn prefetch_line(address: *const u8) {
    // SAFETY: a hint that reads nothing, for any address; every x86-64 has it.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(address.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}
