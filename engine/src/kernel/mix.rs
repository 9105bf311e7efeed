//! Scrambling of 64-bit numbers.

/// Increment of the states of [`next_unit`]: 2⁶⁴ over the golden ratio.
const STEP: u64 = 0x9E37_79B9_7F4A_7C15;

/// A permutation of the 64-bit numbers whose output looks random: the finaliser of SplitMix64 (Steele, Lea and Flood: *Fast
/// Splittable Pseudorandom Number Generators*, OOPSLA 2014), moved so that 0 is nothing special.
#[inline]
pub(crate) fn mix64(number: u64) -> u64 {
    let x = number.wrapping_add(STEP);
    let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// The next number of the SplitMix64 generator in `state`, uniform in 0 to 1 (exclusive).
#[inline]
pub(crate) fn next_unit(state: &mut u64) -> f64 {
    let bits = mix64(*state) >> 11;
    *state = state.wrapping_add(STEP);
    bits as f64 / (1_u64 << 53) as f64
}
