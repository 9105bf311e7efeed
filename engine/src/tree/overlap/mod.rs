//! End-point overlap (EPO): the surface of the scene inside nodes that do not hold it.

use crate::cancel::{CancelToken, Cancelled};
use crate::geometry::Triangle;
use crate::tree::node::{AnyTree, Tree};
use crate::with_tree;

mod clip;

mod estimate;

mod exact;

mod surface;

use clip::Clip;
use surface::Surface;

/// Number of samples of an estimate where the exact value takes too many visits.
const FALLBACK_SAMPLES: usize = 2_000;

/// End-point overlap of a tree, and the share of the scene that it is known from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct EndPointOverlap {
    /// The overlap, at least 0, in the unit of the SAH cost.
    pub value: f32,
    /// Number of triangles whose surface was looked for in foreign nodes.
    pub sampled: usize,
    /// Number of triangles with an area.
    pub triangles: usize,
    /// Half-width of the 95 % interval around the value of an estimate; `None` where the value is exact.
    pub margin: Option<f32>,
    /// Number of nodes visited: the work that it took.
    pub visited: u64,
}

impl EndPointOverlap {
    /// Whether every triangle counted; otherwise the overlap is an estimate.
    pub fn is_exact(&self) -> bool {
        self.margin.is_none()
    }

    /// The sample of an estimate and its interval, in words; `None` where the value is exact.
    ///
    /// ```
    /// use bvhscope_engine::tree::overlap::EndPointOverlap;
    ///
    /// let exact = EndPointOverlap { value: 1.5, sampled: 69_451, triangles: 69_451, margin: None, visited: 100_000 };
    /// assert_eq!(exact.estimate_note(), None);
    /// let estimate = EndPointOverlap { sampled: 2_000, margin: Some(0.0613), ..exact };
    /// assert_eq!(estimate.estimate_note().as_deref(), Some("±0.061 with 95 % confidence, from 2000 of 69451 triangles"));
    /// ```
    pub fn estimate_note(&self) -> Option<String> {
        let Self { sampled, triangles, .. } = self;
        let margin = self.margin?;
        let digits = if margin > 0.0 { (2 - margin.log10().ceil() as i32).clamp(0, 12) as usize } else { 0 };
        Some(format!("±{margin:.digits$} with 95 % confidence, from {sampled} of {triangles} triangles"))
    }
}

/// End-point overlap (Aila, Karras, Laine: *On Quality Metrics of Bounding Volume Hierarchies*, HPG 2013, section 4): the
/// cost of the surface of the scene that lies inside nodes that do not hold it, over the total surface. An interior node
/// costs [`traversal_cost`](crate::tree::ContainerKind::traversal_cost), a leaf
/// [`INTERSECTION_COST`](crate::tree::statistics::INTERSECTION_COST) for each primitive. `triangles` is the list that `tree` was
/// built from.
///
/// Exact for up to `max_samples` triangles. Beyond, estimated from that many triangles, evenly spread over the total surface.
/// The exact value takes some ten to a hundred visits of nodes for each triangle. Where each triangle lies in nearly every node, as
/// in a list of nodes, it would take their square: after some thousand visits for each triangle it is given up, and an estimate
/// returned, of which [`EndPointOverlap::margin`] is the interval. Of the estimate's samples, too, the rest is left out once they have
/// visited some thousand nodes each. All results are the same on any number of threads.
///
/// A triangle in several leaves counts once, and is held by all of them and the nodes above them. 0 for a tree without overlap
/// and for a scene without surface.
pub fn end_point_overlap(
    tree: &AnyTree,
    triangles: &[Triangle],
    max_samples: usize,
    token: &CancelToken,
) -> Result<EndPointOverlap, Cancelled> {
    with_tree!(tree, tree => overlap_of(tree, triangles, max_samples, token))
}

fn overlap_of<C: Clip>(
    tree: &Tree<C>,
    triangles: &[Triangle],
    max_samples: usize,
    token: &CancelToken,
) -> Result<EndPointOverlap, Cancelled> {
    let surface = Surface::new(tree, triangles, token)?;
    let with_area = surface.with_area;
    let none = EndPointOverlap { sampled: with_area, triangles: with_area, ..EndPointOverlap::default() };
    if tree.nodes.is_empty() || tree.nodes[0].is_leaf() || !(surface.total > 0.0 && surface.total.is_finite()) {
        return Ok(none);
    }
    if with_area <= max_samples
        && let Some((value, visited)) = exact::overlap(&surface, token)?
    {
        return Ok(EndPointOverlap { value: finite(value), visited, ..none });
    }
    let samples = if with_area <= max_samples { FALLBACK_SAMPLES } else { max_samples.max(1) };
    estimate::overlap(&surface, samples, token)
}

/// `value` in single precision; 0 where it is no finite number.
fn finite(value: f64) -> f32 {
    let value = value as f32;
    if value.is_finite() { value } else { 0.0 }
}
