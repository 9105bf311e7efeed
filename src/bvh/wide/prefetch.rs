//! Asks for memory before it is needed.

#![allow(unsafe_code, reason = "the compiler offers no other way to ask for memory ahead of time")]

/// Bytes that are fetched together.
const LINE: usize = 64;

/// Has the cache fetch an element, which need not exist, while other work goes on; nothing where the machine's language has no
/// word for it.
#[inline(always)]
pub(super) fn prefetch<T>(list: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    for offset in (0..size_of::<T>()).step_by(LINE) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let at = list.as_ptr().wrapping_add(index).cast::<i8>().wrapping_add(offset);
        // SAFETY: a hint that reads nothing, for any address; every x86-64 has it.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(at) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (list, index);
}
