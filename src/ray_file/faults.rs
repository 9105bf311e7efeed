//! Rays that nothing can be traced along.

use std::fmt;

use super::ray::FileRay;
use crate::text::{count, counted};

/// A fault of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RayFault {
    /// A coordinate that is NaN or infinite, or a limit that is NaN.
    NotFinite,
    /// A direction of length zero, or so short or long that its square is no number of single precision.
    Direction,
    /// `t_min` above `t_max`.
    Interval,
    /// A weight that is negative, NaN or infinite.
    Weight,
}

impl RayFault {
    const ALL: [Self; 4] = [Self::NotFinite, Self::Direction, Self::Interval, Self::Weight];

    /// That of `ray`; the first in this order.
    pub(super) fn of(ray: &FileRay) -> Option<Self> {
        let FileRay { ray, weight, expected_t, .. } = ray;
        let has_nan = [ray.t_min, ray.t_max, expected_t.unwrap_or_default()].iter().any(|number| number.is_nan());
        if has_nan || !ray.origin.is_finite() || !ray.direction.is_finite() {
            Some(Self::NotFinite)
        } else if !ray.direction.length_squared().is_normal() {
            Some(Self::Direction)
        } else if ray.t_min.max(0.0) > ray.t_max {
            Some(Self::Interval)
        } else if !weight.is_finite() || *weight < 0.0 {
            Some(Self::Weight)
        } else {
            None
        }
    }

    const fn text(self) -> &'static str {
        match self {
            Self::NotFinite => "a number that is NaN or infinite",
            Self::Direction => "a direction of length zero, or of no length that single precision can square",
            Self::Interval => "a t_min above t_max",
            Self::Weight => "a weight that is negative or not finite",
        }
    }
}

/// The rays of a file that were skipped, by their fault: their number, and the first.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RayFaults([(u64, u64); RayFault::ALL.len()]);

impl RayFaults {
    pub(super) fn add(&mut self, fault: RayFault, index: u64) {
        let (count, first) = &mut self.0[fault as usize];
        if *count == 0 {
            *first = index;
        }
        *count = count.saturating_add(1);
    }

    /// Whether no ray was skipped.
    pub fn is_empty(&self) -> bool {
        self.count() == 0
    }

    /// Number of rays that were skipped.
    pub fn count(&self) -> u64 {
        self.0.iter().map(|&(count, _)| count).fold(0, u64::saturating_add)
    }

    /// A sentence for each fault.
    pub fn texts(&self) -> impl Iterator<Item = String> {
        RayFault::ALL.into_iter().zip(self.0).filter(|(_, (count, _))| *count > 0).map(|(fault, (number, first))| {
            let fault = fault.text();
            format!("{} skipped, with {fault}: the first is ray {}", counted(number, "rays"), count(first))
        })
    }
}

impl fmt::Display for RayFaults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.texts().collect::<Vec<_>>().join("; "))
    }
}
