//! Trees of a model that moves: each policy by which they may follow, frame by frame through a clip, with the time of the update and the
//! quality of the tree that rays are traced through.

mod break_even;
mod study;

mod animate;

pub use animate::{AnimatePlan, animate};
pub use break_even::{BreakEven, FrameCost, Least, break_even, cheaper_in, cheapest, factor, least, pays_from};
pub use study::{FrameRounds, MAX_FRAMES, MotionPlan, MotionRow, MotionStudy};
