//! Bounds that no tree can have.

/// Fault of a node's bounds.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum BoundsProblem {
    /// A number is NaN, infinite or too large.
    #[error("{0} where a number from -1e18 to 1e18 is expected")]
    Number(f32),
    /// A box is inside out along an axis: 0 for x.
    #[error("a box inside out: its min {axis} is {min}, its max {axis} {max}", axis = ["x", "y", "z"][*axis % 3])]
    InsideOut {
        /// The axis, 0 to 2.
        axis: usize,
        /// Lower corner.
        min: f32,
        /// Upper corner.
        max: f32,
    },
    /// The place of a plane askew is NaN, infinite or too large.
    #[error("{0} as the place of a plane where a number from -4e18 to 4e18 is expected")]
    Diagonal(f32),
    /// A polytope is inside out along a diagonal.
    #[error("a 14-DOP inside out: its low {diagonal} is {low}, its high {diagonal} {high}")]
    DiagonalInsideOut {
        /// The diagonal, 0 to 3.
        diagonal: usize,
        /// Lower plane.
        low: f32,
        /// Upper plane.
        high: f32,
    },
    /// A coordinate of a direction across planes is NaN, infinite or too large.
    #[error("{0} in a direction where a number from -1 to 1 is expected")]
    Direction(f32),
    /// A direction across planes is too short; its length.
    #[error("a direction of length {0:e} where one of at least 1e-6 is expected")]
    ShortDirection(f32),
    /// The directions across the planes lie in a plane, or nearly so.
    #[error("three directions that lie in a plane, between which there is no box")]
    FlatDirections,
    /// An oriented box is inside out along a direction.
    #[error("an oriented box inside out: its low {at} is {low}, its high {at} {high}")]
    OrientedInsideOut {
        /// The direction, 0 to 2.
        at: usize,
        /// Lower plane.
        low: f32,
        /// Upper plane.
        high: f32,
    },
    /// A radius is negative.
    #[error("the negative radius {0}")]
    NegativeRadius(f32),
}
