//! The nearest hit that a traversal has found so far.

use crate::geometry::{Hit, TriangleHit};

/// The nearest hit so far.
#[derive(Clone, Copy)]
pub(crate) struct Nearest {
    t: f32,
    u: f32,
    v: f32,
    primitive_index: u32,
}

impl Nearest {
    /// No hit, and no hit will be accepted.
    pub(crate) const NOTHING: Self = Self { t: 0.0, u: 0.0, v: 0.0, primitive_index: u32::MAX };

    /// A hit of which nothing is known but that there is one.
    pub(crate) const ANYTHING: Self = Self { t: 0.0, u: 0.0, v: 0.0, primitive_index: 0 };

    /// No hit yet within `t_max`, which is made finite. The largest primitive index means none: it loses every tie.
    #[inline(always)]
    pub(crate) fn new(t_max: f32) -> Self {
        Self { t: t_max.min(f32::MAX), u: 0.0, v: 0.0, primitive_index: u32::MAX }
    }

    /// Distance up to which hits are accepted.
    #[inline(always)]
    pub(crate) fn t(&self) -> f32 {
        self.t
    }

    /// Accepts a hit no farther than [`Nearest::t`]; equal distances go to the lower primitive index. Returns whether it is
    /// now the nearest.
    #[inline(always)]
    pub(crate) fn offer(&mut self, hit: TriangleHit, primitive_index: u32) -> bool {
        let is_nearer = hit.t < self.t || hit.t == self.t && primitive_index < self.primitive_index;
        if is_nearer {
            *self = Self { t: hit.t, u: hit.u, v: hit.v, primitive_index };
        }
        is_nearer
    }

    /// Whether there is a hit.
    #[inline(always)]
    pub(crate) fn found(&self) -> bool {
        self.primitive_index != u32::MAX
    }

    /// The hit, if any.
    #[inline(always)]
    pub(crate) fn hit(&self) -> Option<Hit> {
        self.found().then_some(Hit { t: self.t, primitive_index: self.primitive_index, u: self.u, v: self.v })
    }
}
