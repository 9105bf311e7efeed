//! Rays that need no camera: random lines through a container.

use crate::geometry::Ray;
use crate::kernel::mix::{mix64, next_unit};

use crate::geometry::Container;

/// Random lines that meet a container, such as the root's, each a ray from outside of it to infinity.
///
/// All lines are equally likely, in the measure that no motion changes: the point of entry is uniform over the surface, and the
/// direction has a density proportional to the cosine of its angle to the normal. Of these lines those that also meet a convex
/// body inside are a share of area(body) / area(container) (Cauchy–Crofton; Santaló: *Integral Geometry and Geometric
/// Probability*, 1976, section 14.3), which is the assumption of the surface area heuristic.
///
/// The same container, seed and index give the same line on every machine and any number of threads.
///
/// ```
/// use bvhscope_engine::Aabb;
/// use bvhscope_engine::glam::Vec3;
/// use bvhscope_engine::tree::random_lines::RandomLines;
///
/// let lines = RandomLines::new(Aabb { min: Vec3::ZERO, max: Vec3::ONE }, 1);
/// assert_eq!(lines.ray(7), lines.ray(7));
/// assert_ne!(lines.ray(7), lines.ray(8));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RandomLines<C> {
    container: C,
    seed: u64,
}

impl<C: Container> RandomLines<C> {
    /// The lines through `container` of a `seed`.
    pub fn new(container: C, seed: u64) -> Self {
        Self { container, seed: mix64(seed) }
    }

    /// The line `index`. Where the container is empty, a ray that hits nothing.
    pub fn ray(&self, index: u32) -> Ray {
        let mut state = mix64(self.seed ^ u64::from(index));
        self.container.random_line(|| next_unit(&mut state))
    }
}
