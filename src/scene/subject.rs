//! The part of a model that cameras frame: all but the few triangles far from all others.

use bvhscope_engine::cancel::{CancelToken, Cancelled};
use bvhscope_engine::geometry::{Aabb, Triangle};
use glam::Vec3;

/// Largest share of the triangles that is left out.
const MAX_FAR: f64 = 0.01;
/// Share of the centres at each end of an axis that may be far.
const TAIL: f64 = 0.005;
/// Number of triangles by whose centres the others are judged.
const SAMPLE: usize = 1 << 16;
/// Models of fewer triangles are framed as a whole.
const LEAST: usize = 200;
/// Poll for cancellation every 65,536 triangles.
const TRIANGLES_PER_CHECK: usize = 1 << 16;

/// Bounding box of the triangles that are not far: within the middle 99 % of all centres and as much again on either side.
pub(super) fn subject(triangles: &[Triangle], bounds: &Aabb, token: &CancelToken) -> Result<Aabb, Cancelled> {
    if triangles.len() < LEAST {
        return Ok(*bounds);
    }
    let near = neighbourhood(triangles, token)?;
    if near.min.cmple(bounds.min).all() && bounds.max.cmple(near.max).all() {
        return Ok(*bounds);
    }
    let (mut subject, mut kept) = (Aabb::EMPTY, 0_usize);
    for triangles in triangles.chunks(TRIANGLES_PER_CHECK) {
        token.check()?;
        for triangle in triangles {
            let own = triangle.bounds();
            if near.min.cmple(own.min).all() && own.max.cmple(near.max).all() {
                subject = subject.union(&own);
                kept = kept.saturating_add(1);
            }
        }
    }
    let far = triangles.len().saturating_sub(kept);
    Ok(if far as f64 <= triangles.len() as f64 * MAX_FAR { subject } else { *bounds })
}

/// The box in which triangles are near.
fn neighbourhood(triangles: &[Triangle], token: &CancelToken) -> Result<Aabb, Cancelled> {
    let step = triangles.len().div_ceil(SAMPLE);
    let mut centers: Vec<Vec3> = triangles.iter().step_by(step).map(|triangle| triangle.bounds().center()).collect();
    let [first, last] = [TAIL, 1.0 - TAIL].map(|part| (centers.len() as f64 * part) as usize);
    let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
    for axis in 0..3 {
        token.check()?;
        centers.sort_unstable_by(|a, b| a[axis].total_cmp(&b[axis]));
        low[axis] = centers[first][axis];
        high[axis] = centers[last][axis];
    }
    let extent = high - low;
    // Flat models may be as thick as half their width.
    let margin = extent.max(Vec3::splat(extent.max_element() * 0.5));
    Ok(Aabb { min: low - margin, max: high + margin })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    /// A square of small triangles, side 20, with others.
    fn subject_with(others: &[[f32; 3]]) -> (Aabb, Aabb) {
        let small = |at: Vec3| Triangle { a: at, b: at + Vec3::X * 0.1, c: at + Vec3::Y * 0.1 };
        let mut triangles: Vec<Triangle> =
            (0..400).map(|index| small(Vec3::new((index % 20) as f32, (index / 20) as f32, 0.0))).collect();
        triangles.extend(others.iter().map(|&at| small(at.into())));
        let bounds = triangles.iter().fold(Aabb::EMPTY, |all, one| all.union(&one.bounds()));
        (subject(&triangles, &bounds, &CancelToken::new()).unwrap(), bounds)
    }

    #[test]
    fn a_few_far_triangles_are_left_out() {
        let (alone, whole) = subject_with(&[]);
        assert_eq!(alone, whole);
        let (framed, bounds) = subject_with(&[[0.0, 0.0, 5000.0], [-900.0, 3.0, 0.0]]);
        assert_eq!(framed, whole);
        assert!(bounds.max.z > 4000.0);
    }

    #[test]
    fn near_triangles_and_many_far_ones_are_framed() {
        let (framed, bounds) = subject_with(&[[30.0, 0.0, 0.0], [0.0, 0.0, 8.0]]);
        assert_eq!(framed, bounds);
        let far: Vec<[f32; 3]> = (0..20).map(|index| [0.0, index as f32, 5000.0]).collect();
        let (framed, bounds) = subject_with(&far);
        assert_eq!(framed, bounds, "a second part of the model");
    }
}
