//! Observers of a traversal.

/// Observer of a traversal. A probe that does nothing costs nothing.
pub trait Probe {
    /// Called for each container test.
    fn container_test(&mut self);
    /// Called for each primitive test.
    fn primitive_test(&mut self);
}

/// A probe that does nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoProbe;

impl Probe for NoProbe {
    #[inline(always)]
    fn container_test(&mut self) {}
    #[inline(always)]
    fn primitive_test(&mut self) {}
}

/// Numbers of container and primitive tests.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TestCounts {
    /// Number of container tests.
    pub containers: u64,
    /// Number of primitive tests.
    pub primitives: u64,
}

impl Probe for TestCounts {
    #[inline(always)]
    fn container_test(&mut self) {
        self.containers += 1;
    }
    #[inline(always)]
    fn primitive_test(&mut self) {
        self.primitives += 1;
    }
}
