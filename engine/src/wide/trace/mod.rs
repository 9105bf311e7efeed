//! Rays through wide trees: one at a time, coherent ones from one point in packets, all others in streams. Every way finds the
//! same hits.

pub(crate) mod beam;
pub mod packet;
pub(crate) mod single;
pub(crate) mod stack;
pub(crate) mod stream;

use fearless_simd::{Level, dispatch};

use crate::geometry::{Hit, Ray};
use crate::tree::traverse::{NoProbe, Probe};
use crate::wide::tree::AnyWideTree;
use crate::with_wide_tree;

impl AnyWideTree {
    /// The nearest hit of one ray: exactly what the binary tree gives.
    #[inline]
    pub fn closest_hit(&self, level: Level, ray: &Ray) -> Option<Hit> {
        self.closest_hit_with(level, ray, &mut NoProbe)
    }

    /// [`AnyWideTree::closest_hit`], watched by `probe`: nodes are counted as containers, blocks as primitives.
    #[inline]
    pub fn closest_hit_with<P: Probe>(&self, level: Level, ray: &Ray, probe: &mut P) -> Option<Hit> {
        with_wide_tree!(self, tree => dispatch!(level, simd => single::closest_hit(simd, tree, ray, probe)))
    }

    /// Whether anything lies on `ray` between its `t_min` and `t_max`.
    #[inline]
    pub fn any_hit(&self, level: Level, ray: &Ray) -> bool {
        self.any_hit_with(level, ray, &mut NoProbe)
    }

    /// [`AnyWideTree::any_hit`], watched by `probe`: nodes are counted as containers, blocks as primitives.
    #[inline]
    pub fn any_hit_with<P: Probe>(&self, level: Level, ray: &Ray, probe: &mut P) -> bool {
        with_wide_tree!(self, tree => dispatch!(level, simd => single::any_hit(simd, tree, ray, probe)))
    }

    /// Whether anything lies on each of `rays`, into the first elements of `blocked`: faster than ray by ray, the more so the
    /// larger the tree is.
    ///
    /// # Panics
    ///
    /// Where `blocked` is shorter than `rays`.
    pub fn any_hits(&self, level: Level, rays: &[Ray], blocked: &mut [bool]) {
        assert!(blocked.len() >= rays.len(), "{} answers for {} rays", blocked.len(), rays.len());
        with_wide_tree!(self, tree => dispatch!(level, simd => stream::any_hits(simd, tree, rays, blocked)));
    }

    /// The nearest hits of `rays`, into the first elements of `hits`; see [`packet::closest_hits`].
    pub fn closest_hits(&self, level: Level, rays: &[Ray], hits: &mut [Option<Hit>]) {
        with_wide_tree!(self, tree => packet::closest_hits(level, tree, rays, hits));
    }
}
