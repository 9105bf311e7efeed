//! The numbers in which two trees are compared, and which way is better.

use super::measurement::Measurement;

/// Relative change of a time or speed below which it counts as noise.
const TIME_NOISE: f64 = 0.05;
/// Relative change of any other number below which it counts as none.
const EQUAL: f64 = 0.0005;

/// A number of a tree that is compared with that of another tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Wall-clock time of the build.
    BuildTime,
    /// SAH cost.
    SahCost,
    /// End-point overlap.
    Epo,
    /// Number of nodes.
    Nodes,
    /// Number of leaves.
    Leaves,
    /// Depth of the deepest node.
    Depth,
    /// Container and triangle tests per primary ray.
    TestsPerRay,
    /// Container tests per primary ray.
    ContainerTests,
    /// Triangle tests per primary ray.
    TriangleTests,
    /// Primary rays in Mray/s.
    Speed,
}

impl Quantity {
    /// Whether a smaller value is better; `None` where neither direction is.
    pub const fn smaller_is_better(self) -> Option<bool> {
        match self {
            Self::Nodes | Self::Leaves | Self::Depth => None,
            Self::Speed => Some(false),
            _ => Some(true),
        }
    }

    /// Whether the value depends on camera, size and shading of the picture.
    pub const fn depends_on_view(self) -> bool {
        matches!(self, Self::TestsPerRay | Self::ContainerTests | Self::TriangleTests | Self::Speed)
    }

    /// Whether values of boxes and of spheres compare. Costs are relative to the root's container, and a box's surface is
    /// another than a sphere's.
    pub const fn compares_across_containers(self) -> bool {
        !matches!(self, Self::SahCost | Self::Epo)
    }

    const fn noise(self) -> f64 {
        if matches!(self, Self::BuildTime | Self::Speed) { TIME_NOISE } else { EQUAL }
    }

    /// The number of a measured tree; build times in milliseconds.
    pub fn of(self, row: &Measurement) -> f64 {
        match self {
            Self::BuildTime => row.build_ms,
            Self::SahCost => row.sah_cost,
            Self::Epo => row.epo,
            Self::Nodes => row.nodes as f64,
            Self::Leaves => row.leaves as f64,
            Self::Depth => f64::from(row.max_depth),
            Self::TestsPerRay => row.tests_per_ray,
            Self::ContainerTests => row.container_tests_per_ray,
            Self::TriangleTests => row.primitive_tests_per_ray,
            Self::Speed => row.mrays_per_s,
        }
    }

    /// Which way the number went from `before` to `now`.
    pub fn verdict(self, before: f64, now: f64) -> Verdict {
        if before.is_nan() || now.is_nan() {
            return Verdict::Different;
        }
        if (now - before).abs() <= before.abs() * self.noise() {
            return Verdict::Same;
        }
        match self.smaller_is_better() {
            None => Verdict::Different,
            Some(smaller) if smaller == (now < before) => Verdict::Better,
            Some(_) => Verdict::Worse,
        }
    }
}

/// Which way a number went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The tree now is better.
    Better,
    /// The tree before was better.
    Worse,
    /// No difference beyond noise.
    Same,
    /// There is a difference, and neither direction is better; or one of the two is not known.
    Different,
}

impl Verdict {
    /// The word beside the difference; empty where neither direction is better.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Better => "better",
            Self::Worse => "worse",
            Self::Same => "same",
            Self::Different => "",
        }
    }
}
