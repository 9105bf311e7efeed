//! Asks for memory before it is needed.

#![allow(unsafe_code, reason = "the compiler offers no other way to ask for memory ahead of time")]

/// Has the cache fetch the first line of `value` while other work goes on; nothing where the machine's language has no word
/// for it.
#[inline(always)]
pub(super) fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a hint that reads nothing; every x86-64 has it.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}
