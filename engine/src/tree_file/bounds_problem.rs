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
    /// A number along a diagonal is NaN, infinite or too large.
    #[error("{0} along a diagonal where a number from -4e18 to 4e18 is expected")]
    Diagonal(f32),
    /// A polytope is inside out along a diagonal.
    #[error("a polytope inside out: its low {diagonal} is {low}, its high {diagonal} {high}")]
    DiagonalInsideOut {
        /// The diagonal, 0 to 3.
        diagonal: usize,
        /// Lower plane.
        low: f32,
        /// Upper plane.
        high: f32,
    },
    /// A radius is negative.
    #[error("the negative radius {0}")]
    NegativeRadius(f32),
}
