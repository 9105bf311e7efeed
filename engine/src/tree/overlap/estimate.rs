//! The overlap as estimated from triangles that are evenly spread over the surface.

use std::collections::HashMap;

use crate::cancel::{CancelToken, Cancelled, MEDIUM_STEPS};
use crate::kernel::parallel::par_tasks;

use super::clip::Clip;
use super::surface::{FurtherSlot, Surface};
use super::{EndPointOverlap, finite};

/// Number of nodes that the samples may visit on average before the rest of them is left out. On models from scans to
/// architecture, in boxes and spheres, they visit 50 to 800.
const VISITS_PER_SAMPLE: u64 = 1 << 12;
/// Minimum number of samples that are looked at together, where each visits every node: enough for all threads, and bounded.
const MIN_SAMPLES_AT_ONCE: u64 = 16;
/// Half-width of the 95 % interval of a normal distribution, in standard deviations.
const DEVIATIONS: f64 = 1.96;

/// A sampled triangle: its first slot and the surface area that it represents.
struct Sample {
    slot: usize,
    weight: f64,
}

/// The overlap of a sample.
struct Found {
    /// Σ cost · area inside the node, over the nodes that do not hold the triangle, over its area.
    cost: f64,
    weight: f64,
    /// Number of nodes visited.
    visited: u64,
}

/// The overlap of `max_samples` samples, or of as many of them as can be looked at in a bounded number of visits.
pub(super) fn overlap<C: Clip>(
    surface: &Surface<'_, C>,
    max_samples: usize,
    token: &CancelToken,
) -> Result<EndPointOverlap, Cancelled> {
    let samples = choose_samples(surface, max_samples, token)?;
    let further = further_slots(surface, &samples, token)?;
    // Any first part of this order is spread over the whole list.
    let mut order: Vec<u32> = (0..samples.len() as u32).collect();
    order.sort_unstable_by_key(|index| index.reverse_bits());
    let max_visits = (max_samples as u64).saturating_mul(VISITS_PER_SAMPLE);
    let (mut found, mut visited): (Vec<Found>, u64) = (Vec::with_capacity(samples.len()), 0);
    while found.len() < order.len() && visited <= max_visits {
        // As many as stay within the limit even if each of them visits every node.
        let at_once = ((max_visits - visited) / surface.tree.nodes.len() as u64).max(MIN_SAMPLES_AT_ONCE);
        let end = (found.len() as u64).saturating_add(at_once).min(order.len() as u64) as usize;
        // Collected before they are summed, so that the sum does not depend on the number of threads.
        let part = par_tasks(&order[found.len()..end], token, |&index, token| {
            let sample = &samples[index as usize];
            let triangle = surface.tree.primitive_indices[sample.slot];
            look_at(surface, sample, further.get(&triangle).map_or(&[], Vec::as_slice), token)
        })?;
        visited += part.iter().map(|found| found.visited).sum::<u64>();
        found.extend(part);
        token.set_progress(found.len() as f32 / order.len() as f32);
    }
    let (value, margin) = mean(&found);
    let (value, margin) = (finite(value), Some(finite(margin)));
    Ok(EndPointOverlap { value, sampled: found.len(), triangles: surface.with_area, margin, visited })
}

/// Mean cost of the samples by their weights, and the half-width of its interval, as if they had been drawn at random.
fn mean(found: &[Found]) -> (f64, f64) {
    let weight: f64 = found.iter().map(|found| found.weight).sum();
    let mean = found.iter().map(|found| found.weight * found.cost).sum::<f64>() / weight;
    let squares: f64 = found.iter().map(|found| (found.weight * (found.cost - mean)).powi(2)).sum();
    let count = found.len() as f64;
    let variance = squares / weight.powi(2) * count / (count - 1.0).max(1.0);
    (mean, DEVIATIONS * variance.sqrt())
}

/// The triangles at `max_samples` steps of equal area through the list.
fn choose_samples<C: Clip>(
    surface: &Surface<'_, C>,
    max_samples: usize,
    token: &CancelToken,
) -> Result<Vec<Sample>, Cancelled> {
    let step = surface.total / max_samples as f64;
    let mut samples = Vec::with_capacity(max_samples.min(surface.with_area));
    let mut area_so_far = 0.0;
    let mut next = step * 0.5;
    for (slot, &area) in surface.areas.iter().enumerate() {
        token.check_every(MEDIUM_STEPS, slot)?;
        area_so_far += area;
        if area_so_far > next {
            let steps = ((area_so_far - next) / step).floor() + 1.0;
            samples.push(Sample { slot, weight: steps * step });
            next += steps * step;
        }
    }
    Ok(samples)
}

/// The further slots of the samples' triangles.
fn further_slots<C: Clip>(
    surface: &Surface<'_, C>,
    samples: &[Sample],
    token: &CancelToken,
) -> Result<HashMap<u32, Vec<FurtherSlot>>, Cancelled> {
    let triangle = |slot: usize| surface.tree.primitive_indices[slot];
    let mut slots: HashMap<u32, Vec<FurtherSlot>> =
        samples.iter().map(|sample| (triangle(sample.slot), Vec::new())).collect();
    for (at, &further) in surface.further.iter().enumerate() {
        token.check_every(MEDIUM_STEPS, at)?;
        if let Some(slots) = slots.get_mut(&triangle(further.slot as usize)) {
            slots.push(further);
        }
    }
    Ok(slots)
}

/// Visits the nodes that do not hold the triangle of `sample`.
fn look_at<C: Clip>(
    surface: &Surface<'_, C>,
    sample: &Sample,
    further: &[FurtherSlot],
    token: &CancelToken,
) -> Result<Found, Cancelled> {
    let (mut stack, mut visited, mut cost) = (Vec::new(), 0, 0.0);
    let mut visit = || {
        visited += 1;
        token.check_every(MEDIUM_STEPS, visited)
    };
    let mut node = surface.leaves[sample.slot];
    while node != 0 {
        visit()?;
        let parent = surface.parents[node as usize];
        for sibling in surface.tree.nodes[parent as usize].children().filter(|&sibling| sibling != node) {
            cost += surface.cost_below(sample.slot, sibling, &mut stack, &mut visit)?;
        }
        node = parent;
    }
    for &slot in further {
        cost -= surface.cost_held(slot, &mut visit)?;
    }
    let cost = (cost / surface.areas[sample.slot]).max(0.0);
    Ok(Found { cost, weight: sample.weight, visited: visited as u64 })
}
