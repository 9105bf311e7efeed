//! `combine_clusters`: the upward half of approximate agglomerative clustering, a list of clusters in which the closest
//! pair merges until few enough are left (Gu, He, Fatahalian, Blelloch, *Efficient BVH Construction via Approximate
//! Agglomerative Clustering*, HPG 2013). Of equally close pairs the one with fewer primitives merges first, then the one
//! at the lower positions; a union takes the place of its first part, and the last of the list that of the second.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use fearless_simd::Simd;

use super::cluster::{Clustered, Clusters, Pairs};
use super::long_list::{Matches, combine_long};
use super::short_list::combine_short;
use crate::cancel::{CancelToken, Cancelled};

/// What lists of any length need besides themselves, to be used again.
#[derive(Default)]
pub struct Scratch {
    matches: Matches,
}

/// Merges the closest pair of the clusters from `base` on until no more than `target` are left.
#[inline(always)]
pub fn combine_clusters<C: Clustered, S: Simd>(
    simd: S,
    list: &mut Clusters,
    scratch: &mut Scratch,
    base: usize,
    target: usize,
    pairs: &mut Pairs<C>,
    token: &CancelToken,
) -> Result<(), Cancelled> {
    let len = list.len - base;
    if len <= target {
        return Ok(());
    }
    // The nodes are the same whichever of these makes them.
    match len {
        0..=8 => combine_short::<C, S, 1, 8>(simd, list, base, target, pairs),
        9..=16 => combine_short::<C, S, 2, 16>(simd, list, base, target, pairs),
        _ => return combine_long(simd, list, &mut scratch.matches, base, target, pairs, token),
    }
    Ok(())
}
