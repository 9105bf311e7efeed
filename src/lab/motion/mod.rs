//! Trees of a model that moves: each policy by which they may follow, frame by frame through a clip, with the time of the update and the
//! quality of the tree that rays are traced through.

mod break_even;
mod study;

mod animate;

pub use animate::{AnimatePlan, animate};
pub use break_even::{FrameCost, break_even_rays, cheapest, mean, pays_from};
pub use study::{MAX_FRAMES, MotionPlan, MotionRow, MotionStudy};
