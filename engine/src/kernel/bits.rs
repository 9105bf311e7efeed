//! Sets of indices below 64, one bit per index.

/// Iterator over the indices of the bits that are set, lowest first.
pub(crate) struct Bits(u64);

/// The indices of the bits that are set, lowest first.
#[inline(always)]
pub(crate) fn bits(set: u64) -> Bits {
    Bits(set)
}

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let bit = (self.0 != 0).then_some(self.0.trailing_zeros() as usize);
        self.0 &= self.0.wrapping_sub(1);
        bit
    }
}
