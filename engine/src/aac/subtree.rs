//! `build_tree` as one thread does it: the downward half of approximate agglomerative clustering (Gu, He, Fatahalian,
//! Blelloch, *Efficient BVH Construction via Approximate Agglomerative Clustering*, HPG 2013), without recursion, so that
//! everything lies in one function that was compiled for the machine's instructions.

#![allow(clippy::inline_always, reason = "SIMD kernels must land in the caller that enables the instructions")]

use std::ops::Range;

use fearless_simd::Simd;

use crate::aac::cluster::{Cluster, Clustered, Clusters, Pairs};
use crate::aac::combine::{Scratch, combine_clusters};
use crate::aac::reduction::Reduction;
use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::order::sorted_primitives::SortedPrimitives;

/// Primitives whose containers are fetched at once: what they wait for overlaps, and they fit the first cache.
const FETCHED: usize = 256;

/// What is left to do.
enum Step {
    /// Put the clusters of these primitives on the stack.
    Build(Range<usize>),
    /// Merge those of two sides, so and so many, to so and so many.
    Combine(usize, usize),
}

/// The clusters of the primitives `range`.
#[inline(always)]
pub fn build_subtree<C: Clustered, S: Simd>(
    simd: S,
    triangles: &[Triangle],
    input: &SortedPrimitives<C>,
    reduction: &Reduction,
    range: Range<usize>,
    pairs: &mut Pairs<C>,
    token: &CancelToken,
) -> Result<Clusters, Cancelled> {
    let mut stack = Clusters::with_capacity(FETCHED);
    let mut scratch = Scratch::default();
    let mut fetched = Clusters::with_capacity(FETCHED);
    let mut fetched_range = 0..0;
    let mut asked_for = 0;
    let mut steps = vec![Step::Build(range)];
    while let Some(step) = steps.pop() {
        let (base, target) = match step {
            Step::Combine(count, target) => (stack.len - count, target),
            Step::Build(range) => {
                if range.len() <= FETCHED && range.start >= fetched_range.end {
                    token.check()?;
                    // Those after them travel while these are clustered.
                    let ahead = (range.end + FETCHED).min(input.len());
                    for position in range.end.max(asked_for)..ahead {
                        input.prefetch(triangles, position);
                    }
                    asked_for = ahead;
                    for (at, position) in range.clone().enumerate() {
                        let (fields, primitive) = input.fields(simd, triangles, position);
                        fetched.set::<C>(at, Cluster::of_primitive(fields, primitive));
                    }
                    fetched_range = range.clone();
                }
                if range.len() >= reduction.threshold() {
                    let middle = input.split(&range);
                    let clusters = reduction.left_of(middle - range.start) + reduction.left_of(range.end - middle);
                    steps.push(Step::Combine(clusters, reduction.left_of(range.len())));
                    steps.push(Step::Build(middle..range.end));
                    steps.push(Step::Build(range.start..middle));
                    continue;
                }
                // Few enough: one cluster for each primitive.
                let base = stack.len;
                stack.append::<C>(&fetched, range.start - fetched_range.start, range.len());
                (base, reduction.left_of(range.len()))
            }
        };
        combine_clusters(simd, &mut stack, &mut scratch, base, target, pairs, token)?;
    }
    Ok(stack)
}
